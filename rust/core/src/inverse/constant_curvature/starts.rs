//! Starting points of the search over arcs.

use std::f64::consts::{PI, TAU};

use nalgebra::{Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::ConstantCurvatureInverse;
use crate::inverse::Target;
use crate::inverse::bounds::SegmentRange;

impl ConstantCurvatureInverse<'_> {
    /// The k-th start: one arc to the target, which is the answer for a single segment; nearly straight;
    /// then random ones, each from its own stream.
    pub(super) fn start_point(&self, target: &Target, k: usize, point: &mut Vec<f64>) {
        point.clear();
        match k {
            0 => self.single_arc(target, point),
            1 => self.nearly_straight(point),
            _ => self.random(k, point),
        }
    }

    /// All segments on the circle that leaves the base along z and brings the tool to the target.
    fn single_arc(&self, target: &Target, point: &mut Vec<f64>) {
        let (base, tool) = (self.robot.base().inverse(), self.robot.tool());
        let rest: f64 = self.plan.segments().map(|segment| segment.rest_length).sum();
        let (bend, length) = match target {
            Target::Pose(pose) => {
                let tip = pose.compose(&tool.inverse()).translation;
                arc_to(&base.transform(&tip), &Vector3::zeros(), rest)
            }
            Target::Position(position) => {
                arc_to(&base.transform(position), &tool.translation, rest)
            }
        };
        let angle = bend.norm();
        for (segment, draw) in self.plan.segments().zip(&self.space.draws) {
            let share = segment.rest_length / rest;
            let share = if angle * share > draw.widest { draw.widest / angle } else { share };
            point.extend_from_slice((bend * share).as_slice());
            if self.plan.width() == 3 {
                point.push((length / rest).clamp(draw.shortest, draw.longest));
            }
        }
    }

    fn nearly_straight(&self, point: &mut Vec<f64>) {
        for (i, draw) in self.space.draws.iter().enumerate() {
            let (sin, cos) = (2.4 * i as f64).sin_cos();
            point.extend([0.02 * cos, 0.02 * sin]);
            if self.plan.width() == 3 {
                point.push(1.0_f64.clamp(draw.shortest, draw.longest));
            }
        }
    }

    fn random(&self, k: usize, point: &mut Vec<f64>) {
        let mut draws = ChaCha8Rng::seed_from_u64(self.settings.seed);
        draws.set_stream(k as u64);
        for &SegmentRange { widest, shortest, longest } in &self.space.draws {
            // Segments seldom turn by more than half a turn: every other start stays within it.
            let widest = if k.is_multiple_of(2) { widest.min(PI) } else { widest };
            let angle = widest * draws.random::<f64>();
            let (sin, cos) = (TAU * draws.random::<f64>()).sin_cos();
            point.extend([angle * cos, angle * sin]);
            if self.plan.width() == 3 {
                point.push(shortest + (longest - shortest) * draws.random::<f64>());
            }
        }
    }
}

/// Bending vector and length of the arc that leaves the origin along z and brings `tool`, given in the frame
/// of its end, to `point`; of two, the one nearer to a length.
///
/// What the tool is off the axis across the bending plane stays as it is, so `point - tool` lies in that
/// plane; what it is off along the plane, i, is as if the radius were less by i: at half the angle h, with
/// `q = (r - i) sin h + tool_z cos h`, `point - tool` is at `2 q sin h` across and `point` at
/// `2 q cos h - tool_z` along z.
pub(in crate::inverse) fn arc_to(
    point: &Vector3<f64>,
    tool: &Vector3<f64>,
    wanted: f64,
) -> (Vector2<f64>, f64) {
    let off = (point - tool).xy();
    let (across, along) = (off.norm(), point.z + tool.z);
    let direction = if across > 0.0 { off / across } else { Vector2::x() };
    // Bent towards the point, and away from it where the tool leads back (q < 0).
    let arc = |side: f64| {
        let half = across.atan2(side * along);
        let spread = 0.5 * side * across.hypot(along) - tool.z * half.cos();
        let per_sine = if half > 0.0 { half / half.sin() } else { 1.0 };
        let aside = side * direction.dot(&tool.xy());
        (direction * (2.0 * side * half), 2.0 * (spread * per_sine + aside * half))
    };
    let (near, far) = (arc(1.0), arc(-1.0));
    // A negative length is no arc.
    if far.1 > 0.0 && (far.1 - wanted).abs() < (near.1 - wanted).abs() { far } else { near }
}
