//! The inverses of the constant-curvature model and of the rod. Every bench checks its answers first.
//!
//! One iteration of `pose` and `position` is 64 random targets for three segments with nine tendons, of
//! `path` 1,000 poses along a smooth curve. Times over 10,000 targets are printed while it sets up.
#![allow(
    missing_docs, // criterion's macros
    clippy::unwrap_used, // a bench may stop on a bad answer
    clippy::cast_possible_truncation, // places of quantiles
    clippy::cast_sign_loss
)]

use std::f64::consts::{PI, TAU};
use std::hint::black_box;
use std::time::Instant;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::Status;
use tdcr::batch::Control;
use tdcr::constant_curvature::{
    Arc, ConstantCurvature, ConstantCurvatureSettings, Plan, Scratch, displacements,
};
use tdcr::inverse::{
    Bounds, ConstantCurvatureInverse, InverseSettings, Inverter, Range, RodInverse, Target,
    invert_path,
};
use tdcr::lie::{Pose, so3};
use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use tdcr::rod::{self, Rod, RodSettings};

const LENGTHS: [f64; 3] = [0.06, 0.0625, 0.064];

fn robot() -> Robot {
    let mut spec = BackboneSpec::straight(0.2, 1);
    spec.length = LENGTHS.to_vec();
    spec.subsegments = vec![10; 3];
    let tendon = |k: usize| {
        let azimuth = TAU * (k % 3) as f64 / 3.0 + (k / 3) as f64 * PI / 4.0;
        let (azimuth, radius) = (PerDisk::Same(azimuth), PerDisk::Same(0.0045));
        let end = 10 * (k / 3 + 1);
        Tendon::new(Routing::Angles { azimuth, radius }, Some(end), None, None).unwrap()
    };
    let backbone = Backbone::new(spec).unwrap();
    Robot::new(backbone, (0..9).map(tendon).collect(), None, None, None).unwrap()
}

/// Bounds that all random arcs meet.
fn bounds(extensible: bool) -> Bounds {
    let range = |low, high| Some(Range::new("bounds", low, high).unwrap());
    let shortest = if extensible { 0.8 * LENGTHS[0] } else { LENGTHS[0] };
    let [low, high] = [0.8, 1.25].map(|share| LENGTHS.map(|l| share * l).to_vec());
    Bounds {
        curvature: range(vec![0.0], vec![PI / shortest]),
        length: if extensible { range(low, high) } else { None },
        ..Bounds::default()
    }
}

fn tip(arcs: &[Arc]) -> Pose {
    arcs.iter().fold(Pose::identity(), |frame, arc| frame.compose(&arc.frame(1.0)))
}

fn random_poses(count: usize, extensible: bool) -> Vec<Pose> {
    let mut draws = ChaCha8Rng::seed_from_u64(81);
    let pose = |_| {
        let arcs = LENGTHS.map(|rest| {
            let ratio = if extensible { draws.random_range(0.8..1.25) } else { 1.0 };
            let (angle, phi) = (draws.random_range(0.0..PI), draws.random_range(-PI..PI));
            Arc::new(angle / (rest * ratio), phi, rest * ratio)
        });
        tip(&arcs)
    };
    (0..count).map(pose).collect()
}

/// Solves targets one by one with a forward check of each; prints the quantiles of the times.
fn check(name: &str, inverse: &ConstantCurvatureInverse<'_>, plan: &Plan, targets: &[Target]) {
    let model = ConstantCurvature::new(inverse.robot(), plan);
    let (mut work, mut forward) = (inverse.scratch(), Scratch::default());
    let mut found = vec![0.0; 9];
    let mut times: Vec<f64> = Vec::new();
    for target in targets {
        let begin = Instant::now();
        let answer = inverse.solve(target, None, &mut work);
        inverse.write_displacements(&work, &mut found);
        times.push(1e6 * begin.elapsed().as_secs_f64());
        assert_eq!(answer.status, Status::Converged);
        model.solve(&found, &mut forward).unwrap();
        let tip = model.state(&forward).frames[30];
        assert!((tip.translation - target.position()).norm() < 1e-9);
        let turn = target.rotation().map(|wanted| so3::log(&(tip.rotation.transpose() * wanted)));
        assert!(turn.is_none_or(|turn| turn.norm() < 1e-9));
    }
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
    let mean = times.iter().sum::<f64>() / times.len() as f64;
    println!(
        "{name}, {} targets: median {:.1} us, mean {mean:.1} us, 99th percentile {:.1} us",
        times.len(),
        at(0.5),
        at(0.99)
    );
}

/// Arcs along a smooth closed path.
fn along(k: usize) -> Vec<Arc> {
    let t = TAU * k as f64 / 1000.0;
    let segments = LENGTHS.iter().zip([0.0, 1.0, 2.0]);
    let arc = |(length, i): (&f64, f64)| Arc {
        bend: Vector2::new(1.2 + 0.5 * (t + i).cos(), 0.8 * (2.0 * t + 1.3 * i).sin()),
        length: *length,
    };
    segments.map(arc).collect()
}

