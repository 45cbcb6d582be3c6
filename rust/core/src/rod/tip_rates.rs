//! Rates of a point at the tip of a solved rod by its strains, in one pass along it.

use nalgebra::Vector3;

use super::plan::Plan;
use super::subsegment::Local;
use crate::lie::Pose;
use crate::solve::dense::forward;

/// A solved rod: strains, factors of the subsegments' Hessians, and the frame of every disk.
pub(super) struct SolvedRod<'a> {
    pub(super) strains: &'a [f64],
    pub(super) factors: &'a [f64],
    pub(super) frames: &'a [Pose],
}

/// Buffers of a pass.
#[derive(Clone, Debug, Default)]
pub(super) struct TipRates {
    local: Local,
    rows: Vec<f64>,
}

impl TipRates {
    /// Calls `each(i, rows)` for every subsegment: six rows `L⁻¹ pᵀ`, p the velocity of a point that moves with
    /// the tip, then its angular velocity, by the subsegment's strains, in the axes of the frames. The rows times
    /// a whitened row of a tendon are then `p H⁻¹ aᵀ`.
    pub(super) fn for_each_subsegment<const D: usize>(
        &mut self,
        plan: &Plan,
        at: &SolvedRod<'_>,
        point: &Vector3<f64>,
        mut each: impl FnMut(usize, &[f64]),
    ) {
        let size = plan.width();
        let Self { local, rows } = self;
        rows.resize(6 * size, 0.0);
        for (i, data) in plan.data.iter().enumerate() {
            let strains = &at.strains[i * size..(i + 1) * size];
            local.prepare::<D>(plan.settings.subsegment, data, strains);
            let base = &at.frames[i];
            let arm = base.rotation.tr_mul(&(point - base.translation));
            for (e, node) in local.nodes.iter().enumerate() {
                for c in 0..D {
                    let (moved, spin) = node.velocity(c, &arm);
                    let (moved, spin) = (base.rotation * moved, base.rotation * spin);
                    for k in 0..3 {
                        rows[k * size + D * e + c] = moved[k];
                        rows[(k + 3) * size + D * e + c] = spin[k];
                    }
                }
            }
            let factor = &at.factors[i * size * size..(i + 1) * size * size];
            for row in rows.chunks_exact_mut(size) {
                forward(factor, size, row);
            }
            each(i, rows);
        }
    }
}
