//! Strains that take a rod through wanted places, and the rest shape that has them under tension.
//!
//! With the final strains ω and the tensions T known, every subsegment's balance gives its rest shape:
//! `K (ω − ω_rest) + Σ T ∂L/∂ω = 0`. So a rod is marched from the base, each subsegment bent to point its end at
//! the wanted place and twisted so that its rest shape is not; one equation per tendon is left for T.

use nalgebra::{Matrix3, Vector3};

use super::plan::Plan;
use super::subsegment::{Derivatives, Local};
use crate::lie::Pose;

/// A march: strains, rest shape, places and the tendons' lengths.
#[derive(Clone, Debug, Default)]
pub(crate) struct March {
    pub(crate) strains: Vec<Vector3<f64>>,
    pub(crate) rest: Vec<Vector3<f64>>,
    /// What each tendon is longer than at rest \[m\].
    pub(crate) stretch: Vec<f64>,
    local: Local,
    hessian: Vec<f64>,
    rows: Vec<f64>,
    lengths: Vec<f64>,
}

/// Newton steps of one subsegment, and when its direction is met.
const STEPS: usize = 30;
const MET: f64 = 1e-15;

impl March {
    /// Marches from the base frame to `targets` (one per disk from the first) under tensions in the plan's
    /// unit. False when a subsegment finds no way. One element per subsegment, without elongation.
    pub(crate) fn go(
        &mut self,
        plan: &Plan,
        base: &Pose,
        targets: &[Vector3<f64>],
        twists: &[f64],
        tensions: &[f64],
    ) -> bool {
        let taut = vec![true; tensions.len()];
        self.strains.clear();
        self.rest.clear();
        self.stretch.clear();
        self.stretch.resize(tensions.len(), 0.0);
        let mut frame = *base;
        for (i, target) in targets.iter().enumerate() {
            let wanted = frame.rotation.tr_mul(&(target - frame.translation));
            let Some((strain, rest)) = self.bend(plan, i, &wanted, twists[i], tensions, &taut)
            else {
                return false;
            };
            frame = frame.compose(&self.local.end());
            self.strains.push(strain);
            self.rest.push(rest);
            self.measure(plan, i, 1.0);
            self.local.place::<3>(plan.settings.subsegment, &plan.data[i], rest.as_slice());
            self.measure(plan, i, -1.0);
        }
        true
    }

    fn measure(&mut self, plan: &Plan, i: usize, sign: f64) {
        let end = self.local.end();
        for piece in &plan.pieces[plan.starts[i]..plan.starts[i + 1]] {
            let length = (end.transform(&piece.to) - piece.from).norm();
            self.stretch[piece.tendon] += sign * length;
        }
    }

    /// Strain and rest strain of the subsegment whose end lies in the direction of `wanted`.
    fn bend(
        &mut self,
        plan: &Plan,
        i: usize,
        wanted: &Vector3<f64>,
        twist: f64,
        tensions: &[f64],
        taut: &[bool],
    ) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let data = &plan.data[i];
        let elasticity = &data.elasticity;
        let pieces = &plan.pieces[plan.starts[i]..plan.starts[i + 1]];
        let direction = wanted.try_normalize(0.0)?;
        let across = wanted.xy().norm();
        let angle = 2.0 * across.atan2(wanted.z);
        let mut strain = if across > 0.0 {
            Vector3::new(-wanted.y, wanted.x, 0.0) * (angle / across)
        } else {
            Vector3::zeros()
        };
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
                taut,
                &mut out,
            );
            // Slopes of energy and tendons count from this subsegment's own rest twist: from the wanted one.
            let off = elasticity.strain_under(2, elasticity.with_rest(2, gradient[2], twist));
            let node = &self.local.nodes[0];
            let end = self.local.end().translation / data.length;
            let residual = Vector3::new(first.dot(&end), second.dot(&end), off);
            let size = residual.amax();
            if size.is_nan() {
                return None;
            }
            // At rounding the residual no longer falls.
            if size <= MET || (size < 1e-13 && size >= 0.5 * before) {
                let rest = Vector3::from_fn(|c, _| elasticity.balanced_rest(c, gradient[c]));
                return Some((strain, Vector3::new(rest.x, rest.y, twist)));
            }
            before = size;
            let sweep = Matrix3::from_columns(&node.sweep[..3]) / data.length;
            let h = &self.hessian;
            let jacobian = Matrix3::from_rows(&[
                first.transpose() * sweep,
                second.transpose() * sweep,
                Vector3::new(h[6], h[7], h[8]).map(|h| elasticity.strain_under(2, h)).transpose(),
            ]);
            let step = jacobian.try_inverse()? * residual;
            let share = 1.0_f64.min(0.5 / step.amax().max(f64::MIN_POSITIVE));
            strain -= step * share;
        }
        None
    }
}
