//! Contact's hot paths: warm pulls in 20 steps around a bar, past a ball and in a tube of triangles, time per
//! subsegment, and loads alone. Every bench checks its answer first.
#![allow(missing_docs, clippy::unwrap_used)] // criterion's macros; a bench may stop on a bad answer.

#[path = "../tests/rust/prism.rs"]
mod prism;

use std::f64::consts::PI;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Vector3;
use tdcr::Status;
use tdcr::model::Model;
use tdcr::obstacle::{Cylinder, Obstacle, Sphere};
use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
use tdcr::rod::contact::{LoadedRod, Loads, Scene, Scratch};
use tdcr::rod::{Plan, RodSettings};

use prism::prism;

type V = Vector3<f64>;
const STEPS: usize = 20;

/// 180 mm with a tendon that pulls towards -x.
fn robot(n: usize) -> Robot {
    let mut spec = BackboneSpec::straight(0.18, n);
    (spec.youngs_modulus, spec.diameter) = (Some(60e9), Some(vec![1e-3]));
    let tendon = Tendon::straight(PI, 8e-3).unwrap();
    Robot::new(Backbone::new(spec).unwrap(), vec![tendon], None, None, None).unwrap()
}

fn ball() -> Obstacle {
    Obstacle::new(Sphere::new(&V::new(-0.045, 0.006, 0.13), 0.02).unwrap(), false)
}

/// Across the plane of the pull.
fn bar() -> Obstacle {
    Obstacle::new(Cylinder::new(&V::new(-0.045, 0.0, 0.13), &V::y(), 0.02).unwrap(), false)
}

/// A straight tube of about 10,000 triangles.
fn tube() -> Obstacle {
    Obstacle::new(prism(50, 99, 0.02, (-0.05, 0.25)), true)
}

/// A pull in steps from rest, each from the answer before it.
fn pull(c: &mut Criterion, name: &str, n: usize, obstacle: Obstacle, most: f64) {
    let robot = robot(n);
    let plan = Plan::new(&robot, RodSettings::default()).unwrap();
    let scene = Scene::new(&robot, &plan, &[obstacle], None, 0.0).unwrap();
    let model = LoadedRod::new(&robot, &plan, &scene).unwrap();
    let mut work = Scratch::default();
    let mut run = || {
        model.solve(&[0.0], &mut work).unwrap();
        for step in 1..=STEPS {
            let report = model.resume(&[-most * step as f64 / STEPS as f64], &mut work).unwrap();
            assert_eq!(report.status, Status::Converged, "{name} {n}: step {step}");
        }
        assert!(model.state(&work).contacts.iter().any(|c| c.force.norm() > 0.0));
    };
    run();
    let mut group = c.benchmark_group(format!("contact/{name}"));
    group.sample_size(10).throughput(Throughput::Elements(STEPS as u64));
    group.bench_function(BenchmarkId::from_parameter(n), |b| b.iter(&mut run));
    group.finish();
}

fn pulls(c: &mut Criterion) {
    for n in [9, 30, 100, 500] {
        pull(c, "bar", n, bar(), 6e-3);
        pull(c, "ball", n, ball(), 6e-3);
    }
    pull(c, "tube", 9, tube(), 3e-3);
}

fn loads(c: &mut Criterion) {
    let mut group = c.benchmark_group("contact/loads");
    for n in [10, 30, 100, 500] {
        let robot = robot(n);
        let plan = Plan::new(&robot, RodSettings::default()).unwrap();
        let tip_force = V::new(0.1, 0.05, 0.0);
        let loads = Loads { backbone_density: 6450.0, tip_force, ..Default::default() };
        let scene = Scene::new(&robot, &plan, &[], Some(&loads), 0.0).unwrap();
        let model = LoadedRod::new(&robot, &plan, &scene).unwrap();
        let mut work = Scratch::default();
        let free = [f64::INFINITY];
        assert_eq!(model.solve(&free, &mut work).unwrap().status, Status::Converged);
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::from_parameter(n), |b| {
            b.iter(|| model.solve(&free, &mut work));
        });
    }
    group.finish();
}

criterion_group!(benches, loads, pulls);
criterion_main!(benches);
