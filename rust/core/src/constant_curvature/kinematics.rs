//! Chains of arcs: frames along them and the derivative of their end.

use nalgebra::Matrix6xX;

use super::arc::Arc;
use super::unit_arc::UnitArc;
use crate::lie::Pose;

/// Frames along a chain of arcs: `points` (at least 2) evenly spaced on each, its base and its tip
/// included, from the frame of the first base.
pub fn frames(base: &Pose, arcs: &[Arc], points: usize, out: &mut Vec<Pose>) {
    out.clear();
    let mut base = *base;
    for arc in arcs {
        let step = arc.frame(1.0 / (points.max(2) - 1) as f64);
        let mut frame = base;
        out.push(frame);
        for _ in 2..points {
            frame = frame.compose(&step);
            out.push(frame);
        }
        // At s = ell exactly, whatever the steps round to.
        base = base.compose(&arc.frame(1.0));
        out.push(base);
    }
}

/// Velocity of the tool at the end of a chain of arcs (translation, then rotation, world axes) by every
/// arc's bending vector and length, (6, 3m).
#[must_use]
pub fn tip_derivative(base: &Pose, tool: &Pose, arcs: &[Arc]) -> Matrix6xX<f64> {
    let mut frame = *base;
    let walk = arcs.iter().map(|arc| {
        let bent = UnitArc::new(arc.bend);
        let axes = frame.rotation;
        frame = frame.compose(&bent.frame(arc.length));
        (bent.derivative(arc.length), axes, frame.translation)
    });
    let walked: Vec<_> = walk.collect();
    let tip = frame.compose(tool).translation;
    let mut out = Matrix6xX::zeros(3 * arcs.len());
    for (i, (local, axes, end)) in walked.iter().enumerate() {
        let lever = tip - end;
        for j in 0..3 {
            let velocity = axes * local.fixed_view::<3, 1>(0, j);
            let spin = axes * local.fixed_view::<3, 1>(3, j);
            let mut column = out.column_mut(3 * i + j);
            column.fixed_rows_mut::<3>(0).copy_from(&(velocity + spin.cross(&lever)));
            column.fixed_rows_mut::<3>(3).copy_from(&spin);
        }
    }
    out
}
