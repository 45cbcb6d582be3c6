//! The inverse of the strain-energy rod.

use std::f64::consts::TAU;
use std::sync::atomic::AtomicBool;

use nalgebra::{Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::answer::{Answer, tell};
use super::bounds::{Bounds, Space};
use super::constant_curvature::{self, ConstantCurvatureInverse, arc_to};
use super::pull::Pull;
use super::rows::Inverter;
use super::search::{Effort, Found, Search};
use super::{InverseSettings, Method, Target};
use crate::error::InvalidInput;
use crate::model::{Model, State};
use crate::robot::Robot;
use crate::rod::pulled::Pulled;
use crate::rod::{self, Plan, Rod, TendonRule};
use crate::solve::bounded::Bounded;
use crate::solve::fit::Problem;
use crate::solve::region::Region;
use crate::status::Status;

/// Buffers of a solve and the tensions it found.
#[derive(Clone, Debug)]
pub struct RodWorkspace<'a> {
    pub(super) pull: Pull<'a>,
    search: Search<'a>,
    guess: Option<constant_curvature::Workspace<'a>>,
    bends: Vec<Vector2<f64>>,
    /// Whether the last solve met its target.
    met: bool,
    /// The point and the tool's place of the row before the last, along a path.
    before: Option<(Vec<f64>, Vector3<f64>)>,
}

/// Where a step along a path led.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Gone {
    There,
    Jumped,
    Astray,
}

impl RodWorkspace<'_> {
    /// Descends from the point at hand to the target aimed at; whether no unknown is further than a limit from
    /// where it was.
    fn go_on(
        &mut self,
        space: &Space,
        effort: Effort<'_>,
        (from, limit): (&[f64], f64),
        iterations: &mut usize,
    ) -> Gone {
        let found = self.search.run(&mut self.pull, space, effort, |_, _| {});
        *iterations += found.iterations;
        let pairs = self.search.point.iter().zip(from);
        let moved = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        match found.status {
            Status::Converged if moved <= limit => Gone::There,
            Status::Converged => Gone::Jumped,
            _ => Gone::Astray,
        }
    }
}

/// A robot prepared for inverse solves with the rod model.
#[derive(Clone, Debug)]
pub struct RodInverse<'a> {
    robot: &'a Robot,
    settings: InverseSettings,
    /// Unknowns: scaled tensions.
    space: Space,
    /// Tension, in the plan's unit, of a unit of every unknown.
    units: Vec<f64>,
    /// Lowest and highest displacement of every tendon \[m\].
    ranges: Vec<(f64, f64)>,
    /// What bounds of the region hold back.
    labels: Vec<String>,
    /// The rod at rest.
    rest: Pulled<'a>,
    /// The inverse that first guesses are taken from, where the routing allows.
    arcs: Option<ConstantCurvatureInverse<'a>>,
}

/// No tension is more than what would bend the rod by two turns alone, unless bounds ask for it \[rad\]: targets just out
/// of reach are led to infinite ones, which stretch it.
const MOST: f64 = 2.0 * TAU;
/// Swarms and random starts seek unknowns up to here \[rad\].
const WIDEST: f64 = 4.0;
/// Every other random start is no wider than this.
const USUAL: f64 = 1.5;
/// A tendon without leverage at rest counts as if its holes were this share of the robot's length off the backbone.
const LEVER: f64 = 1e-3;
/// Along a path no unknown changes by more in one step \[rad\], and no step is a smaller share of the way between two
/// targets.
const JUMP: f64 = 0.5;
/// Nor, on the way to less tension, by more than this times the tool's way over the robot's length.
const RATE: f64 = 50.0;
const SHORTEST: f64 = 1.0 / 64.0;
/// Where the tool goes so many times as far as before, or further, no start is read off the way before.
const FARTHEST: f64 = 2.0;
/// Starts of a target on a path that steps do not lead to.
const FEW: usize = 16;
/// A bound that is this near holds back \[rad, m\].
const AT_EDGE: f64 = 1e-9;
/// Share of the trace that makes first guesses unique.
const RIDGE: f64 = 1e-6;

