//! First-order conditions, checked without the solvers.

use nalgebra::{DMatrix, DVector};

/// How long the part of a gradient is that constraints do not hold: the least of
/// `|gradient + sum free_k normal_k + sum weight_k normal_k|` over any `free` for the equations and weights
/// of 0 or more for the active inequalities, by trying every set of these.
pub(crate) fn unheld(
    gradient: &DVector<f64>,
    equations: &[DVector<f64>],
    inequalities: &[DVector<f64>],
) -> f64 {
    assert!(inequalities.len() < 12);
    let mut least = f64::INFINITY;
    for set in 0..1_usize << inequalities.len() {
        let active = inequalities.iter().enumerate().filter(|(k, _)| set >> k & 1 == 1);
        let normals: Vec<_> = equations.iter().chain(active.map(|(_, normal)| normal)).collect();
        if normals.is_empty() {
            least = least.min(gradient.norm());
            continue;
        }
        let matrix = DMatrix::from_fn(gradient.len(), normals.len(), |i, k| normals[k][i]);
        let multipliers = matrix.clone().svd(true, true).solve(&-gradient, 1e-10).unwrap();
        if multipliers.iter().skip(equations.len()).all(|m| *m >= -1e-9 * (1.0 + gradient.norm())) {
            least = least.min((gradient + matrix * multipliers).norm());
        }
    }
    least
}
