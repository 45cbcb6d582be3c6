//! From any start to the displacements: Newton's method on the dual.
//!
//! With the subsegments at their minima for given tensions, the minimum of energy and tensions' work is a
//! concave function of the tensions whose slope is what the tendons are too long. Its Newton step is the one of
//! the whole system. A step that goes past the top of its line is shortened, and so is one after which a
//! subsegment is no longer at a minimum: rest leads to the answer without jumps, or the way ends.

use super::newton_system::{Chain, JUMP, Left, RIDGE};
use super::plan::Plan;

/// How far off balance subsegments may be where the way is easy, and where it is not.
pub(super) const EASY: f64 = 0.3;
const HARD: f64 = 1e-9;
/// A way is not easy if it takes more steps, or if one had to be shortened.
const EASY_STEPS: usize = 12;
/// Evaluations that one way may take.
const WAY: usize = 70;
/// Share of what the rod itself gives, which soft tendons begin with, below which they are rigid; from there to
/// here they go by factors from the first towards the last, which is too near 1 to go on.
const RIGID: f64 = 1e-7;
const FACTOR: (f64, f64) = (0.1, 0.7);
/// No strain moves further in one step \[rad\].
const STEP: f64 = 0.5;
/// No load of a subsegment (tension times length² over bending stiffness) grows by more.
const LOAD: f64 = 6.0;
/// Ridges that are tried while the step of dependent tendons is too long.
const RIDGES: [f64; 6] = [1e-11, 1e-9, 1e-7, 1e-5, 1e-3, 1e-2];
/// A slope that turns by more than this share of itself has gone past the top.
const TURNED: f64 = 0.5;
/// Steps are not made shorter.
const SHORTEST: f64 = 1e-6;
/// Subsegments that take no more load than this are at the end of their way.
const MARGIN: f64 = 0.02;

/// How an ascent ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Ending {
    /// At the minimum.
    #[default]
    Converged,
    /// Where no longer step keeps every subsegment at a minimum.
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
    fn keep(&mut self, chain: &Chain) {
        self.strains.clone_from(&chain.strains);
        self.tensions.clone_from(&chain.tensions);
    }

    fn restore(&self, chain: &mut Chain) {
        chain.strains.clone_from(&self.strains);
        chain.tensions.clone_from(&self.tensions);
    }
}

/// Buffers of an ascent.
#[derive(Clone, Debug, Default)]
pub(super) struct DualNewton {
    /// Where the way began, and the last point on it with tendons of some softness.
    start: Point,
    reached: Point,
    /// The point that the last good step led to, and the step from it.
    kept: Point,
    pulls: Vec<f64>,
    step: Vec<f64>,
}

/// The step that is being taken.
#[derive(Clone, Copy)]
struct Stride {
    share: f64,
    /// Slope of the dual along the step, at its start.
    slope: f64,
}

/// How a way is followed.
struct Way {
    /// How far off balance subsegments may be.
    balance: f64,
    steps: usize,
    /// It is the second try, from the start and in balance all along.
    again: bool,
    stride: Option<Stride>,
}

impl DualNewton {
    /// Goes from the chain's strains and tensions to its bounds within a number of evaluations, which is
    /// counted down: at once if that works, else by tendons that are soft at first. Soft tendons leave no
    /// displacements infeasible, and become rigid along a path without jumps.
    pub(super) fn climb(
        &mut self,
        plan: &Plan,
        chain: &mut Chain,
        budget: &mut usize,
    ) -> (Ending, Left) {
        self.start.keep(chain);
        chain.give = 0.0;
        let (ending, left) = self.within(plan, chain, budget);
        if ending == Ending::Converged || *budget == 0 {
            return (ending, left);
        }
        self.start.restore(chain);
        chain.assemble(plan, EASY);
        let scale = chain.softness();
        let (mut factor, mut next) = (FACTOR.0, scale);
        let mut soft = f64::INFINITY;
        loop {
            chain.give = if next < RIGID * scale { 0.0 } else { next };
            self.start.keep(chain);
            let (ending, left) = self.within(plan, chain, budget);
            if ending == Ending::Converged {
                if chain.give == 0.0 {
                    return (ending, left);
                }
                soft = next;
                factor = (factor * factor).max(FACTOR.0 * FACTOR.0);
                self.reached.keep(chain);
            } else {
                factor = factor.sqrt();
                if *budget == 0 || factor > FACTOR.1 || soft.is_infinite() {
                    return self.give_up(plan, chain, *budget, soft.is_finite());
                }
                self.reached.restore(chain);
            }
            next = soft * factor;
        }
    }

