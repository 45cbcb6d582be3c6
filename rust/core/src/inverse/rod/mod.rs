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
use super::bounds::{Bounds, Space};
use super::constant_curvature::{self, ConstantCurvatureInverse};
use super::multistart::{Effort, Freedom, Search};
use super::outcome::{Answer, tell};
use super::pose_goal::ToolGoal;
use super::pose_residual::Aim;
use super::tension_problem::Pull;
use super::{InverseSettings, Method, Target};
use crate::error::InvalidInput;
use crate::model::{Model, State};
use crate::obstacle::{Fault, FirstFault};
use crate::robot::Robot;
use crate::rod::contact::{self, LoadedRod, Scene};
use crate::rod::equilibrium::FreeRod;
use crate::rod::equilibrium::{ContactRod, Equilibrium};
use crate::rod::{self, Plan, Rod, TendonRule};
use crate::solve::convex_region::Region;
use crate::status::Status;
pub use disk_positions::Placed;
use from_rest::Rise;
use outcome::ended;

/// Buffers of a solve and the tensions it found.
#[derive(Debug)]
pub struct RodScratch<'a> {
    pub(super) pull: Pull<'a>,
    search: Search<'a>,
    guess: Option<constant_curvature::Scratch<'a>>,
    bends: Vec<Vector2<f64>>,
    /// Whether the last solve met its target.
    met: bool,
    /// The point and the tool's place of the row before the last, along a path.
    before: Option<(Vec<f64>, Vector3<f64>)>,
    /// Whether answers are what rest leads to, where there is more than one shape.
    rise: Option<Rise<'a>>,
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
    rest: FreeRod<'a>,
    /// The inverse that first guesses are taken from, where the routing allows.
    arcs: Option<ConstantCurvatureInverse<'a>>,
    /// Among obstacles and under loads.
    loaded: Option<LoadedRod<'a>>,
    /// Cell for the first fault of an obstacle's function.
    first_fault: FirstFault,
}

/// No tension is more than what would bend the rod by two turns alone, unless bounds ask for it \[rad\]: targets just out
/// of reach are led to infinite ones, which stretch it.
const MOST: f64 = 2.0 * TAU;
/// Swarms and random starts seek unknowns up to here \[rad\].
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
        if plan.tendon_rule() == TendonRule::Proportional {
            let expected = "sliding tendons for an inverse";
            return Err(InvalidInput::new("settings.tendons", expected, "\"proportional\""));
        }
        bounds.check_rod(robot.tendons().len())?;
        let rest = FreeRod::new(Rod::new(robot, plan));
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
            loaded: None,
            first_fault: FirstFault::default(),
        };
        inverse.bound(bounds);
        Ok(inverse)
    }

    /// The same among obstacles and under loads, in a scene that was made of this robot and its plan.
    ///
    /// # Errors
    /// As [`LoadedRod::new`].
    pub fn among(self, scene: &'a Scene) -> Result<Self, InvalidInput> {
        let loaded = LoadedRod::new(self.robot, self.rest.plan(), scene)?;
        let loaded = loaded.reporting_to(&self.first_fault);
        Ok(Self { loaded: Some(loaded), ..self })
    }

    /// What a function of an obstacle ended all work with, if it did.
    #[must_use]
    pub fn take_fault(&self) -> Option<Fault> {
        self.first_fault.take()
    }

    /// The robot under tensions, at rest.
    fn balance<'w>(&'w self, stop: Option<&'w AtomicBool>) -> Box<dyn Equilibrium + 'w> {
        match &self.loaded {
            Some(rod) => Box::new(ContactRod::new(rod.clone(), stop)),
            None => Box::new(self.rest.clone()),
        }
    }

    fn rise<'w>(&'w self, stop: Option<&'w AtomicBool>) -> Option<Rise<'w>> {
        self.loaded.as_ref().map(|rod| Rise::new(rod, self.robot, stop))
    }

    fn write_tensions_of(&self, rod: &dyn Equilibrium, place: &mut [f64]) {
        for (own, tension) in place.iter_mut().zip(rod.tensions()) {
            *own = tension * self.rest.unit();
        }
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

    /// Seeks from the point at hand, if it is one to start from, then from all starts.
    fn search(
        &self,
        target: &Target,
        given: bool,
        effort: Effort<'_>,
        work: &mut RodScratch<'_>,
    ) -> Answer {
        let RodScratch { pull, search, guess, bends, met, before: row_before, .. } = work;
        *row_before = None;
        pull.aim.aim.at(*target);
        let first: Vec<f64> = if given { self.unknowns(pull.rod.tensions()) } else { Vec::new() };
        let before = usize::from(given);
        let start = |k: usize, point: &mut Vec<f64>| {
            if given && k == 0 {
                point.clone_from(&first);
            } else {
                self.begin(target, k - before, guess.as_mut(), bends, point);
            }
        };
        let found = match &mut work.rise {
            Some(rise) => rise.search(pull, search, &self.space, effort, start),
            None => search.run(pull, &self.space, effort, start),
        };
        *met = found.status == Status::Converged;
        ended(found, pull, search, |goal| goal.aim.misses())
    }

    fn effort(&self, starts: usize) -> Effort<'_> {
        let starts = if self.loaded.is_some() { starts.min(LOADED) } else { starts };
        Effort {
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
    type Work<'w>
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
            rod.lead(displacements, &mut work, stop.map(AsRef::as_ref));
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
            pull: Pull::new(
                self.balance(stop),
                ToolGoal::new(Aim::new(self.robot, &self.settings)),
                lengths,
                &self.units,
                &self.ranges,
            ),
            search: Search { stop, ..Search::default() },
            guess: self.arcs.as_ref().map(ConstantCurvatureInverse::workspace),
            bends: Vec::new(),
            met: false,
            before: None,
            rise: self.rise(stop),
        }
    }

    /// The start is a shape with its tensions.
    fn solve(&self, target: &Target, start: Option<&State>, work: &mut RodScratch<'_>) -> Answer {
        if self.first_fault.is_set() {
            return Answer::none();
        }
        work.pull.forget();
        let given = if let Some(state) = start {
            work.pull.rod.begin(state)
        } else {
            work.pull.rod.rest();
            false
        };
        self.search(target, given, self.effort(self.settings.starts), work)
    }

    /// In steps between which the tool is moved and turned evenly, where one step does not lead there without a
    /// jump; from a few other starts only when that fails, and then `starts` is more than 1.
    fn follow(&self, target: &Target, work: &mut RodScratch<'_>) -> Answer {
        if self.first_fault.is_set() { Answer::none() } else { self.go_on(target, work) }
    }

    fn write_tensions(&self, work: &RodScratch<'_>, place: &mut [f64]) {
        self.write_tensions_of(work.pull.rod.as_ref(), place);
    }

    fn state(&self, work: &mut RodScratch<'_>) -> Option<State> {
        work.pull.rod.state()
    }

    fn message(&self, answer: &Answer, work: &RodScratch<'_>) -> String {
        if answer.status == Status::Infeasible {
            return self.shapeless(answer);
        }
        let held = self.held(&work.search.point, &work.pull);
        let told = tell(answer, &self.settings, &held, "tension");
        match &work.rise {
            Some(rise) if told.is_empty() => rise.message().to_owned(),
            _ => told,
        }
    }

    fn write_displacements(&self, work: &RodScratch<'_>, place: &mut [f64]) {
        work.pull.write_displacements(place);
    }
}
