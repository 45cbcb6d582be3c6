//! Line search on M: as much of a step as lowers it, without passing through an obstacle.

use nalgebra::Vector3;

use super::{LARGEST_SHIFT, LEAST_SHIFT, Minimizer, Problem, SHIFT_FACTOR};
use crate::lie::so3;
use crate::obstacle::Fault;
use crate::solve::dense::dot;

/// No strain moves further in one step \[rad\].
const LONGEST_STEP: f64 = 0.5;
/// Halvings of a step, and the share of the predicted decrease that it must deliver.
const HALVINGS: usize = 30;
const ARMIJO: f64 = 1e-4;
/// Halvings where a step is one of another active set than that of the shape.
const PREDICTED_HALVINGS: usize = 3;
/// Rounding of M, relative to its magnitude: steps that promise less are not judged by it.
const ROUNDING: f64 = 1e-12;
/// Bisections of the path of a point, to see whether it leads through an obstacle.
const BISECTIONS: usize = 8;

impl Minimizer {
    /// Takes as much of the Newton step as lowers M; false when nothing does.
    pub(super) fn search_line(&mut self, problem: &Problem<'_>) -> Result<bool, Fault> {
        if self.riccati.step != self.own_step {
            // An active set so far ahead that the step has to be cut is not worth it.
            if self.backtrack(problem, PREDICTED_HALVINGS)? {
                return Ok(true);
            }
            self.riccati.step.clone_from(&self.own_step);
        }
        self.backtrack(problem, HALVINGS)
    }

    /// Takes as much of the step, halved so often, as lowers M. A whole step that is refused is corrected once.
    fn backtrack(&mut self, problem: &Problem<'_>, halvings: usize) -> Result<bool, Fault> {
        let slope = dot(&self.gradient, &self.riccati.step);
        let longest = largest_component(&self.riccati.step);
        if !slope.is_finite() || slope > 0.0 || !(longest > 0.0 && longest.is_finite()) {
            return Ok(false);
        }
        let whole = 1.0_f64.min(LONGEST_STEP / longest);
        let mut share = whole;
        for trial in 0..halvings {
            if self.is_decrease(problem, share, slope)? {
                return Ok(self.accept(share, whole));
            }
            if trial == 0 && share == 1.0 {
                if self.correct_step(problem) && self.is_decrease(problem, 1.0, slope)? {
                    return Ok(self.accept(share, whole));
                }
                self.riccati.step.clone_from(&self.whole_step);
            }
            share *= 0.5;
        }
        Ok(false)
    }

    /// Makes the trial shape the current one.
    fn accept(&mut self, share: f64, whole: f64) -> bool {
        self.adapt_shift(share, whole);
        std::mem::swap(&mut self.current, &mut self.trial);
        true
    }

    /// Changes the shift: a shorter step next time if this one was cut, a longer one if not.
    fn adapt_shift(&mut self, share: f64, whole: f64) {
        if share < 0.2 * whole {
            self.shift = LEAST_SHIFT.max(SHIFT_FACTOR * self.shift).min(LARGEST_SHIFT);
        } else if share == whole {
            self.shift = if self.shift > LEAST_SHIFT { self.shift / SHIFT_FACTOR } else { 0.0 };
        }
    }

    /// Evaluates the trial shape at a share of the step; true if M falls there by a share of what the slope promises
    /// (Armijo) and no point goes through an obstacle.
    fn is_decrease(
        &mut self,
        problem: &Problem<'_>,
        share: f64,
        slope: f64,
    ) -> Result<bool, Fault> {
        self.trial.strains.clear();
        let ends = self.current.strains.iter().zip(&self.riccati.step);
        self.trial.strains.extend(ends.map(|(own, step)| own + share * step));
        self.evaluate_trial(problem)?;
        let is_unresolved = -slope <= ROUNDING * self.current.magnitude;
        let rounding = if is_unresolved { ROUNDING } else { 1e-2 * ROUNDING };
        let most = self.current.value
            + ARMIJO * share * slope
            + rounding * self.current.magnitude
            + self.moment_work(problem);
        let falls = self.trial.value <= most && self.is_free_path(problem)?;
        self.unresolved_steps += usize::from(falls && is_unresolved);
        Ok(falls)
    }

    /// Second-order correction: solves for the step with gaps and lengths as they came out at the end of the whole
    /// one, which is kept; true if it is one to take.
    fn correct_step(&mut self, problem: &Problem<'_>) -> bool {
        self.whole_step.clone_from(&self.riccati.step);
        self.riccati.write_length_changes(problem.plan, &mut self.length_changes);
        // What the gaps of the constraints changed by beyond first order.
        let (current, trial) = (&mut self.current, &self.trial);
        let trial_forces: Vec<f64> =
            current.constraints.iter().map(|own| own.trial_force).collect();
        for own in &mut current.constraints {
            let Ok(there) = trial.constraints.binary_search_by(|other| other.key.cmp(&own.key))
            else {
                continue;
            };
            let gap_change = own.gap_change(&self.riccati.displacements);
            let beyond = trial.constraints[there].gap - own.gap - gap_change;
            own.trial_force -= beyond / own.compliance;
        }
        // The same of the lengths of the tendons that pull.
        let trial_tensions = current.trial_tensions.clone();
        let tendons = current.trial_tensions.iter_mut().enumerate();
        for (k, tension) in tendons.filter(|(k, _)| self.pulling[*k]) {
            let beyond = trial.excess[k] - current.excess[k] - self.length_changes[k];
            *tension += beyond / self.compliance[k];
        }
        // The step with these, and the shape as it was.
        self.solve_newton_system(problem);
        self.current.trial_tensions = trial_tensions;
        for (own, trial_force) in self.current.constraints.iter_mut().zip(trial_forces) {
            own.trial_force = trial_force;
        }
        self.riccati.unstable.is_none() && largest_component(&self.riccati.step) <= LONGEST_STEP
    }

    /// Work that a moment on the tip, which has no potential, does on the way to the trial shape.
    fn moment_work(&self, problem: &Problem<'_>) -> f64 {
        let moment = problem.scene.moment * problem.load_share;
        let (Some(from), Some(to)) = (self.current.frames.last(), self.trial.frames.last()) else {
            return 0.0;
        };
        if moment == Vector3::zeros() {
            return 0.0;
        }
        moment.dot(&so3::log(&(to.rotation * from.rotation.transpose())))
    }

    /// Freedom of all points' paths to the trial shape: none goes through an obstacle.
    pub(super) fn is_free_path(&self, problem: &Problem<'_>) -> Result<bool, Fault> {
        let paths = self.current.clearances.iter().zip(&self.trial.clearances);
        for (point, (from, to)) in problem.scene.points.iter().flatten().zip(paths) {
            let Problem { scene, allowed_slip, keeps_side, .. } = *problem;
            if !scene.is_free_path(point.radius, from, to, allowed_slip, keeps_side, BISECTIONS)? {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// Largest component of a step; infinite if one is not a number.
fn largest_component(step: &[f64]) -> f64 {
    step.iter().fold(0.0, |most, s| if s.is_nan() { f64::INFINITY } else { s.abs().max(most) })
}
