//! The inverse by particle swarm: the paper's path, how often it succeeds, headings, limits, stops.

use std::f64::consts::TAU;
use std::sync::atomic::Ordering;

use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use tdcr::Status;
use tdcr::batch::{Control, pool};
use tdcr::planar::{
    Circle, Goal, InverseSettings, Row, SwarmInverse, SwarmSettings, SwarmSolver, Trunk,
    TwoSections, Unknowns, WatchDecision, inverse, polish, solve_rows,
};
use tdcr::solve::pso::{Progress, PsoSettings, Topology};

pub(crate) fn uniform(seed: u64) -> impl FnMut(f64, f64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    move |low, high| rng.random_range(low..high)
}

pub(crate) fn trunk(lengths: &[f64]) -> Trunk {
    Trunk::new(lengths.to_vec(), 0.01).unwrap()
}

pub(crate) fn to(point: Vector2<f64>) -> Goal {
    Goal { point, heading: None, limits: vec![TAU] }
}

pub(crate) fn tip(trunk: &Trunk, turns: &[f64]) -> (Vector2<f64>, f64) {
    *trunk.platforms(turns).last().unwrap()
}

pub(crate) fn solve(
    trunk: &Trunk,
    circles: &[Circle],
    goal: &Goal,
    settings: &SwarmSettings,
    seed: u64,
) -> SwarmInverse {
    let mut solver = SwarmSolver::new(trunk, circles, settings).unwrap();
    solver.solve(goal, seed, &mut |_| WatchDecision::GoOn).unwrap().unwrap()
}

fn ring() -> SwarmSettings {
    let swarm = PsoSettings { topology: Topology::Ring, ..PsoSettings::default() };
    SwarmSettings { swarm, ..SwarmSettings::default() }
}

fn points() -> SwarmSettings {
    SwarmSettings { unknowns: Unknowns::Points, ..SwarmSettings::default() }
}

/// The paper's path with 1,000 seeds: within 1e-9 m (in fact 1e-12), on one of the exact branches.
#[test]
fn every_seed_reaches_the_path_of_the_paper() {
    let (l1, l2) = (0.140, 0.120);
    let (two, trunk) = (TwoSections::new(l1, l2, TAU).unwrap(), trunk(&[l1, l2]));
    for (name, settings) in
        [("bends", SwarmSettings::default()), ("ring", ring()), ("points", points())]
    {
        let mut solver = SwarmSolver::new(&trunk, &[], &settings).unwrap();
        let mut evaluations = 0;
        for t in 0..=8 {
            let aim = Vector2::new(0.26 - 0.015 * f64::from(t), 0.015 * f64::from(t));
            let mut exact = Vec::new();
            two.solutions(aim.x, aim.y, &mut exact);
            let mut hits = vec![0; exact.len()];
            let found: Vec<_> = (0..1000)
                .map(|seed| {
                    solver.solve(&to(aim), seed, &mut |_| WatchDecision::GoOn).unwrap().unwrap()
                })
                .collect();
            for (seed, got) in found.iter().enumerate() {
                assert_eq!(got.inverse.status, Status::Converged, "{name} {t} {seed} {got:?}");
                assert!(got.inverse.error <= 1e-12 && got.seed == seed as u64);
                assert!((tip(&trunk, &got.inverse.turns).0 - aim).norm() < 1e-12);
                // The straight trunk is a double solution: the turns are known to half the digits.
                let near = if t == 0 { 1e-5 } else { 1e-9 };
                let turns = &got.inverse.turns;
                let off = |e: &[f64; 2]| (e[0] - turns[0]).abs().max((e[1] - turns[1]).abs());
                let branch = exact.iter().position(|e| off(e) < near);
                hits[branch.unwrap_or_else(|| panic!("{name} {t} {seed} {turns:?}"))] += 1;
                evaluations += got.evaluations;
                assert!(got.swarms <= 11 && got.history.len() == got.moves + got.swarms);
                assert!(got.history.windows(2).all(|pair| pair[1] <= pair[0]));
                assert_eq!(got.value, *got.history.last().unwrap());
            }
            println!("{name} t = {t}: branches {hits:?}");
            // From random starts no branch is out of sight.
            assert!(hits.iter().all(|hits| *hits > 100), "{name} {t} {hits:?}");
        }
        println!("{name}: {} evaluations in the mean", evaluations / 9000);
    }
}

