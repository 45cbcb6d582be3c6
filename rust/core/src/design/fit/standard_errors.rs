//! Standard errors of fitted values by the sandwich estimate with leverages, HC3 (J. G. `MacKinnon`, H. White, Journal
//! of Econometrics 29 (1985), doi:10.1016/0304-4076(85)90158-7).

use nalgebra::{DMatrix, DVector};
use rayon::ThreadPool;
use rayon::prelude::*;

use super::least_squares::{Loss, sum_over, weight_jacobian};
use super::prediction::Row;
use crate::solve::pseudo_inverse::PseudoInverse;

/// Directions whose curvature is below this share of the largest are not told by the data.
const BLIND: f64 = 1e-12;
/// Share of a value in such a direction from which the data do not tell it.
const SHARE: f64 = 1e-4;

/// Standard errors of the scaled values; infinite where the data do not tell them. Rows are independent, points of a
/// row are not: every row's residual is that of a fit without it, by its leverage.
pub(super) fn standard_errors(
    rows: &[Row],
    size: usize,
    loss: Loss,
    pool: &ThreadPool,
) -> DVector<f64> {
    // H: the loss is flatter along a residual than its weight says.
    let (hessian, _) = sum_over(rows, size, pool, |row, hessian, _| {
        hessian.gemm_tr(1.0, &weight_jacobian(row, loss), &row.jacobian, 1.0);
        for (j, square) in row.squares().enumerate() {
            let along = row.jacobian.rows(3 * j, 3).tr_mul(&row.residual.rows(3 * j, 3));
            hessian.ger(loss.curvature(square), &along, &along, 1.0);
        }
    });
    // H⁻¹ along the directions that the data tell, each value in its own length.
    let lengths = hessian.diagonal().map(|entry| entry.max(1e-300).sqrt());
    let scaled = DMatrix::from_fn(size, size, |a, b| hessian[(a, b)] / lengths[a] / lengths[b]);
    let axes = scaled.symmetric_eigen();
    let least = BLIND * axes.eigenvalues.max();
    let mut inverse = DMatrix::zeros(size, size);
    let mut blind: Vec<bool> = (0..size).map(|a| hessian[(a, a)] == 0.0).collect();
    for (axis, curvature) in axes.eigenvectors.column_iter().zip(axes.eigenvalues.iter()) {
        if *curvature > least {
            let along = axis.component_div(&lengths);
            inverse.ger(1.0 / curvature, &along, &along, 1.0);
        } else {
            blind.iter_mut().zip(axis.iter()).for_each(|(own, entry)| *own |= entry.abs() > SHARE);
        }
    }
    // Scores gᵢ = JᵢᵀWᵢ (1 − Jᵢ H⁻¹ JᵢᵀWᵢ)⁻¹ rᵢ, and H⁻¹ gᵢ.
    let moved: Vec<DVector<f64>> = pool.install(|| {
        let moved = rows.par_iter().filter(|row| row.solved).map(|row| {
            let weighted = weight_jacobian(row, loss);
            let leverage = &row.jacobian * &inverse * weighted.transpose();
            let rest = DMatrix::identity(leverage.nrows(), leverage.nrows()) - leverage;
            let without = rest.clone().lu().solve(&row.residual);
            let without = without.filter(|own| own.iter().all(|r| r.is_finite()));
            let without = without.unwrap_or_else(|| PseudoInverse::new(&rest).solve(&row.residual));
            &inverse * weighted.tr_mul(&without)
        });
        moved.collect()
    });
    // Root of the diagonal of H⁻¹ (Σ gᵢ gᵢᵀ) H⁻¹.
    DVector::from_fn(size, |a, _| {
        let variance: f64 = moved.iter().map(|own| own[a] * own[a]).sum();
        if blind[a] { f64::INFINITY } else { variance.sqrt() }
    })
}
