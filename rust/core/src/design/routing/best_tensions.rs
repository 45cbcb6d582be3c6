//! The tensions that bring a given routing nearest to the wanted places.

use nalgebra::{DMatrix, DVector, Vector3};

use super::quadratic_cost::QuadraticCost;
use super::task::{Holes, Task};
use crate::rod::one_subsegment::OneSubsegment;

/// A routing under tensions, and the sum of its disks' squared distances.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) holes: Holes,
    /// In the plan's unit.
    pub(super) tensions: Vec<f64>,
    pub(super) value: f64,
}

/// Steps at most; a change of the value by less than this share ends them.
const STEPS: usize = 40;
const HEADWAY: f64 = 1e-10;
/// A bottom is known to the width of its bracket halved so often.
const HALVES: usize = 40;
/// Places within this share of the length cannot be told apart.
const ROUNDING: f64 = 1e-14;

/// The subsegments of a robot, routed and solved one by one.
pub(super) struct TensionSolver {
    stages: Vec<OneSubsegment>,
    near: Vec<Vec<f64>>,
    /// Steps that were taken.
    pub(super) steps: usize,
}

/// Cost and strains under a set of tensions.
struct CostAtTensions {
    cost: QuadraticCost,
    strains: Vec<Vec<f64>>,
}

impl TensionSolver {
    pub(super) fn new(task: &Task<'_>) -> Self {
        let n = task.targets.len();
        let stages = (0..n).map(|i| OneSubsegment::new(&task.plan, i)).collect();
        Self { stages, near: vec![Vec::new(); n], steps: 0 }
    }

    pub(super) fn equilibria(&self) -> usize {
        self.stages.iter().map(|stage| stage.solved).sum()
    }

    /// Squared distances and their derivatives by the tensions. Nothing where a subsegment has no shape.
    fn evaluate(&mut self, task: &Task<'_>, tensions: &[f64]) -> Option<CostAtTensions> {
        let count = tensions.len();
        let mut frame = *task.robot.base();
        let mut rates = vec![(Vector3::zeros(), Vector3::zeros()); count];
        let mut velocity = vec![Vector3::zeros(); count];
        let (mut cost, mut strains) =
            (QuadraticCost::of(task), Vec::with_capacity(self.stages.len()));
        for ((stage, near), target) in self.stages.iter_mut().zip(&self.near).zip(task.targets) {
            if !stage.solve(tensions, near) {
                return None;
            }
            strains.push(stage.strains().to_vec());
            let end = stage.end();
            let arm = frame.rotation * end.translation;
            for own in &mut rates {
                own.0 += own.1.cross(&arm);
            }
            for (k, rate) in stage.tendons().iter().zip(stage.rates().column_iter()) {
                rates[*k].0 += frame.rotation * rate.fixed_rows::<3>(0);
                rates[*k].1 += frame.rotation * rate.fixed_rows::<3>(3);
            }
            frame = frame.compose(&end);
            for (velocity, rate) in velocity.iter_mut().zip(&rates) {
                *velocity = rate.0;
            }
            cost.add(&(frame.translation - target), &velocity);
            if task.bounds.is_some() {
                let (pulls, slopes) = stage.displacements(count);
                cost.add_pulls(&pulls, &slopes);
            }
        }
        cost.penalise(task, 1.0);
        Some(CostAtTensions { cost, strains })
    }

    /// Tension between two others at which the cost of a routing of one tendon stops falling, or the last at which it
    /// has a shape.
    pub(super) fn valley_bottom(
        &mut self,
        task: &Task<'_>,
        holes: &Holes,
        count: usize,
        (mut low, mut high): (f64, f64),
    ) -> f64 {
        self.route(task, holes, count);
        for _ in 0..HALVES {
            let middle = 0.5 * (low + high);
            if self.evaluate(task, &[middle]).is_some_and(|placed| placed.cost.slope[0] < 0.0) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    fn route(&mut self, task: &Task<'_>, holes: &Holes, count: usize) {
        for (i, (stage, near)) in self.stages.iter_mut().zip(&mut self.near).enumerate() {
            let place = |k, disk: usize| task.hole(k, disk, holes[disk][k], count);
            stage.route(|k| (place(k, i), place(k, i + 1)));
            near.clear();
        }
    }

    /// Gauss-Newton steps on the tensions, none of which becomes negative. Nothing where the routing has no
    /// shape under the first ones.
    pub(super) fn solve(
        &mut self,
        task: &Task<'_>,
        holes: &Holes,
        count: usize,
        tensions: &[f64],
    ) -> Option<Candidate> {
        // Cost |r|² and its slopes at the first tensions.
        self.route(task, holes, count);
        let mut tensions = tensions.to_vec();
        let mut here = self.evaluate(task, &tensions)?;
        let least = (ROUNDING * task.length()).powi(2);
        let mut damping = 0.0;
        for _ in 0..STEPS {
            if here.cost.value <= least || task.is_stopped() {
                break;
            }
            // Step on (DᵀD + damping) δ = −Dᵀr.
            self.near.clone_from(&here.strains);
            self.steps += 1;
            let moved = step(&here, &tensions, damping);
            let headway = |value: f64| 1.0 - value / here.cost.value;
            // Taken if it is nearer, else more damped.
            match self.evaluate(task, &moved) {
                Some(next) if next.cost.value < here.cost.value => {
                    let small = headway(next.cost.value) < HEADWAY;
                    (here, tensions, damping) = (next, moved, 0.1 * damping);
                    if small {
                        break;
                    }
                }
                other => {
                    // Rounding, or a step that was too long.
                    let level = other.is_some_and(|next| -headway(next.cost.value) < HEADWAY);
                    if level || damping > 1e6 {
                        break;
                    }
                    damping = (10.0 * damping).max(1e-2);
                }
            }
        }
        Some(Candidate { holes: holes.clone(), tensions, value: here.cost.value })
    }
}

/// Tensions after a damped step; those that would become negative, or are 0 and would stay so, are held at 0.
fn step(here: &CostAtTensions, tensions: &[f64], damping: f64) -> Vec<f64> {
    let count = tensions.len();
    let mut free: Vec<usize> =
        (0..count).filter(|&k| tensions[k] > 0.0 || here.cost.slope[k] < 0.0).collect();
    loop {
        let mut out = vec![0.0; count];
        let gram = DMatrix::from_fn(free.len(), free.len(), |a, b| {
            let own = here.cost.bend[free[a] * count + free[b]];
            if a == b { own * (1.0 + 1e-12 + damping) } else { own }
        });
        let right = DVector::from_fn(free.len(), |a, _| here.cost.slope[free[a]]);
        let Some(change) = gram.cholesky().map(|factor| factor.solve(&right)) else {
            return tensions.to_vec();
        };
        for (k, change) in free.iter().zip(change.iter()) {
            out[*k] = tensions[*k] - change;
        }
        let before = free.len();
        free.retain(|k| out[*k] >= 0.0);
        if free.len() == before {
            return out;
        }
    }
}
