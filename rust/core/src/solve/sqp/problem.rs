//! Equality-constrained problems on manifolds, and their first derivatives at a point.

use nalgebra::{SMatrix, SVector};

/// Value and first derivatives of a problem at one point.
#[derive(Clone, Copy, Debug)]
pub struct Linearization<const N: usize, const M: usize> {
    /// Objective.
    pub objective: f64,
    /// Gradient of the objective in local coordinates.
    pub gradient: SVector<f64, N>,
    /// Constraint values, wanted zero.
    pub constraints: SVector<f64, M>,
    /// Gradients of the constraints as columns.
    pub jacobian_transposed: SMatrix<f64, N, M>,
}

/// An equality-constrained problem on a manifold with `N` local coordinates.
pub trait Problem<const N: usize, const M: usize> {
    /// A point of the manifold with whatever is worth keeping between the calls below.
    type Point: Copy;

    /// Objective, constraints and their gradients, every entry written.
    fn linearize(&self, point: &Self::Point, out: &mut Linearization<N, M>);

    /// Second derivatives of `f + multipliers . c` along the (second-order) retraction.
    fn hessian(&self, point: &Self::Point, multipliers: &SVector<f64, M>) -> SMatrix<f64, N, N>;

    /// Puts the point reached by `factor` times a step in local coordinates into `out`.
    fn retract(
        &self,
        point: &Self::Point,
        step: &SVector<f64, N>,
        factor: f64,
        out: &mut Self::Point,
    );

    /// Whether the point lies on the branch whose minimum is wanted; steps that leave it are cut.
    fn admissible(&self, point: &Self::Point) -> bool;

    /// Size of a step in the units that the tolerance and the step bound are stated in.
    fn step_size(&self, step: &SVector<f64, N>) -> f64;
}
