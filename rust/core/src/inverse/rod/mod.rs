//! The inverse of the strain-energy rod.

mod disk_positions;
mod from_rest;
mod outcome;
mod path;
mod starts;

use std::f64::consts::TAU;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use nalgebra::{Vector2, Vector3};

use super::batch::Inverter;
use super::bounds::{Bounds, SearchSpace};
use super::constant_curvature::{self, ConstantCurvatureInverse};
use super::multistart::{Freedom, Multistart, SearchOptions};
use super::outcome::{Answer, message_of};
use super::pose_goal::PoseGoal;
use super::pose_residual::PoseResidual;
use super::tension_problem::{TensionProblem, evaluate_answer};
use super::{InverseSettings, Method, Target};
use crate::error::InvalidInput;
use crate::model::{Model, State};
use crate::obstacle::{Fault, FirstFault};
use crate::robot::Robot;
use crate::rod::contact::{self, LoadedRod, Scene};
use crate::rod::equilibrium::FreeRod;
use crate::rod::equilibrium::{ContactRod, Equilibrium};
use crate::rod::{self, Plan, Rod};
use crate::solve::convex_region::Region;
use crate::status::Status;
use from_rest::FromRest;

/// Buffers of a solve and the tensions it found.
///
/// ```
/// use tdcr::inverse::{Bounds, InverseSettings, Inverter, RodInverse};
/// use tdcr::rod::{Plan, RodSettings};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, RodSettings::default())?;
/// let inverse = RodInverse::new(&robot, &plan, &Bounds::default(), InverseSettings::default())?;
/// // One set of buffers serves many targets.
/// let scratch = inverse.buffers(None);
/// # drop(scratch);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct RodScratch<'a> {
    pub(super) problem: TensionProblem<'a>,
    search: Multistart<'a>,
    guess: Option<constant_curvature::Scratch<'a>>,
    bends: Vec<Vector2<f64>>,
    /// True when the last solve met its target.
    met: bool,
    /// Unknowns and tool position of the row before the last, along a path.
    before: Option<(Vec<f64>, Vector3<f64>)>,
    /// Test of answers by solves from rest, where there is more than one shape.
    from_rest: Option<FromRest<'a>>,
}

/// A robot prepared for inverse solves with the rod model.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::inverse::{Bounds, InverseSettings, Inverter, RodInverse, Target};
/// use tdcr::rod::{Plan, RodSettings};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, RodSettings::default())?;
/// let inverse = RodInverse::new(&robot, &plan, &Bounds::default(), InverseSettings::default())?;
/// let mut scratch = inverse.buffers(None);
/// // The tip of an arc of 1 rad.
/// let target = Target::Position(Vector3::new(0.091_939_5, 0.0, 0.168_294_2));
/// let answer = inverse.solve(&target, None, &mut scratch);
/// assert!(answer.distance < 1e-2);
/// let mut tensions = [0.0; 3];
/// inverse.write_tensions(&scratch, &mut tensions);
/// assert!(tensions.iter().all(|tension| *tension >= 0.0));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct RodInverse<'a> {
    robot: &'a Robot,
    settings: InverseSettings,
    /// Unknowns: scaled tensions.
    space: SearchSpace,
    /// Tension, in the plan's unit, of a unit of every unknown.
    units: Vec<f64>,
    /// Lowest and highest displacement of every tendon \[m\].
    ranges: Vec<(f64, f64)>,
    /// Names of the bounds of the region, for messages.
    labels: Vec<String>,
    /// The rod at rest.
    rest: FreeRod<'a>,
    /// The inverse that first guesses are taken from, where the routing allows.
    arcs: Option<ConstantCurvatureInverse<'a>>,
    /// Among obstacles and under loads.
    loaded: Option<LoadedRod<'a>>,
    /// Cell for the first fault of an obstacle's function.
    first_fault: FirstFault,
}

