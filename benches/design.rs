//! Design: pre-bent, the finger around a sphere of Mahapatra & Ghosal (2024), by march, and by descent; and the
//! holes of one and two tendons.
//!
//! `march`: one element, sliding tendons. `descent`: proportional tendons, as the paper's. `known`: a shape that 12 holes
//! make, `near`: one that they do not. All check their answer first.
#![allow(missing_docs, clippy::unwrap_used)] // criterion's macros; a bench may stop on a bad answer.

#[path = "../tests/rust/finger.rs"]
mod finger;

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Vector3;
use tdcr::Status;
use tdcr::design::{PrebendSettings, RoutingSettings, points_on_curve, prebend, routing};
use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use tdcr::rod::{Plan, Rod, RodSettings, Subsegment, TendonLaw};

use finger::finger;

const PULL: f64 = -0.03 * 0.18;

fn designs(c: &mut Criterion) {
    let (robot, curve) = finger(0.064);
    let targets = points_on_curve(&robot, &curve, Subsegment::Arc).unwrap();
    let mut group = c.benchmark_group("design/sphere_finger_9");
    let proportional = RodSettings { tendons: TendonLaw::Proportional, ..Default::default() };
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

/// Places of the disks of a straight backbone whose tendons, through holes given by number, are pulled by 10 mm.
fn pulled(holes: &[[usize; 10]]) -> (Robot, Vec<Vector3<f64>>) {
    let tendons = holes.iter().map(|indices| {
        let (indices, radius) = (indices.to_vec(), PerDisk::Same(8e-3));
        let routing = Routing::Holes { indices, count: 12, radius, azimuth: 0.0 };
        Tendon::new(routing, None, None, None).unwrap()
    });
    let backbone = Backbone::new(BackboneSpec::straight(0.18, 9)).unwrap();
    let robot = Robot::new(backbone, tendons.collect(), None, None, None).unwrap();
    let plan = Plan::new(&robot, RodSettings::default()).unwrap();
    let shape = Rod::new(&robot, &plan).shape(&vec![-0.01; holes.len()]).unwrap();
    assert_eq!(shape.report.status, Status::Converged);
    (robot.clone(), shape.state.frames[1..].iter().map(|frame| frame.translation).collect())
}

fn routings(c: &mut Criterion) {
    let mut group = c.benchmark_group("design/routing_9_disks_12_holes");
    group.sample_size(10);
    let settings = RoutingSettings::default();
    let own = [0, 1, 3, 4, 4, 3, 2, 2, 1, 0];
    let other = [6, 6, 7, 8, 8, 9, 10, 10, 9, 9];
    for (name, holes, off) in [
        ("one_known", &[own][..], 0.0),
        ("one_near", &[own][..], 1e-3),
        ("two_near", &[own, other][..], 0.0),
    ] {
        let (robot, mut targets) = pulled(holes);
        for (i, target) in targets.iter_mut().enumerate() {
            *target += Vector3::new((3 * i) as f64, (5 * i) as f64, 0.0).map(f64::sin) * off;
        }
        let answer = routing(&robot, &targets, None, None, &settings).unwrap();
        assert_eq!(answer.status == Status::Converged, name == "one_known", "{}", answer.message);
        assert!(answer.rms < 1e-3, "{}", answer.message);
        group.bench_function(name, |b| {
            b.iter(|| routing(&robot, black_box(&targets), None, None, &settings));
        });
    }
    group.finish();
}

criterion_group!(benches, designs, routings);
criterion_main!(benches);
