//! The inverse of the constant-curvature model.

mod solution;
mod starts;

use std::borrow::Cow;
use std::sync::{self, atomic::AtomicBool};

use nalgebra::Vector2;

use super::arc_problem::ArcProblem;
use super::batch::Inverter;
use super::bounds::{ArcSpace, Bounds};
use super::multistart::{Freedom, Multistart, SearchOptions, SearchOutcome};
use super::outcome::{Answer, message_of};
use super::{InverseSettings, Method, Target};
use crate::constant_curvature::{self, Arc, ConstantCurvature, ConstantCurvatureSettings, Plan};
use crate::error::InvalidInput;
use crate::model::Model;
use crate::robot::Robot;
use crate::solve::levenberg_marquardt::Problem;
use crate::status::Status;
pub use solution::Solution;
pub(super) use starts::arc_to;

/// Buffers of a solve and the arcs it found.
///
/// ```
/// # use nalgebra::Vector3;
/// # use tdcr::constant_curvature::{ConstantCurvatureSettings, Plan};
/// # use tdcr::inverse::{Bounds, ConstantCurvatureInverse, InverseSettings, Target};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// # let plan = Plan::new(&robot, ConstantCurvatureSettings::default())?;
/// # let (bounds, settings) = (Bounds::default(), InverseSettings::default());
/// # let inverse = ConstantCurvatureInverse::new(&robot, &plan, &bounds, settings)?;
/// let mut scratch = inverse.scratch();
/// inverse.solve(&Target::Position(Vector3::new(0.05, 0.0, 0.18)), None, &mut scratch);
/// assert_eq!(inverse.arcs(&scratch).len(), 1);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Scratch<'a> {
    problem: ArcProblem<'a>,
    search: Multistart<'a>,
}

impl<'a> Scratch<'a> {
    /// Ends solves before their next start when the flag is set.
    #[must_use]
    pub fn stopped_by(mut self, stop: &'a AtomicBool) -> Self {
        self.search.stop = Some(stop);
        self
    }
}

/// A robot prepared for inverse solves with the constant-curvature model.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::constant_curvature::{Arc, ConstantCurvatureSettings, Plan};
/// use tdcr::inverse::{Bounds, ConstantCurvatureInverse, InverseSettings, Target};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, ConstantCurvatureSettings::default())?;
/// let (bounds, settings) = (Bounds::default(), InverseSettings::default());
/// let inverse = ConstantCurvatureInverse::new(&robot, &plan, &bounds, settings)?;
/// let tip = Arc::new(5.0, 1.0, 0.2).frame(1.0).translation;
/// let mut scratch = inverse.scratch();
/// let answer = inverse.solve(&Target::Position(tip), None, &mut scratch);
/// assert_eq!(answer.status, tdcr::Status::Converged);
/// let mut displacements = [0.0; 3];
/// inverse.write_displacements(&scratch, &mut displacements);
/// assert!((inverse.arcs(&scratch)[0].kappa() - 5.0).abs() < 1e-6);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct ConstantCurvatureInverse<'a> {
    robot: &'a Robot,
    plan: Cow<'a, Plan>,
    settings: InverseSettings,
    space: ArcSpace,
}

impl<'a> ConstantCurvatureInverse<'a> {
    /// Prepares a robot; the plan must be of this robot.
    ///
    /// # Errors
    /// `InvalidInput` for settings out of range and bounds that do not fit the robot.
    pub fn new(
        robot: &'a Robot,
        plan: &'a Plan,
        bounds: &Bounds,
        settings: InverseSettings,
    ) -> Result<Self, InvalidInput> {
        settings.validate()?;
        let space = ArcSpace::new(plan, bounds, robot.tendon_names())?;
        Ok(Self { robot, plan: Cow::Borrowed(plan), settings, space })
    }

    /// For first guesses of another model, without bounds: none where the routing is none for arcs.
    pub(super) fn for_guesses(robot: &'a Robot, settings: &InverseSettings) -> Option<Self> {
        let plan = Plan::new(robot, ConstantCurvatureSettings::default()).ok()?;
        let settings = InverseSettings {
            position_tolerance: settings.position_tolerance.max(GUESS),
            rotation_tolerance: settings.rotation_tolerance.max(GUESS),
            method: Method::Newton,
            least_energy: false,
            ..*settings
        };
        let space = ArcSpace::new(&plan, &Bounds::default(), robot.tendon_names()).ok()?;
        Some(Self { robot, plan: Cow::Owned(plan), settings, space })
    }

