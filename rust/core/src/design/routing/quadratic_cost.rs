//! Squared distances of a routing as a quadratic function of its tensions.

use nalgebra::Vector3;

use super::task::Task;

/// Rounds of the descent over single tensions.
const ROUNDS: usize = 6;

/// Squared distances of the disks as a quadratic function of changes of the tensions.
#[derive(Clone, Default)]
pub(super) struct QuadraticCost {
    pub(super) value: f64,
    pub(super) slope: Vec<f64>,
    pub(super) bend: Vec<f64>,
    /// Displacements, and their rows of slopes; empty where they have no bounds.
    pulls: Vec<f64>,
    pull_slopes: Vec<f64>,
}

impl QuadraticCost {
    pub(super) fn of(task: &Task<'_>) -> Self {
        let count = task.tendons();
        let pulls = if task.bounds.is_some() { count } else { 0 };
        Self {
            value: 0.0,
            slope: vec![0.0; count],
            bend: vec![0.0; count * count],
            pulls: vec![0.0; pulls],
            pull_slopes: vec![0.0; pulls * count],
        }
    }

    /// Adds a disk that is `off` its place and moves at `velocity(k)` by tension k.
    pub(super) fn add(&mut self, off: &Vector3<f64>, velocity: &[Vector3<f64>]) {
        self.value += off.norm_squared();
        for (k, v) in velocity.iter().enumerate() {
            self.slope[k] += off.dot(v);
            for (l, w) in velocity[..=k].iter().enumerate() {
                let product = v.dot(w);
                self.bend[k * velocity.len() + l] += product;
                if l < k {
                    self.bend[l * velocity.len() + k] += product;
                }
            }
        }
    }

    /// Adds a subsegment's share of the displacements, and its rows of slopes.
    pub(super) fn add_pulls(&mut self, pulls: &[f64], slopes: &[f64]) {
        for (own, its) in self.pulls.iter_mut().zip(pulls) {
            *own += its;
        }
        for (own, its) in self.pull_slopes.iter_mut().zip(slopes) {
            *own += its;
        }
    }

    /// Adds displacements out of their bounds as distances: of a beginning, out of the same share of them.
    pub(super) fn penalise(&mut self, task: &Task<'_>, share: f64) {
        let count = self.slope.len();
        for (k, pull) in self.pulls.iter().enumerate() {
            let (low, high) = task.bound(k);
            let over = (pull - share * high).max(0.0) + (pull - share * low).min(0.0);
            let weight = (task.length() / task.radii[k][0]).powi(2);
            self.value += weight * over * over;
            if over != 0.0 {
                let row = &self.pull_slopes[k * count..(k + 1) * count];
                for (l, a) in row.iter().enumerate() {
                    self.slope[l] += weight * over * a;
                    for (m, b) in row.iter().enumerate() {
                        self.bend[l * count + m] += weight * a * b;
                    }
                }
            }
        }
    }

    /// The least value with changes within the window, and these changes.
    pub(super) fn least(&self, lower: &[f64], upper: &[f64], change: &mut [f64]) -> f64 {
        let count = change.len();
        change.fill(0.0);
        for _ in 0..if count == 1 { 1 } else { ROUNDS } {
            for k in 0..count {
                let bend = self.bend[k * count + k];
                if bend > 0.0 {
                    let others = (0..count).filter(|l| *l != k);
                    let slope: f64 =
                        others.map(|l| self.bend[k * count + l] * change[l]).sum::<f64>();
                    change[k] = (-(self.slope[k] + slope) / bend).clamp(lower[k], upper[k]);
                }
            }
        }
        let mut value = self.value;
        for k in 0..count {
            let row = &self.bend[k * count..(k + 1) * count];
            let turned: f64 = row.iter().zip(change.iter()).map(|(b, c)| b * c).sum();
            value += change[k] * (2.0 * self.slope[k] + turned);
        }
        value.max(0.0)
    }
}
