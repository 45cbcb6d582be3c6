//! Whether the displacements of an answer lead to it from rest, where a robot has more than one shape.

use std::sync::atomic::AtomicBool;

use crate::inverse::bounds::Space;
use crate::inverse::multistart::{Effort, Found, Freedom, Search};
use crate::inverse::tension_problem::{Goal, Pull};
use crate::lie::{Pose, so3};
use crate::model::Model as _;
use crate::robot::Robot;
use crate::rod::contact::{LoadedRod, Scratch};
use crate::status::Status;

/// The tool comes back to where it was to this share of the robot's length and its tool's reach, and to this angle
/// \[rad\].
const SAME: (f64, f64) = (1e-8, 1e-8);
/// The same shape within the precision of forward solves where all tendons of a segment pull and depend on each other;
/// other shapes are further off.
const ROUGHLY: (f64, f64) = (1e-6, 1e-5);
/// Tendons without tension are let out by this share of the robot's length: as long as their way to the last bit, they
/// and those that depend on them lock on the way from rest.
const HAIR: f64 = 1e-8;
/// So many answers that rest does not lead to, before one of them has to do.
const TRIES: usize = 8;
/// Places of an answer whatever its tensions, and of the first one, which has to do if rest leads to none.
const MET: usize = 0;
const FIRST: usize = 1;

/// The forward model from rest.
#[derive(Debug)]
pub(super) struct Rise<'a> {
    rod: LoadedRod<'a>,
    robot: &'a Robot,
    work: Scratch,
    stop: Option<&'a AtomicBool>,
    /// Whether rest leads to the last answer.
    leads: bool,
}

impl<'a> Rise<'a> {
    pub(super) fn new(rod: &LoadedRod<'a>, robot: &'a Robot, stop: Option<&'a AtomicBool>) -> Self {
        Self { rod: rod.clone(), robot, work: Scratch::default(), stop, leads: true }
    }

    /// Searches on until rest leads to an answer, or for a few more answers; the first is kept otherwise.
    pub(super) fn search<const R: usize, G: Goal<R>>(
        &mut self,
        pull: &mut Pull<'_, G>,
        search: &mut Search<'_, R>,
        space: &Space,
        effort: Effort<'_>,
        mut start: impl FnMut(usize, &mut Vec<f64>),
    ) -> Found {
        let mut meet = Effort { freedom: Freedom::None, ..effort };
        self.leads = true;
        // Not as the row before left it.
        self.slacken(pull);
        let first = search.run(pull, space, meet, &mut start);
        if first.status != Status::Converged {
            return first;
        }
        pull.rod.keep(FIRST);
        let mut first_point = search.point.clone();
        let (mut found, mut iterations, mut starts) = (first, first.iterations, first.starts);
        for tried in 1..=TRIES {
            let point = search.point.clone();
            pull.rod.keep(MET);
            if effort.freedom != Freedom::None {
                let lower = Effort { starts: 1, fall_back: false, nearest: false, ..effort };
                let lower = search.run(pull, space, lower, |_, _| {});
                iterations += lower.iterations;
                if lower.status == Status::Converged {
                    if self.comes_to(pull) {
                        return Found { iterations, starts, ..found };
                    }
                    if tried == 1 {
                        pull.rod.keep(FIRST);
                        first_point.clone_from(&search.point);
                    }
                }
                back(pull, search, MET, &point);
            }
            if self.comes_to(pull) {
                return Found { iterations, starts, ..found };
            }
            if tried == TRIES || found.starts >= meet.starts || search.stopped() {
                break;
            }
            meet.first += found.starts;
            meet.starts -= found.starts;
            (meet.fall_back, meet.nearest) = (false, false);
            found = search.run(pull, space, meet, &mut start);
            (iterations, starts) = (iterations + found.iterations, starts + found.starts);
            if found.status != Status::Converged {
                break;
            }
        }
        self.leads = false;
        back(pull, search, FIRST, &first_point);
        Found { iterations, starts, ..first }
    }

    /// Whether the displacements at hand bring the tool to where it is: with slack tendons let out by a hair, or without.
    fn comes_to<G>(&mut self, pull: &mut Pull<'_, G>) -> bool {
        self.slacken(pull);
        if self.comes_within(SAME, pull) {
            return true;
        }
        pull.hair = 0.0;
        let comes = self.comes_within(ROUGHLY, pull);
        if !comes {
            self.slacken(pull);
        }
        comes
    }

    /// Lets tendons without tension out by a hair.
    pub(super) fn slacken<G>(&self, pull: &mut Pull<'_, G>) {
        pull.hair = HAIR * self.robot.backbone().total_length();
    }

    fn comes_within<G>(&mut self, (near, turn): (f64, f64), pull: &Pull<'_, G>) -> bool {
        let mut displacements = vec![0.0; self.robot.tendons().len()];
        pull.write_displacements(&mut displacements);
        let report = self.rod.lead(&displacements, &mut self.work, self.stop);
        let base = self.robot.base();
        let tip = self.rod.state(&self.work).frames.last().copied();
        let tool = tip.unwrap_or_else(Pose::identity).compose(self.robot.tool());
        let wanted = base.compose(&pull.rod.motion().tool);
        let off = (tool.translation - wanted.translation).norm();
        let turned = so3::log(&tool.rotation.tr_mul(&wanted.rotation)).norm();
        let reach = self.robot.backbone().total_length() + self.robot.tool().translation.norm();
        report.status == Status::Converged && off <= near * reach && turned <= turn
    }

    /// What there is to say of an answer that meets its target.
    pub(super) fn message(&self) -> &'static str {
        if self.leads {
            return "";
        }
        "met on a way through other shapes: from rest the same displacements lead to another shape (start from answer.shape)"
    }
}

/// Back to an answer that was kept, evaluated.
fn back<const R: usize, G: Goal<R>>(
    pull: &mut Pull<'_, G>,
    search: &mut Search<'_, R>,
    place: usize,
    point: &[f64],
) {
    pull.forget();
    pull.rod.go_back(place);
    search.point.clear();
    search.point.extend_from_slice(point);
    search.fit.evaluate(pull, point);
}