impl<'a> RodInverse<'a> {
    /// Prepares a robot; the plan must be of this robot.
    ///
    /// # Errors
    /// `InvalidInput` for settings out of range, bounds that do not fit the robot or the model, and proportional
    /// tendons.
    pub fn new(
        robot: &'a Robot,
        plan: &'a Plan,
        bounds: &Bounds,
        settings: InverseSettings,
    ) -> Result<Self, InvalidInput> {
        settings.validate()?;
        if plan.tendon_rule() == TendonRule::Proportional {
            let expected = "sliding tendons for an inverse";
            return Err(InvalidInput::new("settings.tendons", expected, "\"proportional\""));
        }
        bounds.check_rod(robot.tendons().len())?;
        let rest = Pulled::new(Rod::new(robot, plan));
        let length = robot.backbone().total_length();
        let count = robot.tendons().len();
        let lever = |k: usize| rest.softness(k).sqrt().max(LEVER * length);
        let units: Vec<f64> = (0..count).map(|k| 1.0 / lever(k)).collect();
        let mut inverse = Self {
            robot,
            settings,
            space: Space { region: Region::new(count), lower: Vec::new(), upper: Vec::new() },
            units,
            ranges: (0..count).map(|k| bounds.displacement_of(k)).collect(),
            labels: Vec::new(),
            rest,
            arcs: ConstantCurvatureInverse::guessing(robot, &settings),
        };
        inverse.bound(bounds);
        Ok(inverse)
    }

    /// Tendons only pull, within bounds.
    fn bound(&mut self, bounds: &Bounds) {
        let count = self.units.len();
        for (k, name) in self.robot.tendon_names().iter().enumerate() {
            let unit = self.units[k] * self.rest.unit();
            let (lower, upper) = bounds.tension.as_ref().map_or((0.0, f64::INFINITY), |r| r.at(k));
            let lower = lower.max(0.0) / unit;
            let upper = (upper / unit).min(lower + MOST);
            let mut normal = vec![0.0; count];
            normal[k] = 1.0;
            self.space.region.bound(&normal, upper);
            self.labels.push(format!("tension of '{name}'"));
            normal[k] = -1.0;
            self.space.region.bound(&normal, -lower);
            // A slack tendon is no news.
            self.labels.push(if lower > 0.0 {
                format!("pretension of '{name}'")
            } else {
                String::new()
            });
            self.space.lower.push(lower);
            self.space.upper.push(upper.min(lower + WIDEST));
        }
    }

    /// Goes from the point at hand to the target aimed at; nothing where steps do not lead there.
    fn walk(&self, work: &mut RodWorkspace<'_>) -> Option<Answer> {
        let effort = Effort { fall_back: false, nearest: false, ..self.effort(1) };
        let (from, to) = (work.pull.pulled.tool, work.pull.aim.target());
        let (mut done, mut stride, mut iterations) = (0.0, 1.0_f64, 0);
        let way = work.pull.aim.way(&from, &to);
        let mut last = work.search.point.clone();
        while done < 1.0 {
            let next = (done + stride).min(1.0);
            work.pull.aim.between(&from, &to, next);
            if stride >= 1.0
                && let Some((point, place)) = &work.before
            {
                // On as before, by the share of the way that the tool goes now.
                let share = (to.position() - from.translation).norm()
                    / (from.translation - *place).norm().max(f64::MIN_POSITIVE);
                if share < FARTHEST {
                    let pairs = work.search.point.iter_mut().zip(point.iter());
                    pairs.for_each(|(own, before)| *own += share * (*own - before));
                }
            }
            let limit = if effort.redundant { JUMP.min(RATE * way * (next - done)) } else { JUMP };
            let mut gone = work.go_on(&self.space, effort, (&last, limit), &mut iterations);
            if gone == Gone::Jumped && effort.redundant {
                // The branch of least tensions may end or turn away here: on without.
                work.search.point.clone_from(&last);
                let as_it_is = Effort { redundant: false, ..effort };
                gone = work.go_on(&self.space, as_it_is, (&last, JUMP), &mut iterations);
            }
            if gone == Gone::There {
                (done, stride) = (next, 2.0 * stride);
                last.clone_from(&work.search.point);
            } else {
                work.search.point.clone_from(&last);
                stride = 0.5 * (next - done);
                if stride < SHORTEST || work.search.stopped() {
                    return None;
                }
            }
        }
        let found = Found { status: Status::Converged, iterations, starts: 1 };
        Some(answer(found, &mut work.pull, &mut work.search))
    }

