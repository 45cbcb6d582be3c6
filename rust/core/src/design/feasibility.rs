//! Why places cannot be those of a robot's disks, whatever its rest shape.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

use super::points_on_curve::{mirror_tangent, piece_length};
use crate::robot::Robot;
use crate::rod::Subsegment;

/// The first subsegment whose ends the places do not give it, by more than a share `off` of its length, as the
/// end of a message; empty if there is none.
pub(super) fn infeasible_chord(
    robot: &Robot,
    targets: &[Vector3<f64>],
    kind: Subsegment,
    off: f64,
) -> String {
    let base = robot.base();
    let (mut place, mut tangent) = (base.translation, base.rotation.column(2).into_owned());
    for (i, (target, length)) in targets.iter().zip(robot.backbone().lengths()).enumerate() {
        let chord = target - place;
        let piece = piece_length(kind, &tangent, &chord);
        let half = tangent.cross(&chord).norm().atan2(tangent.dot(&chord));
        // A subsegment bends by twice the angle of its chord, and by half a turn at most.
        let behind = half >= FRAC_PI_2;
        if behind || (piece / length - 1.0).abs() > off {
            let angle = half.to_degrees();
            let (next, size) = (i + 1, chord.norm());
            let axis = if i == 0 { "the base's z axis" } else { "the tangent there" };
            if behind {
                return format!(
                    ": disk {next} would be behind disk {i}: from there it is {size:.6} m, {angle:.1} deg off \
                     {axis}; a subsegment bends by no more than half a turn"
                );
            }
            let shape = if kind == Subsegment::Link { "a link" } else { "an arc" };
            return format!(
                ": from disk {i} to disk {next} it is {size:.6} m, {angle:.1} deg off {axis}, which takes \
                 {shape} of {piece:.6} m; the subsegment has {length:.6} m"
            );
        }
        tangent = mirror_tangent(&tangent, &chord);
        place = *target;
    }
    String::new()
}
