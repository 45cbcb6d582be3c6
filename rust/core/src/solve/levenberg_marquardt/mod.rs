//! Nonlinear least squares over a convex region, by Levenberg-Marquardt and Newton steps.
//!
//! `min |r(z)|^2 / 2` for `z` in a [`Region`]. A step is the minimum of the damped quadratic model under
//! the region's linearised constraints, brought back into the region where discs are round; every point
//! is inside. Damping in proportion to the squared residual keeps the quadratic convergence of
//! Gauss-Newton at points that meet the target (N. Yamashita, M. Fukushima, Computing Suppl. 15 (2001),
//! doi:10.1007/978-3-7091-6217-0_18). The nearest point to a target out of reach is polished with
//! second derivatives, without which steps would shrink only linearly there.

mod least_energy;

use nalgebra::SVector;

use crate::solve::convex_region::{Region, RestoreScratch};
use crate::solve::dense::dot;
use crate::solve::quadratic_program::{Outcome, QuadraticProgram, Rows};
use least_energy::LeastEnergy;

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

/// No step moves an unknown further.
const STEP: f64 = 1.0;
/// Share of the squared residual that damps the first step.
const DAMPING: f64 = 0.1;
/// Damping at least, as a share of the trace: rounding in a singular matrix is below it.
const FLOOR: f64 = 1e-13;
/// Damping beyond which steps vanish.
const STUCK: f64 = 1e12;
/// A step that lowers the squared residual by less than this share makes no headway...
const HEADWAY: f64 = 1e-3;
/// ...and this many of them are a stall.
const PATIENCE: usize = 5;
/// Violations of bounds on functions of the unknowns that count as none, and steps to get there.
pub const WITHIN: f64 = 1e-12;
const RETURNS: usize = 8;
/// Weight of rows along which no step is wanted, over the size of the Hessian: enough for strong multipliers,
/// whose curvature across the rows would otherwise have to be damped away.
const STIFF: f64 = 100.0;
/// A row adds nothing to others when this share of its square is outside them.
const DEPENDENT: f64 = 1e-12;
/// A minimum is found when the gradient of the Lagrangian is this share of what it can be.
const STATIONARY: f64 = 1e-11;
/// Residuals of order 1 are known to this.
const ROUNDING: f64 = 1e-15;

/// Buffers, reused from one descent to the next.
///
/// ```
/// use tdcr::solve::convex_region::Region;
/// use tdcr::solve::levenberg_marquardt::Scratch;
///
/// let mut region = Region::new(2);
/// region.add_bound(&[1.0, 0.0], 1.0);
/// let (mut scratch, mut start) = (Scratch::<6>::default(), [3.0, 0.0]);
/// assert!(scratch.restore(&region, &mut start));
/// assert!(region.contains(&start));
/// ```
#[derive(Clone, Debug)]
pub struct Scratch<const R: usize> {
    /// Steps taken so far, for the caller to reset.
    pub iterations: usize,
    /// Residuals at the last point.
    pub residual: SVector<f64, R>,
    pub(super) jacobian: Vec<SVector<f64, R>>,
    pub(super) program: QuadraticProgram,
    pub(super) rows: Rows,
    pub(super) hessian: Vec<f64>,
    pub(super) trial: Vec<f64>,
    trial_residual: SVector<f64, R>,
    trial_jacobian: Vec<SVector<f64, R>>,
    /// Buffers of the programs that bring points back: the active rows of the last model are still needed.
    pub(super) restoring: RestoreScratch,
    least_energy: LeastEnergy,
    /// Orthonormal basis of the rows across which steps are to stay.
    basis: Vec<f64>,
}

impl<const R: usize> Default for Scratch<R> {
    fn default() -> Self {
        Self {
            iterations: 0,
            residual: SVector::zeros(),
            jacobian: Vec::new(),
            program: QuadraticProgram::default(),
            rows: Rows::default(),
            hessian: Vec::new(),
            trial: Vec::new(),
            trial_residual: SVector::zeros(),
            trial_jacobian: Vec::new(),
            restoring: RestoreScratch::default(),
            least_energy: LeastEnergy::default(),
            basis: Vec::new(),
        }
    }
}

impl<const R: usize> Scratch<R> {
    /// Brings a point into the region; false when the region is empty as far as this can tell.
    pub fn restore(&mut self, region: &Region, z: &mut [f64]) -> bool {
        region.restore(z, &mut self.restoring)
    }

