//! The rod alone under tensions.
//!
//! Given tensions every subsegment is a minimum of its own. From one balance to the next leads the step `dx = −H⁻¹ (g + Aᵀ dT)` of
//! [`Chain`](crate::rod::newton_system::Chain), which is of second order, and Newton steps; what is left of g then counts to
//! first order in all that is read off.

use nalgebra::Vector3;

use super::{Equilibrium, Motion, Twist};
use crate::lie::{Pose, so3};
use crate::model::State;
use crate::rod::dual_newton::EASY;
use crate::rod::model::{Rod, read_state};
use crate::rod::newton_system::{Chain, JUMP};
use crate::rod::plan::Plan;
use crate::rod::tip_rates::{Solved, Sweep};
use crate::solve::dense::dot;

/// Equilibrium that is near enough: its square is below every tolerance \[rad of the own stiffness\].
const BALANCED: f64 = 1e-6;
/// Newton steps to a balance.
const PATIENCE: usize = 12;
/// No strain moves further in one step \[rad\].
const STEP: f64 = 0.5;
/// Steps between two sets of tensions at most, and the shortest one.
const STEPS: usize = 20;
const SHORTEST: f64 = 1e-2;

/// A balance under tensions.
#[derive(Clone, Debug, Default)]
struct Point {
    chain: Chain,
    sound: bool,
}

impl Point {
    /// Largest difference of its tensions from others; infinite where it is none.
    fn away(&self, tensions: &[f64]) -> f64 {
        if !self.sound {
            return f64::INFINITY;
        }
        let pairs = self.chain.tensions.iter().zip(tensions);
        pairs.fold(0.0, |most, (a, b)| most.max((a - b).abs()))
    }
}

/// The rod under tensions, near points where it was balanced before.
#[derive(Clone, Debug)]
pub(crate) struct FreeRod<'r> {
    rod: Rod<'r>,
    /// The last ones; steps start from the nearest.
    points: [Point; 3],
    at: usize,
    kept: [Point; 3],
    sweep: Sweep,
    frames: Vec<Pose>,
    motion: Motion,
    /// What balance the strains of every subsegment lack moves the tool by this.
    lacks: Vec<Twist>,
}

impl<'r> FreeRod<'r> {
    /// At rest.
    pub(crate) fn new(rod: Rod<'r>) -> Self {
        let mut pulled = Self {
            rod,
            points: [Point::default(), Point::default(), Point::default()],
            at: 0,
            kept: Default::default(),
            sweep: Sweep::default(),
            frames: Vec::new(),
            motion: Motion::new(),
            lacks: Vec::new(),
        };
        pulled.rest();
        pulled
    }

