//! The finger of Mahapatra & Ghosal 2024, section 4, for tests and benches.

use std::f64::consts::PI;

use nalgebra::{Matrix4, Vector3};
use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};

/// The paper's finger: 9 subsegments, base 42 mm from the axis, a sphere's centre 110 mm above the base. It
/// leaves its base upwards along an arc that goes over into a circle of `radius` about the centre.
pub(crate) fn finger(radius: f64) -> (Robot, Vec<Vector3<f64>>) {
    let base = Matrix4::new_translation(&Vector3::new(0.042, 0.0, 0.0));
    let backbone = Backbone::new(BackboneSpec::straight(0.18, 9)).unwrap();
    let tendon = Tendon::straight(PI, 8e-3).unwrap();
    let robot = Robot::new(backbone, vec![tendon], Some(&base), None, None).unwrap();
    let (x, z) = (0.042_f64, 0.11_f64);
    // Circles that touch from outside: (x + r)² + z² = (r + radius)².
    let r = (x * x + z * z - radius * radius) / (2.0 * (radius - x));
    let turn = z.atan2(x + r);
    let entry = (0..=100).map(|i| {
        let angle = turn * f64::from(i) / 100.0;
        Vector3::new(x + r * (1.0 - angle.cos()), 0.0, r * angle.sin())
    });
    let around = (1..=200).map(|i| {
        let angle = -turn + 2.5 * f64::from(i) / 200.0;
        Vector3::new(radius * angle.cos(), 0.0, z + radius * angle.sin())
    });
    (robot, entry.chain(around).collect())
}
