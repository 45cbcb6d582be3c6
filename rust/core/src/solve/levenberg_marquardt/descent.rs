//! Levenberg-Marquardt descents inside a region.

use nalgebra::SVector;

use super::problem::{Ending, Problem, Purpose, WITHIN};
use crate::solve::convex_region::{Region, RestoreScratch};
use crate::solve::dense::dot;
use crate::solve::quadratic_program::{Outcome, QuadraticProgram, Rows};

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
/// Steps to get back inside the bounds on functions of the unknowns.
const RETURNS: usize = 8;
/// Weight of rows along which no step is wanted, over the size of the Hessian: enough for strong multipliers,
/// whose curvature across the rows would otherwise have to be damped away.
const STIFF: f64 = 100.0;
/// A row adds nothing to others when this share of its square is outside them.
const DEPENDENT: f64 = 1e-12;
/// Residuals of order 1 are known to this.
const ROUNDING: f64 = 1e-15;

/// Buffers of a descent of the energy.
#[derive(Clone, Debug, Default)]
pub(super) struct LeastEnergy {
    pub(super) energy: f64,
    pub(super) gradient: Vec<f64>,
    pub(super) next: Vec<f64>,
    pub(super) next_gradient: Vec<f64>,
    pub(super) program: QuadraticProgram,
    pub(super) rows: Rows,
}

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
    pub(super) least_energy: LeastEnergy,
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
