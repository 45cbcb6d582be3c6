//! Least-squares problems, and the purposes and ends of descents.

use nalgebra::SVector;

use crate::solve::quadratic_program::Rows;

/// Violations of bounds on functions of the unknowns that count as none.
pub const WITHIN: f64 = 1e-12;
/// A minimum is found when the gradient of the Lagrangian is this share of what it can be.
const STATIONARY: f64 = 1e-11;

/// Residuals of `R` rows, and an energy that chooses among the points where they vanish.
///
/// ```
/// use nalgebra::Vector1;
/// use tdcr::solve::convex_region::Region;
/// use tdcr::solve::levenberg_marquardt::{Ending, Problem, Purpose, Scratch};
///
/// /// The circle of radius 1, and the energy z_0 on it.
/// struct Circle;
///
/// impl Problem<1> for Circle {
///     fn evaluate(&mut self, z: &[f64], r: &mut Vector1<f64>, jacobian: &mut [Vector1<f64>]) {
///         r[0] = z[0] * z[0] + z[1] * z[1] - 1.0;
///         jacobian.iter_mut().zip(z).for_each(|(column, z)| column[0] = 2.0 * z);
///     }
///     fn squared_norm(&mut self, z: &[f64]) -> f64 {
///         (z[0] * z[0] + z[1] * z[1] - 1.0).powi(2)
///     }
///     fn is_met(&self, r: &Vector1<f64>) -> bool {
///         r[0].abs() < 1e-12
///     }
///     fn add_hessian(&mut self, _: &[f64], weights: &Vector1<f64>, hessian: &mut [f64]) {
///         hessian[0] += 2.0 * weights[0];
///         hessian[3] += 2.0 * weights[0];
///     }
///     fn energy(&self, z: &[f64], gradient: &mut [f64]) -> f64 {
///         gradient.copy_from_slice(&[1.0, 0.0]);
///         z[0]
///     }
///     fn add_energy_hessian(&self, _: &[f64], _: &mut [f64]) {}
/// }
///
/// let (mut scratch, region, mut z) = (Scratch::<1>::default(), Region::new(2), vec![2.0, 1.0]);
/// let ending = scratch.descend(&mut Circle, &region, &mut z, Purpose::Meet, 50);
/// assert_eq!(ending, Ending::Met);
/// assert!((z[0].hypot(z[1]) - 1.0).abs() < 1e-12);
/// ```
pub trait Problem<const R: usize> {
    /// Residuals, and their derivatives by every unknown.
    fn evaluate(
        &mut self,
        z: &[f64],
        residual: &mut SVector<f64, R>,
        jacobian: &mut [SVector<f64, R>],
    );

    /// The squared residuals alone.
    fn squared_norm(&mut self, z: &[f64]) -> f64;

    /// True when residuals are within the tolerances.
    fn is_met(&self, residual: &SVector<f64, R>) -> bool;

    /// Adds the second derivatives of `weights . r` to the lower triangle of a matrix, row by row, at `z`,
    /// the point evaluated last.
    fn add_hessian(&mut self, z: &[f64], weights: &SVector<f64, R>, hessian: &mut [f64]);

    /// Resets a problem whose values depend on the points before.
    fn restart(&mut self) {}

    /// Saves the state of the point evaluated last, for [`Self::restore_state`].
    fn save_state(&mut self) {}

    /// Restores the saved state.
    fn restore_state(&mut self) {}

    /// Adds bounds on functions of the unknowns, as rows for a step from the point evaluated last; there are
    /// none unless this is defined.
    fn linearize(&self, _rows: &mut Rows) {}

    /// True when there are bounds on functions of the unknowns.
    fn has_bounds(&self) -> bool {
        false
    }

    /// By how much these bounds are violated at the point evaluated last; not above [`WITHIN`] inside.
    fn violation(&self) -> f64 {
        0.0
    }

    /// Share of its terms that the gradient of a Lagrangian is known to.
    fn precision(&self) -> f64 {
        STATIONARY
    }

    /// The energy, of order 1, and its gradient.
    fn energy(&self, z: &[f64], gradient: &mut [f64]) -> f64;

    /// Adds the energy's second derivatives to the lower triangle of a matrix.
    fn add_energy_hessian(&self, z: &[f64], hessian: &mut [f64]);
}

/// Why an iteration ended.
///
/// ```
/// use tdcr::solve::levenberg_marquardt::Ending;
///
/// let retry = |ending| matches!(ending, Ending::Stalled | Ending::IterationLimit);
/// assert!(retry(Ending::Stalled) && !retry(Ending::Met));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The residuals are within the tolerances.
    Met,
    /// At, or on the way to, a minimum that does not meet them.
    Stalled,
    /// Out of iterations.
    IterationLimit,
    /// A number was not finite, or a program had no solution.
    Failed,
}

/// Purpose of a descent.
///
/// ```
/// use tdcr::solve::levenberg_marquardt::Purpose;
///
/// let purpose = |last_start: bool| if last_start { Purpose::Nearest } else { Purpose::Meet };
/// assert_eq!(purpose(true), Purpose::Nearest);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// To meet the residuals, or to give up early so that another start gets its turn.
    Meet,
    /// To find a minimum to full precision, whether it meets them or not.
    Nearest,
}
