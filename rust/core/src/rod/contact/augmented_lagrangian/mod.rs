//! Augmented-Lagrangian minimisation: Newton's method on M from a shape to the nearest minimum among the obstacles,
//! with updates of the multipliers.

mod line_search;
mod linear_response;
mod saddle;

use std::sync::atomic::{AtomicBool, Ordering};

use super::lagrangian::{Estimates, Lagrangian, MultiplierEstimate, TendonInput};
use super::potential::Potential;
use super::riccati::{Linearization, Riccati};
use super::scene::Scene;
use crate::obstacle::Fault;
use crate::rod::dual_newton::Ending;
use crate::rod::plan::Plan;

/// Steps below the rounding of M that may pass without the moment halving.
const MOST_UNRESOLVED: usize = 4;
/// Factor of the compliances c at every update of the multipliers, until they are so many times as stiff as at first.
const STIFFENING: f64 = 0.1;
const STIFFEST: f64 = 1e4;
/// Updates at the stiffest that may pass without the violation halving.
const MOST_STUCK: usize = 4;
/// Residuals are not asked to be smaller: what stiff conditions make of rounding.
const LEAST_TOLERANCE: f64 = 5e-11;
/// Multipliers are updated when the shape is this near equilibrium \[rad of the whole rod\], and the more often the
/// nearer they are.
const UPDATE_MOMENT: f64 = 1.0;
/// Active sets that are tried for one step.
const MOST_SETS: usize = 8;
/// Shift of the Hessian where steps turn out too long, in shares of the stiffness: the least, the largest, and the
/// factor of its changes.
const LEAST_SHIFT: f64 = 1e-5;
const LARGEST_SHIFT: f64 = 1e2;
const SHIFT_FACTOR: f64 = 8.0;
/// Saddles that are left at most.
const MOST_SADDLES: usize = 6;
/// Steps in a row on which a shape may be unstable before it is taken for a saddle, if its gradient does not lead out.
const MOST_UNSTABLE: usize = 3;

/// Problem of one load step: M is minimised for it.
pub(super) struct Problem<'a> {
    pub(super) plan: &'a Plan,
    pub(super) scene: &'a Scene,
    pub(super) load_share: f64,
    pub(super) tendons: TendonInput<'a>,
    /// Distance up to which parts of obstacles count \[m\].
    pub(super) detection: f64,
    /// Depth in an obstacle that a point may pass through in one step \[m\].
    pub(super) allowed_slip: f64,
    /// Ban on an obstacle's other side, for all points: not where the robot rests in one.
    pub(super) keeps_side: bool,
    pub(super) stop: Option<&'a AtomicBool>,
}

/// Residuals of a shape.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Residuals {
    /// Unbalanced moment, relative to the stiffness.
    pub(super) moment: f64,
    /// Violations of lengths, of gaps and of their complementarity, relative to lengths.
    pub(super) length: f64,
    /// Saddles left on the way.
    pub(super) saddles_left: usize,
    /// True if multipliers grew without an end.
    pub(super) locked: bool,
}

impl Residuals {
    pub(super) fn largest(&self) -> f64 {
        self.moment.max(self.length)
    }
}

/// Buffers of a minimisation.
#[derive(Clone, Debug, Default)]
pub(in crate::rod) struct Minimizer {
    pub(in crate::rod) current: Lagrangian,
    /// At the end of the step that is tried.
    trial: Lagrangian,
    pub(super) estimates: Estimates,
    riccati: Riccati,
    potentials: Vec<Potential>,
    /// Tendons with a bound (or a tension), those of them that a bound makes pull, and constraints that push, at the
    /// end of the step.
    bounded: Vec<bool>,
    pulling: Vec<bool>,
    active: Vec<bool>,
    tensions: Vec<f64>,
    /// c + C of every tendon.
    compliance: Vec<f64>,
    length_changes: Vec<f64>,
    /// Gradient of M here, whatever the active set, and the step with the active set of this shape.
    gradient: Vec<f64>,
    own_step: Vec<f64>,
    /// The whole step, while a corrected one is tried.
    whole_step: Vec<f64>,
    moment: f64,
    /// First block from the tip whose Q is not positive definite.
    unstable: Option<usize>,
    /// Direction out of an unstable shape, its largest component 1.
    escape: Vec<f64>,
    /// Shift of the Hessian, which makes steps shorter that turned out too long, and whether stability was tested with
    /// it.
    shift: f64,
    is_shifted: bool,
    /// Steps in a row at unstable shapes.
    unstable_steps: usize,
    /// Updates at the stiffest in a row that did not halve the violation, and what it was.
    stuck_updates: usize,
    violation: f64,
    /// Steps too small for M to resolve since the moment halved last, and what it was then.
    unresolved_steps: usize,
    reference_moment: f64,
}

