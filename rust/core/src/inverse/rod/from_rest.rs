//! Forward solves from rest with the displacements of an answer, where a robot has more than one shape.

use std::sync::atomic::AtomicBool;

use crate::inverse::bounds::SearchSpace;
use crate::inverse::goal::Goal;
use crate::inverse::multistart::{Freedom, Multistart, SearchOptions, SearchOutcome};
use crate::inverse::tension_problem::TensionProblem;
use crate::lie::{Pose, so3};
use crate::model::Model as _;
use crate::robot::Robot;
use crate::rod::contact::{LoadedRod, Scratch};
use crate::status::Status;

/// The tool comes back to where it was to this share of the robot's length and its tool's reach, and to this angle
/// \[rad\].
const SAME_SHAPE: (f64, f64) = (1e-8, 1e-8);
/// Tolerances of the pose where all tendons of a segment pull and depend on each other: forward solves are no
/// better, and other shapes are further off.
const NEARLY_SAME_SHAPE: (f64, f64) = (1e-6, 1e-5);
/// Slack allowance of tendons without tension, as a share of the robot's length: as long as their path to the last
/// bit, they and those that depend on them lock during the solve from rest.
const SLACK_ALLOWANCE: f64 = 1e-8;
/// Number of answers that rest does not lead to, before one of them is returned.
const ANSWERS: usize = 8;
/// Slots of the last answer, and of the first one, which is returned if rest leads to none.
const LAST_SLOT: usize = 0;
const FIRST_SLOT: usize = 1;

/// Forward model that tests answers by a solve from rest.
#[derive(Debug)]
pub(super) struct FromRest<'a> {
    rod: LoadedRod<'a>,
    robot: &'a Robot,
    work: Scratch,
    stop: Option<&'a AtomicBool>,
    /// True when rest leads to the last answer.
    leads_to_answer: bool,
}

impl<'a> FromRest<'a> {
    pub(super) fn new(rod: &LoadedRod<'a>, robot: &'a Robot, stop: Option<&'a AtomicBool>) -> Self {
        Self { rod: rod.clone(), robot, work: Scratch::default(), stop, leads_to_answer: true }
    }

    /// Searches until rest leads to an answer, through at most eight of them; else the first one is returned.
    pub(super) fn search<const R: usize, G: Goal<R>>(
        &mut self,
        problem: &mut TensionProblem<'_, G>,
        search: &mut Multistart<'_, R>,
        space: &SearchSpace,
        options: SearchOptions<'_>,
        mut start: impl FnMut(usize, &mut Vec<f64>),
    ) -> SearchOutcome {
        // The first answer that meets the target, whatever its tensions.
        let mut meet = SearchOptions { freedom: Freedom::None, ..options };
        self.leads_to_answer = true;
        // The row before may have set another allowance.
        self.allow_slack(problem);
        let first = search.run(problem, space, meet, &mut start);
        if first.status != Status::Converged {
            return first;
        }
        problem.rod.save(FIRST_SLOT);
        let mut first_point = search.point.clone();
        let (mut found, mut iterations, mut starts) = (first, first.iterations, first.starts);
        for tried in 1..=ANSWERS {
            let point = search.point.clone();
            problem.rod.save(LAST_SLOT);
            // Its freedom goes to the least sum T² first, if rest leads to that answer too.
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
                        problem.rod.save(FIRST_SLOT);
                        first_point.clone_from(&search.point);
                    }
                }
                restore_answer(problem, search, LAST_SLOT, &point);
            }
            // Else the answer with the tensions that the descent found.
            if self.leads_to(problem) {
                return SearchOutcome { iterations, starts, ..found };
            }
            if tried == ANSWERS || found.starts >= meet.starts || search.is_stopped() {
                break;
            }
            // Other starts may lead to other shapes.
            meet.first += found.starts;
            meet.starts -= found.starts;
            (meet.fall_back, meet.nearest) = (false, false);
            found = search.run(problem, space, meet, &mut start);
            (iterations, starts) = (iterations + found.iterations, starts + found.starts);
            if found.status != Status::Converged {
                break;
            }
        }
        // Rest leads to none of them: the first one, with a message.
        self.leads_to_answer = false;
        restore_answer(problem, search, FIRST_SLOT, &first_point);
        SearchOutcome { iterations, starts, ..first }
    }

    /// True when a forward solve with the displacements brings the tool back, with the slack allowance or without.
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

    /// Lets tendons without tension out by the slack allowance.
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
        let report = self.rod.solve_until(&displacements, &mut self.work, self.stop);
        let base = self.robot.base();
        let tip = self.rod.state(&self.work).frames.last().copied();
        let tool = tip.unwrap_or_else(Pose::identity).compose(self.robot.tool());
        let wanted = base.compose(&problem.rod.motion().tool);
        let off = (tool.translation - wanted.translation).norm();
        let turned = so3::log(&tool.rotation.tr_mul(&wanted.rotation)).norm();
        let reach = self.robot.backbone().total_length() + self.robot.tool().translation.norm();
        report.status == Status::Converged && off <= near * reach && turned <= turn
    }

    /// Message about an answer that meets its target.
    pub(super) fn message(&self) -> &'static str {
        if self.leads_to_answer {
            return "";
        }
        "met on a way through other shapes: from rest the same displacements lead to another shape (start from answer.shape)"
    }
}

/// Restores an answer from its slot and evaluates it.
fn restore_answer<const R: usize, G: Goal<R>>(
    problem: &mut TensionProblem<'_, G>,
    search: &mut Multistart<'_, R>,
    place: usize,
    point: &[f64],
) {
    problem.forget();
    problem.rod.restore(place);
    search.point.clear();
    search.point.extend_from_slice(point);
    search.solver.evaluate(problem, point);
}
