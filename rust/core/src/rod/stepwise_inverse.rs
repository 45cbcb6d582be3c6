//! Stepwise inverse: strains that take a rod through wanted points, and the rest shape that has them under tension.
//!
//! With the final strains w and the tensions T known, every subsegment's equilibrium gives its rest shape:
//! `K (w − w_rest) + Σ T ∂L/∂w = 0`. So the rod is solved from the base on, subsegment by subsegment: each one bends to
//! point its end at the wanted point, and turns so that its rest shape has the wanted twist. One equation per tendon is
//! left for T.

use nalgebra::{Matrix3, Vector3};

use super::plan::Plan;
use super::subsegment::{Derivatives, Local};
use crate::lie::Pose;

/// Stepwise inverse: strains, rest shape and what the tendons are longer.
#[derive(Clone, Debug, Default)]
pub(crate) struct StepwiseInverse {
    pub(crate) strains: Vec<Vector3<f64>>,
    pub(crate) rest: Vec<Vector3<f64>>,
    /// Difference of each tendon's length from that at rest \[m\].
    pub(crate) elongations: Vec<f64>,
    local: Local,
    hessian: Vec<f64>,
    rows: Vec<f64>,
    lengths: Vec<f64>,
}

/// Newton steps of one subsegment at most, its residual that counts as solved, and the one below which it is rounding
/// once it falls no longer.
const STEPS: usize = 30;
const SOLVED: f64 = 1e-15;
const ROUNDING: f64 = 1e-13;
/// No strain moves further in one step \[rad\].
const STEP: f64 = 0.5;

impl StepwiseInverse {
    /// Solves from the base frame on for `targets` (one per disk from the first) and rest twists under tensions in the
    /// plan's unit. False when a subsegment has no solution. One element per subsegment, without elongation.
    pub(crate) fn solve(
        &mut self,
        plan: &Plan,
        base: &Pose,
        targets: &[Vector3<f64>],
        twists: &[f64],
        tensions: &[f64],
    ) -> bool {
        let active = vec![true; tensions.len()];
        self.strains.clear();
        self.rest.clear();
        self.elongations.clear();
        self.elongations.resize(tensions.len(), 0.0);
        let mut frame = *base;
        for (i, target) in targets.iter().enumerate() {
            let wanted = frame.rotation.tr_mul(&(target - frame.translation));
            let Some((strain, rest)) =
                self.solve_subsegment(plan, i, &wanted, twists[i], tensions, &active)
            else {
                return false;
            };
            frame = frame.compose(&self.local.end());
            self.strains.push(strain);
            self.rest.push(rest);
            self.add_lengths(plan, i, 1.0);
            self.local.place::<3>(plan.settings.subsegment, &plan.data[i], rest.as_slice());
            self.add_lengths(plan, i, -1.0);
        }
        true
    }

    fn add_lengths(&mut self, plan: &Plan, i: usize, sign: f64) {
        let end = self.local.end();
        for piece in &plan.pieces[plan.starts[i]..plan.starts[i + 1]] {
            let length = (end.transform(&piece.to) - piece.from).norm();
            self.elongations[piece.tendon] += sign * length;
        }
    }

    /// Strain and rest strain of the subsegment whose end lies in the direction of `wanted`: Newton's method on the
    /// two components of the end across that direction and on the moment about z.
    fn solve_subsegment(
        &mut self,
        plan: &Plan,
        i: usize,
        wanted: &Vector3<f64>,
        twist: f64,
        tensions: &[f64],
        active: &[bool],
    ) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let data = &plan.data[i];
        let elasticity = &data.elasticity;
        let pieces = &plan.pieces[plan.starts[i]..plan.starts[i + 1]];
        // The arc from the base to the wanted point is the start: it turns by twice the angle of its chord.
        let direction = wanted.try_normalize(0.0)?;
        let across = wanted.xy().norm();
        let angle = 2.0 * across.atan2(wanted.z);
        let mut strain = if across > 0.0 {
            Vector3::new(-wanted.y, wanted.x, 0.0) * (angle / across)
        } else {
            Vector3::zeros()
        };
        // Two axes across the direction.
        let first = if direction.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
        let first = first.cross(&direction).normalize();
        let second = direction.cross(&first);
        let mut gradient = [0.0; 3];
        self.hessian.resize(9, 0.0);
        self.rows.resize(3 * pieces.len(), 0.0);
        self.lengths.resize(pieces.len(), 0.0);
        let mut before = f64::INFINITY;
        for _ in 0..STEPS {
            self.local.place::<3>(plan.settings.subsegment, data, strain.as_slice());
            let mut out = Derivatives {
                gradient: &mut gradient,
                hessian: &mut self.hessian,
                rows: &mut self.rows,
                lengths: &mut self.lengths,
            };
            self.local.differentiate::<3, true>(
                data,
                pieces,
                strain.as_slice(),
                tensions,
                active,
                &mut out,
            );
            // The gradient counts from this subsegment's own rest twist; the moment from the wanted one.
            let moment = elasticity.strain_under(2, elasticity.with_rest(2, gradient[2], twist));
            // Residual: components of the end across the direction, relative to the length, and that moment.
            let node = &self.local.nodes[0];
            let end = self.local.end().translation / data.length;
            let residual = Vector3::new(first.dot(&end), second.dot(&end), moment);
            let size = residual.amax();
            if size.is_nan() {
                return None;
            }
            // Solved: the rest strain for which the gradient is zero. At rounding the residual no longer falls.
            if size <= SOLVED || (size < ROUNDING && size >= 0.5 * before) {
                let rest = Vector3::from_fn(|c, _| elasticity.balanced_rest(c, gradient[c]));
                return Some((strain, Vector3::new(rest.x, rest.y, twist)));
            }
            before = size;
            // Newton step; the moment changes with the Hessian's last row.
            let sweep = Matrix3::from_columns(&node.sweep[..3]) / data.length;
            let h = &self.hessian;
            let jacobian = Matrix3::from_rows(&[
                first.transpose() * sweep,
                second.transpose() * sweep,
                Vector3::new(h[6], h[7], h[8]).map(|h| elasticity.strain_under(2, h)).transpose(),
            ]);
            let step = jacobian.try_inverse()? * residual;
            // No strain moves by more than a longest step.
            let share = 1.0_f64.min(STEP / step.amax().max(f64::MIN_POSITIVE));
            strain -= step * share;
        }
        None
    }
}