    /// The bending vector of every subsegment where the k-th few starts lead, met or not.
    pub(super) fn guess_bends(
        &self,
        target: &Target,
        k: usize,
        work: &mut Scratch<'_>,
        bends: &mut Vec<Vector2<f64>>,
    ) {
        work.problem.pose_residual.set_target(*target);
        let options = self.options(&work.problem, FEW);
        let options = SearchOptions { first: FEW * k, fall_back: false, nearest: false, ..options };
        work.search.run(&mut work.problem, &self.space.search, options, |k, point| {
            self.start_point(target, k, point);
        });
        let lengths = self.robot.backbone().lengths();
        bends.clear();
        for (segment, q) in self.plan.segments().zip(work.search.point.chunks_exact(2)) {
            let bend = Vector2::new(q[0], q[1]) / segment.rest_length;
            bends.extend(lengths[segment.range()].iter().map(|length| bend * *length));
        }
    }

    /// The robot it was prepared from.
    #[must_use]
    pub fn robot(&self) -> &Robot {
        self.robot
    }

    /// The choices it was prepared with.
    #[must_use]
    pub fn settings(&self) -> &InverseSettings {
        &self.settings
    }

    /// Buffers for this inverse.
    #[must_use]
    pub fn scratch(&self) -> Scratch<'_> {
        Scratch {
            problem: ArcProblem::new(self.robot, &self.plan, &self.settings),
            search: Multistart::default(),
        }
    }

    /// Solves for arcs that bring the tool to `target`; first from `start`, if given.
    pub fn solve(&self, target: &Target, start: Option<&[Arc]>, work: &mut Scratch<'_>) -> Answer {
        work.problem.pose_residual.set_target(*target);
        let options = self.options(&work.problem, self.settings.starts);
        let usable = |arcs: &&[Arc]| {
            let sound = |arc: &Arc| arc.bend.amax() < FAR && arc.length.is_finite();
            arcs.len() == self.plan.segment_count() && arcs.iter().all(sound)
        };
        let start = start.filter(usable);
        let given = usize::from(start.is_some());
        let found =
            work.search.run(
                &mut work.problem,
                &self.space.search,
                options,
                |k, point| match start {
                    Some(arcs) if k == 0 => self.unknowns(arcs, point),
                    _ => self.start_point(target, k - given, point),
                },
            );
        Self::answer(found, &work.problem)
    }

    /// Solves again from the point where the last solve in `work` ended, as along a path; from other starts only when
    /// that fails.
    pub fn follow(&self, target: &Target, work: &mut Scratch<'_>) -> Answer {
        if work.search.point.len() != self.space.search.region.size() {
            return self.solve(target, None, work);
        }
        work.problem.pose_residual.set_target(*target);
        let options = self.options(&work.problem, self.settings.starts);
        let found = work.search.run(&mut work.problem, &self.space.search, options, |k, point| {
            if k > 0 {
                self.start_point(target, k - 1, point);
            }
        });
        Self::answer(found, &work.problem)
    }

    /// Every distinct answer that the starts lead to, least bending energy first: its arcs, its energy over
    /// that of the others, and how many starts led there.
    #[must_use]
    pub fn solutions(&self, target: &Target) -> Vec<Solution> {
        self.solutions_in(target, &mut self.scratch())
    }

    /// Distinct answers as in [`Self::solutions`], in buffers of the caller.
    #[must_use]
    pub fn solutions_in(&self, target: &Target, work: &mut Scratch<'_>) -> Vec<Solution> {
        work.problem.pose_residual.set_target(*target);
        let mut distinct: Vec<(Vec<f64>, Solution)> = Vec::new();
        let mut slope = vec![0.0; self.space.search.region.size()];
        for k in 0..self.settings.starts {
            if work.search.is_stopped() {
                break;
            }
            let options = SearchOptions { first: k, ..self.options(&work.problem, 1) };
            let found =
                work.search.run(&mut work.problem, &self.space.search, options, |k, point| {
                    self.start_point(target, k, point);
                });
            if found.status != Status::Converged {
                continue;
            }
            let point = &work.search.point;
            let same =
                |other: &[f64]| other.iter().zip(point).all(|(a, b)| (a - b).abs() <= DISTINCT);
            if let Some((_, known)) = distinct.iter_mut().find(|(other, _)| same(other)) {
                known.hits += 1;
                continue;
            }
            let energy = work.problem.energy(point, &mut slope);
            let answer = Self::answer(found, &work.problem);
            let mut displacements = vec![0.0; self.robot.tendons().len()];
            self.write_displacements(work, &mut displacements);
            let arcs = self.arcs(work);
            let solution = Solution { arcs, displacements, energy, hits: 1, answer };
            distinct.push((point.clone(), solution));
        }
        distinct.sort_by(|(_, a), (_, b)| a.energy.total_cmp(&b.energy));
        distinct.into_iter().map(|(_, solution)| solution).collect()
    }

    fn options(&self, problem: &ArcProblem<'_>, starts: usize) -> SearchOptions<'_> {
        SearchOptions {
            first: 0,
            starts,
            max_iterations: self.settings.max_iterations,
            freedom: if self.settings.least_energy
                && self.space.freedoms > problem.pose_residual.row_count()
            {
                Freedom::Smooth
            } else {
                Freedom::None
            },
            method: self.settings.method,
            swarms: usize::MAX,
            fall_back: self.settings.method == Method::Newton && starts > 1,
            nearest: true,
            swarm: &self.settings.swarm,
        }
    }

    fn answer(found: SearchOutcome, problem: &ArcProblem<'_>) -> Answer {
        let (distance, angle) = problem.pose_residual.errors();
        let SearchOutcome { status, iterations, starts } = found;
        Answer { status, distance, angle, iterations, starts }
    }

    /// The arcs that the last solve in `work` found, base first.
    #[must_use]
    pub fn arcs(&self, work: &Scratch<'_>) -> Vec<Arc> {
        let width = self.plan.width();
        let segments = self.plan.segments().zip(work.search.point.chunks_exact(width));
        let arcs = segments.map(|(segment, q)| Arc {
            bend: Vector2::new(q[0], q[1]),
            length: segment.rest_length * if width == 3 { q[2] } else { 1.0 },
        });
        arcs.collect()
    }

    /// The displacements that give the robot the arcs that the last solve in `work` found \[m\].
    pub fn write_displacements(&self, work: &Scratch<'_>, place: &mut [f64]) {
        self.space.write_displacements(&self.plan, &work.search.point, place);
    }

    /// Reason why the last solve in `work` did not converge, in a sentence; empty when it did.
    #[must_use]
    pub fn message(&self, answer: &Answer, work: &Scratch<'_>) -> String {
        let held = self.space.active_bounds(&work.search.point);
        message_of(answer, &self.settings, &held, "bending energy")
    }

    fn unknowns(&self, arcs: &[Arc], point: &mut Vec<f64>) {
        point.clear();
        for (arc, segment) in arcs.iter().zip(self.plan.segments()) {
            point.extend_from_slice(arc.bend.as_slice());
            if self.plan.width() == 3 {
                point.push(arc.length / segment.rest_length);
            }
        }
    }
}

