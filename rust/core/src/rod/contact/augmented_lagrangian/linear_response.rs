//! How a balanced shape goes on when a tension changes.

use nalgebra::{Vector3, Vector6};

use super::Descent;
use crate::rod::plan::Plan;

/// Answers that find the change of the contact forces, each by the conditions' softness nearer to it, and the share of
/// a point's way that may be left across a surface.
const ANSWERS: usize = 20;
const LEFT: f64 = 1e-12;

impl Descent {
    /// First-order displacement of every disk, a twist about the base's origin, by a unit of a tension, at the shape looked
    /// at last, where it was balanced; contacts that push stay.
    pub(in crate::rod) fn respond(
        &mut self,
        plan: &Plan,
        moment: &Vector3<f64>,
        tendon: usize,
    ) -> &[Vector6<f64>] {
        let pushing: Vec<usize> =
            (0..self.here.entries.len()).filter(|k| self.active[*k]).collect();
        let mut forces = vec![0.0; pushing.len()];
        let mut slopes = vec![Vector6::zeros(); plan.data.len() + 1];
        for _ in 0..ANSWERS {
            slopes.fill(Vector6::zeros());
            for (force, k) in forces.iter().zip(&pushing) {
                let entry = &self.here.entries[*k];
                let push = entry.near.gradient * -*force;
                let turn = entry.at.cross(&push);
                slopes[entry.key.0] += Vector6::new(turn.x, turn.y, turn.z, push.x, push.y, push.z);
            }
            self.sweep.respond(plan, moment, tendon, &slopes);
            let (mut left, mut way) = (0.0_f64, 0.0_f64);
            for (force, k) in forces.iter_mut().zip(&pushing) {
                let entry = &self.here.entries[*k];
                let closing = entry.closing(&self.sweep.moved);
                *force -= closing / entry.give;
                left = left.max(closing.abs());
            }
            for (moved, frame) in self.sweep.moved.iter().zip(&self.here.frames) {
                let spin = Vector3::new(moved[0], moved[1], moved[2]);
                let velocity = Vector3::new(moved[3], moved[4], moved[5]);
                way = way.max((velocity + spin.cross(&frame.translation)).norm());
            }
            if left <= LEFT * way {
                break;
            }
        }
        &self.sweep.moved
    }

    /// First-order displacements of the disks, twists about the base's origin, by the Newton step from where the descent
    /// ended, and what that adds to the lengths of the tendons.
    pub(in crate::rod) fn write_lack(
        &self,
        plan: &Plan,
        disks: &mut Vec<Vector6<f64>>,
        lengths: &mut Vec<f64>,
    ) {
        self.sweep.lengthen(plan, lengths);
        disks.clone_from(&self.sweep.moved);
    }

    /// What the last response adds to the length of every tendon.
    pub(in crate::rod) fn lengthened(&self, plan: &Plan, out: &mut Vec<f64>) {
        self.sweep.lengthen(plan, out);
    }
}
