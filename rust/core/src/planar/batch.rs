//! Batches of targets, on all cores.

use std::sync::atomic::Ordering;

use rayon::ThreadPool;
use rayon::prelude::*;

use super::newton_inverse::{Goal, Inverse, InverseSettings, inverse_until};
use super::trunk::Trunk;
use super::two_section::TwoSections;
use crate::batch::Control;
use crate::error::InvalidInput;

/// Solutions of many targets in one flat table.
///
/// ```
/// use tdcr::batch::{Control, pool};
/// use tdcr::planar::{TwoSections, solution_rows};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let two = TwoSections::new(0.14, 0.12, std::f64::consts::TAU)?;
/// let targets = [[0.2, 0.06], [1.0, 0.0]];
/// let threads = pool(Some(1))?;
/// let rows = solution_rows(&two, &targets, &threads, &Control::default()).unwrap_or_default();
/// // The second target is out of reach.
/// assert_eq!((rows.counts[0], rows.counts[1]), (rows.turns.len(), 0));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SolutionRows {
    /// Turns of all solutions, target by target, each by bending energy \[rad\].
    pub turns: Vec<[f64; 2]>,
    /// Number of solutions of every target.
    pub counts: Vec<usize>,
}

/// Targets of one job: enough to pay for its bookkeeping, few enough to stop and to share well.
const TARGETS_PER_JOB: usize = 256;

/// Every solution of every target (x, y) \[m\], in their order whatever the number of threads.
/// Returns `None` when it was stopped.
#[must_use]
pub fn solution_rows(
    two: &TwoSections,
    targets: &[[f64; 2]],
    pool: &ThreadPool,
    control: &Control,
) -> Option<SolutionRows> {
    let job = |targets: &[[f64; 2]]| {
        let mut part = SolutionRows::default();
        let mut found = Vec::new();
        for &[x, y] in targets {
            if control.stop.load(Ordering::Relaxed) {
                break;
            }
            two.solutions(x, y, &mut found);
            part.turns.extend_from_slice(&found);
            part.counts.push(found.len());
            control.done.fetch_add(1, Ordering::Relaxed);
        }
        part
    };
    let parts: Vec<SolutionRows> =
        pool.install(|| targets.par_chunks(TARGETS_PER_JOB).map(job).collect());
    if control.stop.load(Ordering::Relaxed) {
        return None;
    }
    let mut whole = SolutionRows {
        turns: Vec::with_capacity(parts.iter().map(|part| part.turns.len()).sum()),
        counts: Vec::with_capacity(targets.len()),
    };
    for part in parts {
        whole.turns.extend(part.turns);
        whole.counts.extend(part.counts);
    }
    Some(whole)
}

/// The inverse of every goal, in their order whatever the number of threads. Returns `None` when it was
/// stopped.
///
/// # Errors
/// As [`super::inverse()`], for the first row that has any.
pub fn inverse_rows(
    trunk: &Trunk,
    goals: &[Goal],
    settings: &InverseSettings,
    pool: &ThreadPool,
    control: &Control,
) -> Result<Option<Vec<Inverse>>, InvalidInput> {
    let job = |goal: &Goal| {
        if control.stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let answer = inverse_until(trunk, goal, settings, &control.stop)?;
        control.done.fetch_add(usize::from(answer.is_some()), Ordering::Relaxed);
        Ok(answer)
    };
    // None of a row that was stopped makes the whole None.
    pool.install(|| goals.par_iter().map(job).collect())
}
