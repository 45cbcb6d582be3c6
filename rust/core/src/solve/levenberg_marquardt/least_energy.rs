//! The least energy among the points that meet a target, inside a convex region.
//!
//! `min E(z)` subject to `r(z) = 0`, `z` in a [`Region`], from a point that meets it: every step is the
//! minimum of the quadratic model of the Lagrangian under the linearised target and region (sequential
//! quadratic programming, Nocedal & Wright, *Numerical Optimization*, 2nd ed., section 18.1), and is then
//! brought back onto the target, so that every point meets it and the energy alone measures progress.

use super::descent::{LeastEnergy, Scratch};
use super::problem::{Ending, Problem, Purpose};
use crate::solve::convex_region::Region;
use crate::solve::dense::dot;
use crate::solve::quadratic_program::Outcome;
use nalgebra::SVector;

/// No step moves an unknown further.
const STEP: f64 = 0.5;
/// Steps to bring a point back onto the target.
const CORRECTIONS: usize = 8;
/// Shrinks of one line search, and by how much each.
const BACKTRACKS: usize = 6;
const BACKTRACK: f64 = 0.3;
/// Share of the predicted decrease that a step must deliver.
const ARMIJO: f64 = 1e-4;
/// Damping of an indefinite model at first, and damping beyond which no step is left.
const DAMPING: (f64, f64) = (1e-3, 1e10);
/// Damping at least: the energy may not depend on some unknowns at all.
const FLOOR: f64 = 1e-6;
/// A minimum is found when the gradient of the Lagrangian is below this.
const STATIONARY: f64 = 1e-9;
/// Energies of order 1 are known to this.
const ROUNDING: f64 = 1e-14;

impl<const R: usize> Scratch<R> {
    /// Lowers the energy from `z`, which meets the target: [`Ending::Met`] at a minimum. `z` meets the
    /// target at any ending.
    pub fn minimize_energy<P: Problem<R>>(
        &mut self,
        problem: &mut P,
        region: &Region,
        z: &mut Vec<f64>,
        max_iterations: usize,
    ) -> Ending {
        let mut scratch = std::mem::take(&mut self.least_energy);
        let ending = self.descend_energy(problem, region, z, max_iterations, &mut scratch);
        self.least_energy = scratch;
        ending
    }

    fn descend_energy<P: Problem<R>>(
        &mut self,
        problem: &mut P,
        region: &Region,
        z: &mut Vec<f64>,
        max_iterations: usize,
        scratch: &mut LeastEnergy,
    ) -> Ending {
        // E and its gradient g at a point with r = 0; λ = 0 to begin with.
        scratch.gradient.resize(region.size(), 0.0);
        scratch.next_gradient.resize(region.size(), 0.0);
        scratch.energy = problem.energy(z, &mut scratch.gradient);
        let mut multipliers = SVector::<f64, R>::zeros();
        let mut damping = 0.0;
        self.program.active.clear();
        problem.evaluate(z, &mut self.residual, &mut self.jacobian);
        for _ in 0..max_iterations {
            // Quadratic model of the Lagrangian E + λ·r under the linearised target and region.
            self.iterations += 1;
            match self.solve_energy_model(
                problem,
                region,
                z,
                &scratch.gradient,
                &multipliers,
                &mut damping,
            ) {
                Outcome::Solved => {}
                // Bounds and target agree at this point alone: there is no freedom to spend.
                Outcome::Infeasible if problem.is_met(&self.residual) => return Ending::Met,
                Outcome::Infeasible | Outcome::Failed => return Ending::Failed,
            }
            // λ of the target: the multipliers of the first R rows.
            multipliers.fill(0.0);
            for (&row, multiplier) in self.program.active.iter().zip(&self.program.multipliers) {
                if row < R {
                    multipliers[row] = *multiplier;
                }
            }
            // A minimum has no gradient of the Lagrangian left. Strong multipliers carry the rounding of what they
            // multiply.
            let strongest =
                self.program.multipliers.iter().fold(1.0_f64, |most, m| most.max(m.abs()));
            let known = STATIONARY.max(problem.precision());
            if self.program.lagrangian_gradient(&self.rows) <= known * strongest {
                return Ending::Met;
            }
            // A shorter step along the target, or more damping where none lowers E.
            if self.line_search(problem, region, z, &multipliers, ROUNDING * strongest, scratch) {
                damping = if damping < DAMPING.0 { 0.0 } else { 0.6 * damping };
            } else {
                problem.evaluate(z, &mut self.residual, &mut self.jacobian);
                damping = (8.0 * damping).max(DAMPING.0);
                if damping > DAMPING.1 {
                    break;
                }
            }
        }
        Ending::IterationLimit
    }

