//! Adjoint: gradients of what a shape is used for, by everything that it was made of.

use nalgebra::{DVector, Vector3, Vector6};

use super::{Change, Line, Sensitivity};
use crate::rod::elasticity::StiffnessChange;
use crate::rod::subsegment::Local;

impl Sensitivity<'_> {
    /// Gradient of `Σ positions·(disk centres) + Σ moments·(disk rotations)` by everything, world axes, one
    /// vector per disk.
    #[must_use]
    pub fn adjoint(&self, positions: &[Vector3<f64>], moments: &[Vector3<f64>]) -> Change {
        match self.plan().unknowns() {
            3 => self.adjoint_of::<3>(positions, moments),
            _ => self.adjoint_of::<4>(positions, moments),
        }
    }

    /// Adjoint for `D` unknowns per element: weights f of the disks are summed into y, then one solve.
    fn adjoint_of<const D: usize>(
        &self,
        positions: &[Vector3<f64>],
        moments: &[Vector3<f64>],
    ) -> Change {
        let plan = self.plan();
        let (size, n) = (plan.width(), plan.data.len());
        let mut out = self.no_change();
        let mut local = Local::default();
        let mut right = vec![0.0; self.at.strains.len()];
        // y: f summed from the tip into forces and moments on the strains. `wrench`: force and moment about the world's
        // origin of all that lies beyond.
        let mut wrench = Vector6::zeros();
        for i in (0..n).rev() {
            let at = self.at.frames[i + 1].translation;
            let moment = moments[i + 1] + at.cross(&positions[i + 1]);
            wrench += Vector6::new(
                positions[i + 1].x,
                positions[i + 1].y,
                positions[i + 1].z,
                moment.x,
                moment.y,
                moment.z,
            );
            // In the axes of the base disk.
            let base = &self.at.frames[i];
            let force: Vector3<f64> = wrench.fixed_rows::<3>(0).into();
            let about: Vector3<f64> = wrench.fixed_rows::<3>(3).into();
            let (force, about) = (
                base.rotation.tr_mul(&force),
                base.rotation.tr_mul(&(about - base.translation.cross(&force))),
            );
            let own = &self.at.strains[i * size..(i + 1) * size];
            local.prepare::<D>(plan.settings.subsegment, &plan.data[i], own);
            for (e, node) in local.nodes.iter().enumerate() {
                let about = about - node.end.translation.cross(&force);
                for c in 0..D {
                    right[i * size + D * e + c] =
                        node.sweep[c].dot(&force) + node.spin[c].dot(&about);
                }
            }
            // f·∂p/∂q: lengths move the disks at fixed strains.
            out.lengths[i] += local.end().translation.dot(&force) / plan.length(i);
        }
        // t = S⁻¹ A H⁻¹ y, x* = H⁻¹ (y − Aᵀ t).
        let mut lengths = DVector::zeros(self.at.count);
        self.solve(&mut right, &mut lengths);
        self.contract::<D>(&right, &lengths, &mut out);
        out
    }

    /// Adds `−w·dg − t·d(L − b)` as a gradient by everything.
    fn contract<const D: usize>(&self, w: &[f64], t: &DVector<f64>, out: &mut Change) {
        let plan = self.plan();
        let size = plan.width();
        let mut local = Local::default();
        let mut weights = vec![0.0; plan.pieces.len()];
        let mut whole = vec![0.0; self.at.displacements.len()];
        for (i, data) in plan.data.iter().enumerate() {
            let strains = &self.at.strains[i * size..(i + 1) * size];
            let w = &w[i * size..(i + 1) * size];
            local.prepare::<D>(plan.settings.subsegment, data, strains);
            // −x*·∂g/∂q of the energy.
            let (elasticity, mut stiffness) = (&data.elasticity, StiffnessChange::default());
            for (k, w) in w.iter().enumerate() {
                let c = k % D;
                elasticity.subtract_weighted_moment(c, strains[k], *w, &mut stiffness);
                if c < 3 {
                    let elements = plan.settings.elements as f64;
                    out.rest[i][c] += elasticity.moment_by_rest(c, *w) / elements;
                }
            }
            out.poisson_ratio += stiffness.shear / (1.0 + self.poisson_ratio());
            let mut share = stiffness.length;
            // −x*·∂g/∂q of the tensions' work, and t·∂(b − L)/∂q.
            for p in plan.starts[i]..plan.starts[i + 1] {
                let piece = &plan.pieces[p];
                let multiplier = self.at.equations[p].map_or(0.0, |row| t[row]);
                let at = Line::new(&local, piece);
                let by = at.gradient::<D>(&local, w, self.at.tensions[p], multiplier);
                out.holes[piece.tendon][i] += by.from;
                out.holes[piece.tendon][i + 1] += by.to;
                share += by.share;
                if self.at.equations[p].is_some() {
                    let bound = self.piece_bound(p);
                    let by = plan.settings.tendons.bound_weights(&bound, multiplier);
                    weights[p] += by.piece;
                    whole[piece.tendon] += by.tendon;
                    out.displacements[piece.tendon] += by.displacement;
                    out.stiffness[piece.tendon] -= by.strain * bound.strain;
                }
            }
            // Lengths: by the stiffness, and by the holes that they move.
            out.lengths[i] += share / plan.length(i);
        }
        // ∂b/∂q by the rest lengths of the pieces.
        for (weight, piece) in weights.iter_mut().zip(&plan.pieces) {
            *weight += whole[piece.tendon];
        }
        self.contract_rest::<D>(&weights, out);
    }

    /// Adds the gradient of weighted rest lengths of the pieces.
    fn contract_rest<const D: usize>(&self, weights: &[f64], out: &mut Change) {
        let plan = self.plan();
        let mut local = Local::default();
        for (i, data) in plan.data.iter().enumerate() {
            let rest = data.elasticity.rest()[..D].repeat(plan.settings.elements);
            local.prepare::<D>(plan.settings.subsegment, data, &rest);
            let end = local.end();
            for p in plan.starts[i]..plan.starts[i + 1] {
                let piece = &plan.pieces[p];
                let at = Line::new(&local, piece);
                let force = at.direction * weights[p];
                out.holes[piece.tendon][i] -= force;
                out.holes[piece.tendon][i + 1] += end.rotation.tr_mul(&force);
                out.lengths[i] += end.translation.dot(&force) / plan.length(i);
                for node in &local.nodes {
                    for c in 0..3 {
                        let velocity = node.velocity(c, &at.point).0;
                        out.rest[i][c] += velocity.dot(&force) / plan.settings.elements as f64;
                    }
                }
            }
        }
    }
}