/// Largest unknown \[rad\], two turns of the rod by one tendon alone, unless bounds ask for more: targets just out of
/// reach drive tensions to infinity, which stretches the rod.
const MOST: f64 = 2.0 * TAU;
/// Largest unknown of swarms and random starts \[rad\].
const WIDEST: f64 = 4.0;
/// A tendon without leverage at rest counts as if its holes were this share of the robot's length off the backbone.
const LEVER: f64 = 1e-3;
/// Starts among obstacles and under loads at most: each takes ten times as long.
const LOADED: usize = 50;
/// Starts from swarms there at most: each swarm takes as long as ten descents or more.
const SWARMS: usize = 8;

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
        plan.tendon_law().require_tensions("settings.tendons", "sliding tendons for an inverse")?;
        bounds.check_rod(robot.tendons().len())?;
        let rest = FreeRod::new(Rod::new(robot, plan));
        let length = robot.backbone().total_length();
        let count = robot.tendons().len();
        let lever = |k: usize| rest.shortening(k).sqrt().max(LEVER * length);
        let units: Vec<f64> = (0..count).map(|k| 1.0 / lever(k)).collect();
        let mut inverse = Self {
            robot,
            settings,
            space: SearchSpace { region: Region::new(count), lower: Vec::new(), upper: Vec::new() },
            units,
            ranges: (0..count).map(|k| bounds.displacement_of(k)).collect(),
            labels: Vec::new(),
            rest,
            arcs: ConstantCurvatureInverse::for_guesses(robot, &settings),
            loaded: None,
            first_fault: FirstFault::default(),
        };
        inverse.add_tension_bounds(bounds);
        Ok(inverse)
    }

    /// Inverse among obstacles and under loads, in a scene that was made of this robot and its plan.
    ///
    /// # Errors
    /// As [`LoadedRod::new`].
    pub fn among(self, scene: &'a Scene) -> Result<Self, InvalidInput> {
        let loaded = LoadedRod::new(self.robot, self.rest.plan(), scene)?;
        let loaded = loaded.reporting_to(&self.first_fault);
        Ok(Self { loaded: Some(loaded), ..self })
    }

    /// Fault with which a function of an obstacle ended all work, if it did.
    #[must_use]
    pub fn take_fault(&self) -> Option<Fault> {
        self.first_fault.take()
    }

    /// The robot under tensions, at rest.
    fn equilibrium<'w>(&'w self, stop: Option<&'w AtomicBool>) -> Box<dyn Equilibrium + 'w> {
        match &self.loaded {
            Some(rod) => Box::new(ContactRod::new(rod.clone(), stop)),
            None => Box::new(self.rest.clone()),
        }
    }

    fn rest_solves<'w>(&'w self, stop: Option<&'w AtomicBool>) -> Option<FromRest<'w>> {
        self.loaded.as_ref().map(|rod| FromRest::new(rod, self.robot, stop))
    }

    fn write_tensions_of(&self, rod: &dyn Equilibrium, place: &mut [f64]) {
        for (own, tension) in place.iter_mut().zip(rod.tensions()) {
            *own = tension * self.rest.unit();
        }
    }

    /// Tendons only pull, within bounds.
    fn add_tension_bounds(&mut self, bounds: &Bounds) {
        let count = self.units.len();
        for (k, name) in self.robot.tendon_names().iter().enumerate() {
            let unit = self.units[k] * self.rest.unit();
            let (lower, upper) = bounds.tension.as_ref().map_or((0.0, f64::INFINITY), |r| r.at(k));
            let lower = lower.max(0.0) / unit;
            let upper = (upper / unit).min(lower + MOST);
            let mut normal = vec![0.0; count];
            normal[k] = 1.0;
            self.space.region.add_bound(&normal, upper);
            self.labels.push(format!("tension of '{name}'"));
            normal[k] = -1.0;
            self.space.region.add_bound(&normal, -lower);
            // A slack tendon has no label: messages do not name it.
            self.labels.push(if lower > 0.0 {
                format!("pretension of '{name}'")
            } else {
                String::new()
            });
            self.space.lower.push(lower);
            self.space.upper.push(upper.min(lower + WIDEST));
        }
    }

    /// Searches from the current point, if `given`, then from all starts.
    fn search(
        &self,
        target: &Target,
        given: bool,
        options: SearchOptions<'_>,
        work: &mut RodScratch<'_>,
    ) -> Answer {
        let RodScratch { problem, search, guess, bends, met, before: row_before, .. } = work;
        *row_before = None;
        problem.goal.pose_residual.set_target(*target);
        let first: Vec<f64> =
            if given { self.unknowns(problem.rod.tensions()) } else { Vec::new() };
        let before = usize::from(given);
        let start = |k: usize, point: &mut Vec<f64>| {
            if given && k == 0 {
                point.clone_from(&first);
            } else {
                self.start_point(target, k - before, guess.as_mut(), bends, point);
            }
        };
        let found = match &mut work.from_rest {
            Some(from_rest) => from_rest.search(problem, search, &self.space, options, start),
            None => search.run(problem, &self.space, options, start),
        };
        *met = found.status == Status::Converged;
        evaluate_answer(found, problem, search, |goal| goal.pose_residual.errors())
    }

    fn options(&self, starts: usize) -> SearchOptions<'_> {
        let starts = if self.loaded.is_some() { starts.min(LOADED) } else { starts };
        SearchOptions {
            first: 0,
            starts,
            max_iterations: self.settings.max_iterations,
            freedom: match (self.settings.least_energy, &self.loaded) {
                (false, _) => Freedom::None,
                (true, None) => Freedom::Smooth,
                (true, Some(_)) => Freedom::Kinked,
            },
            method: self.settings.method,
            swarms: if self.loaded.is_some() { SWARMS } else { usize::MAX },
            fall_back: self.settings.method == Method::Newton && starts > 1,
            nearest: true,
            swarm: &self.settings.swarm,
        }
    }

    fn unknowns(&self, tensions: &[f64]) -> Vec<f64> {
        tensions.iter().zip(&self.units).map(|(tension, unit)| tension / unit).collect()
    }
}

