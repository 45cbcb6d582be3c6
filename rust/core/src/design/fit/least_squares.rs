//! Levenberg-Marquardt steps on distances, squared or under the soft-L1 loss.

use std::sync::atomic::Ordering;

use nalgebra::{DMatrix, DVector};
use rayon::ThreadPool;
use rayon::prelude::*;

use super::prediction::{Predictor, Row};
use crate::error::InvalidInput;

/// Relative fall of the loss, and scaled step, below which a round has converged.
const FALL: f64 = 1e-7;
const STEP: f64 = 1e-8;
/// Damping: the first, the least, and beyond which no step is left.
const DAMPING: f64 = 1e-4;
const LEAST_DAMPING: f64 = 1e-12;
const STUCK: f64 = 1e10;
/// Diagonal entries at least: values that nothing depends on stay where they are.
const TINY: f64 = 1e-300;
/// Rows that are added up one after the other: fixed, so that sums are the same on any number of threads.
const ROWS_PER_SUM: usize = 64;

/// Loss of a point at a distance r: `r^2`, or soft-L1 `2 s^2 (sqrt(1 + r^2/s^2) - 1)`.
#[derive(Clone, Copy, Debug)]
pub(super) enum Loss {
    Squares,
    SoftL1(f64),
}

impl Loss {
    /// Weight of a point by its squared distance: how much less it counts than under squares.
    pub(super) fn weight(self, square: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::SoftL1(scale) => 1.0 / (1.0 + square / scale.powi(2)).sqrt(),
        }
    }

    /// Part of the second derivative along a residual that the weight lacks, `-w^3/s^2`.
    pub(super) fn curvature(self, square: f64) -> f64 {
        match self {
            Self::Squares => 0.0,
            Self::SoftL1(scale) => -(self.weight(square) / scale).powi(3) * scale,
        }
    }

    fn of(self, rows: &[Row]) -> f64 {
        let of_point = |square: f64| match self {
            Self::Squares => square,
            Self::SoftL1(scale) => {
                2.0 * scale.powi(2) * ((1.0 + square / scale.powi(2)).sqrt() - 1.0)
            }
        };
        rows.iter().flat_map(Row::squares).map(of_point).sum()
    }
}

/// Iterate of the descent: values, and the rows at them.
pub(super) struct Iterate {
    pub(super) values: DVector<f64>,
    pub(super) rows: Vec<Row>,
    /// Steps taken so far.
    pub(super) iterations: usize,
    /// Convergence: steps no longer fall.
    pub(super) converged: bool,
}

impl Predictor<'_> {
    /// Levenberg-Marquardt steps from an iterate until the loss falls no further, at most `max_iterations` in all.
    pub(super) fn descend(
        &self,
        at: &mut Iterate,
        chosen: &[usize],
        loss: Loss,
        max_iterations: usize,
    ) -> Result<(), InvalidInput> {
        let (mut damping, mut cost) = (DAMPING, loss.of(&at.rows));
        at.converged = false;
        while at.iterations < max_iterations && !at.converged {
            at.iterations += 1;
            let (gram, slope) = self.normal_equations(&at.rows, loss);
            // The damping grows until a step lowers the loss.
            loop {
                let step = damped_step(&gram, &slope, damping);
                let small = step.amax() <= STEP;
                let values = self.parameters.step(&at.values, &step);
                let rows = self.rows(&values, chosen, true)?;
                if self.control.stop.load(Ordering::Relaxed) {
                    return Ok(());
                }
                let trial = loss.of(&rows);
                if trial < cost {
                    at.converged = small || cost - trial < FALL * cost.max(TINY);
                    (at.values, at.rows, cost) = (values, rows, trial);
                    damping = (damping / 10.0).max(LEAST_DAMPING);
                    break;
                }
                damping *= 10.0;
                if small || damping > STUCK {
                    at.converged = true;
                    break;
                }
            }
        }
        Ok(())
    }

    /// `JᵀWJ` and `JᵀWr`.
    fn normal_equations(&self, rows: &[Row], loss: Loss) -> (DMatrix<f64>, DVector<f64>) {
        sum_over(rows, self.parameters.len(), self.pool, |row, gram, slope| {
            let weighted = weight_jacobian(row, loss);
            gram.gemm_tr(1.0, &weighted, &row.jacobian, 1.0);
            slope.gemv_tr(1.0, &weighted, &row.residual, 1.0);
        })
    }
}

/// Sums over the rows that were solved: a matrix and a vector, to which `add` adds one row.
pub(super) fn sum_over(
    rows: &[Row],
    size: usize,
    pool: &ThreadPool,
    add: impl Fn(&Row, &mut DMatrix<f64>, &mut DVector<f64>) + Sync,
) -> (DMatrix<f64>, DVector<f64>) {
    let zero = || (DMatrix::zeros(size, size), DVector::zeros(size));
    let sum = |chunk: &[Row]| {
        let (mut matrix, mut vector) = zero();
        for row in chunk.iter().filter(|row| row.solved) {
            add(row, &mut matrix, &mut vector);
        }
        (matrix, vector)
    };
    let sums: Vec<_> = pool.install(|| rows.par_chunks(ROWS_PER_SUM).map(sum).collect());
    sums.into_iter().fold(zero(), |all, own| (all.0 + own.0, all.1 + own.1))
}

/// Jacobian of a row with its points weighted, `WJ`.
pub(super) fn weight_jacobian(row: &Row, loss: Loss) -> DMatrix<f64> {
    let mut out = row.jacobian.clone();
    for (j, square) in row.squares().enumerate() {
        out.rows_mut(3 * j, 3).scale_mut(loss.weight(square));
    }
    out
}

/// Step that solves `(G + damping diag(G)) step = slope`; none where rounding leaves no positive definite matrix.
fn damped_step(gram: &DMatrix<f64>, slope: &DVector<f64>, damping: f64) -> DVector<f64> {
    let size = gram.diagonal().map(|entry| entry.max(TINY).sqrt());
    let mut scaled =
        DMatrix::from_fn(gram.nrows(), gram.ncols(), |a, b| gram[(a, b)] / size[a] / size[b]);
    for a in 0..size.len() {
        scaled[(a, a)] += damping;
    }
    scaled.cholesky().map_or_else(
        || DVector::zeros(size.len()),
        |factors| factors.solve(&slope.component_div(&size)).component_div(&size),
    )
}