    /// Leaves the last point that was reached, and what is left there.
    fn give_up(
        &self,
        plan: &Plan,
        chain: &mut Chain,
        budget: usize,
        reached: bool,
    ) -> (Ending, Left) {
        if reached {
            self.reached.restore(chain);
        }
        chain.give = 0.0;
        let left = chain.assemble(plan, EASY);
        let ending = if budget == 0 { Ending::Spent } else { Ending::Lost };
        (if left.worst().is_finite() { ending } else { Ending::Broken }, left)
    }

    /// One way, with its share of the budget.
    fn within(&mut self, plan: &Plan, chain: &mut Chain, budget: &mut usize) -> (Ending, Left) {
        let mut share = (*budget).min(WAY);
        *budget -= share;
        let outcome = self.follow(plan, chain, &mut share);
        *budget += share;
        outcome
    }

    fn follow(&mut self, plan: &Plan, chain: &mut Chain, budget: &mut usize) -> (Ending, Left) {
        let mut way = Way { balance: EASY, steps: 0, again: false, stride: None };
        loop {
            if way.balance == HARD && way.stride.is_some() {
                chain.choose(plan, &self.kept.strains);
            }
            let left = chain.assemble(plan, way.balance);
            *budget = budget.saturating_sub(left.rounds);
            if left.worst() <= plan.settings.tolerance && left.stable {
                return (Ending::Converged, left);
            }
            if *budget == 0 {
                return (Ending::Spent, left);
            }
            match self.judge(plan, &mut way, &left, chain) {
                Verdict::Good => {}
                Verdict::Retry => continue,
                Verdict::Lost => return (Ending::Lost, left),
            }
            if !direction(plan, chain) {
                return (Ending::Broken, left);
            }
            way.steps += 1;
            let share = 1.0_f64.min(STEP / chain.longest()).min(LOAD / loads(plan, &chain.pulls));
            way.stride = Some(Stride { share, slope: chain.growth(&chain.pulls) });
            self.kept.keep(chain);
            self.pulls.clone_from(&chain.pulls);
            self.step.clone_from(&chain.step);
            self.put(plan, chain, share);
        }
    }

    /// Whether the point that was assembled is one to go on from; if not, the chain is put at another.
    fn judge(&self, plan: &Plan, way: &mut Way, left: &Left, chain: &mut Chain) -> Verdict {
        let balanced = way.balance == EASY || left.moment <= way.balance;
        let sound = left.worst().is_finite() && left.stable && left.moved < JUMP && balanced;
        let Some(stride) = way.stride else {
            if sound {
                return Verdict::Good;
            }
            if way.again {
                return Verdict::Lost;
            }
            way.again = true;
            way.balance = HARD;
            self.start.restore(chain);
            return Verdict::Retry;
        };
        let slope = chain.growth(&self.pulls);
        let share = if !sound {
            0.25 * stride.share
        } else if slope < -TURNED * stride.slope {
            stride.share * (stride.slope / (stride.slope - slope)).clamp(0.1, 0.7)
        } else if way.balance == HARD || way.steps <= EASY_STEPS {
            return Verdict::Good;
        } else {
            0.5 * stride.share
        };
        let crowded = !sound && share * loads(plan, &self.pulls) < MARGIN;
        if share < SHORTEST || crowded {
            return Verdict::Lost;
        }
        if way.balance == EASY {
            // The slopes were those of a point off balance: once more from there.
            way.balance = HARD;
            way.stride = None;
            self.put(plan, chain, 0.0);
        } else {
            way.stride = Some(Stride { share, ..stride });
            self.put(plan, chain, share);
        }
        Verdict::Retry
    }

    /// Puts the chain at a share of the step.
    fn put(&self, plan: &Plan, chain: &mut Chain, share: f64) {
        let kept = &self.kept;
        for ((own, kept), step) in chain.strains.iter_mut().zip(&kept.strains).zip(&self.step) {
            *own = kept + share * step;
        }
        for ((own, kept), pull) in chain.tensions.iter_mut().zip(&kept.tensions).zip(&self.pulls) {
            let tension = kept + share * pull;
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

/// What changes of the tensions add to the load of the slenderest subsegment, at most.
fn loads(plan: &Plan, pulls: &[f64]) -> f64 {
    pulls.iter().map(|pull| pull.abs()).sum::<f64>() * plan.slenderness
}

/// The Newton step, with as little ridge as keeps dependent tendons from running away, and rounding from
/// turning it downwards.
fn direction(plan: &Plan, chain: &mut Chain) -> bool {
    let mut solved = chain.solve(plan, RIDGE);
    for ridge in RIDGES {
        if solved && loads(plan, &chain.pulls) <= LOAD && chain.growth(&chain.pulls) > 0.0 {
            break;
        }
        solved = chain.solve(plan, ridge);
    }
    solved
}
