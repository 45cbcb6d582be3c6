//! The planar trunk's hot paths. Every bench checks its answers first.
//!
//! `two_sections`: every solution of a target, mean over 1,000 targets made by random turns within
//! 2 pi, and of the straight trunk, a double solution. `nearest`: out of reach. `inverse`: least energy
//! from all starts. `swarm`: the inverse by particle swarm and polish, to 1e-12 m, mean over the
//! paper's path t = 0 ... 8 and 1,000 seeds; and three sections around a circle. `curve`: Simpson's
//! rule through a spline.
#![allow(missing_docs, clippy::unwrap_used)] // criterion's macros; a bench may stop on a bad answer.

use std::f64::consts::{PI, TAU};
use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::Status;
use tdcr::batch::{Control, pool};
use tdcr::planar::{
    AngleFunction, Circle, Goal, InverseSettings, SwarmInverse, SwarmSettings, SwarmSolver, Trunk,
    TwoSections, Unknowns, WatchDecision, inverse, solution_rows,
};
use tdcr::solve::pso::{PsoSettings, Topology};

fn two_sections(c: &mut Criterion) {
    let mut group = c.benchmark_group("planar");
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut found = Vec::with_capacity(16);
    for (name, l2) in [("paper", 0.120), ("equal", 0.140), ("short_tip", 0.014)] {
        let two = TwoSections::new(0.140, l2, TAU).unwrap();
        let targets: Vec<[f64; 2]> = (0..1000)
            .map(|_| {
                let turns = [rng.random_range(-TAU..TAU), rng.random_range(-TAU..TAU)];
                let tip = two.tip(turns);
                two.solutions(tip.x, tip.y, &mut found);
                assert!(found.iter().any(|f| (f[0] - turns[0]).abs() < 1e-6));
                assert!(found.iter().all(|f| (two.tip(*f) - tip).norm() < 1e-15));
                [tip.x, tip.y]
            })
            .collect();
        let mut next = 0;
        group.bench_function(format!("two_sections/{name}"), |b| {
            b.iter(|| {
                next = (next + 1) % targets.len();
                let [x, y] = targets[next];
                two.solutions(black_box(x), black_box(y), &mut found);
            });
        });
    }
    let two = TwoSections::new(0.140, 0.120, TAU).unwrap();
    two.solutions(0.26, 0.0, &mut found);
    assert!(found.len() == 1 && found[0].iter().all(|turn| turn.abs() < 1e-9));
    group.bench_function("two_sections/straight", |b| {
        b.iter(|| two.solutions(black_box(0.26), 0.0, &mut found));
    });
    assert!((two.nearest(0.3, 0.0).1 - 0.04).abs() < 1e-12);
    group.bench_function("nearest", |b| b.iter(|| two.nearest(black_box(0.3), 0.1)));
    group.finish();
}

fn batch(c: &mut Criterion) {
    let mut group = c.benchmark_group("planar/two_sections/batch_of_10000");
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let two = TwoSections::new(0.140, 0.120, TAU).unwrap();
    let turns: Vec<[f64; 2]> =
        (0..10_000).map(|_| [0; 2].map(|_| rng.random_range(-TAU..TAU))).collect();
    let targets: Vec<[f64; 2]> = turns.iter().map(|turns| two.tip(*turns).into()).collect();
    group.throughput(Throughput::Elements(targets.len() as u64));
    for threads in [1, 2] {
        let pool = pool(Some(threads)).unwrap();
        let many = solution_rows(&two, &targets, &pool, &Control::default()).unwrap();
        let mut first = 0;
        for (turns, count) in turns.iter().zip(many.counts) {
            let own = &many.turns[first..first + count];
            assert!(own.iter().any(|f| (f[0] - turns[0]).abs() < 1e-6));
            first += count;
        }
        group.bench_function(format!("{threads}_threads"), |b| {
            b.iter(|| solution_rows(&two, &targets, &pool, &Control::default()));
        });
    }
    group.finish();
}

fn rest(c: &mut Criterion) {
    let mut group = c.benchmark_group("planar");
    let settings = InverseSettings::default();
    for m in [2, 3, 5] {
        let trunk = Trunk::new(vec![0.1; m], 0.01).unwrap();
        let goal =
            Goal { point: Vector2::new(0.06, 0.05) * m as f64, heading: None, limits: vec![TAU] };
        let found = inverse(&trunk, &goal, &settings).unwrap();
        assert!(found.status == Status::Converged && found.error < 1e-12);
        group.bench_function(format!("inverse/{m}_sections"), |b| {
            b.iter(|| inverse(&trunk, black_box(&goal), &settings));
        });
    }
    let angle = AngleFunction::new(vec![0.0, 0.5, 1.0], &[0.0, 0.5 * PI, PI]).unwrap();
    let end = angle.curve(1000).unwrap().points.pop().unwrap();
    assert!((end - Vector2::new(0.0, 2.0 / PI)).norm() < 1e-12);
    group.bench_function("curve/1000_intervals", |b| b.iter(|| angle.curve(black_box(1000))));
    group.finish();
}

fn one(solver: &mut SwarmSolver<'_>, goal: &Goal, seed: u64) -> SwarmInverse {
    solver.solve(goal, seed, &mut |_| WatchDecision::GoOn).unwrap().unwrap()
}

fn swarm(c: &mut Criterion) {
    let mut group = c.benchmark_group("planar/swarm");
    let trunk = Trunk::new(vec![0.140, 0.120], 0.01).unwrap();
    let to = |x, y| Goal { point: Vector2::new(x, y), heading: None, limits: vec![TAU] };
    let path: Vec<Goal> =
        (0..=8).map(|t| 0.015 * f64::from(t)).map(|way| to(0.26 - way, way)).collect();
    let swarm = PsoSettings { topology: Topology::Ring, ..PsoSettings::default() };
    let ring = SwarmSettings { swarm, ..SwarmSettings::default() };
    let points = SwarmSettings { unknowns: Unknowns::Points, ..SwarmSettings::default() };
    for (name, settings) in
        [("global", SwarmSettings::default()), ("ring", ring), ("points", points)]
    {
        let mut solver = SwarmSolver::new(&trunk, &[], &settings).unwrap();
        for seed in 0..1000 {
            assert!(path.iter().all(|goal| one(&mut solver, goal, seed).inverse.error <= 1e-12));
        }
        let mut next = 0;
        group.bench_function(format!("path_point/{name}"), |b| {
            b.iter(|| {
                next += 1;
                let goal = &path[usize::try_from(next).unwrap() % path.len()];
                one(&mut solver, black_box(goal), next / path.len() as u64 % 1000)
            });
        });
    }
    let trunk = Trunk::new(vec![0.1; 3], 0.01).unwrap();
    let circles = [Circle::new(0.1, 0.04, 0.02).unwrap()];
    let mut solver = SwarmSolver::new(&trunk, &circles, &ring).unwrap();
    let goal = to(0.2, 0.1);
    assert!(one(&mut solver, &goal, 0).clearance >= 0.0);
    group.sample_size(20);
    group.bench_function("around_a_circle/3_sections", |b| b.iter(|| one(&mut solver, &goal, 0)));
    group.finish();
}

criterion_group!(all, two_sections, batch, rest, swarm);
criterion_main!(all);
