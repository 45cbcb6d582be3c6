//! Many targets on all cores, and paths.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::ThreadPool;
use rayon::prelude::*;

use super::{Answer, InverseSettings, Target};
use crate::batch::Control;
use crate::error::InvalidInput;
use crate::model::State;
use crate::robot::Robot;

/// Answers, row by row.
#[derive(Clone, Debug, Default)]
pub struct InverseRows {
    /// Displacements, one row per target \[m\].
    pub displacements: Vec<f64>,
    /// Tensions, likewise; NaN where the model knows no forces.
    pub tensions: Vec<f64>,
    /// How each row ended.
    pub answers: Vec<Answer>,
}

/// Rows of one job: unreachable targets take a thousand times as long as easy ones.
const ROWS_PER_JOB: usize = 8;

impl InverseRows {
    fn blank(rows: usize, tendons: usize) -> Self {
        let none = vec![f64::NAN; rows * tendons];
        Self { displacements: none.clone(), tensions: none, answers: vec![Answer::none(); rows] }
    }
}

/// What batches and paths need of an inverse.
pub trait Inverter: Sync {
    /// Where a solve may start.
    type Start: Clone + Sync;
    /// Buffers of a solve, and what it found.
    type Work<'w>
    where
        Self: 'w;

    /// The robot it was prepared from.
    fn robot(&self) -> &Robot;

    /// The choices it was prepared with.
    fn settings(&self) -> &InverseSettings;

    /// Where a solve starts from displacements.
    ///
    /// # Errors
    /// `InvalidInput` for displacements that do not fit the robot.
    fn start(&self, displacements: &[f64]) -> Result<Self::Start, InvalidInput>;

    /// Buffers for this inverse; solves end before their next start when the flag is set, if there is one.
    fn buffers<'w>(&'w self, stop: Option<&'w AtomicBool>) -> Self::Work<'w>;

    /// Seeks what brings the tool to `target`; first from `start`, if given.
    fn solve(
        &self,
        target: &Target,
        start: Option<&Self::Start>,
        work: &mut Self::Work<'_>,
    ) -> Answer;

    /// Seeks again from where the last solve in `work` ended, as along a path.
    fn follow(&self, target: &Target, work: &mut Self::Work<'_>) -> Answer;

    /// The displacements of what the last solve in `work` found \[m\].
    fn write_displacements(&self, work: &Self::Work<'_>, place: &mut [f64]);

    /// Their tensions, in the unit of the results; untouched where the model knows no forces.
    fn write_tensions(&self, work: &Self::Work<'_>, place: &mut [f64]);

    /// The shape that the last solve in `work` found, where displacements do not say which one it is.
    fn state(&self, _work: &mut Self::Work<'_>) -> Option<State> {
        None
    }

    /// What stood in the way of the last solve in `work`, in a sentence; empty when it converged.
    fn message(&self, answer: &Answer, work: &Self::Work<'_>) -> String;
}

/// Solves every target on `pool`, each as alone, from `starts` (one per row, or none). Returns `None` when it was
/// stopped.
#[must_use]
pub fn invert_rows<I: Inverter>(
    inverse: &I,
    targets: &[Target],
    starts: &[I::Start],
    pool: &ThreadPool,
    control: &Control,
) -> Option<InverseRows> {
    let count = inverse.robot().tendons().len();
    let mut rows = InverseRows::blank(targets.len(), count);
    let InverseRows { displacements, tensions, answers } = &mut rows;
    let width = (ROWS_PER_JOB * count).max(1);
    pool.install(|| {
        (targets.par_chunks(ROWS_PER_JOB))
            .zip(answers.par_chunks_mut(ROWS_PER_JOB))
            .zip(displacements.par_chunks_mut(width))
            .zip(tensions.par_chunks_mut(width))
            .enumerate()
            .for_each_init(
                || inverse.buffers(Some(&control.stop)),
                |work, (job, (((targets, answers), displacements), tensions))| {
                    for (i, (target, answer)) in targets.iter().zip(answers).enumerate() {
                        if control.stop.load(Ordering::Relaxed) {
                            return;
                        }
                        let start = starts.get(ROWS_PER_JOB * job + i);
                        *answer = inverse.solve(target, start, work);
                        let own = i * count..(i + 1) * count;
                        inverse.write_displacements(work, &mut displacements[own.clone()]);
                        inverse.write_tensions(work, &mut tensions[own]);
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
pub fn invert_path<I: Inverter>(
    inverse: &I,
    targets: &[Target],
    start: Option<&I::Start>,
    control: &Control,
) -> Option<InverseRows> {
    let count = inverse.robot().tendons().len();
    let mut rows = InverseRows::blank(targets.len(), count);
    let mut work = inverse.buffers(Some(&control.stop));
    for (i, target) in targets.iter().enumerate() {
        if control.stop.load(Ordering::Relaxed) {
            return None;
        }
        rows.answers[i] = if i == 0 {
            inverse.solve(target, start, &mut work)
        } else {
            inverse.follow(target, &mut work)
        };
        let own = i * count..(i + 1) * count;
        inverse.write_displacements(&work, &mut rows.displacements[own.clone()]);
        inverse.write_tensions(&work, &mut rows.tensions[own]);
        control.done.fetch_add(1, Ordering::Relaxed);
    }
    Some(rows)
}
