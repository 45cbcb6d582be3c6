//! The chain of linkages from base to tip.

use nalgebra::Vector3;

use super::LinkageSettings;
use super::driving_tendons::{BOUND_TOLERANCE, DrivingTendons, Run, TendonChoice, runs};
use super::seven_bar::Hole;
use super::subsegment::{Infeasibility, SubsegmentPose, SubsegmentProblem};
use crate::error::InvalidInput;
use crate::lie::Pose;
use crate::model::{Model, Report, State};
use crate::robot::{Path, Robot};
use crate::solve::sqp::{Ending, Settings};
use crate::status::Status;

/// Linkage data of a robot, independent of the displacements: worth keeping between solves.
///
/// ```
/// use tdcr::linkage::{Linkage, LinkageSettings, Plan};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// // One plan serves any settings and any number of solves.
/// let plan = Plan::new(&robot)?;
/// let linkage = Linkage::new(&robot, &plan, LinkageSettings::default())?;
/// # let _ = linkage;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Plan {
    pub(super) runs: Vec<Run>,
    /// Pieces of every tendon, scaled to unit subsegments.
    pieces: Vec<Vec<Hole>>,
}

impl Plan {
    /// Prepares a robot.
    ///
    /// # Errors
    /// `InvalidInput` for a backbone that is bent at rest: the linkages are those of a straight one.
    pub fn new(robot: &Robot) -> Result<Self, InvalidInput> {
        if !robot.backbone().is_straight() {
            let expected = "a backbone that is straight at rest for model \"linkage\"";
            return Err(InvalidInput::new("robot.backbone.rest", expected, "a pre-bent one"));
        }
        let lengths = robot.backbone().lengths();
        let pieces = (robot.paths().iter())
            .map(|path| {
                path.holes.windows(2).zip(lengths).map(|(pair, l)| piece(pair, *l)).collect()
            })
            .collect();
        Ok(Self { runs: runs(robot), pieces })
    }
}

/// The linkage model of a robot, ready to solve.
///
/// ```
/// use tdcr::linkage::{Linkage, LinkageSettings, Plan};
/// use tdcr::model::Model;
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot)?;
/// let linkage = Linkage::new(&robot, &plan, LinkageSettings::default())?;
/// let shape = linkage.shape(&[-0.01, f64::INFINITY, f64::INFINITY])?;
/// assert_eq!(shape.report.status, tdcr::Status::Converged);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Linkage<'r> {
    pub(super) robot: &'r Robot,
    pub(super) plan: &'r Plan,
    settings: LinkageSettings,
}

/// Buffers of a solve, reused from one to the next.
///
/// ```
/// use tdcr::linkage::{Linkage, LinkageSettings, Plan, Scratch};
/// use tdcr::model::Model;
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot)?;
/// let linkage = Linkage::new(&robot, &plan, LinkageSettings::default())?;
/// // The same buffers for many solves.
/// let mut scratch = Scratch::default();
/// for pull in [0.001, 0.002, 0.003] {
///     linkage.solve(&[-pull, f64::INFINITY, f64::INFINITY], &mut scratch)?;
///     assert!((linkage.state(&scratch).tendon_lengths[0] - 0.2 + pull).abs() < 1e-9);
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    pub(super) state: State,
    pub(super) driving: Vec<DrivingTendons>,
    pub(super) failure: Option<Failure>,
}

/// First failure of a solve.
#[derive(Clone, Copy, Debug)]
pub(super) enum Failure {
    /// Upper disk of the subsegment, its run and what is in the way.
    Reach { disk: usize, run: usize, infeasibility: Infeasibility },
    /// Upper disk of a subsegment whose solve did not converge.
    Solve { disk: usize, ending: Ending },
    /// Tendons outside the linkage are longer than they may be.
    Bound,
}

impl<'r> Linkage<'r> {
    /// Solves with a plan that was made of this robot.
    ///
    /// # Errors
    /// `InvalidInput` for settings out of range.
    pub fn new(
        robot: &'r Robot,
        plan: &'r Plan,
        settings: LinkageSettings,
    ) -> Result<Self, InvalidInput> {
        settings.validate()?;
        Ok(Self { robot, plan, settings })
    }

    /// The choice of tendons for these displacements.
    pub(super) fn choice<'a>(&'a self, displacements: &'a [f64]) -> TendonChoice<'a> {
        TendonChoice { robot: self.robot, pieces: &self.plan.pieces, displacements }
    }

    fn solve_chain(&self, displacements: &[f64], work: &mut Scratch, report: &mut Report) {
        let Scratch { state, driving, failure } = work;
        *failure = None;
        let lengths = self.robot.backbone().lengths();
        let settings = self.settings.sqp();
        let mut frame = *self.robot.base();
        let mut last: Option<(SubsegmentProblem, SubsegmentPose)> = None;
        state.clear();
        state.frames.reserve(lengths.len() + 1);
        state.strains.reserve(lengths.len());
        state.frames.push(frame);
        for (index, run) in self.plan.runs.iter().enumerate() {
            for i in run.first..run.last {
                let problem = self.problem(driving[index], i, displacements);
                // Alike subsegments under alike pulls are one problem: it is solved once.
                let answer = match last {
                    Some((same, answer)) if same == problem => answer,
                    _ => {
                        let (answer, failed) = answer(&problem, &settings, (i + 1, index));
                        report.residual = report.residual.max(answer.residual);
                        report.iterations += answer.iterations;
                        if let (Some((status, first)), None) = (failed, &failure) {
                            report.status = status;
                            *failure = Some(first);
                        }
                        last = Some((problem, answer));
                        answer
                    }
                };
                frame = Pose {
                    translation: frame.translation + frame.rotation * (answer.link * lengths[i]),
                    rotation: frame.rotation * answer.rotation,
                };
                state.frames.push(frame);
                state.strains.push(answer.rotation_vector);
            }
        }
    }

