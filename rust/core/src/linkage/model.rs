//! The chain of linkages from base to tip.

use nalgebra::Vector3;

use super::LinkageSettings;
use super::driving_tendons::{BOUND_TOLERANCE, Choice, Drive, Run, runs};
use super::seven_bar::Hole;
use super::subsegment::{Answer, Obstacle, Question};
use crate::error::InvalidInput;
use crate::lie::Pose;
use crate::model::{Model, Report, State};
use crate::robot::{Path, Robot};
use crate::solve::sqp::{Ending, Settings};
use crate::status::Status;

/// What the linkage model knows of a robot before any displacement: worth keeping between solves.
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
#[derive(Clone, Copy, Debug)]
pub struct Linkage<'r> {
    pub(super) robot: &'r Robot,
    pub(super) plan: &'r Plan,
    settings: LinkageSettings,
}

/// Buffers of a solve, reused from one to the next.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    pub(super) state: State,
    pub(super) drives: Vec<Drive>,
    pub(super) failure: Option<Failure>,
}

/// What failed first.
#[derive(Clone, Copy, Debug)]
pub(super) enum Failure {
    /// Upper disk of the subsegment, its run and what is in the way.
    Reach { disk: usize, run: usize, obstacle: Obstacle },
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
    pub(super) fn choice<'a>(&'a self, displacements: &'a [f64]) -> Choice<'a> {
        Choice { robot: self.robot, pieces: &self.plan.pieces, displacements }
    }

    fn chain(&self, displacements: &[f64], work: &mut Scratch, report: &mut Report) {
        let Scratch { state, drives, failure } = work;
        *failure = None;
        let lengths = self.robot.backbone().lengths();
        let settings = self.settings.sqp();
        let mut frame = *self.robot.base();
        let mut last: Option<(Question, Answer)> = None;
        state.clear();
        state.frames.reserve(lengths.len() + 1);
        state.strains.reserve(lengths.len());
        state.frames.push(frame);
        for (index, run) in self.plan.runs.iter().enumerate() {
            for i in run.first..run.last {
                let question = self.question(drives[index], i, displacements);
                // Alike subsegments under alike pulls are one problem: it is solved once.
                let answer = match last {
                    Some((same, answer)) if same == question => answer,
                    _ => {
                        let (answer, failed) = answer(&question, &settings, (i + 1, index));
                        report.residual = report.residual.max(answer.residual);
                        report.iterations += answer.iterations;
                        if let (Some((status, first)), None) = (failed, &failure) {
                            report.status = status;
                            *failure = Some(first);
                        }
                        last = Some((question, answer));
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

    fn question(&self, drive: Drive, subsegment: usize, displacements: &[f64]) -> Question {
        let hole = |k: usize| {
            let piece = self.plan.pieces[k][subsegment];
            let share = -displacements[k] / self.robot.paths()[k].rest_length;
            Hole { pull: share * piece.rest, ..piece }
        };
        match drive {
            Drive::None => Question::Straight,
            Drive::One(k) => {
                let hole = hole(k);
                let azimuths = &self.robot.paths()[k].azimuths;
                if hole.is_alike() || azimuths[subsegment] == azimuths[subsegment + 1] {
                    return Question::Planar(hole);
                }
                let quarter = |h: Vector3<f64>| Vector3::new(-h.y, h.x, 0.0);
                let span = Hole::new(quarter(hole.lower), quarter(hole.upper), 0.0);
                Question::Spatial([hole, span])
            }
            Drive::Two(a, b) => Question::Pair([hole(a), hole(b)]),
        }
    }

    /// Tendons that are longer than their displacement allows.
    pub(super) fn overlong<'a>(
        &'a self,
        displacements: &'a [f64],
        drives: &'a [Drive],
        state: &'a State,
    ) -> impl Iterator<Item = usize> + 'a {
        // Those that drive on their whole way meet their length as a constraint, to the solver's
        // tolerance.
        let drives = move |k: usize, end: usize| {
            let mut way = self.plan.runs.iter().zip(drives).take_while(|(run, _)| run.last <= end);
            way.all(|(_, drive)| drive.contains(k))
        };
        let bound = move |k: usize, path: &Path| {
            path.rest_length * (1.0 + BOUND_TOLERANCE) + displacements[k]
        };
        (self.robot.paths().iter().enumerate())
            .filter(move |(k, path)| {
                !drives(*k, path.end()) && state.tendon_lengths[*k] > bound(*k, path)
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
        work.drives.clear();
        for run in &self.plan.runs {
            work.drives.push(choice.of(run)?);
        }
        let mut report = Report { status: Status::Converged, residual: 0.0, iterations: 0 };
        self.chain(displacements, work, &mut report);
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
            && self.overlong(displacements, &work.drives, &work.state).next().is_some()
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
    question: &Question,
    settings: &Settings,
    (disk, run): (usize, usize),
) -> (Answer, Option<(Status, Failure)>) {
    if let Some(obstacle) = question.obstacle() {
        let failure = Failure::Reach { disk, run, obstacle };
        return (question.stand_in(), Some((Status::Infeasible, failure)));
    }
    let answer = question.solve(settings);
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