/// How many of `count` random reachable targets of random trunks with m sections are reached.
fn rate(settings: &SwarmSettings, m: usize, count: u64, heading: bool) -> (u64, usize) {
    let rows = (0..count).into_par_iter().map(|case| {
        let mut u = uniform(71_000 + 100_000 * m as u64 + case);
        let trunk = trunk(&(0..m).map(|_| u(0.05, 0.2)).collect::<Vec<_>>());
        let made: Vec<f64> = (0..m).map(|_| u(-TAU, TAU)).collect();
        let (aim, direction) = tip(&trunk, &made);
        let goal = Goal { heading: heading.then_some(direction), ..to(aim) };
        let got = solve(&trunk, &[], &goal, settings, case);
        let hit = got.inverse.status == Status::Converged && got.inverse.error <= 1e-12;
        let off = (tip(&trunk, &got.inverse.turns).0 - aim).norm();
        assert!(!hit || off < 2e-12 && got.inverse.turns.iter().all(|t| t.abs() <= TAU), "{case}");
        if !hit {
            println!("{m} sections, case {case}: {got:?}");
        }
        (u64::from(hit), got.evaluations)
    });
    rows.reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
}

/// 10,000 random reachable targets each: all of them.
fn random_targets_are_reached() {
    let kinds = [("global", SwarmSettings::default()), ("ring", ring()), ("points", points())];
    for (name, settings) in kinds {
        for m in [2, 3, 5] {
            let count = 10_000;
            let (hits, evaluations) = rate(&settings, m, count, false);
            println!(
                "{name}, {m} sections: {hits} of {count}, {} evaluations",
                evaluations / count as usize
            );
            assert_eq!(hits, count, "{name} {m}");
        }
    }
}

/// Headings and limits, on the target to 1e-12 m; the energy is at a minimum along it.
#[test]
fn headings_and_limits_hold() {
    let mut evaluations = 0;
    for case in 0..600 {
        let mut u = uniform(7200 + case);
        let m = 3 + case as usize % 4;
        let trunk = trunk(&(0..m).map(|_| u(0.05, 0.2)).collect::<Vec<_>>());
        let limit = [1.0, 3.0, TAU][case as usize % 3];
        let made: Vec<f64> = (0..m).map(|_| u(-limit, limit)).collect();
        let (aim, heading) = tip(&trunk, &made);
        let goal = Goal { point: aim, heading: Some(heading + TAU), limits: vec![limit] };
        let settings = if case % 2 == 0 { SwarmSettings::default() } else { points() };
        let got = solve(&trunk, &[], &goal, &settings, case);
        assert_eq!(got.inverse.status, Status::Converged, "{case} {got:?}");
        assert!(got.inverse.error <= 1e-12 && got.inverse.heading_error.abs() < 1e-10);
        let whole = (tip(&trunk, &got.inverse.turns).1 - heading) / TAU;
        assert!((whole - whole.round()).abs() < 1e-9);
        assert!(got.inverse.turns.iter().all(|t| t.abs() <= limit));
        let again = InverseSettings::default();
        let around = polish(&trunk, &goal, &got.inverse.turns, &again).unwrap();
        assert!(around.energy >= got.inverse.energy * (1.0 - 1e-9));
        evaluations += got.evaluations;
    }
    println!("with headings: {} evaluations in the mean", evaluations / 600);
}

/// Without polish the answer is the swarm's own, to the tolerance asked for.
#[test]
fn without_polish() {
    let trunk = trunk(&[0.14, 0.12]);
    let aim = Vector2::new(0.2, 0.06);
    for unknowns in Unknowns::ALL {
        let settings =
            SwarmSettings { unknowns, polish: false, tolerance: 1e-9, ..SwarmSettings::default() };
        for seed in 0..50 {
            let got = solve(&trunk, &[], &to(aim), &settings, seed);
            assert_eq!(got.inverse.status, Status::Converged, "{got:?}");
            assert!(got.inverse.error <= 1e-9 && got.value <= 1e-9 && got.inverse.starts == 0);
            // The length that a section is off moves the tip by no more than that.
            assert!(got.inverse.error <= got.value * (1.0 + 1e-6) + 1e-15, "{got:?}");
            assert_eq!(got.inverse.iterations, 0);
        }
        let few = PsoSettings { max_iterations: 5, ..PsoSettings::default() };
        let got = solve(&trunk, &[], &to(aim), &SwarmSettings { swarm: few, ..settings }, 0);
        assert_eq!(got.inverse.status, Status::IterationLimit);
        assert_eq!((got.swarms, got.moves, got.history.len()), (11, 55, 66));
    }
}

