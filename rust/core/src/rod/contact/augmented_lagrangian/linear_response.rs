//! Linear response of a shape in equilibrium to a change of a tension.

use nalgebra::{Vector3, Vector6};

use super::Minimizer;
use crate::rod::plan::Plan;

/// Solves that find the change of the contact forces, each nearer to it by the conditions' softness, and the share of
/// a point's way that may be left across a surface.
const MOST_SOLVES: usize = 20;
const LEFT_ACROSS: f64 = 1e-12;

impl Minimizer {
    /// First-order displacement of every disk, a twist about the base's origin, by a unit of a tension, at the shape
    /// that was linearised last, in equilibrium; contacts that push stay.
    pub(in crate::rod) fn tension_response(
        &mut self,
        plan: &Plan,
        moment: &Vector3<f64>,
        tendon: usize,
    ) -> &[Vector6<f64>] {
        // Contacts that push, and the changes of their forces, of which nothing is known at first.
        let pushing: Vec<usize> =
            (0..self.current.constraints.len()).filter(|k| self.active[*k]).collect();
        let mut forces = vec![0.0; pushing.len()];
        let mut slopes = vec![Vector6::zeros(); plan.data.len() + 1];
        for _ in 0..MOST_SOLVES {
            // The response under these changes of the contact forces.
            slopes.fill(Vector6::zeros());
            for (force, k) in forces.iter().zip(&pushing) {
                let own = &self.current.constraints[*k];
                let push = own.near.gradient * -*force;
                let turn = own.position.cross(&push);
                slopes[own.key.0] += Vector6::new(turn.x, turn.y, turn.z, push.x, push.y, push.z);
            }
            self.riccati.respond_to_tension(plan, moment, tendon, &slopes);
            // The forces that undo what is left of the gaps' changes.
            let (mut left, mut way) = (0.0_f64, 0.0_f64);
            for (force, k) in forces.iter_mut().zip(&pushing) {
                let own = &self.current.constraints[*k];
                let gap_change = own.gap_change(&self.riccati.displacements);
                *force -= gap_change / own.compliance;
                left = left.max(gap_change.abs());
            }
            // Done when it is little against the way of the disks.
            for (twist, frame) in self.riccati.displacements.iter().zip(&self.current.frames) {
                let spin = Vector3::new(twist[0], twist[1], twist[2]);
                let velocity = Vector3::new(twist[3], twist[4], twist[5]);
                way = way.max((velocity + spin.cross(&frame.translation)).norm());
            }
            if left <= LEFT_ACROSS * way {
                break;
            }
        }
        &self.riccati.displacements
    }

    /// Writes first-order displacements of the disks, twists about the base's origin, by the Newton step from where the
    /// minimisation ended, and the changes of the tendons' lengths.
    pub(in crate::rod) fn write_last_step(
        &self,
        plan: &Plan,
        disks: &mut Vec<Vector6<f64>>,
        lengths: &mut Vec<f64>,
    ) {
        self.riccati.write_length_changes(plan, lengths);
        disks.clone_from(&self.riccati.displacements);
    }

    /// Writes the changes of the tendons' lengths by the last response.
    pub(in crate::rod) fn write_length_response(&self, plan: &Plan, out: &mut Vec<f64>) {
        self.riccati.write_length_changes(plan, out);
    }
}
