//! Residuals that a goal asks of a rod at an equilibrium.

use nalgebra::SVector;

use crate::rod::equilibrium::Motion;

/// What is wanted of a rod: residuals at a balance, and their derivatives by the tensions.
pub(super) trait Goal<const R: usize> {
    /// Looks at where the rod is.
    fn update(&mut self, motion: &Motion);

    /// Residuals of the last placing and their derivatives.
    fn write_residual(
        &mut self,
        motion: &Motion,
        residual: &mut SVector<f64, R>,
        jacobian: &mut [SVector<f64, R>],
    );

    /// The squared residuals of the last placing.
    fn squared_norm(&self) -> f64;

    /// Whether residuals, not those of the last placing in every case, are as small as wanted.
    fn is_met(&self, residual: &SVector<f64, R>) -> bool;

    /// Adds the second derivatives of `weights . r` by the tensions to the lower triangle of a matrix.
    fn add_hessian(&mut self, motion: &mut Motion, weights: &SVector<f64, R>, matrix: &mut [f64]);
}
