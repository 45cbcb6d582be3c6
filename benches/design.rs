//! Pre-bent design: the finger around a sphere of Mahapatra & Ghosal (2024), by march, and by descent.
//!
//! `march`: one element, sliding tendons. `descent`: proportional tendons, as the paper's. Both check their answer first.
#![allow(missing_docs, clippy::unwrap_used)] // criterion's macros; a bench may stop on a bad answer.

use std::f64::consts::PI;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Matrix4, Vector3};
use tdcr::Status;
use tdcr::design::{PrebendSettings, points_on_curve, prebend};
use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
use tdcr::rod::{RodSettings, Subsegment, TendonRule};

const PULL: f64 = -0.03 * 0.18;

/// Base 42 mm from the axis; an arc from there goes over into a circle of 64 mm about a centre 110 mm above.
fn finger() -> (Robot, Vec<Vector3<f64>>) {
    let base = Matrix4::new_translation(&Vector3::new(0.042, 0.0, 0.0));
    let backbone = Backbone::new(BackboneSpec::straight(0.18, 9)).unwrap();
    let tendon = Tendon::straight(PI, 8e-3).unwrap();
    let robot = Robot::new(backbone, vec![tendon], Some(&base), None, None).unwrap();
    let (x, z, radius) = (0.042_f64, 0.11_f64, 0.064_f64);
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

fn designs(c: &mut Criterion) {
    let (robot, curve) = finger();
    let targets = points_on_curve(&robot, &curve, Subsegment::Arc).unwrap();
    let mut group = c.benchmark_group("design/sphere_finger_9");
    let proportional = RodSettings { tendons: TendonRule::Proportional, ..Default::default() };
    for (name, rod, tolerance) in
        [("march", RodSettings::default(), 1e-10), ("descent", proportional, 1e-3)]
    {
        let settings = PrebendSettings { rod, tolerance, ..Default::default() };
        let answer = prebend(&robot, &targets, &[PULL], &settings).unwrap();
        assert_eq!(answer.status, Status::Converged, "{}", answer.message);
        group.bench_function(name, |b| {
            b.iter(|| prebend(&robot, black_box(&targets), &[PULL], &settings));
        });
    }
    group.finish();
    c.bench_function("design/points_on_curve_9", |b| {
        b.iter(|| points_on_curve(&robot, black_box(&curve), Subsegment::Arc));
    });
}

criterion_group!(benches, designs);
criterion_main!(benches);