    /// The plan it was made of.
    pub(crate) fn plan(&self) -> &'r Plan {
        self.rod.plan
    }

    /// The model of displacements.
    pub(crate) fn rod(&self) -> &Rod<'r> {
        &self.rod
    }

    /// Length of every tendon at rest \[m\].
    pub(crate) fn rest_lengths(&self) -> &'r [f64] {
        &self.plan().rest_lengths
    }

    /// One step towards tensions, of a share of the way that is left; the point that it leads to.
    fn step(&mut self, tensions: &[f64], share: &mut f64) -> Option<usize> {
        let plan = self.plan();
        let (from, to) = (self.at, self.farthest(tensions));
        *share = (2.0 * *share).min(1.0);
        loop {
            let [base, other] = self.points.get_disjoint_mut([from, to]).ok()?;
            let base = &mut base.chain;
            base.pulls.clear();
            base.pulls.extend(base.tensions.iter().zip(tensions).map(|(own, t)| t - own));
            if !base.bend(plan) {
                return None;
            }
            *share = share.min(STEP / base.longest());
            let chain = &mut other.chain;
            chain.unbound(plan);
            chain.taut.clone_from(&base.taut);
            chain.strains.clear();
            chain.tensions.clear();
            for (strain, step) in base.strains.iter().zip(&base.step) {
                chain.strains.push(strain + *share * step);
            }
            for (own, pull) in base.tensions.iter().zip(&base.pulls) {
                chain.tensions.push(own + *share * pull);
            }
            if *share == 1.0 {
                chain.tensions.copy_from_slice(tensions);
            }
            other.sound = settle(plan, chain);
            if other.sound {
                return Some(to);
            }
            *share *= 0.25;
            if *share < SHORTEST || share.is_nan() {
                return None;
            }
        }
    }

    /// The point that is least useful from where the search is.
    fn farthest(&self, tensions: &[f64]) -> usize {
        let others = (0..3).filter(|k| *k != self.at);
        others.fold(usize::MAX, |worst, k| {
            let further =
                |a: usize, b: usize| self.points[a].away(tensions) > self.points[b].away(tensions);
            if worst == usize::MAX || further(k, worst) { k } else { worst }
        })
    }

    fn differentiate_of<const D: usize>(&mut self) {
        let plan = self.plan();
        let size = plan.width();
        let chain = &self.points[self.at].chain;
        let mut frame = Pose::identity();
        self.frames.clear();
        self.frames.push(frame);
        for end in &chain.ends {
            frame = frame.compose(end);
            self.frames.push(frame);
        }
        let tool = frame.compose(self.rod.robot.tool());
        let motion = &mut self.motion;
        motion.begin(tool, chain.tensions.len());
        let lacks = &mut self.lacks;
        lacks.clear();
        let at = Solved { strains: &chain.strains, factors: &chain.factors, frames: &self.frames };
        self.sweep.run::<D>(plan, &at, &tool.translation, |i, rows| {
            let product = |image: &[f64]| {
                let by = |k: usize| -dot(&rows[k * size..(k + 1) * size], image);
                (Vector3::new(by(0), by(1), by(2)), Vector3::new(by(3), by(4), by(5)))
            };
            for p in plan.starts[i]..plan.starts[i + 1] {
                motion.add(plan.pieces[p].tendon, product(&chain.images[p * size..(p + 1) * size]));
            }
            motion.next();
            lacks.push(product(&chain.gradients[i * size..(i + 1) * size]));
        });
        motion.place(&self.frames, lacks.iter().copied());
        let sum = |sum: Twist, lack: &Twist| (sum.0 + lack.0, sum.1 + lack.1);
        let lack = lacks.iter().fold((Vector3::zeros(), Vector3::zeros()), sum);
        let tool = &mut motion.tool;
        tool.translation += lack.0;
        tool.rotation = so3::exp(&lack.1) * tool.rotation;
    }

    /// Where nothing was solved yet: by what turns of the subsegments shorten every tendon, linearly \[m\], into
    /// `right`; and `S`, lower triangle row by row, by what tensions do.
    pub(crate) fn shorten(&self, turns: &[Vector3<f64>], right: &mut Vec<f64>) -> &[f64] {
        let plan = self.plan();
        let (size, unknowns) = (plan.width(), plan.unknowns());
        let chain = &self.points[0].chain;
        right.clear();
        right.resize(plan.rest_lengths.len(), 0.0);
        let (mut bent, mut turned) = (vec![0.0; size], vec![0.0; size]);
        for (i, turn) in turns.iter().enumerate() {
            let rest = &chain.strains[i * size..(i + 1) * size];
            for (k, bent) in bent.iter_mut().enumerate().filter(|(k, _)| k % unknowns < 3) {
                *bent = turn[k % unknowns] / plan.settings.elements as f64 - rest[k];
            }
            let factor = &chain.factors[i * size * size..(i + 1) * size * size];
            for c in 0..size {
                // Lᵀ, its diagonal inverted.
                let below = (c + 1..size).map(|k| factor[k * size + c] * bent[k]);
                turned[c] = bent[c] / factor[c * (size + 1)] + below.sum::<f64>();
            }
            for p in plan.starts[i]..plan.starts[i + 1] {
                let image = &chain.images[p * size..(p + 1) * size];
                right[plan.pieces[p].tendon] -= dot(image, &turned);
            }
        }
        &chain.schur
    }

    /// What a unit of a tension shortens its own tendon by, elasticity aside \[m\].
    pub(crate) fn softness(&self, k: usize) -> f64 {
        let chain = &self.points[self.at].chain;
        chain.schur[k * (chain.tensions.len() + 1)]
    }

    /// Tension of one unit of the plan in the unit of the results.
    pub(crate) fn unit(&self) -> f64 {
        self.plan().unit
    }
}

