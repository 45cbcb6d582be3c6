//! Random rods: pulls that exist are found again, any others are solved or honestly flagged.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::Status;
use tdcr::model::Model;
use tdcr::robot::Robot;
use tdcr::rod::{Plan, Rod, RodSettings, Scratch};

use crate::common::FREE;
use crate::rod_common::Recipe;

/// Same shape: every disk within this share of the length.
const SAME: f64 = 1e-6;
const RESIDUAL: f64 = 1e-10;

/// A generator per case, so that each can be looked at alone.
fn case(number: usize) -> (ChaCha8Rng, Recipe) {
    let mut draw = ChaCha8Rng::seed_from_u64(number as u64);
    let recipe = Recipe::random(&mut draw, 60);
    (draw, recipe)
}

/// What became of the pulls that exist, within the geometric limit and beyond.
#[derive(Default)]
struct Round {
    cases: [usize; 2],
    /// The same shape, with a residual below RESIDUAL.
    same: [usize; 2],
    outcomes: BTreeMap<String, usize>,
    off: f64,
    /// Tensions under which rest leads to no shape.
    unstable: usize,
    iterations: usize,
}

impl Round {
    fn run(&mut self, number: usize) {
        let (mut draw, recipe) = case(number);
        let robot = recipe.robot();
        let plan = Plan::new(&robot, RodSettings::default()).unwrap();
        let rod = Rod::new(&robot, &plan);
        let mut work = Scratch::default();
        let tensions = recipe.random_tensions(&mut draw, 6.0);
        if rod.solve_tensions(&tensions, &mut work).unwrap().status != Status::Converged {
            self.unstable += 1;
            return;
        }
        let state = rod.state(&work);
        let wanted: Vec<Vector3<f64>> = state.frames.iter().map(|f| f.translation).collect();
        let class = usize::from(recipe.reach(&state.strains) > 1.0);
        let lengths = state.tendon_lengths.iter().zip(rod.rest_lengths()).zip(&tensions);
        let displacements: Vec<f64> = lengths
            .map(|((length, rest), tension)| if *tension > 0.0 { length - rest } else { FREE })
            .collect();
        let report = rod.solve(&displacements, &mut work).unwrap();
        self.iterations += report.iterations;
        self.cases[class] += 1;
        let pairs = rod.state(&work).frames.iter().zip(&wanted);
        let off = pairs.fold(0.0, |most, (f, p)| f64::max(most, (f.translation - p).norm()))
            / robot.backbone().total_length();
        let outcome = match (report.status, off < SAME) {
            (Status::Converged, true) => {
                self.off = self.off.max(off);
                if report.residual < RESIDUAL { "the same shape" } else { "a larger residual" }
            }
            (Status::Converged, false) => "another shape",
            (status, _) => status.as_str(),
        };
        if outcome == "the same shape" {
            self.same[class] += 1;
        } else {
            let side = ["within", "beyond"][class];
            *self.outcomes.entry(format!("{outcome}, {side} the limit")).or_default() += 1;
        }
    }

    fn print(&mut self) {
        let count: usize = self.cases.iter().sum();
        println!("pulls that exist, {count} robots ({} tensions are unstable):", self.unstable);
        for (class, of) in ["within", "beyond"].into_iter().enumerate() {
            let (same, cases) = (self.same[class], self.cases[class]);
            println!("  {of} the geometric limit: {same} of {cases} return the same shape");
        }
        println!("  others: {:?}; off by {:.1e} of the length", self.outcomes, self.off);
        println!("  Newton steps: {:.2}", self.iterations as f64 / count as f64);
    }
}

/// What became of arbitrary displacements.
#[derive(Default)]
struct Arbitrary {
    outcomes: BTreeMap<&'static str, usize>,
}

impl Arbitrary {
    fn run(&mut self, number: usize) {
        let (mut draw, recipe) = case(number);
        let robot = recipe.robot();
        let plan = Plan::new(&robot, RodSettings::default()).unwrap();
        let rod = Rod::new(&robot, &plan);
        let mut work = Scratch::default();
        let mut displacement = |rest: &f64| match draw.random_range(0.0..1.0) {
            share if share < 0.15 => FREE,
            share if share < 0.3 => 0.0,
            _ => rest * draw.random_range(-0.2..0.05),
        };
        let displacements: Vec<f64> = rod.rest_lengths().iter().map(&mut displacement).collect();
        let report = rod.solve(&displacements, &mut work).unwrap();
        *self.outcomes.entry(report.status.as_str()).or_default() += 1;
        let message = rod.message(&displacements, &work);
        let state = rod.state(&work);
        assert!(state.frames.iter().all(|f| f.translation.iter().all(|x| x.is_finite())));
        if report.status == Status::Converged {
            assert!(report.residual < RESIDUAL && message.is_empty(), "{number}: {report:?}");
            check_tendons(number, &robot, &rod, &displacements, &work, &recipe);
        } else {
            assert!(!message.is_empty(), "{number}");
            assert!(robot.tendon_names().iter().any(|name| message.contains(name)), "{message}");
        }
    }
}

/// Lengths within their bounds, tensions that only pull, and none on a tendon that is slack.
fn check_tendons(
    number: usize,
    robot: &Robot,
    rod: &Rod<'_>,
    displacements: &[f64],
    work: &Scratch,
    recipe: &Recipe,
) {
    let state = rod.state(work);
    for (k, path) in robot.paths().iter().enumerate() {
        // Measured on the frames, not by the solver.
        let over = path.length(&state.frames) - rod.rest_lengths()[k] - displacements[k];
        let (rest, tension) = (path.rest_length, state.tensions[k]);
        assert!(over < RESIDUAL * rest, "{number}, tendon {k}: {over:e} m over");
        assert!(tension >= 0.0, "{number}, tendon {k}: {tension}");
        let load = tension * recipe.piece().powi(2);
        assert!(load < RESIDUAL || over > -RESIDUAL * rest, "{number}, {k}: {load} at {over:e}");
    }
}

fn run(count: usize) -> (Round, Arbitrary) {
    let (mut round, mut arbitrary) = (Round::default(), Arbitrary::default());
    for number in 0..count {
        round.run(number);
        arbitrary.run(number);
    }
    round.print();
    println!("arbitrary displacements: {:?}", arbitrary.outcomes);
    (round, arbitrary)
}

fn pulls_that_exist_are_found_and_others_flagged() {
    let (round, arbitrary) = run(2000);
    let [within, beyond] = round.cases;
    assert!(within > 1000 && beyond > 400);
    assert_eq!(round.same[0], within);
    assert!(round.same[1] as f64 >= 0.995 * beyond as f64);
    let of = |name| arbitrary.outcomes.get(name).copied().unwrap_or_default();
    assert!(of("converged") > 1000 && of("infeasible") > 30);
    assert_eq!(of("numerical_error"), 0);
}

/// The whole statistics, for `docs/rod.md`.
#[test]
#[ignore = "200,000 solves: cargo test --release -- --ignored --nocapture rod_random"]
fn a_hundred_thousand_of_each() {
    let (round, _) = run(100_000);
    assert_eq!(round.same[0], round.cases[0]);
    assert!(round.same[1] as f64 >= 0.995 * round.cases[1] as f64);
}

crate::common::slow!(pulls_that_exist_are_found_and_others_flagged,);