    /// Evaluates the problem at a point.
    pub fn evaluate<P: Problem<R>>(&mut self, problem: &mut P, z: &[f64]) {
        self.jacobian.resize(z.len(), SVector::zeros());
        problem.evaluate(z, &mut self.residual, &mut self.jacobian);
    }

    /// Descends from `z`, a point of the region.
    pub fn descend<P: Problem<R>>(
        &mut self,
        problem: &mut P,
        region: &Region,
        z: &mut Vec<f64>,
        purpose: Purpose,
        max_iterations: usize,
    ) -> Ending {
        // r and J at the start, brought inside the problem's own bounds.
        self.trial_jacobian.resize(region.size(), SVector::zeros());
        self.evaluate(problem, z);
        if problem.violation() > WITHIN {
            let (mut residual, mut jacobian) = (self.residual, std::mem::take(&mut self.jacobian));
            let inside = self.return_inside(problem, region, z, &mut residual, &mut jacobian);
            (self.residual, self.jacobian) = (residual, jacobian);
            if !inside {
                return Ending::Failed;
            }
        }
        let mut squared = self.residual.norm_squared();
        let (mut damping, mut idle) = (DAMPING, 0);
        self.program.active.clear();
        for _ in 0..max_iterations {
            if problem.is_met(&self.residual) {
                return Ending::Met;
            }
            if !squared.is_finite() {
                return Ending::Failed;
            }
            // Step p of the damped model, ½|r + J p|² + ½ μ|p|² under the region's rows.
            self.iterations += 1;
            if !self.solve_model(problem, region, z, purpose, &mut damping) {
                return Ending::Failed;
            }
            if purpose == Purpose::Nearest && self.stationary(squared, problem.precision()) {
                return Ending::Stalled;
            }
            // A step that lowers |r|² is taken and lowers μ; another one raises μ.
            let lower = self.try_step(problem, region, z, squared);
            if let Some(lower) = lower {
                idle = if lower > (1.0 - HEADWAY) * squared { idle + 1 } else { 0 };
                squared = lower;
                damping *= 0.2;
            } else {
                damping = (8.0 * damping).max(1e-9);
                if purpose == Purpose::Nearest || problem.has_bounds() {
                    // Second derivatives and bounds are those of the point evaluated last.
                    self.evaluate(problem, z);
                }
            }
            // Without headway the next start gets its turn.
            let stuck = damping > STUCK || (purpose == Purpose::Meet && idle > PATIENCE);
            if stuck {
                return Ending::Stalled;
            }
        }
        if problem.is_met(&self.residual) { Ending::Met } else { Ending::IterationLimit }
    }

    /// Minimises the damped model under the linearised constraints; raises the damping until the model is
    /// convex.
    fn solve_model<P: Problem<R>>(
        &mut self,
        problem: &mut P,
        region: &Region,
        z: &[f64],
        purpose: Purpose,
        damping: &mut f64,
    ) -> bool {
        // JᵀJ and Jᵀr; the nearest point needs the second derivatives of r and of the discs too.
        let size = region.size();
        self.gauss_newton(size);
        let trace: f64 = (0..size).map(|i| self.hessian[i * (size + 1)]).sum();
        if purpose == Purpose::Nearest {
            problem.add_hessian(z, &self.residual, &mut self.hessian);
            region.add_curvature(z, &self.program, 0, &mut self.hessian);
            self.rows.clear();
            region.linearize(z, &mut self.rows);
            problem.linearize(&mut self.rows);
            self.penalize_rows(size, 0);
        }
        // Damping μ in proportion to |r|², raised until the matrix is positive definite.
        let squared = self.residual.norm_squared();
        let mut added = 0.0;
        loop {
            let shift = *damping * squared + FLOOR * trace;
            for i in 0..size {
                self.hessian[i * (size + 1)] += shift - added;
            }
            added = shift;
            if self.program.factor(&self.hessian, size) {
                break;
            }
            *damping = (8.0 * *damping).max(1e-9);
            if *damping > STUCK {
                return false;
            }
        }
        // The free minimum, where the region and the bounds allow it.
        self.program.solve_free();
        self.trial.clear();
        self.trial.extend(z.iter().zip(&self.program.step).map(|(z, p)| z + p));
        // A point inside satisfies every tangent too.
        let inside = region.contains(&self.trial);
        if inside && !problem.has_bounds() {
            return true;
        }
        // Else the minimum under the linearised constraints.
        self.rows.clear();
        region.linearize(z, &mut self.rows);
        problem.linearize(&mut self.rows);
        if inside && self.rows.allow(size, &self.program.step) {
            return true;
        }
        self.program.solve(&self.rows) == Outcome::Solved
    }

