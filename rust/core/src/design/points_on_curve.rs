//! Places on a curve that a robot's disks can have.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

use crate::error::InvalidInput;
use crate::lie::{Pose, so3};
use crate::robot::{Robot, Spline};
use crate::rod::Subsegment;

/// Bisections of one subsegment's end on the curve.
const HALVINGS: usize = 60;

/// Length of the link over a chord, or of the arc over it that starts along a tangent.
pub(super) fn piece_length(kind: Subsegment, tangent: &Vector3<f64>, chord: &Vector3<f64>) -> f64 {
    let size = chord.norm();
    match kind {
        Subsegment::Link => size,
        Subsegment::Arc => {
            let half = tangent.cross(chord).norm().atan2(tangent.dot(chord));
            let ratio = if half > 1e-8 { half / half.sin() } else { 1.0 };
            size * ratio
        }
    }
}

/// The tangent at an arc's end: the one at its start, mirrored at the chord.
pub(super) fn mirror_tangent(tangent: &Vector3<f64>, chord: &Vector3<f64>) -> Vector3<f64> {
    let axis = tangent.cross(chord);
    let half = axis.norm().atan2(tangent.dot(chord));
    if axis.norm() > 0.0 {
        return so3::exp(&(axis.normalize() * (2.0 * half))) * tangent;
    }
    *tangent
}

/// Angle between the base's z axis and the spline through `points` \[m\] where it begins \[rad\].
///
/// # Errors
/// `InvalidInput` for fewer than two points, points that are not finite or repeat.
pub fn angle_at_base(robot: &Robot, points: &[Vector3<f64>]) -> Result<f64, InvalidInput> {
    let along = Spline::through(points)?.at_arc_length(0.0).1;
    let axis = robot.base().rotation.column(2).into_owned();
    Ok(axis.cross(&along).norm().atan2(axis.dot(&along)))
}

/// Wanted places of disks 1 to n on the spline through `points` \[m\], where they can be reached one after the
/// other from the base frame: at equal chords for links; for arcs, whose tangents go over into each other, at the
/// ends of arcs that start along the last one's end. The curve is moved to start at the base.
///
/// # Errors
/// `InvalidInput` for fewer than two points, points that are not finite or repeat, a curve that leaves the base
/// across its z axis or backwards, or one that is shorter than the robot.
pub fn points_on_curve(
    robot: &Robot,
    points: &[Vector3<f64>],
    kind: Subsegment,
) -> Result<Vec<Vector3<f64>>, InvalidInput> {
    let spline = Spline::through(points)?;
    let angle = angle_at_base(robot, points)?;
    // Then the first subsegment would have to bend by half a turn or more.
    if angle > FRAC_PI_2 * (1.0 - 1e-9) {
        let expected =
            "a curve that leaves along the base's z axis, as the robot does: turn one of them";
        let got = format!("one that leaves {:.1} deg off it", angle.to_degrees());
        return Err(InvalidInput::new("points", expected, got));
    }
    // The curve moved to the base, one subsegment after the other.
    let base: &Pose = robot.base();
    let shift = base.translation - points[0];
    let mut tangent = base.rotation.column(2).into_owned();
    let (mut place, mut at) = (base.translation, 0.0);
    let mut out = Vec::with_capacity(robot.backbone().subsegments());
    for (i, length) in robot.backbone().lengths().iter().enumerate() {
        // Length of the piece that would end at an arc length of the curve.
        let needed =
            |s: f64| piece_length(kind, &tangent, &(spline.at_arc_length(s).0 + shift - place));
        let (mut low, mut high) = (at, (at + 2.0 * length).min(spline.length()));
        if needed(high) < *length * (1.0 - 1e-12) {
            let expected = format!("a curve that reaches disk {}", i + 1);
            let got = format!("one of {:.6} m", spline.length());
            return Err(InvalidInput::new("points", expected, got));
        }
        // Bisection for the arc length at which the piece has the subsegment's length.
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if needed(middle) < *length { low = middle } else { high = middle }
        }
        at = 0.5 * (low + high);
        let next = spline.at_arc_length(at).0 + shift;
        if kind == Subsegment::Arc {
            tangent = mirror_tangent(&tangent, &(next - place));
        }
        place = next;
        out.push(next);
    }
    Ok(out)
}