/// Out of reach: the nearest point, as the Newton inverse finds it; one swarm is enough.
#[test]
fn out_of_reach_is_the_nearest_point() {
    let trunk = trunk(&[0.14, 0.12]);
    for case in 0..100 {
        let mut u = uniform(7300 + case);
        let (angle, radius) = (u(-3.0, 3.0), u(0.27, 0.5));
        let aim = Vector2::new(radius * angle.cos(), radius * angle.sin());
        let got = solve(&trunk, &[], &to(aim), &SwarmSettings::default(), case);
        assert_eq!(got.inverse.status, Status::Unreachable, "{case} {got:?}");
        assert_eq!(got.swarms, 1);
        let newton = inverse(&trunk, &to(aim), &InverseSettings::default()).unwrap();
        assert!((got.inverse.error - newton.error).abs() < 1e-9, "{case} {got:?} {newton:?}");
    }
    // Distances that overflow leave a swarm without a best point.
    let beyond = to(Vector2::new(1e200, -1e250));
    let circles = [Circle::new(0.1, 0.1, 0.01).unwrap()];
    for circles in [&circles[..], &[]] {
        for polish in [true, false] {
            let settings = SwarmSettings { polish, ..SwarmSettings::default() };
            let got = solve(&trunk, circles, &beyond, &settings, 0);
            assert!(got.inverse.status != Status::Converged && got.inverse.error > 1e200);
        }
    }
    let got = solve(&trunk, &[], &beyond, &points(), 0);
    assert!(got.inverse.status != Status::Converged && got.inverse.turns.len() == 2);
    let one = self::trunk(&[0.2]);
    for turn in [0.0, 0.3, -2.0, 5.0] {
        let got = solve(&one, &[], &to(tip(&one, &[turn]).0), &SwarmSettings::default(), 1);
        assert_eq!(got.inverse.status, Status::Converged, "{turn} {got:?}");
        assert!((got.inverse.turns[0] - turn).abs() < 1e-6);
    }
}

/// A row of a batch is what it is alone, on any number of threads, whatever the solver did before.
#[test]
fn rows_are_the_same_on_any_number_of_threads() {
    let trunk = trunk(&[0.1, 0.08, 0.12]);
    let settings = SwarmSettings::default();
    let solver = SwarmSolver::new(&trunk, &[], &settings).unwrap();
    let mut u = uniform(74);
    let rows: Vec<Row> = (0..500)
        .map(|seed| {
            let made = [u(-TAU, TAU), u(-TAU, TAU), u(-TAU, TAU)];
            Row { goal: to(tip(&trunk, &made).0), seed }
        })
        .collect();
    let control = Control::default();
    let run = |threads| {
        let pool = pool(Some(threads)).unwrap();
        solve_rows(&solver, &rows, &pool, &control).unwrap().unwrap()
    };
    let answers = run(1);
    assert_eq!(answers, run(3));
    assert_eq!(control.done.load(Ordering::Relaxed), 1000);
    for (row, answer) in rows.iter().zip(&answers) {
        let alone = solve(&trunk, &[], &row.goal, &settings, row.seed);
        assert_eq!(SwarmInverse { history: vec![], ..alone }, *answer);
    }
    control.stop.store(true, Ordering::Relaxed);
    let pool = pool(Some(2)).unwrap();
    assert!(solve_rows(&solver, &rows, &pool, &control).unwrap().is_none());
    let bad = [Row { goal: to(Vector2::new(f64::NAN, 0.0)), seed: 0 }];
    let error = solve_rows(&solver, &bad, &pool, &Control::default()).unwrap_err();
    assert_eq!(error.argument, "x");
}

#[test]
fn whoever_watches_ends_it() {
    let trunk = trunk(&[0.14, 0.12]);
    let settings = SwarmSettings::default();
    let mut solver = SwarmSolver::new(&trunk, &[], &settings).unwrap();
    let far = to(Vector2::new(0.3, 0.0));
    let mut moves = 0;
    let mut watch = |progress: &Progress| {
        moves = progress.iteration;
        if progress.iteration == 7 { WatchDecision::Finish } else { WatchDecision::GoOn }
    };
    let got = solver.solve(&far, 3, &mut watch).unwrap().unwrap();
    assert_eq!((moves, got.moves, got.swarms), (7, 7, 1));
    assert_eq!(got.inverse.status, Status::IterationLimit);
    assert!(solver.solve(&far, 3, &mut |_| WatchDecision::Abandon).unwrap().is_none());
    // What the watcher ends is polished first.
    let near = to(Vector2::new(0.2, 0.06));
    let got = solver.solve(&near, 3, &mut |_| WatchDecision::Finish).unwrap().unwrap();
    assert_eq!((got.moves, got.inverse.status), (0, Status::Converged));
}