    /// The lower triangle of `J^T J`, and the gradient.
    fn gauss_newton(&mut self, size: usize) {
        self.hessian.clear();
        self.hessian.resize(size * size, 0.0);
        self.program.gradient.clear();
        for i in 0..size {
            for j in 0..=i {
                self.hessian[i * size + j] = self.jacobian[i].dot(&self.jacobian[j]);
            }
            self.program.gradient.push(self.jacobian[i].dot(&self.residual));
        }
    }

    /// Adds the square of the projection onto the first `fixed` rows and those that were active last: no
    /// step along them is wanted, so that only curvature across them has to be positive.
    pub(super) fn penalize_rows(&mut self, size: usize, fixed: usize) {
        self.basis.clear();
        let active = self.program.active.iter().copied().filter(|row| *row >= fixed);
        for row in (0..fixed).chain(active) {
            let start = self.basis.len();
            self.basis.extend_from_slice(self.rows.normal(size, row));
            let (others, mine) = self.basis.split_at_mut(start);
            let whole = dot(mine, mine);
            for other in others.chunks_exact(size) {
                let along = dot(other, mine);
                mine.iter_mut().zip(other).for_each(|(m, o)| *m -= along * o);
            }
            let left = dot(mine, mine);
            if left > DEPENDENT * whole {
                let norm = left.sqrt();
                for entry in mine {
                    *entry /= norm;
                }
            } else {
                self.basis.truncate(start);
            }
        }
        if self.basis.is_empty() {
            return;
        }
        let weight = STIFF * dot(&self.hessian, &self.hessian).sqrt();
        for normal in self.basis.chunks_exact(size) {
            for i in 0..size {
                for j in 0..=i {
                    self.hessian[i * size + j] += weight * normal[i] * normal[j];
                }
            }
        }
    }

    /// True when the gradient of the Lagrangian vanishes.
    fn stationary(&self, squared: f64, precision: f64) -> bool {
        let steepest = self.jacobian.iter().fold(0.0_f64, |most, column| most.max(column.norm()));
        let left = self.program.lagrangian_gradient(&self.rows);
        left <= steepest * (precision * squared.sqrt()).max(ROUNDING)
    }

    /// Takes the model's step if it lowers the squared residual, which is returned.
    fn try_step<P: Problem<R>>(
        &mut self,
        problem: &mut P,
        region: &Region,
        z: &mut Vec<f64>,
        squared: f64,
    ) -> Option<f64> {
        let longest = self.program.step.iter().fold(0.0_f64, |most, p| most.max(p.abs()));
        let share = if longest > STEP { STEP / longest } else { 1.0 };
        self.trial.clear();
        self.trial.extend(z.iter().zip(&self.program.step).map(|(z, p)| z + share * p));
        if !region.contains(&self.trial) && !region.restore(&mut self.trial, &mut self.restoring) {
            return None;
        }
        problem.evaluate(&self.trial, &mut self.trial_residual, &mut self.trial_jacobian);
        if problem.violation() > WITHIN {
            let (mut trial, mut residual) = (std::mem::take(&mut self.trial), self.trial_residual);
            let mut jacobian = std::mem::take(&mut self.trial_jacobian);
            let inside =
                self.return_inside(problem, region, &mut trial, &mut residual, &mut jacobian);
            (self.trial, self.trial_residual, self.trial_jacobian) = (trial, residual, jacobian);
            if !inside {
                return None;
            }
        }
        let lower = self.trial_residual.norm_squared();
        if lower < squared {
            std::mem::swap(z, &mut self.trial);
            std::mem::swap(&mut self.residual, &mut self.trial_residual);
            std::mem::swap(&mut self.jacobian, &mut self.trial_jacobian);
            return Some(lower);
        }
        None
    }

    /// Brings a point back inside the problem's own bounds by steps of least length; it is then the one evaluated
    /// last.
    fn return_inside<P: Problem<R>>(
        &mut self,
        problem: &mut P,
        region: &Region,
        z: &mut [f64],
        residual: &mut SVector<f64, R>,
        jacobian: &mut [SVector<f64, R>],
    ) -> bool {
        for _ in 0..RETURNS {
            if !region.restoring_step(z, &mut self.restoring, |rows| problem.linearize(rows)) {
                return false;
            }
            problem.evaluate(z, residual, jacobian);
            if problem.violation() <= WITHIN {
                return true;
            }
        }
        false
    }
}
