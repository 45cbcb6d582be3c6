//! Load stepping: equilibria under given tensions, along tensions that grow from rest.
//!
//! Given the tensions T, only `g(x, T) = 0` is left, and every subsegment is a problem of its own. Newton's method
//! finds the minimum near a point. Where it finds none, all tensions grow together in shorter steps, so that rest
//! leads to the minimum without jumps.

use super::dual_newton::{Ending, LOOSE_BALANCE};
use super::newton_system::{JUMP, NewtonSystem, Residual};
use super::plan::Plan;

/// Limits of a solve under given tensions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Newton steps per load step.
    pub(super) newton_steps: usize,
    /// Residual that counts as solved.
    pub(super) tolerance: f64,
    /// Shortest load step, as a share of the tensions.
    pub(super) shortest_load_step: f64,
}

/// Newton's method under the tensions of a system without bounds, from its strains: whether it ended at a minimum
/// without a jump, and the residual there. Evaluations are subtracted from the budget.
pub(super) fn solve_near(
    plan: &Plan,
    system: &mut NewtonSystem,
    limits: &Limits,
    budget: &mut usize,
) -> (bool, Residual) {
    let (mut moved, mut residual) = (0.0, Residual::default());
    system.tension_step.clear();
    system.tension_step.resize(system.tensions.len(), 0.0);
    for _ in 0..limits.newton_steps {
        residual = system.assemble(plan, LOOSE_BALANCE);
        *budget = budget.saturating_sub(residual.evaluations);
        moved += residual.moved;
        if residual.worst() <= limits.tolerance && moved <= JUMP {
            return (residual.stable, residual);
        }
        let lost = moved > JUMP || !residual.worst().is_finite();
        if *budget == 0 || lost || !system.solve_strain_step(plan) {
            break;
        }
        for (strain, step) in system.strains.iter_mut().zip(&system.strain_step) {
            *strain += step;
        }
    }
    (false, residual)
}

/// Buffers of load stepping.
#[derive(Clone, Debug, Default)]
pub(super) struct LoadStepping {
    /// Target tensions, and the plan's unit of tension in the unit that these are in.
    target: Vec<f64>,
    unit: f64,
    /// Strains at the last load that was reached.
    reached: Vec<f64>,
}

impl LoadStepping {
    /// Solves from the strains of a system without tensions to target tensions of a unit. Where no shorter load step
    /// helps, the system is left at the last load that was reached.
    pub(super) fn solve(
        &mut self,
        plan: &Plan,
        system: &mut NewtonSystem,
        target: impl Iterator<Item = f64>,
        unit: f64,
        limits: &Limits,
        budget: &mut usize,
    ) -> (Ending, Residual) {
        self.target.clear();
        self.target.extend(target);
        self.unit = unit;
        self.reached.clone_from(&system.strains);
        let (mut load, mut step) = (0.0, 1.0_f64);
        loop {
            let next = (load + step).min(1.0);
            self.set_load(system, next);
            let (found, residual) = solve_near(plan, system, limits, budget);
            if found {
                if next == 1.0 {
                    return (Ending::Converged, residual);
                }
                (load, step) = (next, 2.0 * step);
                self.reached.clone_from(&system.strains);
                continue;
            }
            system.strains.clone_from(&self.reached);
            step = 0.5 * (next - load);
            if *budget == 0 || step < limits.shortest_load_step {
                self.set_load(system, load);
                let ending = if *budget == 0 { Ending::Spent } else { Ending::Lost };
                return (ending, system.assemble(plan, LOOSE_BALANCE));
            }
        }
    }

    fn set_load(&self, system: &mut NewtonSystem, load: f64) {
        for (tension, target) in system.tensions.iter_mut().zip(&self.target) {
            *tension = load * target / self.unit;
        }
    }
}
