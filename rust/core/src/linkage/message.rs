//! Messages about a solve of the linkage model.

use super::driving_tendons::{BOUND_TOLERANCE, DrivingTendons, Run};
use super::model::{Failure, Linkage, Scratch};
use super::seven_bar::linear_bend;
use super::subsegment::{BEND_MARGIN, Infeasibility};
use crate::solve::sqp::Ending;

impl Linkage<'_> {
    /// Reason why the last solve in `work` did not converge; empty when it did.
    pub(super) fn describe(&self, displacements: &[f64], work: &Scratch) -> String {
        match work.failure {
            None => self.push_message(displacements, work),
            Some(Failure::Reach { disk, run, infeasibility: Infeasibility::Bend }) => {
                self.subsegments_needed(disk, run, work.driving[run], displacements)
            }
            Some(Failure::Reach { disk, run, infeasibility: Infeasibility::Piece(hole) }) => {
                let tendon = match (work.driving[run], hole) {
                    (DrivingTendons::Two(_, second), 1) => second,
                    (DrivingTendons::One(first) | DrivingTendons::Two(first, _), _) => first,
                    (DrivingTendons::None, _) => return String::new(),
                };
                format!(
                    "tendon '{}' is pulled by {} m, its path of {} m or more: no length is left \
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
            Some(Failure::Bound) => self.bound_message(displacements, work),
        }
    }

    /// The smallest number of subsegments that takes the pull: more than `|(C, S)| / 2`, from the
    /// shortenings of the whole run.
    fn subsegments_needed(
        &self,
        disk: usize,
        run: usize,
        tendons: DrivingTendons,
        displacements: &[f64],
    ) -> String {
        let Run { first, last, .. } = self.plan.runs[run];
        let arcs = self.robot.backbone().arc_lengths();
        let shortening = |k: usize| {
            let path = &self.robot.paths()[k];
            // Alike holes: the pieces are as long as the subsegments.
            let share = if (first, last) == (0, path.end()) {
                1.0
            } else {
                (arcs[last] - arcs[first]) / path.rest_length
            };
            (path.holes[last], -displacements[k] * share)
        };
        let (c, s) = match tendons {
            DrivingTendons::None => return String::new(),
            DrivingTendons::One(k) => linear_bend(&[shortening(k)]),
            DrivingTendons::Two(a, b) => linear_bend(&[shortening(a), shortening(b)]),
        };
        let needed = 0.5 * c.hypot(s);
        let here = last - first;
        // Not below what is there, however the last digits fell.
        let least = ((needed * (1.0 + BEND_MARGIN)).floor() + 1.0).max(here as f64 + 1.0);
        format!(
            "failed at disk {disk}: the pull bends a subsegment beyond a half turn; between disks \
             {first} and {last} it takes at least {least} subsegments (n > {needed:.6}), here there \
             are {here}",
        )
    }

    /// Remark on a converged answer: the linkage keeps both lengths, as in the paper, also
    /// where the second tendon would have to push.
    fn push_message(&self, displacements: &[f64], work: &Scratch) -> String {
        let choice = self.choice(displacements);
        let names = self.robot.tendon_names();
        for (run, tendons) in self.plan.runs.iter().zip(&work.driving) {
            let DrivingTendons::Two(a, b) = *tendons else { continue };
            for (alone, pushed) in [(a, b), (b, a)] {
                let share = choice.overstretch(run, alone, pushed).share;
                if displacements[alone] < 0.0 && share < -BOUND_TOLERANCE {
                    return format!(
                        "'{}' is kept at its length and would have to push: '{}' alone shortens it \
                         further; free it (inf) to let it go slack",
                        names[pushed], names[alone],
                    );
                }
            }
        }
        String::new()
    }

    fn bound_message(&self, displacements: &[f64], work: &Scratch) -> String {
        let state = &work.state;
        let names = self.robot.tendon_names();
        let list = |tendons: &[usize]| {
            let quoted: Vec<String> = tendons.iter().map(|k| format!("'{}'", names[*k])).collect();
            quoted.join(", ")
        };
        let mut parts: Vec<String> = Vec::new();
        for k in self.overlong(displacements, &work.driving, state) {
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
