//! Messages about a search of the rod that did not converge.

use super::RodInverse;
use crate::inverse::outcome::Answer;
use crate::inverse::tension_problem::TensionProblem;
use crate::rod::contact::LoadedRod;

/// Distance within which a bound is active \[rad, m\].
const AT_EDGE: f64 = 1e-9;

impl RodInverse<'_> {
    /// Message about bounds that exclude every shape, or about a robot of which none was found.
    pub(super) fn no_shape_message(&self, answer: &Answer) -> String {
        if !answer.distance.is_nan() {
            return "the bounds leave the robot no shape".to_owned();
        }
        let own = self.loaded.as_ref().map_or_else(String::new, LoadedRod::slack_message);
        let own = if own.is_empty() { own } else { format!("; without tensions: {own}") };
        format!("none of {} starts leads to a shape of the robot{own}", answer.starts)
    }

    /// Names of the bounds that are active at a point.
    pub(super) fn active_bounds<G>(
        &self,
        point: &[f64],
        problem: &TensionProblem<'_, G>,
    ) -> Vec<String> {
        let names = self.robot.tendon_names();
        let (edges, _) = self.space.region.active_at(point, AT_EDGE);
        let labels = edges.iter().map(|k| self.labels[*k].clone());
        let mut active: Vec<String> = labels.filter(|label| !label.is_empty()).collect();
        active.extend(problem.active_bounds(AT_EDGE).into_iter().map(|(k, release)| {
            format!("{} of '{}'", if release { "release" } else { "pull" }, names[k])
        }));
        active
    }
}
