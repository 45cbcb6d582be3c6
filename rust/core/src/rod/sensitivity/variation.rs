//! Variation of a shape by a change of what it is made of.

use nalgebra::{DVector, Vector3};

use super::{Change, Line, Sensitivity, Variation};
use crate::rod::elasticity::StiffnessChange;
use crate::rod::subsegment::Local;
use crate::rod::tendon_law::BoundRate;

impl Sensitivity<'_> {
    /// Variation of the shape by a change, its sizes those of [`Sensitivity::no_change`].
    #[must_use]
    pub fn forward(&self, change: &Change) -> Variation {
        match self.plan().unknowns() {
            3 => self.forward_of::<3>(change),
            _ => self.forward_of::<4>(change),
        }
    }

    /// Variation for `D` unknowns per element: −dg and −dr at fixed strains and tensions, then one solve.
    fn forward_of<const D: usize>(&self, change: &Change) -> Variation {
        let plan = self.plan();
        let size = plan.width();
        let mut local = Local::default();
        let mut right = vec![0.0; self.at.strains.len()];
        let mut lengths = DVector::zeros(self.at.count);
        // Changes of the rest lengths, of the pieces and of whole tendons.
        let rest = self.rest_change::<D>(change);
        let mut whole = vec![0.0; self.at.displacements.len()];
        for (piece, change) in plan.pieces.iter().zip(&rest) {
            whole[piece.tendon] += change;
        }
        for (i, data) in plan.data.iter().enumerate() {
            let strains = &self.at.strains[i * size..(i + 1) * size];
            local.prepare::<D>(plan.settings.subsegment, data, strains);
            let share = change.lengths[i] / plan.length(i);
            // −dg of the energy.
            let own = &mut right[i * size..(i + 1) * size];
            let count = plan.settings.elements as f64;
            let shear = change.poisson_ratio / (1.0 + self.poisson_ratio());
            let stiffness = StiffnessChange { length: share, shear };
            for (k, own) in own.iter_mut().enumerate() {
                let c = k % D;
                *own -= data.elasticity.moment_by_stiffness(c, strains[k], stiffness);
                if c < 3 {
                    *own += data.elasticity.moment_by_rest(c, change.rest[i][c]) / count;
                }
            }
            // −dg of the tensions' work: the direction u turns, and the hole's velocity changes.
            for p in plan.starts[i]..plan.starts[i + 1] {
                let piece = &plan.pieces[p];
                let holes = &change.holes[piece.tendon];
                let (from, to) = (holes[i], holes[i + 1]);
                let at = Line::new(&local, piece);
                let end = local.end();
                let turned = end.rotation * to;
                let moved = end.translation * share + turned - from;
                let direction = (moved - at.direction * at.direction.dot(&moved)) / at.length;
                // Lever and velocity of the hole, element by element.
                for (e, node) in local.nodes.iter().enumerate() {
                    let lever = at.point - node.end.translation;
                    let shifted = (end.translation - node.end.translation) * share + turned;
                    for c in 0..D {
                        let velocity = node.sweep[c] + node.spin[c].cross(&lever);
                        let change = node.sweep[c] * share + node.spin[c].cross(&shifted);
                        let slope = direction.dot(&velocity) + at.direction.dot(&change);
                        own[D * e + c] -= self.at.tensions[p] * slope;
                    }
                }
                // −dr = db − dL.
                if let Some(row) = self.at.equations[p] {
                    lengths[row] -= at.direction.dot(&moved);
                    let bound = self.piece_bound(p);
                    let rate = BoundRate {
                        piece: rest[p],
                        tendon: whole[piece.tendon],
                        displacement: change.displacements[piece.tendon],
                        strain: -bound.strain * change.stiffness[piece.tendon],
                    };
                    lengths[row] += plan.settings.tendons.bound_rate(&bound, &rate);
                }
            }
        }
        // H dx + Aᵀ dT = −dg, A dx − C dT = −dr.
        self.solve(&mut right, &mut lengths);
        self.variation::<D>(right, &lengths, change)
    }

    /// Change of the rest length of every piece.
    fn rest_change<const D: usize>(&self, change: &Change) -> Vec<f64> {
        let plan = self.plan();
        let mut out = Vec::with_capacity(plan.pieces.len());
        let mut local = Local::default();
        for (i, data) in plan.data.iter().enumerate() {
            let rest = data.elasticity.rest()[..D].repeat(plan.settings.elements);
            local.prepare::<D>(plan.settings.subsegment, data, &rest);
            let end = local.end();
            let share = change.lengths[i] / plan.length(i);
            let turn = change.rest[i] / plan.settings.elements as f64;
            for piece in &plan.pieces[plan.starts[i]..plan.starts[i + 1]] {
                let at = Line::new(&local, piece);
                let holes = &change.holes[piece.tendon];
                let mut moved = end.translation * share + end.rotation * holes[i + 1] - holes[i];
                for node in &local.nodes {
                    for c in 0..3 {
                        moved += node.velocity(c, &at.point).0 * turn[c];
                    }
                }
                out.push(at.direction.dot(&moved));
            }
        }
        out
    }

    /// Variation of strains, tensions and disks from the solved dx and dT.
    fn variation<const D: usize>(
        &self,
        strains: Vec<f64>,
        multipliers: &DVector<f64>,
        change: &Change,
    ) -> Variation {
        let plan = self.plan();
        let size = plan.width();
        let mut tensions = vec![0.0; self.at.displacements.len()];
        for p in plan.starts[0]..plan.starts[1] {
            if let Some(row) = self.at.equations[p] {
                tensions[plan.pieces[p].tendon] = multipliers[row] * plan.unit;
            }
        }
        // Velocities of the disks, one after another from the base on.
        let (mut velocity, mut spin) = (Vector3::zeros(), Vector3::zeros());
        let (mut velocities, mut spins) = (vec![velocity], vec![spin]);
        let mut local = Local::default();
        for (i, data) in plan.data.iter().enumerate() {
            let own = &self.at.strains[i * size..(i + 1) * size];
            local.prepare::<D>(plan.settings.subsegment, data, own);
            let end = local.end().translation;
            let mut moved = end * (change.lengths[i] / plan.length(i));
            let mut turned = Vector3::zeros();
            for (e, node) in local.nodes.iter().enumerate() {
                for c in 0..D {
                    let (v, s) = node.velocity(c, &end);
                    moved += v * strains[i * size + D * e + c];
                    turned += s * strains[i * size + D * e + c];
                }
            }
            let rotation = &self.at.frames[i].rotation;
            velocity += spin.cross(&(rotation * end)) + rotation * moved;
            spin += rotation * turned;
            velocities.push(velocity);
            spins.push(spin);
        }
        Variation { strains, tensions, velocities, spins }
    }
}
