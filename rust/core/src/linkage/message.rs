//! What stood in the way of a solve, in words.

use super::chain::{Failure, Linkage, Workspace};
use super::drive::{Drive, Run};
use super::subsegment::Obstacle;
use crate::model::State;
use crate::solve::sqp::Ending;

impl Linkage<'_> {
    /// What stood in the way of the last solve in `work`; empty when it converged.
    pub(super) fn describe(&self, displacements: &[f64], work: &Workspace) -> String {
        match work.failure {
            None => String::new(),
            Some(Failure::Reach { disk, run, obstacle: Obstacle::Bend(half) }) => {
                self.too_few(disk, run, half)
            }
            Some(Failure::Reach { disk, run, obstacle: Obstacle::Piece(hole) }) => {
                let tendon = match (work.drives[run], hole) {
                    (Drive::Two(_, second), 1) => second,
                    (Drive::One(first) | Drive::Two(first, _), _) => first,
                    (Drive::None, _) => return String::new(),
                };
                format!(
                    "tendon '{}' is pulled by {} m, as long as its path of {} m: no length is left \
                     between disks {} and {disk}",
                    self.robot.tendon_names()[tendon],
                    -displacements[tendon],
                    self.robot.paths()[tendon].rest_length,
                    disk - 1,
                )
            }
            Some(Failure::Solve { disk, ending }) => {
                let reason = match ending {
                    Ending::Infeasible => "no linkage there reaches the pull",
                    Ending::NumericalError => "the arithmetic broke down",
                    _ => "not solved within max_iterations",
                };
                format!("failed at disk {disk}: {reason}")
            }
            Some(Failure::Bound) => self.bound_message(displacements, &work.state),
        }
    }

    /// The smallest number of subsegments that takes the pull: more than `|(C, S)| / 2`.
    fn too_few(&self, disk: usize, run: usize, half: f64) -> String {
        let Run { first, last, .. } = self.plan.runs[run];
        let arcs = self.robot.backbone().arc_lengths();
        let needed = half * (arcs[last] - arcs[first]) / (arcs[disk] - arcs[disk - 1]);
        format!(
            "failed at disk {disk}: the pull bends a subsegment beyond a half turn; between disks \
             {first} and {last} it takes at least {} subsegments (n > {needed:.4}), here there are {}",
            needed.floor() + 1.0,
            last - first,
        )
    }

    fn bound_message(&self, displacements: &[f64], state: &State) -> String {
        let names = self.robot.tendon_names();
        let list = |tendons: &[usize]| {
            let quoted: Vec<String> = tendons.iter().map(|k| format!("'{}'", names[*k])).collect();
            quoted.join(", ")
        };
        let mut parts: Vec<String> = Vec::new();
        for k in self.overlong(displacements, state) {
            let needs = state.tendon_lengths[k] - self.robot.paths()[k].rest_length;
            let given = displacements[k];
            parts.push(format!("'{}' would need {needs:+.6} m and has {given:+.6} m", names[k]));
        }
        let held: Vec<usize> = (0..names.len()).filter(|k| displacements[*k] == 0.0).collect();
        let held = if held.is_empty() {
            String::new()
        } else {
            format!("; held at their rest length: {}", list(&held))
        };
        format!(
            "the pulled tendons bend the trunk so that {}{held}; free tendons (inf) or release them \
             further",
            parts.join(", "),
        )
    }
}
