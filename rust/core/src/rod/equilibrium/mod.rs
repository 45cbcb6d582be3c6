//! Equilibrium of the rod as a smooth function of its tensions, which an inverse descends on.
//!
//! Given tensions there is an equilibrium near the ones before, so that no set of displacements is infeasible and no
//! tendon slack.

mod contact;
mod free;
mod memory;

use std::fmt::Debug;

use nalgebra::{Matrix3, Vector3};

use crate::lie::Pose;
use crate::model::State;

pub(crate) use contact::ContactRod;
pub(crate) use free::FreeRod;

/// A velocity and an angular velocity.
pub(crate) type Twist = (Vector3<f64>, Vector3<f64>);

/// Robot that is solved at one set of tensions after another. Tensions are in the plan's unit.
pub(crate) trait Equilibrium: Debug {
    /// Forgets all but the shape without tensions, so that what follows does not depend on what went before.
    fn reset(&mut self);

    /// Starts from a shape with its tensions instead; false when it is no equilibrium.
    fn start_from(&mut self, start: &State) -> bool;

    /// Tensions of the equilibrium at hand.
    fn tensions(&self) -> &[f64];

    /// Solves for the equilibrium under tensions; false when none is found from the nearest known one.
    fn solve_at(&mut self, tensions: &[f64]) -> bool;

    /// Differentiates the equilibrium at hand by the tensions.
    fn differentiate(&mut self);

    /// Motion that [`Self::differentiate`] found last.
    fn motion(&self) -> &Motion;

    /// Mutable motion, for [`Motion::curve`].
    fn motion_mut(&mut self) -> &mut Motion;

    /// Change of a tendon's own length from rest, without what its tension stretches it by \[m\].
    fn displacement(&self, k: usize) -> f64;

    /// Derivative of a displacement by a tension.
    fn displacement_slope(&self, k: usize, by: usize) -> f64;

    /// Saves the equilibrium at hand in one of three slots for [`Self::restore`]: tensions do not always determine
    /// which one it is.
    fn save(&mut self, slot: usize);

    /// Starts from the equilibrium that was saved in a slot, instead of rest.
    fn restore(&mut self, slot: usize);

    /// Shape at hand, where tensions do not determine which one it is.
    fn state(&mut self) -> Option<State> {
        None
    }
}

/// Pose of the tool at an equilibrium, and its rates by the tensions.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    /// The tool in the base's frame.
    pub(crate) tool: Pose,
    /// Velocity of the tool and angular velocity by every tension, in the base's axes.
    pub(crate) columns: Vec<Twist>,
    /// Position of every disk from the first, in the base's frame.
    pub(crate) disks: Vec<Vector3<f64>>,
    /// Point of the tool that the velocities are those of.
    point: Vector3<f64>,
    /// Every subsegment's shares of them, with the tendon, and the end of those of each subsegment.
    shares: Vec<(usize, Twist)>,
    ends: Vec<usize>,
    /// Angular velocities of the middle of the subsegment at hand.
    spins: Vec<Vector3<f64>>,
}

impl Motion {
    pub(super) fn new() -> Self {
        Self {
            tool: Pose::identity(),
            columns: Vec::new(),
            disks: Vec::new(),
            point: Vector3::zeros(),
            shares: Vec::new(),
            ends: Vec::new(),
            spins: Vec::new(),
        }
    }

    /// Begins with a tool that so many tensions do not move.
    pub(super) fn begin(&mut self, tool: Pose, count: usize) {
        (self.tool, self.point) = (tool, tool.translation);
        self.disks.clear();
        self.columns.clear();
        self.columns.resize(count, (Vector3::zeros(), Vector3::zeros()));
        self.shares.clear();
        self.ends.clear();
    }

    /// Adds the share of the subsegment at hand in the tool's rate by a tension.
    pub(super) fn add(&mut self, tendon: usize, share: Twist) {
        let sum = &mut self.columns[tendon];
        *sum = (sum.0 + share.0, sum.1 + share.1);
        self.shares.push((tendon, share));
    }

