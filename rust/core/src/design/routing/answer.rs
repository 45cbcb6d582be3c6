//! Answers of a design, and beginnings of another.

use super::best_tensions::Candidate;
use super::evaluation::{Evaluation, Evaluator};
use super::task::{Holes, PerHole, Task};
use crate::error::InvalidInput;

/// Share by which the rod's own rounding may make a shape worse.
const ROUNDING: f64 = 1.0 + 1e-9;

/// Outcome of a design.
pub(super) struct Answer {
    pub(super) best: Evaluation,
    /// Least sum of squared distances with any azimuth that was met.
    pub(super) relaxed: f64,
    /// Every routing was looked at over a row of tensions.
    pub(super) whole: bool,
    /// The nearest routings of the search, in holes.
    pub(super) found: Vec<Candidate>,
    pub(super) steps: usize,
    pub(super) solved: usize,
}

/// Beginning of a design.
#[derive(Default)]
pub(super) struct Begin<'b> {
    /// Routing to look at first: azimuths, and tensions in the unit of the results.
    pub(super) start: Option<&'b (PerHole, Vec<f64>)>,
    /// Answers with a tendon less.
    pub(super) fewer: Vec<ExtendedAnswer>,
    /// Routings that a search without bounds found.
    pub(super) found: &'b [Candidate],
}

/// An answer with one tendon less, and that tendon beside the others, unpulled.
pub(super) struct ExtendedAnswer {
    pub(super) azimuths: PerHole,
    pub(super) tensions: Vec<f64>,
    /// With any azimuth.
    pub(super) relaxed: f64,
    radii: PerHole,
    holes: Option<Holes>,
    displacements: Vec<f64>,
    value: f64,
    /// The tendon that is new, and the one that it goes beside.
    new: usize,
    beside: usize,
}

impl ExtendedAnswer {
    /// Extension to a task with one tendon more.
    pub(super) fn new(task: &Task<'_>, answer: &Answer, new: usize) -> Self {
        let best = &answer.best;
        let mut tensions = best.shape.state.tensions.clone();
        let most = (0..tensions.len()).max_by(|a, b| tensions[*a].total_cmp(&tensions[*b]));
        let donor = most.unwrap_or(0);
        let along = |own: &[f64]| -> Vec<f64> {
            (0..=task.end(new)).map(|disk| own[disk.min(own.len() - 1)]).collect()
        };
        let (mut azimuths, mut radii) = (best.point.azimuths.clone(), best.point.radii.clone());
        azimuths.insert(new, along(&azimuths[donor]));
        let mut own = task.radii[new].clone();
        if let Some((low, high)) = task.settings.radius {
            for radius in &mut own {
                *radius = radius.clamp(low, high);
            }
        }
        radii.insert(new, own);
        let end = best.point.azimuths[donor].len() - 1;
        let holes = best.holes.as_ref().map(|holes| {
            let row = |(disk, row): (usize, &Vec<usize>)| {
                let mut row = row.clone();
                let hole = if disk <= task.end(new) { holes[disk.min(end)][donor] } else { 0 };
                row.insert(new, hole);
                row
            };
            holes.iter().enumerate().map(row).collect()
        });
        let mut displacements = best.point.displacements.clone();
        displacements.insert(new, 0.0_f64.clamp(task.bound(new).0, task.bound(new).1));
        tensions.insert(new, 0.0);
        let beside = donor + usize::from(new <= donor);
        let (relaxed, value) = (answer.relaxed, best.value);
        Self { azimuths, tensions, relaxed, radii, holes, displacements, value, new, beside }
    }

    /// Solves for its shape: held at its rest length, or where that pulls it, released as far as it may be.
    pub(super) fn evaluate(
        &self,
        task: &Task<'_>,
        evaluator: &mut Evaluator<'_, '_>,
    ) -> Result<(), InvalidInput> {
        let high = task.bound(self.new).1;
        let released = if high.is_finite() { high } else { task.length() };
        for pull in [self.displacements[self.new], released] {
            let mut pulls = self.displacements.clone();
            pulls[self.new] = pull;
            let holes = (self.azimuths.clone(), self.radii.clone());
            let numbers = self.holes.clone().zip(task.settings.holes);
            if evaluator.evaluate_given(holes, numbers, &pulls, ROUNDING * self.value)? {
                break;
            }
        }
        Ok(())
    }

    /// The pull of one tendon shared by it and the new one, so far apart in azimuth.
    pub(super) fn share_pull(&self, apart: f64) -> (PerHole, Vec<f64>) {
        let (mut azimuths, mut tensions) = (self.azimuths.clone(), self.tensions.clone());
        for (k, by) in [(self.new, 0.5 * apart), (self.beside, -0.5 * apart)] {
            azimuths[k].iter_mut().for_each(|azimuth| *azimuth += by);
            tensions[k] = 0.5 * self.tensions[self.beside];
        }
        (azimuths, tensions)
    }
}
