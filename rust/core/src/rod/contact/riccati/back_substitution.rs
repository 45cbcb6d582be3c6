//! Solves by the factors of a Riccati recursion.

use nalgebra::{Vector3, Vector6};

use super::Riccati;
use crate::rod::plan::Plan;
use crate::solve::dense::{backward, dot, forward};

impl Riccati {
    /// Solves for the step that undoes the slope in `rhs`: `L⁻¹` times it from the tip to the base, then the step back.
    pub(super) fn solve(&mut self, plan: &Plan) {
        let (width, count) = (plan.width(), self.active_tendons.len());
        let mut slope = Vector6::zeros();
        let mut tendon_slope = vec![0.0; count];
        for i in (0..plan.data.len()).rev() {
            let range = i * width..(i + 1) * width;
            let column = &mut self.column[range.clone()];
            for (e, column) in range.clone().zip(&mut *column) {
                let rows = &self.tendon_rows[e * count..(e + 1) * count];
                *column = self.rhs[e] + self.twists[e].dot(&slope) + dot(rows, &tendon_slope);
            }
            forward(&self.factors[i * width * width..(i + 1) * width * width], width, column);
            for (e, z) in range.zip(&*column) {
                slope -= self.n[e] * *z;
                let gain = &self.tendon_gain[e * count..(e + 1) * count];
                for (slope, gain) in tendon_slope.iter_mut().zip(gain) {
                    *slope -= gain * z;
                }
            }
        }
        self.step.clear();
        self.step.resize(self.rhs.len(), 0.0);
        self.sweep_to_tip(plan, 0, true);
    }

    /// Finds the first-order change of the shape by a unit of a tendon's tension and of forces in the disks'
    /// potentials, slopes of twists.
    pub(in super::super) fn respond_to_tension(
        &mut self,
        plan: &Plan,
        moment: &Vector3<f64>,
        tendon: usize,
        slopes: &[Vector6<f64>],
    ) {
        let width = plan.width();
        let mut beyond = Vector6::zeros();
        for i in (0..plan.data.len()).rev() {
            beyond += slopes[i + 1];
            let range = i * width..(i + 1) * width;
            let rhs = &mut self.rhs[range.clone()];
            for (rhs, twist) in rhs.iter_mut().zip(&self.twists[range]) {
                *rhs = twist.dot(&beyond);
            }
            for p in plan.starts[i]..plan.starts[i + 1] {
                if plan.pieces[p].tendon == tendon {
                    let row = &self.rows[p * width..(p + 1) * width];
                    rhs.iter_mut().zip(row).for_each(|(rhs, slope)| *rhs += slope);
                }
            }
        }
        self.solve(plan);
        if *moment != Vector3::zeros() {
            self.add_tip_moment(plan, moment);
        }
    }

    /// Changes the step by what a moment m on the tip, which has no potential, adds to the derivatives of the slope:
    /// `½ m · (ω_a × ω_b) = ½ |m| (u vᵀ - v uᵀ)`, of rank two and antisymmetric.
    pub(super) fn add_tip_moment(&mut self, plan: &Plan, moment: &Vector3<f64>) {
        // Two axes across m; u and v are the parts of the spins along them, a and b the answers to these.
        let size = 0.5 * moment.norm();
        let axis = moment.normalize();
        let across = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
        let axes = [across, axis.cross(&across)];
        let mut answers = [const { Vec::new() }; 2];
        let mut spins = [const { Vec::new() }; 2];
        let own = std::mem::take(&mut self.step);
        for k in 0..2 {
            let along = |twist: &Vector6<f64>| twist.fixed_rows::<3>(0).dot(&axes[k]);
            spins[k] = self.twists.iter().map(along).collect();
            self.rhs.clone_from(&spins[k]);
            self.solve(plan);
            answers[k] = self.step.iter().map(|s| -s).collect();
        }
        let [u, v] = &spins;
        let [a, b] = &answers;
        // Sherman, Morrison and Woodbury: a system of two equations.
        let (c, p, q) = (size * dot(v, a), size * dot(v, b), size * dot(u, a));
        let (along, across) = (dot(v, &own), dot(u, &own));
        // At least 1, as c² ≤ p q.
        let determinant = 1.0 - c * c + p * q;
        let share = [
            ((1.0 - c) * along + p * across) / determinant,
            ((1.0 + c) * across - q * along) / determinant,
        ];
        for (e, step) in self.step.iter_mut().enumerate() {
            *step = own[e] - size * (a[e] * share[0] - b[e] * share[1]);
        }
        self.displace_disks(plan);
    }

    /// First-order displacements of the disks by the step.
    fn displace_disks(&mut self, plan: &Plan) {
        let width = plan.width();
        let mut sum = Vector6::zeros();
        self.displacements.truncate(1);
        for (twists, steps) in self.twists.chunks_exact(width).zip(self.step.chunks_exact(width)) {
            for (twist, step) in twists.iter().zip(steps) {
                sum += twist * *step;
            }
            self.displacements.push(sum);
        }
    }

    /// Sweep from a subsegment to the tip, with the displacement x of every base: the step by the gradient, or the
    /// answer of all beyond to the step that this subsegment has.
    fn sweep_to_tip(&mut self, plan: &Plan, from: usize, by_gradient: bool) {
        let (width, count) = (plan.width(), self.active_tendons.len());
        let mut x = Vector6::zeros();
        let mut growth = vec![0.0; count];
        self.displacements.clear();
        self.displacements.resize(from + 1, x);
        for i in from..plan.data.len() {
            let range = i * width..(i + 1) * width;
            let own = &mut self.step[range.clone()];
            if by_gradient || i > from {
                for a in 0..width {
                    let e = i * width + a;
                    let gain = &self.tendon_gain[e * count..(e + 1) * count];
                    own[a] = -(self.n[e].dot(&x) + dot(gain, &growth));
                    if by_gradient {
                        own[a] -= self.column[e];
                    }
                }
                backward(&self.factors[i * width * width..(i + 1) * width * width], width, own);
            }
            for (e, own) in range.zip(own) {
                x += self.twists[e] * *own;
                for (k, growth) in growth.iter_mut().enumerate() {
                    *growth += self.tendon_rows[e * count + k] * *own;
                }
            }
            self.displacements.push(x);
        }
    }

    /// Writes the direction of negative curvature that starts in the unstable block, largest component 1.
    pub(in super::super) fn write_escape(&mut self, plan: &Plan, out: &mut Vec<f64>) {
        let Some(i) = self.unstable else { return };
        let width = plan.width();
        self.step.fill(0.0);
        self.step[i * width..(i + 1) * width].copy_from_slice(&self.block_escape);
        self.sweep_to_tip(plan, i, false);
        let most = self.step.iter().fold(0.0_f64, |most, s| most.max(s.abs()));
        out.clear();
        out.extend(self.step.iter().map(|s| s / most));
    }

    /// Writes the first-order change of every tendon's length by the step.
    pub(in super::super) fn write_length_changes(&self, plan: &Plan, out: &mut Vec<f64>) {
        let width = plan.width();
        out.clear();
        out.resize(plan.rest_lengths.len(), 0.0);
        for i in 0..plan.data.len() {
            let step = &self.step[i * width..(i + 1) * width];
            for p in plan.starts[i]..plan.starts[i + 1] {
                out[plan.pieces[p].tendon] += dot(&self.rows[p * width..(p + 1) * width], step);
            }
        }
    }
}
