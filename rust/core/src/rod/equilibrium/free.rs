//! Rod alone under tensions.
//!
//! Given tensions every subsegment is at a minimum of its own. From one equilibrium to the next leads the step
//! `dx = −H⁻¹ (g + Aᵀ dT)` of [`NewtonSystem`], whose error is of second order, and Newton steps. The g that remains
//! counts to first order in all that is read off.

use nalgebra::Vector3;

use super::memory::{distance, farthest, nearest};
use super::{Equilibrium, Motion, Twist};
use crate::lie::{Pose, so3};
use crate::model::State;
use crate::rod::dual_newton::LOOSE_BALANCE;
use crate::rod::load_stepping::{Limits, solve_near};
use crate::rod::model::{Rod, read_state};
use crate::rod::newton_system::NewtonSystem;
use crate::rod::plan::Plan;
use crate::rod::tip_rates::{SolvedRod, TipRates};
use crate::solve::dense::dot;

/// Limits of a solve at given tensions. The square of the residual \[rad of the own stiffness\] is below every
/// tolerance.
const LIMITS: Limits = Limits { newton_steps: 12, tolerance: 1e-6, shortest_load_step: 1e-2 };
/// No strain moves further in one step \[rad\].
const STEP: f64 = 0.5;
/// Steps between two sets of tensions at most.
const STEPS: usize = 20;

/// Equilibrium under tensions.
#[derive(Clone, Debug, Default)]
struct Point {
    system: NewtonSystem,
    sound: bool,
}

impl Point {
    fn distance(&self, tensions: &[f64]) -> f64 {
        distance(self.sound, &self.system.tensions, tensions)
    }
}

/// Rod under tensions, near equilibria that were solved before.
#[derive(Clone, Debug)]
pub(crate) struct FreeRod<'r> {
    rod: Rod<'r>,
    /// The last ones; steps start from the nearest.
    points: [Point; 3],
    at: usize,
    saved: [Point; 3],
    tip_rates: TipRates,
    frames: Vec<Pose>,
    motion: Motion,
    /// Motion of the tool by the Newton step that remains, subsegment by subsegment.
    remaining: Vec<Twist>,
}

impl<'r> FreeRod<'r> {
    /// Rod at rest.
    pub(crate) fn new(rod: Rod<'r>) -> Self {
        let mut rod = Self {
            rod,
            points: [Point::default(), Point::default(), Point::default()],
            at: 0,
            saved: Default::default(),
            tip_rates: TipRates::default(),
            frames: Vec::new(),
            motion: Motion::new(),
            remaining: Vec::new(),
        };
        rod.reset();
        rod
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

    /// Steps towards tensions by a share of what is left to them; returns the point that the step leads to.
    fn step(&mut self, tensions: &[f64], share: &mut f64) -> Option<usize> {
        let plan = self.plan();
        let distances = self.points.each_ref().map(|point| point.distance(tensions));
        let (from, to) = (self.at, farthest(&distances, self.at));
        // Twice the share of the step before.
        *share = (2.0 * *share).min(1.0);
        loop {
            let [base, other] = self.points.get_disjoint_mut([from, to]).ok()?;
            let base = &mut base.system;
            // Predictor: dx = −H⁻¹ (g + Aᵀ dT), no strain further than a longest step.
            base.tension_step.clear();
            base.tension_step.extend(base.tensions.iter().zip(tensions).map(|(own, t)| t - own));
            if !base.solve_strain_step(plan) {
                return None;
            }
            *share = share.min(STEP / base.longest_strain_step());
            // The point there, in place of the one that is least useful.
            let system = &mut other.system;
            system.clear_bounds(plan);
            system.active.clone_from(&base.active);
            system.strains.clear();
            system.tensions.clear();
            for (strain, step) in base.strains.iter().zip(&base.strain_step) {
                system.strains.push(strain + *share * step);
            }
            for (own, step) in base.tensions.iter().zip(&base.tension_step) {
                system.tensions.push(own + *share * step);
            }
            if *share == 1.0 {
                system.tensions.copy_from_slice(tensions);
            }
            // Corrector: Newton's method there, or a quarter of the step.
            other.sound = solve_near(plan, system, &LIMITS, &mut { usize::MAX }).0;
            if other.sound {
                return Some(to);
            }
            *share *= 0.25;
            if *share < LIMITS.shortest_load_step || share.is_nan() {
                return None;
            }
        }
    }

    fn differentiate_of<const D: usize>(&mut self) {
        let plan = self.plan();
        let size = plan.width();
        let system = &self.points[self.at].system;
        let mut frame = Pose::identity();
        self.frames.clear();
        self.frames.push(frame);
        for end in &system.ends {
            frame = frame.compose(end);
            self.frames.push(frame);
        }
        let tool = frame.compose(self.rod.robot.tool());
        let motion = &mut self.motion;
        motion.begin(tool, system.tensions.len());
        let remaining = &mut self.remaining;
        remaining.clear();
        // Columns −P H⁻¹ Aᵀ, and the motion −P H⁻¹ g of the Newton step that remains.
        let at =
            SolvedRod { strains: &system.strains, factors: &system.factors, frames: &self.frames };
        self.tip_rates.for_each_subsegment::<D>(plan, &at, &tool.translation, |i, rows| {
            let product = |whitened: &[f64]| {
                let by = |k: usize| -dot(&rows[k * size..(k + 1) * size], whitened);
                (Vector3::new(by(0), by(1), by(2)), Vector3::new(by(3), by(4), by(5)))
            };
            for p in plan.starts[i]..plan.starts[i + 1] {
                let row = &system.whitened_rows[p * size..(p + 1) * size];
                motion.add(plan.pieces[p].tendon, product(row));
            }
            motion.next();
            remaining.push(product(&system.whitened_gradients[i * size..(i + 1) * size]));
        });
        motion.place(&self.frames, remaining.iter().copied());
        // Disks and tool as they are after that step, to first order.
        let sum = |sum: Twist, share: &Twist| (sum.0 + share.0, sum.1 + share.1);
        let (moved, turned) = remaining.iter().fold((Vector3::zeros(), Vector3::zeros()), sum);
        let tool = &mut motion.tool;
        tool.translation += moved;
        tool.rotation = so3::exp(&turned) * tool.rotation;
    }

    /// Shortening of every tendon by turns of the subsegments from rest, linearly \[m\], into `right`; and `S`, lower
    /// triangle row by row, the shortening by tensions. Only where nothing was solved yet.
    pub(crate) fn shorten(&self, turns: &[Vector3<f64>], right: &mut Vec<f64>) -> &[f64] {
        let plan = self.plan();
        let (size, unknowns) = (plan.width(), plan.unknowns());
        let system = &self.points[0].system;
        right.clear();
        right.resize(plan.rest_lengths.len(), 0.0);
        let (mut bent, mut turned) = (vec![0.0; size], vec![0.0; size]);
        for (i, turn) in turns.iter().enumerate() {
            let rest = &system.strains[i * size..(i + 1) * size];
            for (k, bent) in bent.iter_mut().enumerate().filter(|(k, _)| k % unknowns < 3) {
                *bent = turn[k % unknowns] / plan.settings.elements as f64 - rest[k];
            }
            let factor = &system.factors[i * size * size..(i + 1) * size * size];
            for c in 0..size {
                // Lᵀ, its diagonal inverted.
                let below = (c + 1..size).map(|k| factor[k * size + c] * bent[k]);
                turned[c] = bent[c] / factor[c * (size + 1)] + below.sum::<f64>();
            }
            for p in plan.starts[i]..plan.starts[i + 1] {
                let row = &system.whitened_rows[p * size..(p + 1) * size];
                right[plan.pieces[p].tendon] -= dot(row, &turned);
            }
        }
        &system.schur
    }

    /// Shortening of a tendon by a unit of its tension, elasticity aside \[m\].
    pub(crate) fn shortening(&self, k: usize) -> f64 {
        let system = &self.points[self.at].system;
        system.schur[k * (system.tensions.len() + 1)]
    }

    /// Tension of one unit of the plan in the unit of the results.
    pub(crate) fn unit(&self) -> f64 {
        self.plan().unit
    }
}

impl Equilibrium for FreeRod<'_> {
    fn reset(&mut self) {
        let plan = self.plan();
        for point in &mut self.points {
            point.sound = false;
        }
        let Point { system, sound } = &mut self.points[0];
        system.reset(plan);
        system.clear_bounds(plan);
        system.active.clear();
        system.active.resize(plan.rest_lengths.len(), true);
        system.assemble(plan, LOOSE_BALANCE);
        *sound = true;
        self.at = 0;
    }

