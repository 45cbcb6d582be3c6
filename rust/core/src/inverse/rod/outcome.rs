//! How a search of the rod ended, and what is said of it.

use super::RodInverse;
use crate::inverse::multistart::{Found, Search};
use crate::inverse::outcome::Answer;
use crate::inverse::tension_problem::{Goal, Pull};
use crate::rod::contact::LoadedRod;
use crate::solve::levenberg_marquardt::Problem;
use crate::status::Status;

/// A bound that is this near holds back \[rad, m\].
const AT_EDGE: f64 = 1e-9;

/// How a search ended, its point evaluated; `misses` tells how far off that is.
pub(super) fn ended<const R: usize, G: Goal<R>>(
    mut found: Found,
    pull: &mut Pull<'_, G>,
    search: &mut Search<'_, R>,
    misses: impl FnOnce(&G) -> (f64, f64),
) -> Answer {
    let failed = found.status == Status::NumericalError && !search.stopped();
    if failed && Problem::<R>::violation(pull) > 0.0 {
        // No start could be brought inside.
        found.status = Status::Infeasible;
    }
    search.fit.evaluate(pull, &search.point);
    if failed && !pull.sound() {
        return Answer::shapeless(found);
    }
    Answer::of(found, misses(&pull.aim))
}

impl RodInverse<'_> {
    /// What to say of bounds that exclude every shape, or of a robot of which none was found.
    pub(super) fn shapeless(&self, answer: &Answer) -> String {
        if !answer.distance.is_nan() {
            return "the bounds leave the robot no shape".to_owned();
        }
        let own = self.loaded.as_ref().map_or_else(String::new, LoadedRod::hindrance);
        let own = if own.is_empty() { own } else { format!("; without tensions: {own}") };
        format!("none of {} starts leads to a shape of the robot{own}", answer.starts)
    }

    /// Bounds that hold a point back.
    pub(super) fn held<G>(&self, point: &[f64], pull: &Pull<'_, G>) -> Vec<String> {
        let names = self.robot.tendon_names();
        let (edges, _) = self.space.region.at_edge(point, AT_EDGE);
        let labels = edges.iter().map(|k| self.labels[*k].clone());
        let mut held: Vec<String> = labels.filter(|label| !label.is_empty()).collect();
        held.extend(pull.holding(AT_EDGE).into_iter().map(|(k, release)| {
            format!("{} of '{}'", if release { "release" } else { "pull" }, names[k])
        }));
        held
    }
}
