//! Newton's method on the dual: from any start to the displacements.
//!
//! With the subsegments at their minima for given tensions, the minimum of energy and tensions' work is a
//! concave function D(T) of the tensions whose gradient is what the tendons are too long. Its Newton step is the one
//! of the whole system. A step past the maximum along its line is shortened, and so is one after which a subsegment
//! is no longer at a minimum: rest leads to the answer without jumps, or the path ends.

use super::newton_system::{JUMP, NewtonSystem, RIDGE, Residual};
use super::plan::Plan;

/// Balance of the subsegments while steps go well \[rad of their own stiffness\], and from the first bad one on.
pub(super) const LOOSE_BALANCE: f64 = 0.3;
const TIGHT_BALANCE: f64 = 1e-9;
/// Newton steps in loose balance at most.
const LOOSE_STEPS: usize = 12;
/// Evaluations of one path at most.
const PATH_EVALUATIONS: usize = 70;
/// Added compliance that counts as none, as a share of the rod's own.
const RIGID: f64 = 1e-7;
/// Factor by which the added compliance falls: the first one, and the one that is too near 1 to go on.
const FACTOR: (f64, f64) = (0.1, 0.7);
/// No strain moves further in one step \[rad\].
const STEP: f64 = 0.5;
/// No load of a subsegment (tension times length² over bending stiffness) grows by more.
const LOAD: f64 = 6.0;
/// Ridges that are tried while the step of dependent tendons is too long.
const RIDGES: [f64; 6] = [1e-11, 1e-9, 1e-7, 1e-5, 1e-3, 1e-2];
/// Slope of the dual at the end of a step, as a share of minus that at its start, beyond which it is shortened.
const TURNED: f64 = 0.5;
/// Steps are not made shorter.
const SHORTEST: f64 = 1e-6;
/// Subsegments that bear no more load than this are at the end of their path.
const MARGIN: f64 = 0.02;

/// End of a solve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Ending {
    /// At the minimum.
    #[default]
    Converged,
    /// No longer step keeps every subsegment at a minimum.
    Lost,
    /// Out of evaluations.
    Spent,
    /// The arithmetic broke down.
    Broken,
    /// Another thread wanted no more of it.
    Stopped,
}

/// Strains and tensions.
#[derive(Clone, Debug, Default)]
struct Point {
    strains: Vec<f64>,
    tensions: Vec<f64>,
}

impl Point {
    fn save(&mut self, system: &NewtonSystem) {
        self.strains.clone_from(&system.strains);
        self.tensions.clone_from(&system.tensions);
    }

    fn restore(&self, system: &mut NewtonSystem) {
        system.strains.clone_from(&self.strains);
        system.tensions.clone_from(&self.tensions);
    }
}

/// Buffers of Newton's method on the dual.
#[derive(Clone, Debug, Default)]
pub(super) struct DualNewton {
    /// Start of the path, and the last point that was solved with added compliance.
    start: Point,
    solved: Point,
    /// Point from which the last step was taken, and that step.
    accepted: Point,
    tension_step: Vec<f64>,
    strain_step: Vec<f64>,
}

/// Step that is being tried.
#[derive(Clone, Copy)]
struct Step {
    share: f64,
    /// Slope of the dual along the step, at its start.
    slope: f64,
}

/// Progress along one path.
struct Path {
    /// Balance of the subsegments.
    balance: f64,
    steps: usize,
    /// It is the second try, from the start and in tight balance all along.
    again: bool,
    step: Option<Step>,
}

impl DualNewton {
    /// Solves from the strains and tensions of a system to its bounds within a number of evaluations, which is
    /// counted down: at once if that works, else by tendons that are soft at first. Soft tendons leave no
    /// displacements infeasible, and become rigid along a path without jumps.
    pub(super) fn solve(
        &mut self,
        plan: &Plan,
        system: &mut NewtonSystem,
        budget: &mut usize,
    ) -> (Ending, Residual) {
        // At once, with the tendons' own compliance C.
        self.start.save(system);
        system.added_compliance = 0.0;
        let (ending, residual) = self.solve_path(plan, system, budget);
        if ending == Ending::Converged || *budget == 0 {
            return (ending, residual);
        }
        // C grows by the largest diagonal entry of S at the start.
        self.start.restore(system);
        system.assemble(plan, LOOSE_BALANCE);
        let scale = system.largest_compliance();
        let (mut factor, mut next) = (FACTOR.0, scale);
        let mut compliance = f64::INFINITY;
        // It falls to nothing: by a smaller factor after a success, by one nearer to 1 after a failure.
        loop {
            system.added_compliance = if next < RIGID * scale { 0.0 } else { next };
            self.start.save(system);
            let (ending, residual) = self.solve_path(plan, system, budget);
            if ending == Ending::Converged {
                if system.added_compliance == 0.0 {
                    return (ending, residual);
                }
                // On to a stiffer one.
                compliance = next;
                factor = (factor * factor).max(FACTOR.0 * FACTOR.0);
                self.solved.save(system);
            } else {
                factor = factor.sqrt();
                if *budget == 0 || factor > FACTOR.1 || compliance.is_infinite() {
                    return self.give_up(plan, system, *budget, compliance.is_finite());
                }
                self.solved.restore(system);
            }
            next = compliance * factor;
        }
    }