    /// Ends the shares of the subsegment at hand.
    pub(super) fn next(&mut self) {
        self.ends.push(self.shares.len());
    }

    /// Places the disks beyond the base at their frames, moved by every subsegment's share of a motion of the tool.
    pub(super) fn place(&mut self, frames: &[Pose], shares: impl IntoIterator<Item = Twist>) {
        let mut sum = (Vector3::zeros(), Vector3::zeros());
        for (frame, share) in frames.iter().skip(1).zip(shares) {
            sum = (sum.0 + share.0, sum.1 + share.1);
            let at = frame.translation;
            self.disks.push(at + sum.0 + sum.1.cross(&(at - self.point)));
        }
    }

    /// Velocities of the disks by the tensions: all of the first disk, all of the next one.
    pub(crate) fn write_velocities(&self, out: &mut Vec<Vector3<f64>>) {
        let count = self.columns.len();
        out.clear();
        let mut sums = vec![(Vector3::zeros(), Vector3::zeros()); count];
        let mut start = 0;
        for (end, at) in self.ends.iter().zip(&self.disks) {
            for (tendon, share) in &self.shares[start..*end] {
                let sum = &mut sums[*tendon];
                *sum = (sum.0 + share.0, sum.1 + share.1);
            }
            let arm = at - self.point;
            out.extend(sums.iter().map(|(moved, spin)| moved + spin.cross(&arm)));
            start = *end;
        }
    }

    /// Second derivatives of the tool's place times a force and of its rotation times a moment, by two tensions, into
    /// two square matrices: `(a, b)` of the first summed with `(b, a)`; of the second, the change of column a by
    /// tension b. As if tensions turned every subsegment by as much as they do here: what is left out is that of its
    /// strains by the tensions, small unless it is about to buckle.
    pub(crate) fn curve(
        &mut self,
        force: &Vector3<f64>,
        moment: &Vector3<f64>,
        moved: &mut Vec<f64>,
        turned: &mut Vec<f64>,
    ) {
        self.turn(moved, |_, share| share.0.cross(force));
        self.turn(turned, |_, share| share.1.cross(moment));
    }

    /// Second derivatives of the disks' positions times a force on each, summed, by two tensions.
    pub(crate) fn curve_places(&mut self, forces: &[Vector3<f64>], moved: &mut Vec<f64>) {
        // Of all forces beyond every subsegment, with `(w × d) × f = d (w · f) − w (d · f)`.
        let mut beyond = vec![(Vector3::zeros(), Matrix3::zeros()); forces.len()];
        let (mut force, mut arms) = (Vector3::zeros(), Matrix3::zeros());
        for ((own, at), f) in beyond.iter_mut().zip(&self.disks).zip(forces).rev() {
            let arm = at - self.point;
            force += f;
            arms += arm * f.transpose() - Matrix3::from_diagonal_element(arm.dot(f));
            *own = (force, arms);
        }
        self.turn(moved, |i, share| share.0.cross(&beyond[i].0) + beyond[i].1 * share.1);
    }

    /// Sums the spins of every subsegment's middle by tension b, times what a share of a causes beyond: `(a, b)`.
    fn turn(&mut self, out: &mut Vec<f64>, swing: impl Fn(usize, &Twist) -> Vector3<f64>) {
        let count = self.columns.len();
        out.clear();
        out.resize(count * count, 0.0);
        let Self { shares, ends, spins, .. } = self;
        spins.clear();
        spins.resize(count, Vector3::zeros());
        let mut start = 0;
        for (i, end) in ends.iter().enumerate() {
            let own = &shares[start..*end];
            let halve = |spins: &mut [Vector3<f64>]| {
                for (tendon, share) in own {
                    spins[*tendon] += share.1 * 0.5;
                }
            };
            // Half a subsegment turns the other half.
            halve(spins);
            for (tendon, share) in own {
                let swung = swing(i, share);
                let row = &mut out[tendon * count..(tendon + 1) * count];
                row.iter_mut().zip(spins.iter()).for_each(|(out, spin)| *out += spin.dot(&swung));
            }
            halve(spins);
            start = *end;
        }
    }
}