    fn start_from(&mut self, start: &State) -> bool {
        let plan = self.plan();
        self.reset();
        let Point { system, sound } = &mut self.points[0];
        let NewtonSystem { strains, tensions, .. } = system;
        let read = read_state(start, plan, strains, tensions).is_ok();
        *sound = read && solve_near(plan, system, &LIMITS, &mut { usize::MAX }).0;
        let started = *sound;
        if !started {
            self.reset();
        }
        started
    }

    fn tensions(&self) -> &[f64] {
        &self.points[self.at].system.tensions
    }

    fn solve_at(&mut self, tensions: &[f64]) -> bool {
        self.at = nearest(&self.points.each_ref().map(|point| point.distance(tensions)));
        let mut share = 1.0;
        for _ in 0..STEPS {
            if self.points[self.at].distance(tensions) == 0.0 {
                return true;
            }
            let Some(next) = self.step(tensions, &mut share) else { return false };
            self.at = next;
        }
        self.points[self.at].distance(tensions) == 0.0
    }

    fn differentiate(&mut self) {
        match self.plan().unknowns() {
            3 => self.differentiate_of::<3>(),
            _ => self.differentiate_of::<4>(),
        }
    }

    fn save(&mut self, slot: usize) {
        self.saved[slot].clone_from(&self.points[self.at]);
    }

    fn restore(&mut self, slot: usize) {
        self.reset();
        if self.saved[slot].sound {
            self.points[0].clone_from(&self.saved[slot]);
        }
    }

    fn motion(&self) -> &Motion {
        &self.motion
    }

    fn motion_mut(&mut self) -> &mut Motion {
        &mut self.motion
    }

    fn displacement(&self, k: usize) -> f64 {
        let (plan, system) = (self.plan(), &self.points[self.at].system);
        system.length_error[k] + system.dual_gradient[k]
            - plan.compliance[k] * system.tensions[k]
            - plan.rest_lengths[k]
    }

    fn displacement_slope(&self, k: usize, by: usize) -> f64 {
        let system = &self.points[self.at].system;
        let count = system.tensions.len();
        let compliance = if k == by { self.plan().compliance[k] } else { 0.0 };
        -system.schur[k.max(by) * count + k.min(by)] - compliance
    }
}
