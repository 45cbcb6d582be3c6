//! Whether the displacements of an answer lead to it from rest, where a robot has more than one shape.

use crate::error::InvalidInput;
use crate::inverse::bounds::Space;
use crate::inverse::pull::{Goal, Pull};
use crate::inverse::search::{Effort, Found, Freedom, Search};
use crate::lie::{Pose, so3};
use crate::model::Model;
use crate::obstacle::Fault;
use crate::robot::Robot;
use crate::rod::contact::{LoadedRod, Workspace};
use crate::status::Status;

/// The tool comes back to where it was to this share of the robot's length, and to this angle \[rad\].
const SAME: f64 = 1e-8;
/// So many answers that rest does not lead to, before one of them has to do.
const TRIES: usize = 8;
/// Places of an answer whatever its tensions, and of the first one that rest does not lead to.
const MET: usize = 0;
const FIRST: usize = 1;

/// The forward model from rest.
#[derive(Debug)]
pub(super) struct Rise<'a> {
    rod: LoadedRod<'a>,
    robot: &'a Robot,
    work: Workspace,
    /// Whether rest leads to the last answer.
    leads: bool,
}

impl<'a> Rise<'a> {
    pub(super) fn new(rod: &LoadedRod<'a>, robot: &'a Robot) -> Self {
        Self { rod: rod.clone(), robot, work: Workspace::default(), leads: true }
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
        let first = search.run(pull, space, meet, &mut start);
        if first.status != Status::Converged {
            return first;
        }
        pull.rod.keep(FIRST);
        let first_point = search.point.clone();
        let (mut found, mut iterations, mut starts) = (first, first.iterations, first.starts);
        for tried in 1..=TRIES {
            let point = search.point.clone();
            pull.rod.keep(MET);
            if effort.freedom != Freedom::None {
                let lower = Effort { starts: 1, fall_back: false, nearest: false, ..effort };
                let lower = search.run(pull, space, lower, |_, _| {});
                iterations += lower.iterations;
                if lower.status == Status::Converged && self.comes_to(pull).unwrap_or(false) {
                    return Found { iterations, starts, ..found };
                }
                back(pull, search, MET, &point);
            }
            if self.comes_to(pull).unwrap_or(false) {
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

    /// Whether the displacements at hand bring the tool to where it is.
    fn comes_to<G>(&mut self, pull: &Pull<'_, G>) -> Result<bool, InvalidInput> {
        let mut displacements = vec![0.0; self.robot.tendons().len()];
        pull.write_displacements(&mut displacements);
        let report = self.rod.solve(&displacements, &mut self.work)?;
        let base = self.robot.base();
        let tip = self.rod.state(&self.work).frames.last().copied();
        let tool = tip.unwrap_or_else(Pose::identity).compose(self.robot.tool());
        let wanted = base.compose(&pull.rod.motion().tool);
        let off = (tool.translation - wanted.translation).norm();
        let turned = so3::log(&tool.rotation.tr_mul(&wanted.rotation)).norm();
        let near = SAME * self.robot.backbone().total_length();
        Ok(report.status == Status::Converged && off <= near && turned <= SAME)
    }

    /// What there is to say of an answer that meets its target.
    pub(super) fn message(&self) -> &'static str {
        if self.leads {
            return "";
        }
        "met on a way through other shapes: from rest the same displacements lead to another shape (start from answer.shape)"
    }

    pub(super) fn take_fault(&mut self) -> Option<Fault> {
        self.work.take_fault()
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