impl Minimizer {
    /// Goes from the strains of the current shape and the estimates to a minimum under the conditions, in at most
    /// `budget` evaluations of derivatives, which are counted down.
    ///
    /// Newton steps lead towards the minimum of M; near it the multipliers become the estimates and c falls. A shape
    /// that meets all conditions is an answer if every Q is positive definite without a shift; otherwise it is a
    /// saddle, and is left.
    pub(super) fn minimize(
        &mut self,
        problem: &Problem<'_>,
        budget: &mut usize,
    ) -> Result<(Ending, Residuals), Fault> {
        let tolerance = problem.plan.settings.tolerance.max(LEAST_TOLERANCE);
        let mut residuals = Residuals::default();
        let first_limit = UPDATE_MOMENT / problem.plan.data.len() as f64;
        let mut update_limit = first_limit;
        self.shift = 0.0;
        self.unstable_steps = 0;
        (self.unresolved_steps, self.reference_moment) = (0, f64::INFINITY);
        (self.stuck_updates, self.violation) = (0, f64::INFINITY);
        self.evaluate_current(problem)?;
        loop {
            // Gradient, factors and residuals at the current shape.
            self.linearize(problem);
            *budget = budget.saturating_sub(1);
            residuals = self.residuals(problem, residuals.saddles_left);
            if !residuals.largest().is_finite() {
                return Ok((Ending::Broken, residuals));
            }
            // All conditions met: an answer, once stability is tested without a shift.
            if residuals.largest() <= tolerance && self.is_shifted {
                self.shift = 0.0;
                continue;
            }
            if residuals.largest() <= tolerance && self.unstable.is_none() {
                return Ok((Ending::Converged, residuals));
            }
            // A saddle: soft conditions may leave unstable what is a minimum under stiff ones, so stiffen first.
            self.unstable_steps = if self.unstable.is_some() { self.unstable_steps + 1 } else { 0 };
            let stays = self.unstable_steps >= MOST_UNSTABLE && self.is_symmetric(problem.plan);
            if residuals.largest() <= tolerance || (stays && residuals.saddles_left < MOST_SADDLES)
            {
                if self.estimates.stiffness < STIFFEST {
                    self.estimates.scale_compliance(STIFFENING);
                    self.evaluate_current(problem)?;
                } else if residuals.saddles_left < MOST_SADDLES {
                    // Stiff already: off along the least curvature, and from there as at first.
                    self.leave_saddle(problem)?;
                    residuals.saddles_left += 1;
                    update_limit = first_limit;
                } else {
                    return Ok((Ending::Lost, residuals));
                }
                continue;
            }
            // Out of steps, or stopped.
            if *budget == 0 {
                return Ok((Ending::Spent, residuals));
            }
            if problem.stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
                return Ok((Ending::Stopped, residuals));
            }
            // Near the minimum of M: T̂ and λ̂ become T and λ, and c falls. Where rounding hides it: c grows.
            if residuals.moment <= update_limit && residuals.length > tolerance {
                if self.is_locked(residuals.length) {
                    return Ok((Ending::Lost, Residuals { locked: true, ..residuals }));
                }
                self.update_multipliers();
                update_limit = (0.1 * update_limit).max(0.5 * tolerance);
                self.evaluate_current(problem)?;
                self.linearize(problem);
            } else if self.is_stalled(residuals.moment) {
                self.soften();
                self.evaluate_current(problem)?;
                self.linearize(problem);
            }
            // Newton's step with the active set of its end, and as much of it as lowers M.
            self.newton_step(problem);
            if !self.search_line(problem)? {
                // No further decrease: the rounding of M, or a kink.
                if residuals.moment > 1e3 * tolerance {
                    return Ok((Ending::Lost, residuals));
                }
                self.update_multipliers();
                self.evaluate_current(problem)?;
            }
        }
    }

    fn evaluate_current(&mut self, problem: &Problem<'_>) -> Result<(), Fault> {
        let Problem { plan, scene, tendons, load_share, detection, .. } = *problem;
        self.current.evaluate(plan, scene, tendons, load_share, &self.estimates, detection)
    }

    fn evaluate_trial(&mut self, problem: &Problem<'_>) -> Result<(), Fault> {
        let Problem { plan, scene, tendons, load_share, detection, .. } = *problem;
        self.trial.evaluate(plan, scene, tendons, load_share, &self.estimates, detection)
    }

    /// Gradient, factors and step with the conditions that are active here.
    fn linearize(&mut self, problem: &Problem<'_>) {
        self.bounded.clear();
        self.pulling.clear();
        match problem.tendons {
            TendonInput::Lengths(bounds) => {
                self.bounded.extend(bounds.iter().map(|bound| bound.is_finite()));
                self.pulling.extend(self.current.tensions.iter().map(|tension| *tension > 0.0));
            }
            TendonInput::Tensions(tensions) => {
                self.bounded.resize(tensions.len(), true);
                self.pulling.resize(tensions.len(), false);
            }
        }
        self.compliance.clear();
        let own = self.estimates.tendon_compliance.iter().zip(&problem.plan.compliance);
        self.compliance.extend(own.map(|(c, own)| c + own));
        self.active.clear();
        self.active.extend(self.current.constraints.iter().map(|own| own.force > 0.0));
        self.is_shifted = self.shift > 0.0;
        self.solve_newton_system(problem);
        self.gradient.clone_from(&self.riccati.gradient);
        (self.moment, self.unstable) = (self.riccati.moment, self.riccati.unstable);
        if self.unstable.is_some() {
            self.riccati.write_escape(problem.plan, &mut self.escape);
        }
    }

    /// Finds a step downhill, with those conditions active that are so at its end (primal-dual active set).
    fn newton_step(&mut self, problem: &Problem<'_>) {
        while self.riccati.unstable.is_some() && self.shift <= LARGEST_SHIFT {
            self.shift = LEAST_SHIFT.max(SHIFT_FACTOR * self.shift);
            self.solve_newton_system(problem);
        }
        self.own_step.clone_from(&self.riccati.step);
        for _ in 0..MOST_SETS {
            if !self.predict_active_set(problem) {
                return;
            }
            self.solve_newton_system(problem);
            if self.riccati.unstable.is_some() {
                break;
            }
        }
        // The sets go round, or lead to no minimum: the one of this shape leads down.
        self.riccati.step.clone_from(&self.own_step);
    }

    /// Factors the Hessian with the active set at hand, and solves for the step.
    fn solve_newton_system(&mut self, problem: &Problem<'_>) {
        let Problem { plan, scene, load_share, .. } = *problem;
        self.current.potentials(scene, load_share, &self.active, &mut self.potentials);
        self.tensions.clear();
        match problem.tendons {
            TendonInput::Lengths(_) => {
                let trial = self.current.trial_tensions.iter().zip(&self.pulling);
                self.tensions.extend(trial.map(|(tension, on)| if *on { *tension } else { 0.0 }));
            }
            TendonInput::Tensions(tensions) => self.tensions.extend_from_slice(tensions),
        }
        self.riccati.factor_and_solve(&Linearization {
            plan,
            strains: &self.current.strains,
            frames: &self.current.frames,
            potentials: &self.potentials,
            tensions: &self.tensions,
            bounded: &self.bounded,
            pulling: &self.pulling,
            compliance: &self.compliance,
            moment: scene.moment * load_share,
            shift: self.shift,
        });
    }

    /// Finds the conditions that push or pull at the end of the step, to first order; true if they are others.
    fn predict_active_set(&mut self, problem: &Problem<'_>) -> bool {
        let mut changes = false;
        for (own, active) in self.current.constraints.iter().zip(&mut self.active) {
            let gap_change = own.gap_change(&self.riccati.displacements);
            let pushes = own.trial_force - gap_change / own.compliance > 0.0;
            changes |= pushes != *active;
            *active = pushes;
        }
        if matches!(problem.tendons, TendonInput::Tensions(_)) {
            return changes;
        }
        self.riccati.write_length_changes(problem.plan, &mut self.length_changes);
        for (k, pulling) in self.pulling.iter_mut().enumerate() {
            let more = self.length_changes[k] / self.compliance[k];
            let is_tight = self.bounded[k] && self.current.trial_tensions[k] + more > 0.0;
            changes |= is_tight != *pulling;
            *pulling = is_tight;
        }
        changes
    }

    /// Residuals at the current shape: the moment of its gradient, and violations of what the multipliers stand for.
    fn residuals(&self, problem: &Problem<'_>, saddles_left: usize) -> Residuals {
        let plan = problem.plan;
        let mut length = 0.0_f64;
        // L - C T = bound where T > 0, L <= bound elsewhere.
        let has_bounds = matches!(problem.tendons, TendonInput::Lengths(_));
        for (k, tension) in self.current.tensions.iter().enumerate() {
            if has_bounds && self.bounded[k] {
                let excess = self.current.excess[k] - plan.compliance[k] * tension;
                let off = if *tension > 0.0 { excess.abs() } else { excess.max(0.0) };
                length = length.max(off / plan.rest_lengths[k]);
            }
        }
        // gap = 0 where λ > 0, gap >= 0 elsewhere.
        let total = plan.total_length();
        for own in &self.current.constraints {
            let off = if own.force > 0.0 { own.gap.abs() } else { (-own.gap).max(0.0) };
            length = length.max(off / total);
        }
        Residuals { moment: self.moment, length, saddles_left, locked: false }
    }

    /// Makes the multipliers the estimates, and the conditions stiffer.
    fn update_multipliers(&mut self) {
        let estimates = &mut self.estimates;
        estimates.tensions.clone_from(&self.current.tensions);
        estimates.contacts.clear();
        let pushing = self.current.constraints.iter().filter(|own| own.force > 0.0);
        estimates.contacts.extend(pushing.map(MultiplierEstimate::of));
        if estimates.stiffness < STIFFEST {
            estimates.scale_compliance(STIFFENING);
        }
    }

    /// Locking: the stiffest conditions stay violated by as much however large their multipliers become.
    fn is_locked(&mut self, violation: f64) -> bool {
        let stays = self.estimates.stiffness >= STIFFEST && violation > 0.5 * self.violation;
        self.stuck_updates = if stays { self.stuck_updates + 1 } else { 0 };
        self.violation = violation;
        self.stuck_updates >= MOST_STUCK
    }

    /// Stalling: the last steps were below what M resolves, and moments do not fall either.
    fn is_stalled(&mut self, moment: f64) -> bool {
        if moment <= 0.5 * self.reference_moment {
            (self.reference_moment, self.unresolved_steps) = (moment, 0);
        }
        self.unresolved_steps >= MOST_UNRESOLVED
    }

    /// Makes the conditions softer, which makes less of the rounding of places.
    fn soften(&mut self) {
        (self.unresolved_steps, self.reference_moment) = (0, f64::INFINITY);
        if self.estimates.stiffness > 1.0 {
            self.estimates.scale_compliance(1.0 / STIFFENING);
        }
    }
}