    /// Seeks from the point at hand, if it is one to start from, then from all starts.
    fn search(
        &self,
        target: &Target,
        given: bool,
        effort: Effort<'_>,
        work: &mut RodWorkspace<'_>,
    ) -> Answer {
        let RodWorkspace { pull, search, guess, bends, met, before: row_before } = work;
        *row_before = None;
        pull.aim.at(*target);
        let first: Vec<f64> =
            if given { self.unknowns(pull.pulled.tensions()) } else { Vec::new() };
        let before = usize::from(given);
        let mut start = |k: usize, point: &mut Vec<f64>| {
            if given && k == 0 {
                point.clone_from(&first);
            } else {
                self.begin(target, k - before, guess.as_mut(), bends, point);
            }
        };
        let mut found = search.run(pull, &self.space, effort, &mut start);
        if found.status == Status::NumericalError && pull.violation() > 0.0 {
            // No start could be brought inside.
            found.status = Status::Infeasible;
        }
        *met = found.status == Status::Converged;
        answer(found, pull, search)
    }

    fn effort(&self, starts: usize) -> Effort<'_> {
        Effort {
            first: 0,
            starts,
            max_iterations: self.settings.max_iterations,
            redundant: self.settings.least_energy,
            method: self.settings.method,
            fall_back: self.settings.method == Method::Newton && starts > 1,
            nearest: true,
            swarm: &self.settings.swarm,
        }
    }

    fn unknowns(&self, tensions: &[f64]) -> Vec<f64> {
        tensions.iter().zip(&self.units).map(|(tension, unit)| tension / unit).collect()
    }

    /// The k-th start: what tensions come nearest to the arcs of constant curvature, or to a single arc to the
    /// target; hardly pulled; and random ones, each from its own stream.
    fn begin(
        &self,
        target: &Target,
        k: usize,
        guess: Option<&mut constant_curvature::Workspace<'_>>,
        bends: &mut Vec<Vector2<f64>>,
        point: &mut Vec<f64>,
    ) {
        match (&self.arcs, guess) {
            (Some(arcs), Some(guess)) if k.is_multiple_of(2) => {
                arcs.guess(target, k / 2, guess, bends);
                self.towards(bends, point);
            }
            _ if k == 0 => {
                self.single_arc(target, bends);
                self.towards(bends, point);
            }
            _ => self.random(k, point),
        }
    }

    /// The tensions that bend the rod most nearly so, by its stiffness at rest.
    fn towards(&self, bends: &[Vector2<f64>], point: &mut Vec<f64>) {
        let turns: Vec<_> = bends.iter().map(|b| Vector3::new(-b.y, b.x, 0.0)).collect();
        let mut right = Vec::new();
        let mut matrix = self.rest.shorten(&turns, &mut right).to_vec();
        let count = right.len();
        let trace: f64 = (0..count).map(|k| matrix[k * (count + 1)]).sum();
        (0..count).for_each(|k| matrix[k * (count + 1)] += RIDGE * trace);
        let mut program = Bounded::default();
        // What it leaves when it does not end is a start too.
        let _ = program.solve(&matrix, &right, &vec![0.0; count], |_| false);
        point.clear();
        point.extend(program.step.iter().zip(&self.units).map(|(tension, unit)| tension / unit));
    }

    /// The circle that leaves the base along z and brings the tool to the target.
    fn single_arc(&self, target: &Target, bends: &mut Vec<Vector2<f64>>) {
        let (base, tool) = (self.robot.base().inverse(), self.robot.tool());
        let backbone = self.robot.backbone();
        let length = backbone.total_length();
        let (bend, _) = match target {
            Target::Pose(pose) => {
                let tip = pose.compose(&tool.inverse()).translation;
                arc_to(&base.transform(&tip), &Vector3::zeros(), length)
            }
            Target::Position(position) => {
                arc_to(&base.transform(position), &tool.translation, length)
            }
        };
        bends.clear();
        bends.extend(backbone.lengths().iter().map(|own| bend * (own / length)));
    }

    fn random(&self, k: usize, point: &mut Vec<f64>) {
        let mut draws = ChaCha8Rng::seed_from_u64(self.settings.seed);
        draws.set_stream(k as u64);
        let share = if k.is_multiple_of(4) { 1.0 } else { USUAL / WIDEST };
        point.clear();
        for (lower, upper) in self.space.lower.iter().zip(&self.space.upper) {
            let pulls = draws.random::<bool>();
            let more = draws.random::<f64>() * share * (upper - lower);
            point.push(if pulls { lower + more } else { *lower });
        }
    }
}

