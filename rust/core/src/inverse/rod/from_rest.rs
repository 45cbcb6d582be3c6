//! Whether the displacements of an answer lead to it from rest, where a robot has more than one shape.

use std::sync::atomic::AtomicBool;

use crate::inverse::bounds::SearchSpace;
use crate::inverse::goal::Goal;
use crate::inverse::multistart::{Freedom, Multistart, SearchOptions, SearchOutcome};
use crate::inverse::tension_problem::TensionProblem;
use crate::lie::{Pose, so3};
use crate::model::Model as _;
use crate::obstacle::Fault;
use crate::robot::Robot;
use crate::rod::contact::{LoadedRod, Scratch};
use crate::status::Status;

/// The tool comes back to where it was to this share of the robot's length and its tool's reach, and to this angle
/// \[rad\].
const SAME_SHAPE: (f64, f64) = (1e-8, 1e-8);
/// The same shape within the precision of forward solves where all tendons of a segment pull and depend on each other;
/// other shapes are further off.
const NEARLY_SAME_SHAPE: (f64, f64) = (1e-6, 1e-5);
/// Tendons without tension are let out by this share of the robot's length: as long as their way to the last bit, they
/// and those that depend on them lock on the way from rest.
const SLACK_ALLOWANCE: f64 = 1e-8;
/// So many answers that rest does not lead to, before one of them has to do.
const ANSWERS: usize = 8;
/// Places of an answer whatever its tensions, and of the first one, which has to do if rest leads to none.
const LAST_SLOT: usize = 0;
const FIRST_SLOT: usize = 1;

/// The forward model from rest.
#[derive(Debug)]
pub(super) struct FromRest<'a> {
    rod: LoadedRod<'a>,
    robot: &'a Robot,
    work: Scratch,
    stop: Option<&'a AtomicBool>,
    /// Whether rest leads to the last answer.
    leads_to_answer: bool,
}

impl<'a> FromRest<'a> {
    pub(super) fn new(rod: &LoadedRod<'a>, robot: &'a Robot, stop: Option<&'a AtomicBool>) -> Self {
        Self { rod: rod.clone(), robot, work: Scratch::default(), stop, leads_to_answer: true }
    }

    /// Searches on until rest leads to an answer, or for a few more answers; the first is kept otherwise.
    pub(super) fn search<const R: usize, G: Goal<R>>(
        &mut self,
        problem: &mut TensionProblem<'_, G>,
        search: &mut Multistart<'_, R>,
        space: &SearchSpace,
        options: SearchOptions<'_>,
        mut start: impl FnMut(usize, &mut Vec<f64>),
    ) -> SearchOutcome {
        let mut meet = SearchOptions { freedom: Freedom::None, ..options };
        self.leads_to_answer = true;
        // Not as the row before left it.
        self.allow_slack(problem);
        let first = search.run(problem, space, meet, &mut start);
        if first.status != Status::Converged {
            return first;
        }
        problem.rod.keep(FIRST_SLOT);
        let mut first_point = search.point.clone();
        let (mut found, mut iterations, mut starts) = (first, first.iterations, first.starts);
        for tried in 1..=ANSWERS {
            let point = search.point.clone();
            problem.rod.keep(LAST_SLOT);
            if options.freedom != Freedom::None {
                let lower =
                    SearchOptions { starts: 1, fall_back: false, nearest: false, ..options };
                let lower = search.run(problem, space, lower, |_, _| {});
                iterations += lower.iterations;
                if lower.status == Status::Converged {
                    if self.leads_to(problem) {
                        return SearchOutcome { iterations, starts, ..found };
                    }
                    if tried == 1 {
                        problem.rod.keep(FIRST_SLOT);
                        first_point.clone_from(&search.point);
                    }
                }
                restore_answer(problem, search, LAST_SLOT, &point);
            }
            if self.leads_to(problem) {
                return SearchOutcome { iterations, starts, ..found };
            }
            if tried == ANSWERS || found.starts >= meet.starts || search.is_stopped() {
                break;
            }
            meet.first += found.starts;
            meet.starts -= found.starts;
            (meet.fall_back, meet.nearest) = (false, false);
            found = search.run(problem, space, meet, &mut start);
            (iterations, starts) = (iterations + found.iterations, starts + found.starts);
            if found.status != Status::Converged {
                break;
            }
        }
        self.leads_to_answer = false;
        restore_answer(problem, search, FIRST_SLOT, &first_point);
        SearchOutcome { iterations, starts, ..first }
    }

    /// Whether the displacements at hand bring the tool to where it is: with slack tendons let out by a hair, or without.
    fn leads_to<G>(&mut self, problem: &mut TensionProblem<'_, G>) -> bool {
        self.allow_slack(problem);
        if self.leads_within(SAME_SHAPE, problem) {
            return true;
        }
        problem.slack_allowance = 0.0;
        let comes = self.leads_within(NEARLY_SAME_SHAPE, problem);
        if !comes {
            self.allow_slack(problem);
        }
        comes
    }

    /// Lets tendons without tension out by a hair.
    pub(super) fn allow_slack<G>(&self, problem: &mut TensionProblem<'_, G>) {
        problem.slack_allowance = SLACK_ALLOWANCE * self.robot.backbone().total_length();
    }

    fn leads_within<G>(
        &mut self,
        (near, turn): (f64, f64),
        problem: &TensionProblem<'_, G>,
    ) -> bool {
        let mut displacements = vec![0.0; self.robot.tendons().len()];
        problem.write_displacements(&mut displacements);
        let report = self.rod.lead(&displacements, &mut self.work, self.stop);
        let base = self.robot.base();
        let tip = self.rod.state(&self.work).frames.last().copied();
        let tool = tip.unwrap_or_else(Pose::identity).compose(self.robot.tool());
        let wanted = base.compose(&problem.rod.motion().tool);
        let off = (tool.translation - wanted.translation).norm();
        let turned = so3::log(&tool.rotation.tr_mul(&wanted.rotation)).norm();
        let reach = self.robot.backbone().total_length() + self.robot.tool().translation.norm();
        report.status == Status::Converged && off <= near * reach && turned <= turn
    }

    /// What there is to say of an answer that meets its target.
    pub(super) fn message(&self) -> &'static str {
        if self.leads_to_answer {
            return "";
        }
        "met on a way through other shapes: from rest the same displacements lead to another shape (start from answer.shape)"
    }

    pub(super) fn take_fault(&mut self) -> Option<Fault> {
        self.work.take_fault()
    }
}

/// Back to an answer that was kept, evaluated.
fn restore_answer<const R: usize, G: Goal<R>>(
    problem: &mut TensionProblem<'_, G>,
    search: &mut Multistart<'_, R>,
    place: usize,
    point: &[f64],
) {
    problem.forget();
    problem.rod.go_back(place);
    search.point.clear();
    search.point.extend_from_slice(point);
    search.solver.evaluate(problem, point);
}
