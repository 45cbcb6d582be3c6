//! The rod's hot paths.
//!
//! `cold`: whole solves from rest, a helix and a robot of three segments. `chain`: time per subsegment, with
//! two helical tendons. `warm`: a step along a path from the answer before it. `jacobian`: derivatives at a
//! solved shape, without the solve. `tensions`: the shape under given tensions. `batch`: rows on one and two threads.
//! Every bench checks its answer first.
#![allow(missing_docs, clippy::unwrap_used)] // criterion's macros; a bench may stop on a bad answer.

use std::f64::consts::TAU;
use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use tdcr::Status;
use tdcr::batch::{Control, Field, Key, pool, solve_rows};
use tdcr::lie::Pose;
use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, Robot, Routing, Tendon};
use tdcr::rod::{Plan, Rod, RodSettings, Scratch};

const FREE: f64 = f64::INFINITY;
const RADIUS: f64 = 8e-3;

fn robot(n: usize, tendons: Vec<Tendon>) -> Robot {
    let backbone = Backbone::new(BackboneSpec::straight(0.02 * n as f64, n)).unwrap();
    Robot::new(backbone, tendons, None, None, None).unwrap()
}

/// One helical tendon per azimuth, of a turn per 40 subsegments.
fn helices(n: usize, azimuths: &[f64]) -> Robot {
    let tendon = |azimuth: &f64| {
        let turns = n as f64 / 40.0;
        let routing = Routing::Helical { azimuth: *azimuth, radius: RADIUS, turns };
        Tendon::new(routing, None, None, None).unwrap()
    };
    robot(n, azimuths.iter().map(tendon).collect())
}

/// Three segments of ten subsegments, three straight tendons to the end of each.
fn segments() -> Robot {
    let tendon = |k: usize| {
        let straight = Tendon::straight(TAU * k as f64 / 3.0 + 0.2 * (k / 3) as f64, RADIUS);
        let routing = straight.unwrap().routing().clone();
        Tendon::new(routing, Some(10 * (k / 3 + 1)), None, None).unwrap()
    };
    robot(30, (0..9).map(tendon).collect())
}

fn plan(robot: &Robot) -> Plan {
    Plan::new(robot, RodSettings::default()).unwrap()
}

/// Lengths that tensions lead to; tendons without tension are released by 5 mm more, or free.
fn pulls(rod: &Rod<'_>, tensions: &[f64], release: f64) -> Vec<f64> {
    let mut work = Scratch::default();
    let report = rod.solve_tensions(tensions, &mut work).unwrap();
    assert_eq!(report.status, Status::Converged);
    let lengths = rod.state(&work).tendon_lengths.iter().zip(rod.rest_lengths());
    let given = lengths.zip(tensions).map(|((length, rest), tension)| {
        length - rest + if *tension > 0.0 { 0.0 } else { release }
    });
    let given: Vec<f64> = given.collect();
    let report = rod.solve(&given, &mut work).unwrap();
    assert_eq!(report.status, Status::Converged);
    for (own, wanted) in rod.state(&work).tensions.iter().zip(tensions) {
        assert!((own - wanted).abs() < 1e-6 * (1.0 + wanted), "{own} {wanted}");
    }
    given
}

/// Two tendons of the first segment, one of the second, two of the third.
const TENSIONS: [f64; 9] = [300.0, 100.0, 0.0, 0.0, 200.0, 0.0, 100.0, 0.0, 150.0];

fn cold(c: &mut Criterion) {
    let (helix, three) = (helices(10, &[0.3]), segments());
    let (helix_plan, three_plan) = (plan(&helix), plan(&three));
    let (one, nine) = (Rod::new(&helix, &helix_plan), Rod::new(&three, &three_plan));
    let cases = [
        ("helical_10", &one, pulls(&one, &[400.0], FREE)),
        ("three_segments_30/free", &nine, pulls(&nine, &TENSIONS, FREE)),
        ("three_segments_30/released", &nine, pulls(&nine, &TENSIONS, 5e-3)),
    ];
    let mut group = c.benchmark_group("rod/cold");
    let mut work = Scratch::default();
    for (name, rod, pulls) in &cases {
        group.bench_function(*name, |b| b.iter(|| rod.solve(black_box(pulls), &mut work)));
    }
    group.finish();
}

