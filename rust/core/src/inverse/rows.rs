//! Many targets on all cores, and paths.

use std::sync::atomic::Ordering;

use rayon::ThreadPool;
use rayon::prelude::*;

use super::{Answer, ConstantCurvatureInverse, Target};
use crate::batch::Control;
use crate::constant_curvature::Arc;
use crate::status::Status;

/// Answers, row by row.
#[derive(Clone, Debug, Default)]
pub struct InverseRows {
    /// Displacements, one row per target \[m\].
    pub displacements: Vec<f64>,
    /// How each row ended.
    pub answers: Vec<Answer>,
}

/// Rows of one job: unreachable targets take a thousand times as long as easy ones.
const ROWS_PER_JOB: usize = 8;

impl InverseRows {
    fn blank(rows: usize, tendons: usize) -> Self {
        let blank = Answer {
            status: Status::NumericalError,
            distance: f64::NAN,
            angle: f64::NAN,
            iterations: 0,
            starts: 0,
        };
        Self { displacements: vec![f64::NAN; rows * tendons], answers: vec![blank; rows] }
    }
}

/// Solves every target on `pool`, each as alone, from `starts` (the arcs of one start per row, or none).
/// Returns `None` when it was stopped.
#[must_use]
pub fn invert_rows(
    inverse: &ConstantCurvatureInverse<'_>,
    targets: &[Target],
    starts: &[Vec<Arc>],
    pool: &ThreadPool,
    control: &Control,
) -> Option<InverseRows> {
    let tendons = inverse.robot().tendons().len();
    let mut rows = InverseRows::blank(targets.len(), tendons);
    let InverseRows { displacements, answers } = &mut rows;
    pool.install(|| {
        (targets.par_chunks(ROWS_PER_JOB))
            .zip(answers.par_chunks_mut(ROWS_PER_JOB))
            .zip(displacements.par_chunks_mut((ROWS_PER_JOB * tendons).max(1)))
            .enumerate()
            .for_each_init(
                || inverse.workspace().stopped_by(&control.stop),
                |work, (job, ((targets, answers), displacements))| {
                    for (i, (target, answer)) in targets.iter().zip(answers).enumerate() {
                        if control.stop.load(Ordering::Relaxed) {
                            return;
                        }
                        let start = starts.get(ROWS_PER_JOB * job + i).map(Vec::as_slice);
                        *answer = inverse.solve(target, start, work);
                        let place = &mut displacements[i * tendons..(i + 1) * tendons];
                        inverse.write_displacements(work, place);
                        control.done.fetch_add(1, Ordering::Relaxed);
                    }
                },
            );
    });
    (!control.stop.load(Ordering::Relaxed)).then_some(rows)
}

/// Solves targets one after the other, each from the answer of the one before. Returns `None` when it was
/// stopped.
#[must_use]
pub fn invert_path(
    inverse: &ConstantCurvatureInverse<'_>,
    targets: &[Target],
    start: Option<&[Arc]>,
    control: &Control,
) -> Option<InverseRows> {
    let tendons = inverse.robot().tendons().len();
    let mut rows = InverseRows::blank(targets.len(), tendons);
    let mut work = inverse.workspace().stopped_by(&control.stop);
    for (i, target) in targets.iter().enumerate() {
        if control.stop.load(Ordering::Relaxed) {
            return None;
        }
        rows.answers[i] = if i == 0 {
            inverse.solve(target, start, &mut work)
        } else {
            inverse.follow(target, &mut work)
        };
        inverse.write_displacements(&work, &mut rows.displacements[i * tendons..(i + 1) * tendons]);
        control.done.fetch_add(1, Ordering::Relaxed);
    }
    Some(rows)
}