    /// Takes a share of the model's step that lowers the energy, if there is one; the new point has then
    /// been evaluated.
    fn line_search<P: Problem<R>>(
        &mut self,
        problem: &mut P,
        region: &Region,
        z: &mut Vec<f64>,
        multipliers: &SVector<f64, R>,
        rounding: f64,
        scratch: &mut LeastEnergy,
    ) -> bool {
        let LeastEnergy { energy, gradient, next, next_gradient, program, rows } = scratch;
        // The active rows are still needed for the next model: the way back has its own program.
        std::mem::swap(&mut self.program, program);
        std::mem::swap(&mut self.rows, rows);
        let step = &program.step;
        let longest = step.iter().fold(0.0_f64, |most, p| most.max(p.abs()));
        let mut share = if longest > STEP { STEP / longest } else { 1.0 };
        // Residuals within the tolerance are worth this much energy.
        let lagrangian = *energy + multipliers.dot(&self.residual);
        let mut lower = None;
        for _ in 0..BACKTRACKS {
            // A share of the step, brought back into the region and onto the target.
            next.clear();
            next.extend(z.iter().zip(step).map(|(z, p)| z + share * p));
            let wanted = ARMIJO * share * dot(gradient, step).abs();
            if region.restore(next, &mut self.restoring)
                && self.descend(problem, region, next, Purpose::Meet, CORRECTIONS) == Ending::Met
            {
                // Armijo's condition on E + λ·r.
                let reached = problem.energy(next, next_gradient);
                if reached + multipliers.dot(&self.residual) <= lagrangian - wanted + rounding {
                    lower = Some(reached);
                    break;
                }
            }
            share *= BACKTRACK;
        }
        std::mem::swap(&mut self.program, program);
        std::mem::swap(&mut self.rows, rows);
        let Some(reached) = lower else { return false };
        std::mem::swap(z, next);
        std::mem::swap(gradient, next_gradient);
        *energy = reached;
        true
    }

    /// Minimises the model of the Lagrangian under the linearised target (the first `R` rows) and region;
    /// raises the damping until the model is convex where the target leaves freedom.
    fn solve_energy_model<P: Problem<R>>(
        &mut self,
        problem: &mut P,
        region: &Region,
        z: &[f64],
        gradient: &[f64],
        multipliers: &SVector<f64, R>,
        damping: &mut f64,
    ) -> Outcome {
        // Hessian of the Lagrangian: of E, of λ·r, of the active discs.
        let size = region.size();
        self.hessian.clear();
        self.hessian.resize(size * size, 0.0);
        problem.add_energy_hessian(z, &mut self.hessian);
        problem.add_hessian(z, multipliers, &mut self.hessian);
        region.add_curvature(z, &self.program, R, &mut self.hessian);
        // Rows: J p = −r of the target, then those of the region and of the problem's bounds.
        self.rows.clear();
        for row in 0..R {
            let normal = self.rows.push(size, -self.residual[row]);
            normal.iter_mut().zip(&self.jacobian).for_each(|(n, column)| *n = column[row]);
        }
        self.rows.equalities = R;
        region.linearize(z, &mut self.rows);
        problem.linearize(&mut self.rows);
        self.penalize_rows(size, R);
        // Damping until the model is positive definite across these rows.
        let mut added = 0.0;
        loop {
            let shift = damping.max(FLOOR);
            for i in 0..size {
                self.hessian[i * (size + 1)] += shift - added;
            }
            added = shift;
            if self.program.factor(&self.hessian, size) {
                break;
            }
            // Little more than it takes: steps along negative curvature should be long.
            *damping = (2.0 * *damping).max(DAMPING.0);
            if *damping > DAMPING.1 {
                return Outcome::Failed;
            }
        }
        self.program.gradient.clear();
        self.program.gradient.extend_from_slice(gradient);
        self.program.solve(&self.rows)
    }
}
