//! Goal of a rod as a least-squares problem in the tensions: residuals, bounds on displacements, the sum of squared
//! tensions.

use nalgebra::SVector;

use crate::rod::equilibrium::Equilibrium;
use crate::solve::levenberg_marquardt::Problem;
use crate::solve::quadratic_program::Rows;
use crate::status::Status;

use super::goal::Goal;
use super::multistart::{Multistart, SearchOutcome};
use super::outcome::Answer;
use super::pose_goal::PoseGoal;

/// Unknowns: tensions in such units that each is about the angle by which it bends the rod alone \[rad\].
#[derive(Debug)]
pub(super) struct TensionProblem<'a, G = PoseGoal<'a>> {
    pub(super) rod: Box<dyn Equilibrium + 'a>,
    pub(super) goal: G,
    /// Tension of a unit of every unknown.
    units: &'a [f64],
    /// Lowest and highest displacement of every tendon \[m\].
    ranges: &'a [(f64, f64)],
    /// Length of every tendon at rest, which violations are measured by \[m\].
    rest_lengths: &'a [f64],
    has_bounds: bool,
    /// Length by which slack tendons are let out, so that rounding does not lock those that depend on each other \[m\].
    pub(super) slack_allowance: f64,
    tensions: Vec<f64>,
    /// The point evaluated last is an equilibrium.
    in_equilibrium: bool,
    second: Vec<f64>,
}

/// Second derivatives that are nearly right lead to a gradient of this precision in few steps.
const PRECISION: f64 = 1e-6;
/// Slot of the equilibrium nearest to the goal, among those that are kept.
const NEAREST: usize = 2;
/// Largest unknown of a slack tendon \[rad\].
const SLACK: f64 = 1e-9;

impl<'a, G> TensionProblem<'a, G> {
    pub(super) fn new(
        rod: Box<dyn Equilibrium + 'a>,
        goal: G,
        rest_lengths: &'a [f64],
        units: &'a [f64],
        ranges: &'a [(f64, f64)],
    ) -> Self {
        let finite = |(lower, upper): &(f64, f64)| lower.is_finite() || upper.is_finite();
        Self {
            rod,
            goal,
            units,
            ranges,
            rest_lengths,
            has_bounds: ranges.iter().any(finite),
            slack_allowance: 0.0,
            tensions: Vec::new(),
            in_equilibrium: false,
            second: Vec::new(),
        }
    }

    /// Moves the rod to the equilibrium under the tensions of a point and updates the goal; false when there is none.
    fn move_to<const R: usize>(&mut self, z: &[f64]) -> bool
    where
        G: Goal<R>,
    {
        // Rounding leaves no tension below zero.
        let tension = |(z, unit): (&f64, &f64)| (z * unit).max(0.0);
        let wanted = z.iter().zip(self.units).map(tension);
        if !(self.in_equilibrium && wanted.clone().eq(self.tensions.iter().copied())) {
            self.tensions.clear();
            self.tensions.extend(wanted);
            self.in_equilibrium = self.rod.solve_at(&self.tensions);
            if self.in_equilibrium {
                self.rod.differentiate();
            }
        }
        if self.in_equilibrium {
            self.goal.update(self.rod.motion());
        }
        self.in_equilibrium
    }

    /// Displacements at the equilibrium \[m\]; rounding leaves none outside its bounds.
    pub(super) fn write_displacements(&self, place: &mut [f64]) {
        for (k, (displacement, (lower, upper))) in place.iter_mut().zip(self.ranges).enumerate() {
            // There are none where an obstacle's function failed before the first equilibrium.
            let own = self.rod.tensions().get(k);
            let slack = own.is_some_and(|tension| *tension <= SLACK * self.units[k]);
            let slack_allowance = if slack { self.slack_allowance } else { 0.0 };
            *displacement = (self.rod.displacement(k) + slack_allowance).max(*lower).min(*upper);
        }
    }

    /// True when the point evaluated last is an equilibrium.
    pub(super) fn in_equilibrium(&self) -> bool {
        self.in_equilibrium
    }

    /// Invalidates the point evaluated last: the rod is moved elsewhere.
    pub(super) fn forget(&mut self) {
        self.in_equilibrium = false;
    }

    /// Bounds on displacements that are active at the point evaluated last: a tendon, and true for its release.
    pub(super) fn active_bounds(&self, within: f64) -> Vec<(usize, bool)> {
        let mut out = Vec::new();
        for (k, (lower, upper)) in self.ranges.iter().enumerate() {
            let displacement = self.rod.displacement(k);
            if displacement - lower <= within {
                out.push((k, false));
            }
            if upper - displacement <= within {
                out.push((k, true));
            }
        }
        out
    }
}