impl Equilibrium for FreeRod<'_> {
    fn rest(&mut self) {
        let plan = self.plan();
        for point in &mut self.points {
            point.sound = false;
        }
        let Point { chain, sound } = &mut self.points[0];
        chain.rest(plan);
        chain.unbound(plan);
        chain.taut.clear();
        chain.taut.resize(plan.rest_lengths.len(), true);
        chain.assemble(plan, EASY);
        *sound = true;
        self.at = 0;
    }

    fn begin(&mut self, start: &State) -> bool {
        let plan = self.plan();
        self.rest();
        let Point { chain, sound } = &mut self.points[0];
        let Chain { strains, tensions, .. } = chain;
        *sound = read_state(start, plan, strains, tensions).is_ok() && settle(plan, chain);
        let began = *sound;
        if !began {
            self.rest();
        }
        began
    }

    fn tensions(&self) -> &[f64] {
        &self.points[self.at].chain.tensions
    }

    fn go(&mut self, tensions: &[f64]) -> bool {
        let away = self.points.each_ref().map(|point| point.away(tensions));
        let nearest = (0..3).fold(0, |best, k| if away[k] < away[best] { k } else { best });
        self.at = nearest;
        let mut share = 1.0;
        for _ in 0..STEPS {
            if self.points[self.at].away(tensions) == 0.0 {
                return true;
            }
            let Some(next) = self.step(tensions, &mut share) else { return false };
            self.at = next;
        }
        self.points[self.at].away(tensions) == 0.0
    }

    fn differentiate(&mut self) {
        match self.plan().unknowns() {
            3 => self.differentiate_of::<3>(),
            _ => self.differentiate_of::<4>(),
        }
    }

    fn keep(&mut self, place: usize) {
        self.kept[place].clone_from(&self.points[self.at]);
    }

    fn go_back(&mut self, place: usize) {
        self.rest();
        if self.kept[place].sound {
            self.points[0].clone_from(&self.kept[place]);
        }
    }

    fn motion(&self) -> &Motion {
        &self.motion
    }

    fn motion_mut(&mut self) -> &mut Motion {
        &mut self.motion
    }

    fn displacement(&self, k: usize) -> f64 {
        let (plan, chain) = (self.plan(), &self.points[self.at].chain);
        chain.over[k] + chain.slope[k]
            - plan.compliance[k] * chain.tensions[k]
            - plan.rest_lengths[k]
    }

    fn displacement_slope(&self, k: usize, by: usize) -> f64 {
        let chain = &self.points[self.at].chain;
        let count = chain.tensions.len();
        let give = if k == by { self.plan().compliance[k] } else { 0.0 };
        -chain.schur[k.max(by) * count + k.min(by)] - give
    }
}

/// Newton's method to the balance under the chain's tensions; whether there is a minimum near.
fn settle(plan: &Plan, chain: &mut Chain) -> bool {
    let mut moved = 0.0;
    for _ in 0..PATIENCE {
        let left = chain.assemble(plan, EASY);
        moved += left.moved;
        if !left.moment.is_finite() || moved > JUMP {
            return false;
        }
        if left.moment <= BALANCED {
            return left.stable;
        }
        chain.pulls.clear();
        chain.pulls.resize(chain.tensions.len(), 0.0);
        if !chain.bend(plan) {
            return false;
        }
        chain.strains.iter_mut().zip(&chain.step).for_each(|(strain, step)| *strain += step);
    }
    false
}
