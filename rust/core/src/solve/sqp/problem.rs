//! Equality-constrained problems on manifolds, and their first derivatives at a point.

use nalgebra::{SMatrix, SVector};

/// Value and first derivatives of a problem at one point.
///
/// ```
/// use nalgebra::{SMatrix, Vector1, Vector2};
/// use tdcr::solve::sqp::Linearization;
///
/// // f = x, c = x² + y² - 1 at (0, 1).
/// let at = Linearization {
///     objective: 0.0,
///     gradient: Vector2::new(1.0, 0.0),
///     constraints: Vector1::new(0.0),
///     jacobian_transposed: SMatrix::from([[0.0, 2.0]]),
/// };
/// assert_eq!(at.jacobian_transposed.shape(), (2, 1));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Linearization<const N: usize, const M: usize> {
    /// Objective.
    pub objective: f64,
    /// Gradient of the objective in local coordinates.
    pub gradient: SVector<f64, N>,
    /// Constraint values, zero at a solution.
    pub constraints: SVector<f64, M>,
    /// Gradients of the constraints as columns.
    pub jacobian_transposed: SMatrix<f64, N, M>,
}

/// An equality-constrained problem on a manifold with `N` local coordinates.
///
/// ```
/// use nalgebra::{Matrix2, SMatrix, Vector1, Vector2};
/// use tdcr::solve::sqp::{Ending, Linearization, Problem, Settings, minimize};
///
/// /// The lowest x on the circle of radius 1.
/// struct Circle;
///
/// impl Problem<2, 1> for Circle {
///     type Point = Vector2<f64>;
///
///     fn linearize(&self, p: &Vector2<f64>, out: &mut Linearization<2, 1>) {
///         *out = Linearization {
///             objective: p.x,
///             gradient: Vector2::new(1.0, 0.0),
///             constraints: Vector1::new(p.norm_squared() - 1.0),
///             jacobian_transposed: SMatrix::from([[2.0 * p.x, 2.0 * p.y]]),
///         };
///     }
///     fn hessian(&self, _: &Vector2<f64>, multipliers: &Vector1<f64>) -> Matrix2<f64> {
///         Matrix2::identity() * (2.0 * multipliers[0])
///     }
///     fn retract(&self, p: &Vector2<f64>, step: &Vector2<f64>, factor: f64, out: &mut Vector2<f64>) {
///         *out = p + step * factor;
///     }
///     fn admissible(&self, _: &Vector2<f64>) -> bool {
///         true
///     }
///     fn step_size(&self, step: &Vector2<f64>) -> f64 {
///         step.amax()
///     }
/// }
///
/// let settings = Settings {
///     step_tolerance: 1e-9,
///     step_bound: 0.5,
///     constraint_tolerance: 1e-12,
///     max_iterations: 50,
/// };
/// let found = minimize(&Circle, Vector2::new(-0.6, 0.8), &settings);
/// assert_eq!(found.ending, Ending::Converged);
/// assert!((found.point - Vector2::new(-1.0, 0.0)).norm() < 1e-9);
/// ```
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

    /// True when the point lies on the branch of the minimum; steps that leave it are cut.
    fn admissible(&self, point: &Self::Point) -> bool;

    /// Size of a step in the units that the tolerance and the step bound are stated in.
    fn step_size(&self, step: &SVector<f64, N>) -> f64;
}