    /// Leaves the last point that was solved, and the residual there.
    fn give_up(
        &self,
        plan: &Plan,
        system: &mut NewtonSystem,
        budget: usize,
        solved: bool,
    ) -> (Ending, Residual) {
        if solved {
            self.solved.restore(system);
        }
        system.added_compliance = 0.0;
        let residual = system.assemble(plan, LOOSE_BALANCE);
        let ending = if budget == 0 { Ending::Spent } else { Ending::Lost };
        (if residual.worst().is_finite() { ending } else { Ending::Broken }, residual)
    }

    /// One path, with its share of the budget.
    fn solve_path(
        &mut self,
        plan: &Plan,
        system: &mut NewtonSystem,
        budget: &mut usize,
    ) -> (Ending, Residual) {
        let mut share = (*budget).min(PATH_EVALUATIONS);
        *budget -= share;
        let outcome = self.follow_path(plan, system, &mut share);
        *budget += share;
        outcome
    }

    fn follow_path(
        &mut self,
        plan: &Plan,
        system: &mut NewtonSystem,
        budget: &mut usize,
    ) -> (Ending, Residual) {
        let mut path = Path { balance: LOOSE_BALANCE, steps: 0, again: false, step: None };
        loop {
            if path.balance == TIGHT_BALANCE && path.step.is_some() {
                system.keep_lower_energy(plan, &self.accepted.strains);
            }
            let residual = system.assemble(plan, path.balance);
            *budget = budget.saturating_sub(residual.evaluations);
            if residual.worst() <= plan.settings.tolerance && residual.stable {
                return (Ending::Converged, residual);
            }
            if *budget == 0 {
                return (Ending::Spent, residual);
            }
            match self.accept_or_shorten(plan, &mut path, &residual, system) {
                Verdict::Good => {}
                Verdict::Retry => continue,
                Verdict::Lost => return (Ending::Lost, residual),
            }
            // Length of a step: bounds on what strains and loads change by.
            if !newton_step(plan, system) {
                return (Ending::Broken, residual);
            }
            path.steps += 1;
            let share = 1.0_f64
                .min(STEP / system.longest_strain_step())
                .min(LOAD / load(plan, &system.tension_step));
            path.step = Some(Step { share, slope: system.dual_slope(&system.tension_step) });
            self.accepted.save(system);
            self.tension_step.clone_from(&system.tension_step);
            self.strain_step.clone_from(&system.strain_step);
            self.move_to(plan, system, share);
        }
    }

    /// Accepts the point that was assembled, or puts the system at another: start of tighter balance, shorter step.
    fn accept_or_shorten(
        &self,
        plan: &Plan,
        path: &mut Path,
        residual: &Residual,
        system: &mut NewtonSystem,
    ) -> Verdict {
        // Every H_i positive definite, no jump, and balanced as asked.
        let balanced = path.balance == LOOSE_BALANCE || residual.moment <= path.balance;
        let sound =
            residual.worst().is_finite() && residual.stable && residual.moved < JUMP && balanced;
        // A start has no step to shorten: once more in tight balance.
        let Some(step) = path.step else {
            if sound {
                return Verdict::Good;
            }
            if path.again {
                return Verdict::Lost;
            }
            path.again = true;
            path.balance = TIGHT_BALANCE;
            self.start.restore(system);
            return Verdict::Retry;
        };
        // Shares of the step: a quarter, or the secant rule where the slope has turned past the maximum.
        let slope = system.dual_slope(&self.tension_step);
        let share = if !sound {
            0.25 * step.share
        } else if slope < -TURNED * step.slope {
            step.share * (step.slope / (step.slope - slope)).clamp(0.1, 0.7)
        } else if path.balance == TIGHT_BALANCE || path.steps <= LOOSE_STEPS {
            return Verdict::Good;
        } else {
            0.5 * step.share
        };
        let at_end = !sound && share * load(plan, &self.tension_step) < MARGIN;
        if share < SHORTEST || at_end {
            return Verdict::Lost;
        }
        if path.balance == LOOSE_BALANCE {
            // The slopes were those of a point off balance: once more from there.
            path.balance = TIGHT_BALANCE;
            path.step = None;
            self.move_to(plan, system, 0.0);
        } else {
            path.step = Some(Step { share, ..step });
            self.move_to(plan, system, share);
        }
        Verdict::Retry
    }

    /// Moves the system to a share of the step.
    fn move_to(&self, plan: &Plan, system: &mut NewtonSystem, share: f64) {
        let from = &self.accepted;
        for ((own, from), step) in
            system.strains.iter_mut().zip(&from.strains).zip(&self.strain_step)
        {
            *own = from + share * step;
        }
        for ((own, from), step) in
            system.tensions.iter_mut().zip(&from.tensions).zip(&self.tension_step)
        {
            let tension = from + share * step;
            // Rounding leaves no tension below zero.
            *own = if plan.signed { tension } else { tension.max(0.0) };
        }
    }
}

enum Verdict {
    Good,
    Retry,
    Lost,
}

/// Load that changes of the tensions add to the slenderest subsegment, at most: `Σ |dT| ℓ²/EI`.
fn load(plan: &Plan, tension_step: &[f64]) -> f64 {
    tension_step.iter().map(|step| step.abs()).sum::<f64>() * plan.slenderness
}

/// The Newton step, with as little ridge as keeps dependent tendons from running away, and rounding from
/// turning it downwards.
fn newton_step(plan: &Plan, system: &mut NewtonSystem) -> bool {
    let mut solved = system.solve(plan, RIDGE);
    for ridge in RIDGES {
        let step = &system.tension_step;
        if solved && load(plan, step) <= LOAD && system.dual_slope(step) > 0.0 {
            break;
        }
        solved = system.solve(plan, ridge);
    }
    solved
}