impl<const R: usize, G: Goal<R>> Problem<R> for TensionProblem<'_, G> {
    fn evaluate(
        &mut self,
        z: &[f64],
        residual: &mut SVector<f64, R>,
        jacobian: &mut [SVector<f64, R>],
    ) {
        if !self.move_to::<R>(z) {
            // Without an equilibrium the step is refused.
            residual.fill(f64::NAN);
            return;
        }
        self.goal.write_residual(self.rod.motion(), residual, jacobian);
        jacobian.iter_mut().zip(self.units).for_each(|(column, unit)| *column *= *unit);
    }

    fn squared_norm(&mut self, z: &[f64]) -> f64 {
        // What is infinite is no value, to a swarm.
        if self.move_to::<R>(z) { self.goal.squared_norm() } else { f64::INFINITY }
    }

    fn is_met(&self, residual: &SVector<f64, R>) -> bool {
        self.goal.is_met(residual)
    }

    fn add_hessian(&mut self, z: &[f64], weights: &SVector<f64, R>, hessian: &mut [f64]) {
        let size = z.len();
        let Self { rod, goal, second, units, .. } = self;
        second.clear();
        second.resize(size * size, 0.0);
        goal.add_hessian(rod.motion_mut(), weights, second);
        for a in 0..size {
            for b in 0..=a {
                hessian[a * size + b] += units[a] * units[b] * second[a * size + b];
            }
        }
    }

    fn restart(&mut self) {
        self.rod.reset();
        self.forget();
    }

    fn save_state(&mut self) {
        self.rod.save(NEAREST);
    }

    fn restore_state(&mut self) {
        self.rod.restore(NEAREST);
        self.forget();
    }

    fn has_bounds(&self) -> bool {
        self.has_bounds
    }

    fn linearize(&self, rows: &mut Rows) {
        if !self.in_equilibrium {
            return;
        }
        let size = self.units.len();
        for (k, (lower, upper)) in self.ranges.iter().enumerate() {
            let displacement = self.rod.displacement(k);
            for (sign, room) in [(1.0, upper - displacement), (-1.0, displacement - lower)] {
                if !room.is_finite() {
                    continue;
                }
                let slope = |j| sign * self.rod.displacement_slope(k, j) * self.units[j];
                let norm = (0..size).map(|j| slope(j) * slope(j)).sum::<f64>().sqrt();
                if norm > 0.0 {
                    let row = rows.push(size, room / norm);
                    row.iter_mut().enumerate().for_each(|(j, entry)| *entry = slope(j) / norm);
                }
            }
        }
    }

    fn violation(&self) -> f64 {
        if !(self.has_bounds && self.in_equilibrium) {
            return 0.0;
        }
        let rows = self.ranges.iter().zip(self.rest_lengths).enumerate();
        rows.fold(0.0, |most, (k, ((lower, upper), length))| {
            let displacement = self.rod.displacement(k);
            most.max((displacement - upper).max(lower - displacement) / length)
        })
    }

    fn precision(&self) -> f64 {
        PRECISION
    }

    fn energy(&self, z: &[f64], gradient: &mut [f64]) -> f64 {
        let scale = self.scale();
        let mut energy = 0.0;
        for (k, (z, unit)) in z.iter().zip(self.units).enumerate() {
            let weight = unit * unit / scale;
            energy += 0.5 * weight * z * z;
            gradient[k] = weight * z;
        }
        energy
    }

    fn add_energy_hessian(&self, z: &[f64], hessian: &mut [f64]) {
        let scale = self.scale();
        for (k, unit) in self.units.iter().enumerate() {
            hessian[k * (z.len() + 1)] += unit * unit / scale;
        }
    }
}

impl<G> TensionProblem<'_, G> {
    /// Mean square of the units: the energy is then of order 1.
    fn scale(&self) -> f64 {
        self.units.iter().map(|unit| unit * unit).sum::<f64>() / self.units.len().max(1) as f64
    }
}

/// Outcome of a search whose point is evaluated once more; `errors` measures distance \[m\] and angle \[rad\] there.
pub(super) fn evaluate_answer<const R: usize, G: Goal<R>>(
    mut found: SearchOutcome,
    problem: &mut TensionProblem<'_, G>,
    search: &mut Multistart<'_, R>,
    errors: impl FnOnce(&G) -> (f64, f64),
) -> Answer {
    let failed = found.status == Status::NumericalError && !search.is_stopped();
    if failed && Problem::<R>::violation(problem) > 0.0 {
        // No start could be brought inside.
        found.status = Status::Infeasible;
    }
    search.solver.evaluate(problem, &search.point);
    if failed && !problem.in_equilibrium() {
        return Answer::without_shape(found);
    }
    Answer::of(found, errors(&problem.goal))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // A test may stop where it fails.
mod tests;