/// Gradient by the holes and by the relative length of the subsegment.
struct ByPiece {
    from: Vector3<f64>,
    to: Vector3<f64>,
    share: f64,
}

impl Line {
    /// Gradient of `−tension w·d(∂L/∂w) − multiplier dL`.
    fn gradient<const D: usize>(
        &self,
        local: &Local,
        w: &[f64],
        tension: f64,
        multiplier: f64,
    ) -> ByPiece {
        let (u, end) = (self.direction, local.end());
        let (mut velocity, mut levers, mut share) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        for (e, node) in local.nodes.iter().enumerate() {
            let (mut swept, mut spun) = (Vector3::zeros(), Vector3::zeros());
            for c in 0..D {
                swept += node.sweep[c] * w[D * e + c];
                spun += node.spin[c] * w[D * e + c];
            }
            velocity += swept + spun.cross(&(self.point - node.end.translation));
            let by_lever = u.cross(&spun) * -tension;
            levers += by_lever;
            share += (end.translation - node.end.translation).dot(&by_lever);
            share -= tension * u.dot(&swept);
        }
        let across = velocity - u * u.dot(&velocity);
        let by_line = across * (-tension / self.length) - u * multiplier;
        share += end.translation.dot(&by_line);
        ByPiece { from: -by_line, to: end.rotation.tr_mul(&(by_line + levers)), share }
    }
}
