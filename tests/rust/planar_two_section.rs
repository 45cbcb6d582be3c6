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

/// Targets at, just inside and just outside of folds, where two solutions meet.
#[test]
fn folds_keep_both_solutions_or_the_double_one() {
    let mut u = uniform(42);
    let (mut doubles, mut pairs) = (0, 0);
    for case in 0..4000 {
        let (l1, l2) = (1.0, 5f64.powf(u(-1.0, 1.0)));
        let two = TwoSections::new(l1, l2, TAU).unwrap();
        // A fold: bisection of the determinant along a random line of turns.
        let (a, b) = ([u(-6.0, 6.0), u(-6.0, 6.0)], [u(-6.0, 6.0), u(-6.0, 6.0)]);
        let at = |s: f64| [a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])];
        let (mut low, mut high) = (0.0, 1.0);
        if (fold(&two, at(low)) < 0.0) == (fold(&two, at(high)) < 0.0) {
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let same = (fold(&two, at(middle)) < 0.0) == (fold(&two, at(low)) < 0.0);
            *(if same { &mut low } else { &mut high }) = middle;
        }
        let turns = at(low);
        let target = two.tip(turns);
        // Across the fold: normal to both derivatives.
        let along = (two.tip([turns[0] + 1e-5, turns[1]]) - target).normalize();
        let across = Vector2::new(-along.y, along.x);
        let off = [0.0, 1e-16, 1e-14, 1e-12, 1e-10, 1e-8, 1e-5][case % 7] * (l1 + l2);
        for sign in [1.0, -1.0] {
            let aim = target + across * (sign * off);
            let found = all(&two, aim.x, aim.y);
            for f in &found {
                assert!((two.tip(*f) - aim).norm() < 1e-12 * (l1 + l2));
            }
            // Solutions near the fold: sqrt of the distance away.
            let reach = 20.0 * (off / (l1 + l2)).sqrt() + 1e-5;
            let close = found.iter().filter(|f| near(**f, turns, reach)).count();
            if off < 2e-14 * (l1 + l2) {
                assert!(close >= 1, "{l2} {turns:?} {off:e} {found:?}");
                doubles += 1;
            } else {
                pairs += close;
            }
        }
    }
    println!("{doubles} double roots, {pairs} solutions near folds");
    assert!(doubles > 1000 && pairs > 2000);
}

/// Targets that the first section reaches: the second is a closed circle to either side.
#[test]
fn closed_circles_are_solutions() {
    let mut u = uniform(43);
    for _ in 0..2000 {
        let (l1, l2, turn) = (0.1, u(0.02, 0.5), u(-6.2, 6.2));
        let two = TwoSections::new(l1, l2, TAU).unwrap();
        let target = two.tip([turn, TAU]);
        let found = all(&two, target.x, target.y);
        for side in [TAU, -TAU] {
            assert!(found.iter().any(|f| near(*f, [turn, side], 1e-9)), "{turn} {found:?}");
        }
        let found = all(&TwoSections::new(l1, l2, 6.25).unwrap(), target.x, target.y);
        assert!(found.iter().all(|f| f[1].abs() <= 6.25));
    }
    // The base itself: one circle of both sections, and each section a circle of its own.
    for l2 in [0.1, 0.03, 0.5] {
        let two = TwoSections::new(0.1, l2, TAU).unwrap();
        let found = all(&two, 0.0, 0.0);
        assert_eq!(found.len(), 6, "{found:?}");
        let whole = [TAU * 0.1 / (0.1 + l2), TAU * l2 / (0.1 + l2)];
        assert!(near(found[0].map(f64::abs), whole, 1e-12), "{found:?}");
        assert!(found[2..].iter().all(|f| f.map(f64::abs) == [TAU, TAU]));
    }
}

/// No solution beyond the reach, and the mirrored ones for the mirrored target.
#[test]
fn reach_and_mirror() {
    let two = TwoSections::new(0.140, 0.120, TAU).unwrap();
    assert!(all(&two, 0.26 + 1e-12, 0.0).is_empty());
    assert!(all(&two, 1.0, -3.0).is_empty());
    assert!(all(&two, f64::NAN, 0.0).is_empty());
    let mut u = uniform(44);
    for _ in 0..2000 {
        let (x, y) = (u(-0.26, 0.26), u(-0.26, 0.26));
        let (up, down) = (all(&two, x, y), all(&two, x, -y));
        assert_eq!(up.len(), down.len());
        for f in &up {
            assert!(down.iter().any(|g| near(*f, [-g[0], -g[1]], 1e-9)), "{x} {y} {f:?}");
        }
    }
}

