//! Residuals that a goal asks of a rod at an equilibrium.

use nalgebra::SVector;

use crate::rod::equilibrium::Motion;

/// Goal of a rod's inverse: residuals at an equilibrium, and their derivatives with respect to the tensions.
pub(super) trait Goal<const R: usize> {
    /// Reads the rod's position at an equilibrium.
    fn update(&mut self, motion: &Motion);

    /// Residuals of the last update and their derivatives.
    fn write_residual(
        &mut self,
        motion: &Motion,
        residual: &mut SVector<f64, R>,
        jacobian: &mut [SVector<f64, R>],
    );

    /// Squared residuals of the last update.
    fn squared_norm(&self) -> f64;

    /// True when residuals, which need not be those of the last update, are within the tolerances.
    fn is_met(&self, residual: &SVector<f64, R>) -> bool;

    /// Adds the second derivatives of `weights . r` by the tensions to the lower triangle of a matrix.
    fn add_hessian(&mut self, motion: &mut Motion, weights: &SVector<f64, R>, matrix: &mut [f64]);
}