impl Inverter for RodInverse<'_> {
    type Start = State;
    type Scratch<'w>
        = RodScratch<'w>
    where
        Self: 'w;

    fn robot(&self) -> &Robot {
        self.robot
    }

    fn settings(&self) -> &InverseSettings {
        &self.settings
    }

    fn start(
        &self,
        displacements: &[f64],
        stop: Option<&Arc<AtomicBool>>,
    ) -> Result<State, InvalidInput> {
        self.robot.check_displacements(displacements)?;
        if let Some(rod) = &self.loaded {
            let mut work = contact::Scratch::default();
            rod.solve_until(displacements, &mut work, stop.map(AsRef::as_ref));
            return Ok(rod.take_state(work));
        }
        let (mut rod, mut work) = (self.rest.rod().clone(), rod::Scratch::default());
        if let Some(stop) = stop {
            rod = rod.stopped_by(Arc::clone(stop));
        }
        rod.solve(displacements, &mut work)?;
        Ok(rod.take_state(work))
    }

    fn buffers<'w>(&'w self, stop: Option<&'w AtomicBool>) -> RodScratch<'w> {
        let lengths = self.rest.rest_lengths();
        RodScratch {
            problem: TensionProblem::new(
                self.equilibrium(stop),
                PoseGoal::new(PoseResidual::new(self.robot, &self.settings)),
                lengths,
                &self.units,
                &self.ranges,
            ),
            search: Multistart { stop, ..Multistart::default() },
            guess: self.arcs.as_ref().map(ConstantCurvatureInverse::scratch),
            bends: Vec::new(),
            met: false,
            before: None,
            from_rest: self.rest_solves(stop),
        }
    }

    /// The start is a shape with its tensions.
    fn solve(&self, target: &Target, start: Option<&State>, work: &mut RodScratch<'_>) -> Answer {
        if self.first_fault.is_set() {
            return Answer::none();
        }
        work.problem.forget();
        let given = if let Some(state) = start {
            work.problem.rod.start_from(state)
        } else {
            work.problem.rod.reset();
            false
        };
        self.search(target, given, self.options(self.settings.starts), work)
    }

    /// Moves and turns the tool in even steps where one step does not lead there without a
    /// jump; from a few other starts only when that fails, and then `starts` is more than 1.
    fn follow(&self, target: &Target, work: &mut RodScratch<'_>) -> Answer {
        if self.first_fault.is_set() { Answer::none() } else { self.track(target, work) }
    }

    fn write_tensions(&self, work: &RodScratch<'_>, place: &mut [f64]) {
        self.write_tensions_of(work.problem.rod.as_ref(), place);
    }

    fn state(&self, work: &mut RodScratch<'_>) -> Option<State> {
        work.problem.rod.state()
    }

    fn message(&self, answer: &Answer, work: &RodScratch<'_>) -> String {
        if answer.status == Status::Infeasible {
            return self.no_shape_message(answer);
        }
        let active = self.active_bounds(&work.search.point, &work.problem);
        let message = message_of(answer, &self.settings, &active, "tension");
        match &work.from_rest {
            Some(from_rest) if message.is_empty() => from_rest.message().to_owned(),
            _ => message,
        }
    }

    fn write_displacements(&self, work: &RodScratch<'_>, place: &mut [f64]) {
        work.problem.write_displacements(place);
    }
}
