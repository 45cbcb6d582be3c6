//! Contact's hot paths: warm pulls in 20 steps around a bar, past a ball and in a tube of triangles, time per
//! subsegment, and loads alone. Every bench checks its answer first.
#![allow(missing_docs, clippy::unwrap_used)] // criterion's macros; a bench may stop on a bad answer.

use std::f64::consts::{PI, TAU};

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Vector3;
use tdcr::Status;
use tdcr::model::Model;
use tdcr::obstacle::{Cylinder, Mesh, Obstacle, Sphere};
use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
use tdcr::rod::contact::{LoadedRod, Loads, Scene, Workspace};
use tdcr::rod::{Plan, RodSettings};

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
    let (sides, rings, radius) = (50, 99, 0.02);
    let mut vertices = vec![V::new(0.0, 0.0, -0.05), V::new(0.0, 0.0, 0.25)];
    for ring in 0..=rings {
        let z = -0.05 + 0.3 * ring as f64 / rings as f64;
        vertices.extend((0..sides).map(|k| {
            let (sin, cos) = (TAU * k as f64 / sides as f64).sin_cos();
            V::new(radius * cos, radius * sin, z)
        }));
    }
    let at = |ring: usize, k: usize| 2 + ring * sides + k % sides;
    let mut faces = Vec::new();
    for k in 0..sides {
        faces.extend([[0, at(0, k + 1), at(0, k)], [1, at(rings, k), at(rings, k + 1)]]);
        for ring in 0..rings {
            let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)];
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    Obstacle::new(Mesh::new(&vertices, &faces).unwrap(), true)
}

/// A pull in steps from rest, each from the answer before it.
fn pull(c: &mut Criterion, name: &str, n: usize, obstacle: Obstacle, most: f64) {
    let robot = robot(n);
    let plan = Plan::new(&robot, RodSettings::default()).unwrap();
    let scene = Scene::new(&robot, &plan, &[obstacle], None, 0.0).unwrap();
    let model = LoadedRod::new(&robot, &plan, &scene).unwrap();
    let mut work = Workspace::default();
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
        let mut work = Workspace::default();
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
