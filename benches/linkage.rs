//! The linkage model's hot paths.
//!
//! `seven_bar`: one solve from its own start (which is not the closed form), alike and differing holes.
//! `chain_*`: whole robots per subsegment; `varied` changes its radii from disk to disk, so that every
//! subsegment is a solve of its own, `uniform` solves one and reuses it. `batch`: rows on one and all
//! threads. Every bench but the batch, whose
//! rows the tests compare with single solves, checks its answer first.
#![allow(missing_docs, clippy::unwrap_used)] // criterion's macros; a bench may stop on a bad answer.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Vector3;
use tdcr::Status;
use tdcr::batch::{Control, Field, Key, pool, solve_rows};
use tdcr::linkage::four_bar::FourBar;
use tdcr::linkage::seven_bar::{Hole, SevenBar};
use tdcr::linkage::{Linkage, LinkageSettings, Plan, Pose, Scratch};
use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use tdcr::solve::sqp::{Ending, minimize};

fn polar(radius: f64, azimuth: f64) -> Vector3<f64> {
    Vector3::new(radius * azimuth.cos(), radius * azimuth.sin(), 0.0)
}

/// A subsegment of the classic trunk: holes at half its length, bent by about 0.15 rad.
fn holes(taper: f64) -> [Hole; 2] {
    [(0.0, 0.06), (1.6, 0.04)]
        .map(|(azimuth, pull)| Hole::new(polar(0.5, azimuth), polar(0.5 * taper, azimuth), pull))
}

/// Tendon pieces as long as asked, and for alike holes the closed form: bend `2 asin(|(c, s)| / 2)`.
fn check(holes: &[Hole; 2], pose: &Pose) {
    for hole in holes {
        let piece = (pose.link + pose.rotation() * hole.upper - hole.lower).norm();
        assert!((piece - (hole.rest - hole.pull)).abs() < 1e-14);
    }
    if holes.iter().all(Hole::is_alike) {
        let [(a, p), (b, q)] = holes.map(|hole| (hole.upper, hole.pull));
        let determinant = a.x * b.y - a.y * b.x;
        let c = (p * b.y - q * a.y) / determinant;
        let s = (a.x * q - b.x * p) / determinant;
        let exact = Pose::from_bend(2.0 * (0.5 * c.hypot(s)).asin(), s.atan2(c));
        assert!((pose.rotation() - exact.rotation()).amax() < 1e-13);
    }
}

fn bars(c: &mut Criterion) {
    let settings = LinkageSettings::default().sqp();
    let mut group = c.benchmark_group("bar");
    for (name, taper) in [("seven_bar/alike", 1.0), ("seven_bar/differing", 0.98)] {
        let holes = holes(taper);
        let solve = |holes: &[Hole; 2]| {
            let problem = SevenBar::<2>::new(holes);
            minimize(&problem, problem.point(problem.start()), &settings)
        };
        let found = solve(&holes);
        assert_eq!(found.ending, Ending::Converged);
        check(&holes, &found.point.pose);
        group.bench_function(name, |b| b.iter(|| solve(black_box(&holes))));
    }
    let hole = holes(1.0)[0];
    let solve = |hole: &Hole| {
        let problem = FourBar::new(hole);
        minimize(&problem, problem.start(), &settings)
    };
    let found = solve(&hole);
    let exact = 2.0 * (0.5 * hole.pull / hole.upper.norm()).asin();
    assert!(found.ending == Ending::Converged && (found.point.disk - exact).abs() < 1e-14);
    group.bench_function("four_bar/alike", |b| b.iter(|| solve(black_box(&hole))));
    group.finish();
}

fn trunk(n: usize, varied: bool) -> Robot {
    let backbone = Backbone::new(BackboneSpec::straight(0.02 * n as f64, n)).unwrap();
    let radius = if varied {
        PerDisk::Each((0..=n).map(|i| 0.01 - 0.002 * i as f64 / n as f64).collect())
    } else {
        PerDisk::Same(0.01)
    };
    let tendons = [0.0, 1.6].map(|azimuth| {
        let routing = Routing::Angles { azimuth: PerDisk::Same(azimuth), radius: radius.clone() };
        Tendon::new(routing, None, None, None).unwrap()
    });
    Robot::new(backbone, tendons.to_vec(), None, None, None).unwrap()
}

fn chains(c: &mut Criterion) {
    for (name, varied) in [("chain_varied", true), ("chain_uniform", false)] {
        let mut group = c.benchmark_group(name);
        for n in [10, 100, 1000] {
            let robot = trunk(n, varied);
            let plan = Plan::new(&robot).unwrap();
            let model = Linkage::new(&robot, &plan, LinkageSettings::default()).unwrap();
            let pull = 0.02 * n as f64;
            let displacements = [-0.06 * pull, -0.04 * pull];
            let mut work = Scratch::default();
            let report = model.solve(&displacements, &mut work).unwrap();
            assert_eq!(report.status, Status::Converged);
            for (k, path) in robot.paths().iter().enumerate() {
                let length = path.rest_length + displacements[k];
                let off = model.state(&work).tendon_lengths[k] / length - 1.0;
                assert!(off.abs() < 1e-12, "{off:e}");
            }
            // Elements are subsegments: the time per element is the time per subsegment.
            group.throughput(Throughput::Elements(n as u64));
            group.bench_function(BenchmarkId::from_parameter(n), |b| {
                b.iter(|| model.solve(black_box(&displacements), &mut work));
            });
        }
        group.finish();
    }
}

fn batches(c: &mut Criterion) {
    let robot = trunk(20, true);
    let plan = Plan::new(&robot).unwrap();
    let model = Linkage::new(&robot, &plan, LinkageSettings::default()).unwrap();
    let rows = 2000_u32;
    let displacements: Vec<f64> =
        (0..rows).flat_map(|i| [-1e-5 * f64::from(i), -0.5e-5 * f64::from(i)]).collect();
    let mut group = c.benchmark_group("batch");
    group.throughput(Throughput::Elements(u64::from(rows)));
    for (name, threads) in [("one_thread", Some(1)), ("all_threads", None)] {
        let pool = pool(threads).unwrap();
        group.bench_function(name, |b| {
            b.iter(|| {
                let control = Control::default();
                let rows = rows as usize;
                let solved =
                    solve_rows(&model, &displacements, rows, &[Field::Tip], &pool, &control);
                let tips = solved.unwrap().unwrap();
                assert_eq!(tips.values(Key::Tip).unwrap().len(), 16 * rows);
            });
        });
    }
    group.finish();
}

criterion_group!(benches, bars, chains, batches);
criterion_main!(benches);