fn benches(c: &mut Criterion) {
    let mut group = c.benchmark_group("inverse");
    let robot = robot();
    for extensible in [false, true] {
        let choices = ConstantCurvatureSettings { extensible, ..Default::default() };
        let plan = Plan::new(&robot, choices).unwrap();
        let settings = InverseSettings::default();
        let inverse =
            ConstantCurvatureInverse::new(&robot, &plan, &bounds(extensible), settings).unwrap();
        let kind = if extensible { "extensible" } else { "inextensible" };
        let poses = random_poses(10_000, extensible);
        for posed in [true, false] {
            let of = |pose: &Pose| {
                if posed { Target::frame(pose) } else { Target::Position(pose.translation) }
            };
            let targets: Vec<Target> = poses.iter().map(of).collect();
            let name = format!("{}/{kind}", if posed { "pose" } else { "position" });
            check(&name, &inverse, &plan, &targets);
            let mut work = inverse.scratch();
            group.throughput(Throughput::Elements(64));
            group.bench_function(format!("{name}/64_targets"), |b| {
                b.iter(|| {
                    for target in &targets[..64] {
                        black_box(inverse.solve(black_box(target), None, &mut work));
                    }
                });
            });
        }
        if extensible {
            continue;
        }
        let targets: Vec<Target> = (0..1000).map(|k| Target::frame(&tip(&along(k)))).collect();
        let (start, control) = (displacements(&plan, &along(0)), Control::default());
        let start = Some(start.as_slice());
        let rows = invert_path(&inverse, &targets, start, &control).unwrap().unwrap();
        for k in [0, 500, 999] {
            let made = displacements(&plan, &along(k));
            let found = &rows.displacements[9 * k..9 * (k + 1)];
            assert!(made.iter().zip(found).all(|(made, found)| (made - found).abs() < 1e-9));
        }
        assert!(rows.answers.iter().all(|a| a.status == Status::Converged && a.starts == 1));
        group.throughput(Throughput::Elements(1000));
        group.bench_function("path/inextensible/1000_poses", |b| {
            b.iter(|| invert_path(&inverse, black_box(&targets), start, &control));
        });
    }
    group.finish();
}

/// Tips of shapes with two of three tendons of every segment pulled.
fn rod_tips(robot: &Robot, plan: &rod::Plan, count: usize) -> Vec<Pose> {
    let mut draws = ChaCha8Rng::seed_from_u64(4);
    let (model, mut work) = (Rod::new(robot, plan), rod::Scratch::default());
    let mut tip = || {
        let mut pull =
            |k: usize| if k.is_multiple_of(3) { 0.0 } else { draws.random_range(0.0..4400.0) };
        let tensions: Vec<f64> = (0..9).map(&mut pull).collect();
        let report = model.solve_tensions(&tensions, &mut work).unwrap();
        assert_eq!(report.status, Status::Converged);
        *model.state(&work).frames.last().unwrap()
    };
    (0..count).map(|_| tip()).collect()
}

fn rods(c: &mut Criterion) {
    let mut group = c.benchmark_group("inverse_rod");
    let robot = robot();
    let plan = rod::Plan::new(&robot, RodSettings::default()).unwrap();
    let inverse =
        RodInverse::new(&robot, &plan, &Bounds::default(), InverseSettings::default()).unwrap();
    let tips = rod_tips(&robot, &plan, 64);
    let (model, mut forward) = (Rod::new(&robot, &plan), rod::Scratch::default());
    let mut work = inverse.buffers(None);
    for posed in [true, false] {
        let of = |tip: &Pose| {
            if posed { Target::frame(tip) } else { Target::Position(tip.translation) }
        };
        let targets: Vec<Target> = tips.iter().map(of).collect();
        for target in &targets {
            let answer = inverse.solve(target, None, &mut work);
            assert_eq!(answer.status, Status::Converged);
            let mut displacements = [0.0; 9];
            inverse.write_displacements(&work, &mut displacements);
            model.solve(&displacements, &mut forward).unwrap();
            let tip = model.state(&forward).frames.last().unwrap().translation;
            assert!((tip - target.position()).norm() < 1e-8);
        }
        group.throughput(Throughput::Elements(64));
        let name = if posed { "pose" } else { "position" };
        group.bench_function(format!("{name}/64_targets"), |b| {
            b.iter(|| {
                for target in &targets {
                    black_box(inverse.solve(black_box(target), None, &mut work));
                }
            });
        });
    }
    let from = tips[0].translation;
    let turn = |k: usize| {
        let (sin, cos) = (TAU * k as f64 / 1000.0).sin_cos();
        Target::Position(from + Vector3::new(cos - 1.0, sin, -0.0005 * k as f64) * 0.01)
    };
    let targets: Vec<Target> = (0..1000).map(turn).collect();
    let control = Control::default();
    let rows = invert_path(&inverse, &targets, None, &control).unwrap().unwrap();
    assert!(rows.answers.iter().all(|a| a.status == Status::Converged));
    assert!(rows.answers[1..].iter().all(|a| a.starts == 1));
    group.throughput(Throughput::Elements(1000));
    group.bench_function("path/1000_positions", |b| {
        b.iter(|| invert_path(&inverse, black_box(&targets), None, &control));
    });
    group.finish();
}

criterion_group!(all, benches, rods);
criterion_main!(all);