#[test]
fn bad_settings_name_the_argument() {
    let trunk = trunk(&[0.1, 0.1]);
    let fine = SwarmSettings::default();
    let name = |settings: SwarmSettings| {
        SwarmSolver::new(&trunk, &[], &settings).map(|_| ()).unwrap_err().argument
    };
    assert_eq!(name(SwarmSettings { tolerance: f64::NAN, ..fine }), "tolerance");
    assert_eq!(name(SwarmSettings { max_iterations: 0, ..fine }), "max_iterations");
    assert_eq!(name(SwarmSettings { restarts: 10_001, ..fine }), "restarts");
    let swarm = PsoSettings { particles: 0, ..PsoSettings::default() };
    assert_eq!(name(SwarmSettings { swarm, ..fine }), "particles");
    let mut solver = SwarmSolver::new(&trunk, &[], &fine).unwrap();
    let mut bad =
        |goal: &Goal| solver.solve(goal, 0, &mut |_| WatchDecision::GoOn).unwrap_err().argument;
    let goal = to(Vector2::new(0.1, 0.1));
    assert_eq!(bad(&to(Vector2::new(f64::NAN, 0.1))), "x");
    assert_eq!(bad(&Goal { limits: vec![7.0], ..goal.clone() }), "limit");
    assert_eq!(bad(&Goal { heading: Some(f64::NAN), ..goal }), "heading");
}

/// Straight, nearly straight and too far, for many sections: the status and the nearest point.
fn straight_targets_of_many_sections() {
    straight_targets(1);
}

#[test]
#[ignore = "40 s: cargo test -- --ignored straight_targets"]
fn straight_targets_of_five_seeds() {
    straight_targets(5);
}

fn straight_targets(seeds: u64) {
    for n in [4_usize, 8, 12, 16, 20, 50] {
        let trunk = trunk(&vec![0.1; n]);
        let whole = 0.1 * n as f64;
        for (name, settings) in [("bends", SwarmSettings::default()), ("points", points())] {
            let cases = [1.0, 0.9999, 0.99, 1.2];
            let cases: Vec<(f64, u64)> =
                cases.iter().flat_map(|share| (0..seeds).map(|seed| (*share, seed))).collect();
            cases.into_par_iter().for_each(|(share, seed)| {
                let aim = Vector2::new(share * whole, 0.0);
                let got = solve(&trunk, &[], &to(aim), &settings, seed).inverse;
                let what = format!("{name} {n} {share} {seed} {got:?}");
                let status = if share > 1.0 { Status::Unreachable } else { Status::Converged };
                assert_eq!(got.status, status, "{what}");
                let error = (share - 1.0).max(0.0) * whole;
                assert!((got.error - error).abs() <= 1e-12 * whole.max(1.0), "{what}");
            });
        }
    }
}

/// Platforms as unknowns and no polish: the limits hold all the same, and the error is that within them.
#[test]
fn limits_hold_without_polish() {
    let trunk = trunk(&[0.14, 0.12]);
    let (mut u, mut reached) = (uniform(75), 0);
    for seed in 0..100 {
        let limit = 1.0;
        let made = [limit, if seed % 2 == 0 { -limit } else { u(-1.0, 1.0) }];
        let goal = Goal { point: tip(&trunk, &made).0, heading: None, limits: vec![limit] };
        let settings = SwarmSettings { polish: false, tolerance: 1e-4, ..points() };
        let got = solve(&trunk, &[], &goal, &settings, seed).inverse;
        assert!(got.turns.iter().all(|turn| turn.abs() <= limit), "{seed} {got:?}");
        let error = (tip(&trunk, &got.turns).0 - goal.point).norm();
        assert!((got.error - error).abs() < 1e-15);
        assert_eq!(got.status == Status::Converged, got.error <= 1e-4, "{seed} {got:?}");
        reached += usize::from(got.status == Status::Converged);
    }
    println!("{reached} of 100 within limits");
    assert!(reached > 50, "{reached}");
}

crate::common::slow!(random_targets_are_reached, straight_targets_of_many_sections,);
