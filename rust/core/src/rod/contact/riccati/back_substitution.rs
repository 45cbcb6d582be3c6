//! Steps from the factors of a sweep.

use nalgebra::{Vector3, Vector6};

use super::Sweep;
use crate::rod::plan::Plan;
use crate::solve::dense::{backward, dot, forward};

impl Sweep {
    /// The step that undoes a slope, in `right`.
    pub(super) fn answer(&mut self, plan: &Plan) {
        let (size, count) = (plan.width(), self.taut.len());
        let mut slope = Vector6::zeros();
        let mut grown = vec![0.0; count];
        for i in (0..plan.data.len()).rev() {
            let range = i * size..(i + 1) * size;
            let column = &mut self.column[range.clone()];
            for (e, column) in range.clone().zip(&mut *column) {
                let reins = &self.reins[e * count..(e + 1) * count];
                *column = self.right[e] + self.twists[e].dot(&slope) + dot(reins, &grown);
            }
            forward(&self.factors[i * size * size..(i + 1) * size * size], size, column);
            for (e, z) in range.zip(&*column) {
                slope -= self.coupling[e] * *z;
                let growing = &self.growing[e * count..(e + 1) * count];
                for (grown, growing) in grown.iter_mut().zip(growing) {
                    *grown -= growing * z;
                }
            }
        }
        self.step.clear();
        self.step.resize(self.right.len(), 0.0);
        self.go_out(plan, 0, true);
    }

    /// The first-order change of the shape by a unit of a tendon's tension and of forces in the disks' potentials,
    /// slopes of twists.
    pub(in super::super) fn respond(
        &mut self,
        plan: &Plan,
        moment: &Vector3<f64>,
        tendon: usize,
        slopes: &[Vector6<f64>],
    ) {
        let size = plan.width();
        let mut beyond = Vector6::zeros();
        for i in (0..plan.data.len()).rev() {
            beyond += slopes[i + 1];
            let range = i * size..(i + 1) * size;
            let right = &mut self.right[range.clone()];
            for (right, twist) in right.iter_mut().zip(&self.twists[range]) {
                *right = twist.dot(&beyond);
            }
            for p in plan.starts[i]..plan.starts[i + 1] {
                if plan.pieces[p].tendon == tendon {
                    let row = &self.rows[p * size..(p + 1) * size];
                    right.iter_mut().zip(row).for_each(|(right, slope)| *right += slope);
                }
            }
        }
        self.answer(plan);
        if *moment != Vector3::zeros() {
            self.turn(plan, moment);
        }
    }

    /// Changes the step by what a moment on the tip, which has no potential, adds to the derivatives of the slope:
    /// `½ m · (ω_a × ω_b)`, of rank two and antisymmetric.
    pub(super) fn turn(&mut self, plan: &Plan, moment: &Vector3<f64>) {
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
            self.right.clone_from(&spins[k]);
            self.answer(plan);
            answers[k] = self.step.iter().map(|s| -s).collect();
        }
        let [u, v] = &spins;
        let [a, b] = &answers;
        let (c, p, q) = (size * dot(v, a), size * dot(v, b), size * dot(u, a));
        let (along, across) = (dot(v, &own), dot(u, &own));
        // At least 1, as c² ≤ p q.
        let least = 1.0 - c * c + p * q;
        let share =
            [((1.0 - c) * along + p * across) / least, ((1.0 + c) * across - q * along) / least];
        for (e, step) in self.step.iter_mut().enumerate() {
            *step = own[e] - size * (a[e] * share[0] - b[e] * share[1]);
        }
        self.displace(plan);
    }

    /// First-order displacements of the disks by the step.
    fn displace(&mut self, plan: &Plan) {
        let size = plan.width();
        let mut moved = Vector6::zeros();
        self.moved.truncate(1);
        for (twists, steps) in self.twists.chunks_exact(size).zip(self.step.chunks_exact(size)) {
            for (twist, step) in twists.iter().zip(steps) {
                moved += twist * *step;
            }
            self.moved.push(moved);
        }
    }

    /// The step from a subsegment on: by the gradient, or as an answer to the one that this subsegment has.
    fn go_out(&mut self, plan: &Plan, from: usize, by_gradient: bool) {
        let (size, count) = (plan.width(), self.taut.len());
        let mut moved = Vector6::zeros();
        let mut grown = vec![0.0; count];
        self.moved.clear();
        self.moved.resize(from + 1, moved);
        for i in from..plan.data.len() {
            let range = i * size..(i + 1) * size;
            let own = &mut self.step[range.clone()];
            if by_gradient || i > from {
                for a in 0..size {
                    let e = i * size + a;
                    let growing = &self.growing[e * count..(e + 1) * count];
                    own[a] = -(self.coupling[e].dot(&moved) + dot(growing, &grown));
                    if by_gradient {
                        own[a] -= self.column[e];
                    }
                }
                backward(&self.factors[i * size * size..(i + 1) * size * size], size, own);
            }
            for (e, own) in range.zip(own) {
                moved += self.twists[e] * *own;
                for (k, grown) in grown.iter_mut().enumerate() {
                    *grown += self.reins[e * count + k] * *own;
                }
            }
            self.moved.push(moved);
        }
    }

    /// The direction of negative curvature that starts in the unstable block, largest component 1.
    pub(in super::super) fn lead_out(&mut self, plan: &Plan, out: &mut Vec<f64>) {
        let Some(i) = self.unstable else { return };
        let size = plan.width();
        self.step.fill(0.0);
        self.step[i * size..(i + 1) * size].copy_from_slice(&self.escape);
        self.go_out(plan, i, false);
        let most = self.step.iter().fold(0.0_f64, |most, s| most.max(s.abs()));
        out.clear();
        out.extend(self.step.iter().map(|s| s / most));
    }

    /// What the step adds to the length of every tendon, to first order.
    pub(in super::super) fn lengthen(&self, plan: &Plan, out: &mut Vec<f64>) {
        let size = plan.width();
        out.clear();
        out.resize(plan.rest_lengths.len(), 0.0);
        for i in 0..plan.data.len() {
            let step = &self.step[i * size..(i + 1) * size];
            for p in plan.starts[i]..plan.starts[i + 1] {
                out[plan.pieces[p].tendon] += dot(&self.rows[p * size..(p + 1) * size], step);
            }
        }
    }
}

/// A direction of negative curvature of a small symmetric matrix: of its least eigenvalue, its largest
/// component positive.
pub(super) fn escape(matrix: &[f64], size: usize, out: &mut Vec<f64>) {
    let full = nalgebra::DMatrix::from_fn(size, size, |a, b| matrix[a.max(b) * size + a.min(b)]);
    out.clear();
    if full.iter().any(|x| !x.is_finite()) {
        out.resize(size, 0.0);
        return;
    }
    let eigen = full.symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    let vector = eigen.eigenvectors.column(least);
    let sign = vector[vector.iamax()].signum();
    out.extend(vector.iter().map(|x| x * sign));
}