    fn problem(
        &self,
        tendons: DrivingTendons,
        subsegment: usize,
        displacements: &[f64],
    ) -> SubsegmentProblem {
        let hole = |k: usize| {
            let piece = self.plan.pieces[k][subsegment];
            let share = -displacements[k] / self.robot.paths()[k].rest_length;
            Hole { pull: share * piece.rest, ..piece }
        };
        match tendons {
            DrivingTendons::None => SubsegmentProblem::Straight,
            DrivingTendons::One(k) => {
                let hole = hole(k);
                let azimuths = &self.robot.paths()[k].azimuths;
                if hole.is_alike() || azimuths[subsegment] == azimuths[subsegment + 1] {
                    return SubsegmentProblem::Planar(hole);
                }
                let quarter = |h: Vector3<f64>| Vector3::new(-h.y, h.x, 0.0);
                let span = Hole::new(quarter(hole.lower), quarter(hole.upper), 0.0);
                SubsegmentProblem::Spatial([hole, span])
            }
            DrivingTendons::Two(a, b) => SubsegmentProblem::Pair([hole(a), hole(b)]),
        }
    }

    /// Tendons that are longer than their displacement allows.
    pub(super) fn overlong<'a>(
        &'a self,
        displacements: &'a [f64],
        driving: &'a [DrivingTendons],
        state: &'a State,
    ) -> impl Iterator<Item = usize> + 'a {
        // Those that drive on their whole way meet their length as a constraint, to the solver's
        // tolerance.
        let driving = move |k: usize, end: usize| {
            let mut way = self.plan.runs.iter().zip(driving).take_while(|(run, _)| run.last <= end);
            way.all(|(_, tendons)| tendons.contains(k))
        };
        let bound = move |k: usize, path: &Path| {
            path.rest_length * (1.0 + BOUND_TOLERANCE) + displacements[k]
        };
        (self.robot.paths().iter().enumerate())
            .filter(move |(k, path)| {
                !driving(*k, path.end()) && state.tendon_lengths[*k] > bound(*k, path)
            })
            .map(|(k, _)| k)
    }
}

impl Model for Linkage<'_> {
    const NAME: &'static str = "linkage";

    type Scratch = Scratch;

    fn robot(&self) -> &Robot {
        self.robot
    }

    fn solve(&self, displacements: &[f64], work: &mut Scratch) -> Result<Report, InvalidInput> {
        let choice = self.choice(displacements);
        work.driving.clear();
        for run in &self.plan.runs {
            work.driving.push(choice.of(run)?);
        }
        let mut report = Report { status: Status::Converged, residual: 0.0, iterations: 0 };
        self.solve_chain(displacements, work, &mut report);
        let state = &mut work.state;
        let backbone = self.robot.backbone();
        state.tendon_lengths.extend(self.robot.paths().iter().map(|p| p.length(&state.frames)));
        state.tensions.resize(displacements.len(), f64::NAN);
        state.energy =
            state.strains.iter().enumerate().map(|(i, w)| backbone.strain_energy(i, w)).sum();
        let lost = |pose: &Pose| !pose.translation.iter().all(|x| x.is_finite());
        if let (None, Some(disk)) = (&work.failure, work.state.frames.iter().position(lost)) {
            report.status = Status::NumericalError;
            work.failure = Some(Failure::Solve { disk, ending: Ending::NumericalError });
        }
        if work.failure.is_none()
            && self.overlong(displacements, &work.driving, &work.state).next().is_some()
        {
            report.status = Status::Infeasible;
            work.failure = Some(Failure::Bound);
        }
        Ok(report)
    }

    fn state<'w>(&self, work: &'w Scratch) -> &'w State {
        &work.state
    }

    fn take_state(&self, work: Scratch) -> State {
        work.state
    }

    fn message(&self, displacements: &[f64], work: &Scratch) -> String {
        self.describe(displacements, work)
    }
}

/// Solves one subsegment, given by its upper disk and its run.
fn answer(
    problem: &SubsegmentProblem,
    settings: &Settings,
    (disk, run): (usize, usize),
) -> (SubsegmentPose, Option<(Status, Failure)>) {
    if let Some(infeasibility) = problem.infeasibility() {
        let failure = Failure::Reach { disk, run, infeasibility };
        return (problem.fallback_pose(), Some((Status::Infeasible, failure)));
    }
    let answer = problem.solve(settings);
    let status = match answer.ending {
        Ending::Converged => return (answer, None),
        Ending::Infeasible => Status::Infeasible,
        Ending::IterationLimit => Status::IterationLimit,
        Ending::NumericalError => Status::NumericalError,
    };
    (answer, Some((status, Failure::Solve { disk, ending: answer.ending })))
}

/// A tendon piece between two disks, in units of the subsegment's length.
fn piece(holes: &[Vector3<f64>], length: f64) -> Hole {
    Hole::new(holes[0] / length, holes[1] / length, 0.0)
}
