//! One subsegment between chosen holes: its shape under given tensions, and how tensions change it.
//!
//! Tensions known, a subsegment's balance asks for nothing beyond its own two disks, so that a search over
//! holes solves each of their pairs once.

use nalgebra::{Matrix6xX, Vector3, Vector6};

use super::degenerate_rest::aside;
use super::dual_newton::EASY;
use super::newton_system::{Chain, JUMP};
use super::plan::Plan;
use crate::lie::Pose;
use crate::solve::dense::{backward, dot};

/// Newton steps per load step, and load steps are not made shorter.
const PATIENCE: usize = 20;
const SHORTEST: f64 = 1e-2;

/// A subsegment whose tendons' holes may be moved, and the shape that it was solved for last.
#[derive(Clone, Debug)]
pub(crate) struct Stage {
    part: Plan,
    /// The robot's tendons that run through it.
    tendons: Vec<usize>,
    chain: Chain,
    reached: Vec<f64>,
    /// Equilibria that were asked for.
    pub(crate) solved: usize,
}

impl Stage {
    /// Of subsegment `i`, its tendons through the robot's own holes.
    pub(crate) fn new(plan: &Plan, i: usize) -> Self {
        let pieces = &plan.pieces[plan.starts[i]..plan.starts[i + 1]];
        let tendons: Vec<usize> = pieces.iter().map(|piece| piece.tendon).collect();
        let mut chain = Chain::default();
        chain.bounds = vec![f64::INFINITY; tendons.len()];
        chain.taut = vec![true; tendons.len()];
        Self { part: plan.part(i), tendons, chain, reached: Vec::new(), solved: 0 }
    }

    /// The robot's tendons that run through it.
    pub(crate) fn tendons(&self) -> &[usize] {
        &self.tendons
    }

    /// Whether another subsegment bends in the same way between the same holes.
    pub(crate) fn alike(&self, other: &Self) -> bool {
        let (own, its) = (&self.part.data[0], &other.part.data[0]);
        (own.length, own.elasticity) == (its.length, its.elasticity)
            && self.tendons == other.tendons
    }

    /// Puts the holes of the tendons that run through it, each robot's tendon's from the base disk's frame to
    /// the next one's.
    pub(crate) fn route(&mut self, hole: impl Fn(usize) -> (Vector3<f64>, Vector3<f64>)) {
        for (piece, tendon) in self.part.pieces.iter_mut().zip(&self.tendons) {
            (piece.from, piece.to) = hole(*tendon);
        }
    }

    /// Strains of the last solve.
    pub(crate) fn strains(&self) -> &[f64] {
        &self.chain.strains
    }

    /// Goes to the minimum under the robot's tensions (in the plan's unit): from strains near it, or along growing
    /// tensions from rest. False where there is none.
    pub(crate) fn bend(&mut self, tensions: &[f64], near: &[f64]) -> bool {
        self.solved += 1;
        self.chain.rest(&self.part);
        if near.len() == self.chain.strains.len() {
            self.chain.strains.copy_from_slice(near);
            self.load(tensions, 1.0);
            if self.settle() {
                return true;
            }
            self.chain.rest(&self.part);
        }
        self.climb(tensions) || {
            // A tendon that crosses sides may go either way.
            self.chain.rest(&self.part);
            self.load(tensions, 1.0);
            aside(&self.part, &mut self.chain) && self.settle()
        }
    }

    fn load(&mut self, tensions: &[f64], share: f64) {
        for (own, tendon) in self.chain.tensions.iter_mut().zip(&self.tendons) {
            *own = share * tensions[*tendon];
        }
    }

    fn climb(&mut self, tensions: &[f64]) -> bool {
        let (mut at, mut stride) = (0.0, 1.0_f64);
        self.reached.clone_from(&self.chain.strains);
        while at < 1.0 {
            let next = (at + stride).min(1.0);
            self.load(tensions, next);
            if self.settle() {
                (at, stride) = (next, 2.0 * stride);
                self.reached.clone_from(&self.chain.strains);
            } else {
                self.chain.strains.clone_from(&self.reached);
                stride = 0.5 * (next - at);
                if stride < SHORTEST {
                    return false;
                }
            }
        }
        true
    }

    /// Newton's method from the point at hand; whether it ended at a minimum.
    fn settle(&mut self) -> bool {
        let mut moved = 0.0;
        for _ in 0..PATIENCE {
            let left = self.chain.assemble(&self.part, EASY);
            moved += left.moved;
            if left.worst() <= self.part.settings.tolerance {
                return left.stable;
            }
            if moved > JUMP || !left.worst().is_finite() || !self.chain.solve(&self.part, 0.0) {
                return false;
            }
            for (strain, step) in self.chain.strains.iter_mut().zip(&self.chain.step) {
                *strain += step;
            }
        }
        false
    }

    /// Frame of the next disk in the base disk's.
    pub(crate) fn end(&self) -> Pose {
        self.chain.local.end()
    }

    /// Velocity and angular velocity of that frame by each of its tendons' tensions, base disk's axes, one
    /// column per tendon that runs through.
    pub(crate) fn rates(&self) -> Matrix6xX<f64> {
        let (size, width) = (self.part.width(), self.part.unknowns());
        let end = self.end().translation;
        let mut rates = Matrix6xX::zeros(self.tendons.len());
        for (image, mut rate) in self.chain.images.chunks_exact(size).zip(rates.column_iter_mut()) {
            let mut turned = image.to_vec();
            backward(&self.chain.factors, size, &mut turned);
            for (e, node) in self.chain.local.nodes.iter().enumerate() {
                for c in 0..width {
                    let (velocity, spin) = node.velocity(c, &end);
                    let by = -turned[width * e + c];
                    rate +=
                        Vector6::new(velocity.x, velocity.y, velocity.z, spin.x, spin.y, spin.z)
                            * by;
                }
            }
        }
        rates
    }

    /// What the tensions shorten and stretch the robot's tendons by here, elasticity apart, and how that changes with
    /// each tension, row by row: zeros for those of its `count` tendons that end before.
    pub(crate) fn pulls(&mut self, count: usize) -> (Vec<f64>, Vec<f64>) {
        let (mut pulls, mut slopes) = (vec![0.0; count], vec![0.0; count * count]);
        let size = self.part.width();
        let end = self.end();
        let at_rest = self.part.lengths_at_rest();
        for (s, (piece, rest)) in self.part.pieces.iter().zip(at_rest).enumerate() {
            let k = self.tendons[s];
            // Elasticity is in proportion to the length at rest.
            let give = rest * self.part.compliance[s] / self.part.rest_lengths[s];
            let length = (end.transform(&piece.to) - piece.from).norm();
            pulls[k] = length - rest - give * self.chain.tensions[s];
            slopes[k * count + k] = -give;
            let image = &self.chain.images[s * size..(s + 1) * size];
            for (other, l) in self.chain.images.chunks_exact(size).zip(&self.tendons) {
                slopes[k * count + l] -= dot(image, other);
            }
        }
        (pulls, slopes)
    }
}
