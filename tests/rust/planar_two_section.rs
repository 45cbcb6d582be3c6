//! Two sections exactly: every solution, at folds, at closed circles, and against an independent scan.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use tdcr::planar::TwoSections;

fn uniform(seed: u64) -> impl FnMut(f64, f64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    move |low, high| rng.random_range(low..high)
}

fn all(two: &TwoSections, x: f64, y: f64) -> Vec<[f64; 2]> {
    let mut found = Vec::new();
    two.solutions(x, y, &mut found);
    found
}

fn near(a: [f64; 2], b: [f64; 2], by: f64) -> bool {
    (a[0] - b[0]).abs() < by && (a[1] - b[1]).abs() < by
}

/// The tip by integration of the heading: Gauss-Legendre with five points on pieces of each arc,
/// nothing shared with the solver.
fn tip(l1: f64, l2: f64, turns: [f64; 2]) -> Vector2<f64> {
    let nodes = [0.0, 0.538_469_310_105_683_1, 0.906_179_845_938_664];
    let weights = [0.568_888_888_888_888_9, 0.478_628_670_499_366_47, 0.236_926_885_056_189_1];
    let mut sum = Vector2::zeros();
    for (start, turn, length) in [(0.0, turns[0], l1), (turns[0], turns[1], l2)] {
        let pieces = 24;
        for piece in 0..pieces {
            let mut add = |node: f64, weight: f64| {
                let s = (f64::from(piece) + 0.5 + 0.5 * node) / f64::from(pieces);
                let angle: f64 = start + turn * s;
                let share = 0.5 * weight * length / f64::from(pieces);
                sum += Vector2::new(angle.cos(), angle.sin()) * share;
            };
            add(nodes[0], weights[0]);
            for k in 1..3 {
                add(nodes[k], weights[k]);
                add(-nodes[k], weights[k]);
            }
        }
    }
    sum
}

/// Determinant of the tip's derivative by both turns, over `l1 l2`, by differences.
fn fold(two: &TwoSections, turns: [f64; 2]) -> f64 {
    let h = 1e-6;
    let by = |i: usize| {
        let (mut up, mut down) = (turns, turns);
        up[i] += h;
        down[i] -= h;
        (two.tip(up) - two.tip(down)) / (2.0 * h)
    };
    by(0).perp(&by(1))
}

/// The path of the paper, x = 260 - 15 t, y = 15 t for sections of 140 and 120 mm.
#[test]
fn the_path_of_the_paper() {
    let two = TwoSections::new(0.140, 0.120, TAU).unwrap();
    let listed: [&[[f64; 2]]; 5] = [
        &[[0.0, 0.0]],
        &[[-0.324_743, 1.682_972], [0.731_936, -1.831_385]],
        &[[-0.218_664, 2.214_672], [1.149_471, -2.567_076]],
        &[[0.031_414, 2.419_806], [1.538_991, -3.029_328]],
        &[[0.369_117, 2.336_526], [1.913_319, -3.219_822]],
    ];
    for (k, listed) in listed.iter().enumerate() {
        let t = 2.0 * k as f64;
        let (x, y) = (0.260 - 0.015 * t, 0.015 * t);
        let found = all(&two, x, y);
        assert_eq!(found.len(), listed.len(), "t = {t}: {found:?}");
        for (found, listed) in found.iter().zip(*listed) {
            assert!(near(*found, *listed, 6e-7), "t = {t}: {found:?}");
            assert!((tip(0.140, 0.120, *found) - Vector2::new(x, y)).norm() < 1e-15);
        }
        // |turn| <= pi leaves one branch at t = 8.
        let half = TwoSections::new(0.140, 0.120, PI).unwrap();
        assert_eq!(all(&half, x, y).len(), if k == 4 { 1 } else { listed.len() });
    }
}

/// 1,000,000 targets reached by turns within 2 pi: the turns that made them are always found, or at a
/// fold a pair with the same tip to 1e-12; every answer hits its target to 1e-12 of the length.
#[test]
fn a_million_random_targets() {
    let jobs: Vec<u64> = (0..1000).collect();
    let per_job = 1000;
    let sums = jobs.par_iter().map(|job| {
        let mut u = uniform(4100 + job);
        let mut found = Vec::new();
        let (mut folds, mut count, mut worst) = (0, 0, 0.0_f64);
        for case in 0..per_job {
            // A third each: the paper's lengths, equal lengths, lengths up to 30 times apart.
            let l1 = 0.140;
            let l2 = [0.120, l1, l1 * 30f64.powf(u(-1.0, 1.0))][case % 3];
            let two = TwoSections::new(l1, l2, TAU).unwrap();
            let turns = [u(-TAU, TAU), u(-TAU, TAU)];
            let target = two.tip(turns);
            two.solutions(target.x, target.y, &mut found);
            count += found.len();
            if !found.iter().any(|f| near(*f, turns, 1e-6)) {
                folds += 1;
                let distance = |f: &[f64; 2]| {
                    let middle = [0.5 * (f[0] + turns[0]), 0.5 * (f[1] + turns[1])];
                    (two.tip(middle) - target).norm()
                };
                let least = found.iter().map(distance).fold(f64::INFINITY, f64::min);
                assert!(least < 1e-12 * (l1 + l2), "{l1} {l2} {turns:?} {found:?} {least:e}");
            }
            for f in &found {
                let miss = (two.tip(*f) - target).norm() / (l1 + l2);
                worst = worst.max(miss);
                assert!(miss < 1e-12 && f[0].abs() <= TAU && f[1].abs() <= TAU);
            }
            let energies: Vec<f64> = found.iter().map(|f| two.energy(*f)).collect();
            assert!(energies.is_sorted());
        }
        (folds, count, worst)
    });
    let (folds, count, worst) =
        sums.reduce(|| (0, 0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1, a.2.max(b.2)));
    println!("{count} solutions, {folds} at folds, largest miss {worst:.1e} of the length");
}
