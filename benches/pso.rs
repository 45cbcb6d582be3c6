//! The swarm's hot paths. Every bench checks its answer first.
//!
//! `move`: iterations of a swarm whose objective costs nothing, per particle and dimension, in every
//! preset and topology. `start`: seeding, scattering and one move of a small swarm. `two_sections`: the
//! inverse of Mahfoudi's planar trunk to 1e-9 m at t = 4, whole runs with a reused swarm.
#![allow(missing_docs, clippy::unwrap_used)] // criterion's macros; a bench may stop on a bad answer.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use tdcr::Status;
use tdcr::solve::pso::{Pointwise, PsoSettings, Swarm, Topology, Whole};

/// Iterations of one bench of moves.
const MOVES: usize = 100;

fn ring() -> PsoSettings {
    PsoSettings { topology: Topology::Ring, ..PsoSettings::constriction() }
}

fn moves(c: &mut Criterion) {
    let mut group = c.benchmark_group("move");
    let swarms = [
        ("constriction", PsoSettings::constriction()),
        ("ring", ring()),
        ("spso2011", PsoSettings::spso2011()),
    ];
    for (name, settings) in swarms {
        for n in [2, 5, 30] {
            let settings =
                PsoSettings { particles: 30, max_iterations: MOVES, stagnation: None, ..settings };
            let mut swarm = Swarm::new(settings, &vec![-1.0; n], &vec![1.0; n]).unwrap();
            // A value for every particle that falls every time: all leaders change all the time.
            let run = |swarm: &mut Swarm| {
                let mut level = 0.0;
                swarm.run(&mut Whole(|_: &[f64], _, values: &mut [f64]| {
                    level -= 1.0;
                    values.fill(level);
                }))
            };
            let Ok(report) = run(&mut swarm);
            assert_eq!((report.iterations, report.value), (MOVES, -(MOVES as f64) - 1.0));
            group.throughput(Throughput::Elements((30 * n * MOVES) as u64));
            group.bench_function(BenchmarkId::new(name, n), |b| b.iter(|| run(&mut swarm)));
        }
    }
    group.finish();
}

fn starts(c: &mut Criterion) {
    let settings = PsoSettings { particles: 20, max_iterations: 1, ..PsoSettings::default() };
    let mut swarm = Swarm::new(settings, &[-1.0; 2], &[1.0; 2]).unwrap();
    let mut objective = Pointwise(|x: &[f64]| x[0]);
    let Ok(report) = swarm.run(&mut objective);
    assert_eq!(report.evaluations, 40);
    c.bench_function("start/20_particles_2", |b| b.iter(|| swarm.run(&mut objective)));
}

/// Tip of two arcs of 140 and 120 mm with given turns, to a point.
fn distance(turns: &[f64], x: f64, y: f64) -> f64 {
    // Chord of an arc: sin(t/2)/(t/2) of its length, at half its turn.
    let chord = |length: f64, turn: f64| {
        let half = 0.5 * turn;
        if half.abs() < 1e-8 { length } else { length * half.sin() / half }
    };
    let (first, second) = (chord(0.14, turns[0]), chord(0.12, turns[1]));
    let (s1, c1) = (0.5 * turns[0]).sin_cos();
    let (s2, c2) = (turns[0] + 0.5 * turns[1]).sin_cos();
    (first * c1 + second * c2 - x).hypot(first * s1 + second * s2 - y)
}

fn two_sections(c: &mut Criterion) {
    assert!(distance(&[-0.218_664, 2.214_672], 0.200, 0.060) < 1e-6);
    let mut group = c.benchmark_group("two_sections");
    let swarms = [
        ("constriction", PsoSettings::constriction()),
        ("ring", ring()),
        ("spso2011", PsoSettings::spso2011()),
        ("mahfoudi", PsoSettings::mahfoudi()),
    ];
    for (name, settings) in swarms {
        let settings = PsoSettings { particles: 20, target: Some(1e-9), ..settings };
        let bound = [2.0 * std::f64::consts::PI; 2];
        let mut swarm = Swarm::new(settings, &bound.map(|b| -b), &bound).unwrap();
        let mut seed = 0;
        let mut run = |swarm: &mut Swarm| {
            seed += 1;
            swarm.reseed(seed % 100);
            swarm.run(&mut Pointwise(|turns: &[f64]| distance(black_box(turns), 0.2, 0.06)))
        };
        let hits =
            (0..100).filter(|_| run(&mut swarm).unwrap().status == Status::Converged).count();
        println!("two_sections/{name}: {hits} of 100 seeds to 1e-9 m");
        group.bench_function(name, |b| b.iter(|| run(&mut swarm)));
    }
    group.finish();
}

criterion_group!(benches, moves, starts, two_sections);
criterion_main!(benches);
