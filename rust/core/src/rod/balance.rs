//! The rod as a smooth function of its tensions: what an inverse descends on.
//!
//! Given tensions there is a balance near the ones before, so that no set of displacements is infeasible and no
//! tendon slack.

use std::fmt::Debug;

use nalgebra::Vector3;

use crate::lie::Pose;
use crate::model::State;
use crate::obstacle::Fault;

/// A velocity and an angular velocity.
pub(crate) type Twist = (Vector3<f64>, Vector3<f64>);

/// A robot that goes from one balance under tensions to the next. Tensions are in the plan's unit.
pub(crate) trait Balance: Debug {
    /// Forgets all but the shape without tensions, so that what follows does not depend on what went before.
    fn rest(&mut self);

    /// Puts a shape with its tensions in place of that; false when it is no balance.
    fn begin(&mut self, start: &State) -> bool;

    /// Tensions of the balance at hand.
    fn tensions(&self) -> &[f64];

    /// Goes to the balance under tensions; false when none is found from the nearest known one.
    fn go(&mut self, tensions: &[f64]) -> bool;

    /// Finds how the balance at hand moves.
    fn differentiate(&mut self);

    /// What [`Self::differentiate`] found last.
    fn motion(&self) -> &Motion;

    /// The same, for [`Motion::curve`].
    fn motion_mut(&mut self) -> &mut Motion;

    /// Change of a tendon's own length from rest, without what its tension stretches it by \[m\].
    fn displacement(&self, k: usize) -> f64;

    /// Its derivative by a tension.
    fn displacement_slope(&self, k: usize, by: usize) -> f64;

    /// Keeps the balance at hand in one of two places for [`Self::go_back`], where tensions do not say which one it
    /// is.
    fn keep(&mut self, _place: usize) {}

    /// Puts the balance that was kept in place of that at rest.
    fn go_back(&mut self, _place: usize) {}

    /// The shape at hand, where tensions do not say which one it is.
    fn state(&mut self) -> Option<State> {
        None
    }

    /// What a function of an obstacle ended the work with, if it did.
    fn take_fault(&mut self) -> Option<Fault> {
        None
    }
}

/// Where the tool is at a balance, and how tensions move it.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    /// The tool in the base's frame.
    pub(crate) tool: Pose,
    /// Velocity of the tool and angular velocity by every tension, in the base's axes.
    pub(crate) columns: Vec<Twist>,
    /// Every subsegment's shares of them, with the tendon, and where each subsegment's end.
    shares: Vec<(usize, Twist)>,
    ends: Vec<usize>,
    /// Angular velocities of the subsegment's middle that is looked at.
    spins: Vec<Vector3<f64>>,
}

impl Motion {
    pub(super) fn new() -> Self {
        Self {
            tool: Pose::identity(),
            columns: Vec::new(),
            shares: Vec::new(),
            ends: Vec::new(),
            spins: Vec::new(),
        }
    }

    /// Begins with a tool that so many tensions do not move.
    pub(super) fn begin(&mut self, tool: Pose, count: usize) {
        self.tool = tool;
        self.columns.clear();
        self.columns.resize(count, (Vector3::zeros(), Vector3::zeros()));
        self.shares.clear();
        self.ends.clear();
    }

    /// Adds what a tension moves the tool by in the subsegment at hand.
    pub(super) fn add(&mut self, tendon: usize, share: Twist) {
        let sum = &mut self.columns[tendon];
        *sum = (sum.0 + share.0, sum.1 + share.1);
        self.shares.push((tendon, share));
    }

    /// On to the next subsegment.
    pub(super) fn next(&mut self) {
        self.ends.push(self.shares.len());
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
        let count = self.columns.len();
        for matrix in [&mut *moved, &mut *turned] {
            matrix.clear();
            matrix.resize(count * count, 0.0);
        }
        let Self { shares, ends, spins, .. } = self;
        spins.clear();
        spins.resize(count, Vector3::zeros());
        let mut start = 0;
        for end in ends {
            let own = &shares[start..*end];
            let halve = |spins: &mut [Vector3<f64>]| {
                for (tendon, share) in own {
                    spins[*tendon] += share.1 * 0.5;
                }
            };
            // Half a subsegment turns the other half.
            halve(spins);
            for (tendon, share) in own {
                let (swung, spun) = (share.0.cross(force), share.1.cross(moment));
                let row = tendon * count..(tendon + 1) * count;
                let rows = moved[row.clone()].iter_mut().zip(&mut turned[row]);
                for ((moved, turned), spin) in rows.zip(spins.iter()) {
                    *moved += spin.dot(&swung);
                    *turned += spin.dot(&spun);
                }
            }
            halve(spins);
            start = *end;
        }
    }
}