impl Inverter for RodInverse<'_> {
    type Start = State;
    type Work<'w>
        = RodWorkspace<'w>
    where
        Self: 'w;

    fn robot(&self) -> &Robot {
        self.robot
    }

    fn settings(&self) -> &InverseSettings {
        &self.settings
    }

    fn start(&self, displacements: &[f64]) -> Result<State, InvalidInput> {
        self.robot.check_displacements(displacements)?;
        let (rod, mut work) = (self.rest.rod(), rod::Workspace::default());
        rod.solve(displacements, &mut work)?;
        Ok(rod.take_state(work))
    }

    fn buffers<'w>(&'w self, stop: Option<&'w AtomicBool>) -> RodWorkspace<'w> {
        let rest = self.rest.clone();
        RodWorkspace {
            pull: Pull::new(rest, &self.settings, &self.units, &self.ranges),
            search: Search { stop, ..Search::default() },
            guess: self.arcs.as_ref().map(ConstantCurvatureInverse::workspace),
            bends: Vec::new(),
            met: false,
            before: None,
        }
    }

    /// The start is a shape with its tensions.
    fn solve(&self, target: &Target, start: Option<&State>, work: &mut RodWorkspace<'_>) -> Answer {
        work.pull.forget();
        let given = if let Some(state) = start {
            work.pull.pulled.begin(state)
        } else {
            work.pull.pulled.rest();
            false
        };
        self.search(target, given, self.effort(self.settings.starts), work)
    }

    /// In steps between which the tool is moved and turned evenly, where one step does not lead there without a
    /// jump; from a few other starts only when that fails, and then `starts` is more than 1.
    fn follow(&self, target: &Target, work: &mut RodWorkspace<'_>) -> Answer {
        let few = self.effort(self.settings.starts.min(FEW));
        if !work.met {
            let given = work.search.point.len() == self.units.len();
            return self.search(target, given, Effort { fall_back: false, ..few }, work);
        }
        let here = (work.search.point.clone(), work.pull.pulled.tool.translation);
        work.pull.aim.at(*target);
        if let Some(answer) = self.walk(work) {
            work.before = Some(here);
            return answer;
        }
        work.search.point = here.0;
        work.search.fit.evaluate(&mut work.pull, &work.search.point);
        let answer = self.search(target, true, Effort { fall_back: false, ..few }, work);
        Answer { starts: answer.starts + 1, ..answer }
    }

    fn write_tensions(&self, work: &RodWorkspace<'_>, place: &mut [f64]) {
        for (own, tension) in place.iter_mut().zip(work.pull.pulled.tensions()) {
            *own = tension * self.rest.unit();
        }
    }

    fn message(&self, answer: &Answer, work: &RodWorkspace<'_>) -> String {
        let names = self.robot.tendon_names();
        let (edges, _) = self.space.region.at_edge(&work.search.point, AT_EDGE);
        let labels = edges.iter().map(|k| self.labels[*k].clone());
        let mut held: Vec<String> = labels.filter(|label| !label.is_empty()).collect();
        held.extend(work.pull.holding(AT_EDGE).into_iter().map(|(k, release)| {
            format!("{} of '{}'", if release { "release" } else { "pull" }, names[k])
        }));
        tell(answer, &self.settings, &held, "tension")
    }

    fn write_displacements(&self, work: &RodWorkspace<'_>, place: &mut [f64]) {
        for (k, (displacement, (lower, upper))) in place.iter_mut().zip(&self.ranges).enumerate() {
            *displacement = work.pull.pulled.displacement(k).max(*lower).min(*upper);
        }
    }
}

fn answer(found: Found, pull: &mut Pull<'_>, search: &mut Search<'_>) -> Answer {
    search.fit.evaluate(pull, &search.point);
    let (distance, angle) = pull.aim.misses();
    let Found { status, iterations, starts } = found;
    Answer { status, distance, angle, iterations, starts }
}