fn chains(c: &mut Criterion) {
    let mut group = c.benchmark_group("rod/chain");
    let mut work = Scratch::default();
    for n in [10, 30, 100, 300, 1000] {
        let robot = helices(n, &[0.3, 2.0]);
        let plan = plan(&robot);
        let rod = Rod::new(&robot, &plan);
        let pulls = pulls(&rod, &[300.0, 200.0], FREE);
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::from_parameter(n), |b| {
            b.iter(|| rod.solve(black_box(&pulls), &mut work));
        });
    }
    group.finish();
}

/// A closed path: the tensions of two tendons rise and fall by turns. Rows, row-major.
fn path(rod: &Rod<'_>, rows: usize) -> Vec<f64> {
    let row = |i: usize| {
        let (sin, cos) = (TAU * i as f64 / rows as f64).sin_cos();
        pulls(rod, &[250.0 + 100.0 * sin, 250.0 + 100.0 * cos], FREE)
    };
    (0..rows).flat_map(row).collect()
}

fn warm(c: &mut Criterion) {
    let robot = helices(20, &[0.3, 2.0]);
    let plan = plan(&robot);
    let rod = Rod::new(&robot, &plan);
    let path = path(&rod, 1000);
    let mut group = c.benchmark_group("rod/step_20");
    let mut work = Scratch::default();
    for row in path.chunks_exact(2) {
        assert_eq!(rod.resume(row, &mut work).unwrap().status, Status::Converged);
    }
    for (name, warm) in [("cold", false), ("warm", true)] {
        let mut rows = path.chunks_exact(2).cycle();
        group.bench_function(name, |b| {
            b.iter(|| {
                let row = rows.next().unwrap_or_default();
                if warm { rod.resume(row, &mut work) } else { rod.solve(row, &mut work) }
            });
        });
    }
    group.finish();
}

fn derivatives(c: &mut Criterion) {
    let three = segments();
    let plan = plan(&three);
    let rod = Rod::new(&three, &plan);
    let pulls = pulls(&rod, &TENSIONS, FREE);
    let mut work = Scratch::default();
    let mut group = c.benchmark_group("rod/three_segments_30");
    group.bench_function("solve", |b| b.iter(|| rod.solve(black_box(&pulls), &mut work)));
    rod.solve(&pulls, &mut work).unwrap();
    let tool = Pose::identity();
    // Against a difference on the first tendon.
    let step = 1e-7;
    let jacobian = rod.sensitivity(&pulls, &work).jacobian(&tool);
    let mut moved = pulls.clone();
    moved[0] -= step;
    let mut other = Scratch::default();
    rod.solve(&moved, &mut other).unwrap();
    let tip = |work: &Scratch| rod.state(work).frames[30].translation;
    let slope = (tip(&work) - tip(&other)) / step;
    assert!((slope - jacobian.fixed_view::<3, 1>(0, 0)).norm() < 1e-3 * slope.norm());
    group.bench_function("jacobian", |b| {
        b.iter(|| rod.sensitivity(black_box(&pulls), &work).jacobian(&tool));
    });
    group.bench_function("tensions", |b| {
        b.iter(|| rod.solve_tensions(black_box(&TENSIONS), &mut other));
    });
    group.finish();
}

fn batches(c: &mut Criterion) {
    let robot = helices(20, &[0.3, 2.0]);
    let plan = plan(&robot);
    let rod = Rod::new(&robot, &plan);
    let rows = 10_000;
    let displacements = path(&rod, rows);
    let mut group = c.benchmark_group("rod/batch_20");
    group.sample_size(20).throughput(Throughput::Elements(rows as u64));
    for (name, threads) in [("one_thread", 1), ("two_threads", 2)] {
        let pool = pool(Some(threads)).unwrap();
        group.bench_function(name, |b| {
            b.iter(|| {
                let control = Control::default();
                let solved = solve_rows(&rod, &displacements, rows, &[Field::Tip], &pool, &control);
                let tips = solved.unwrap().unwrap();
                assert_eq!(tips.values(Key::Tip).unwrap().len(), 16 * rows);
            });
        });
    }
    group.finish();
}

criterion_group!(benches, cold, chains, warm, derivatives, batches);
criterion_main!(benches);