/// A dense scan of the tip on a grid of both turns finds nothing that the solver has not: every cell
/// whose corners say that it may hold the target is searched by Newton's method from its middle.
#[test]
fn a_dense_scan_finds_no_more() {
    let n = 500;
    let width = 2.0 * TAU / f64::from(n);
    let total: usize = (0..40_u64)
        .into_par_iter()
        .map(|case| {
            let mut u = uniform(4500 + case);
            let (l1, l2) = (1.0, 4f64.powf(u(-1.0, 1.0)));
            let two = TwoSections::new(l1, l2, TAU).unwrap();
            let aim = tip(l1, l2, [u(-TAU, TAU), u(-TAU, TAU)]);
            let found = all(&two, aim.x, aim.y);
            let mut seen: Vec<[f64; 2]> = Vec::new();
            for i in 0..n {
                for k in 0..n {
                    let middle = [i, k].map(|i| (f64::from(i) + 0.5) * width - TAU);
                    // |d tip/d turn1| <= l1/2 + l2, |d tip/d turn2| <= l2/2.
                    let reach = 0.5 * width * (0.5 * l1 + 1.5 * l2);
                    if (two.tip(middle) - aim).norm() > reach {
                        continue;
                    }
                    if let Some(root) = newton(&two, middle, aim)
                        && root.iter().all(|t| t.abs() <= TAU)
                        && !seen.iter().any(|s| near(*s, root, 1e-7))
                    {
                        seen.push(root);
                    }
                }
            }
            for root in &seen {
                assert!(
                    found.iter().any(|f| near(*f, *root, 1e-6)),
                    "{l2} {aim} {root:?} {found:?}"
                );
            }
            assert!(found.len() >= seen.len());
            seen.len()
        })
        .sum();
    println!("{total} solutions by the scan");
    assert!(total > 80);
}

/// Newton's method with differences, to a miss below 1e-11.
fn newton(two: &TwoSections, start: [f64; 2], aim: Vector2<f64>) -> Option<[f64; 2]> {
    let mut turns = start;
    for _ in 0..30 {
        let off = two.tip(turns) - aim;
        if off.norm() < 1e-11 {
            return Some(turns);
        }
        let h = 1e-6;
        let by = |i: usize| {
            let mut moved = turns;
            moved[i] += h;
            (two.tip(moved) - two.tip(turns)) / h
        };
        let (a, b) = (by(0), by(1));
        let area = a.perp(&b);
        turns = [turns[0] - off.perp(&b) / area, turns[1] - a.perp(&off) / area];
        if !turns.iter().all(|t| t.abs() < 10.0) {
            return None;
        }
    }
    None
}

#[test]
fn bad_sections_name_the_argument() {
    let name = |l1, l2, limit| TwoSections::new(l1, l2, limit).unwrap_err().argument;
    assert_eq!(name(0.0, 1.0, 1.0), "l1");
    assert_eq!(name(1.0, f64::NAN, 1.0), "l2");
    assert_eq!(name(1.0, 1.0, 0.0), "limit");
    assert_eq!(name(1.0, 1.0, 6.3), "limit");
    assert_eq!(name(1.0, 1.0, f64::NAN), "limit");
}

/// Where the equation is at its worst: turns near 2 pi and near zero, sections up to 10,000 times apart.
/// The turns that made the target are found, and the work stays bounded.
fn hard_targets_take_little_more() {
    let count = 2000;
    let job = |job: u64| {
        let mut u = uniform(4600 + job);
        let (mut found, mut most, mut total) = (Vec::new(), 0, 0);
        for _ in 0..count {
            let (l1, l2) = (1.0, 10f64.powf(u(-4.0, 4.0)));
            let two = TwoSections::new(l1, l2, TAU).unwrap();
            let turns = [0; 2].map(|_| {
                let small = 10f64.powf(u(-16.0, 0.0)).copysign(u(-1.0, 1.0));
                match u(0.0, 1.0) {
                    kind if kind < 0.3 => small,
                    kind if kind < 0.6 => (TAU - small.abs()).copysign(small),
                    _ => u(-TAU, TAU),
                }
            });
            let aim = two.tip(turns);
            let looks = two.search(aim.x, aim.y, &mut found);
            (most, total) = (most.max(looks), total + looks);
            let hit = |f: &[f64; 2]| {
                let middle = [0.5 * (f[0] + turns[0]), 0.5 * (f[1] + turns[1])];
                let miss = (two.tip(middle) - aim).norm();
                near(*f, turns, 1e-6) || (near(*f, turns, 1e-2) && miss < 1e-12 * (l1 + l2))
            };
            assert!(found.iter().any(hit), "{l2} {turns:?} {found:?}");
        }
        (most, total)
    };
    let (most, total) = (0..64_u64)
        .into_par_iter()
        .map(job)
        .reduce(|| (0, 0), |a: (usize, usize), b| (a.0.max(b.0), a.1 + b.1));
    println!("at most {most} intervals, {} in the mean", total / (64 * count));
    assert!(most < 10_000);
}

/// Sections up to 1e15 times apart: the search ends, and what it finds is right.
#[test]
fn extreme_lengths_end() {
    let mut u = uniform(47);
    let (mut found, mut most) = (Vec::new(), 0);
    for case in 0..20_000 {
        let (l1, l2) = (1.0, 10f64.powf(u(-15.0, 15.0)));
        let two = TwoSections::new(l1, l2, TAU).unwrap();
        let turns = [u(-TAU, TAU), if case % 2 == 0 { TAU } else { u(-TAU, TAU) }];
        let aim = two.tip(turns);
        most = most.max(two.search(aim.x, aim.y, &mut found));
        assert!(found.iter().all(|f| (two.tip(*f) - aim).norm() < 1e-12 * (l1 + l2)));
    }
    println!("at most {most} intervals");
    assert!(most < 10_000);
}

crate::common::slow!(a_million_random_targets, hard_targets_take_little_more,);