/// Tolerance of a first guess \[m, rad\], and its starts.
const GUESS: f64 = 1e-6;
const FEW: usize = 8;

impl Inverter for ConstantCurvatureInverse<'_> {
    type Start = Vec<Arc>;
    type Scratch<'w>
        = Scratch<'w>
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
        _stop: Option<&sync::Arc<AtomicBool>>,
    ) -> Result<Vec<Arc>, InvalidInput> {
        self.robot.check_displacements(displacements)?;
        let mut work = constant_curvature::Scratch::default();
        ConstantCurvature::new(self.robot, &self.plan).solve(displacements, &mut work)?;
        Ok(work.arcs().to_vec())
    }

    fn buffers<'w>(&'w self, stop: Option<&'w AtomicBool>) -> Scratch<'w> {
        let work = self.scratch();
        match stop {
            Some(stop) => work.stopped_by(stop),
            None => work,
        }
    }

    fn solve(&self, target: &Target, start: Option<&Vec<Arc>>, work: &mut Scratch<'_>) -> Answer {
        Self::solve(self, target, start.map(Vec::as_slice), work)
    }

    fn follow(&self, target: &Target, work: &mut Scratch<'_>) -> Answer {
        Self::follow(self, target, work)
    }

    fn write_displacements(&self, work: &Scratch<'_>, place: &mut [f64]) {
        Self::write_displacements(self, work, place);
    }

    fn write_tensions(&self, _: &Scratch<'_>, _: &mut [f64]) {}

    fn message(&self, answer: &Answer, work: &Scratch<'_>) -> String {
        Self::message(self, answer, work)
    }
}

/// A start that turns further than this is none \[rad\].
const FAR: f64 = 1e3;

/// Unknowns that differ by more than this are other answers.
const DISTINCT: f64 = 1e-6;
