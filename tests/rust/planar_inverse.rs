//! The inverse of least bending energy: any number of sections, headings, limits, out of reach.

use std::f64::consts::{PI, TAU};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use tdcr::Status;
use tdcr::batch::{Control, pool};
use tdcr::planar::{
    Goal, Inverse, InverseSettings, Trunk, TwoSections, inverse, inverse_rows, inverse_until,
    polish,
};

fn uniform(seed: u64) -> impl FnMut(f64, f64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    move |low, high| rng.random_range(low..high)
}

fn trunk(lengths: &[f64]) -> Trunk {
    Trunk::new(lengths.to_vec(), 0.01).unwrap()
}

fn goal(point: Vector2<f64>, heading: Option<f64>, limit: f64) -> Goal {
    Goal { point, heading, limits: vec![limit] }
}

fn solve(trunk: &Trunk, goal: &Goal) -> Inverse {
    inverse(trunk, goal, &InverseSettings::default()).unwrap()
}

fn tip(trunk: &Trunk, turns: &[f64]) -> (Vector2<f64>, f64) {
    *trunk.platforms(turns).last().unwrap()
}

fn energy(trunk: &Trunk, turns: &[f64]) -> f64 {
    turns.iter().zip(trunk.lengths()).map(|(t, l)| 0.5 * t * t / l).sum()
}

/// Two sections: the first of the exact solutions; t = 0 and t = 8 of the paper's path among them.
#[test]
fn two_sections_get_the_exact_answer() {
    let (l1, l2) = (0.140, 0.120);
    let (two, trunk) = (TwoSections::new(l1, l2, TAU).unwrap(), trunk(&[l1, l2]));
    let mut u = uniform(61);
    let path = (0..5).map(|k| Vector2::new(0.26 - 0.03 * f64::from(k), 0.03 * f64::from(k)));
    let random = (0..3000).map(|_| two.tip([u(-TAU, TAU), u(-TAU, TAU)]));
    for (k, aim) in path.chain(random).enumerate() {
        let mut exact = Vec::new();
        two.solutions(aim.x, aim.y, &mut exact);
        let got = solve(&trunk, &goal(aim, None, TAU));
        assert_eq!(got.status, Status::Converged, "{k} {aim}");
        assert!(got.error <= 1e-12, "{k} {:e}", got.error);
        let off = (got.turns[0] - exact[0][0]).abs().max((got.turns[1] - exact[0][1]).abs());
        assert!(off < 1e-6 || (got.energy / two.energy(exact[0]) - 1.0).abs() < 1e-9, "{k} {off}");
    }
}

/// Reachable targets of three to eight sections: on the target to 1e-12 m, and nothing near it that is
/// on the target too has less energy.
#[test]
fn redundant_sections_take_the_least_energy() {
    let worst = (0..400_u64)
        .into_par_iter()
        .map(|case| {
            let mut u = uniform(6200 + case);
            let m = 3 + case as usize % 6;
            let lengths: Vec<f64> = (0..m).map(|_| u(0.05, 0.2)).collect();
            let trunk = trunk(&lengths);
            let wide = 0.9 * TAU / m as f64;
            let made: Vec<f64> = (0..m).map(|_| u(-wide, wide)).collect();
            let (aim, heading) = tip(&trunk, &made);
            let heading = (case % 3 == 0).then_some(heading);
            let goal = goal(aim, heading, TAU);
            let got = solve(&trunk, &goal);
            assert_eq!(got.status, Status::Converged, "{case} {got:?}");
            assert!(got.error <= 1e-12 && got.heading_error.abs() < 1e-10, "{case} {got:?}");
            assert!((tip(&trunk, &got.turns).0 - aim).norm() < 2e-12);
            assert!((got.energy / energy(&trunk, &got.turns) - 1.0).abs() < 1e-12);
            assert!(got.energy <= energy(&trunk, &made) * (1.0 + 1e-9), "{case} {got:?} {made:?}");
            for _ in 0..20 {
                let moved: Vec<f64> = got.turns.iter().map(|t| t + u(-0.02, 0.02)).collect();
                let around = polish(&trunk, &goal, &moved, &InverseSettings::default()).unwrap();
                assert!(around.energy >= got.energy * (1.0 - 1e-9), "{case}");
            }
            got.error
        })
        .reduce(|| 0.0, f64::max);
    println!("largest miss {worst:.1e} m");
}

/// Three sections against an independent search: the first turn scanned, the other two exact.
#[test]
fn three_sections_against_a_scan() {
    let lengths = [0.1, 0.08, 0.12];
    let trunk = trunk(&lengths);
    let rest = TwoSections::new(lengths[1], lengths[2], TAU).unwrap();
    let counts: Vec<(usize, f64)> = (0..60_u64)
        .into_par_iter()
        .map(|case| {
            let mut u = uniform(6300 + case);
            let aim = tip(&trunk, &[u(-3.0, 3.0), u(-3.0, 3.0), u(-3.0, 3.0)]).0;
            let got = solve(&trunk, &goal(aim, None, TAU));
            let (mut least, mut found) = (f64::INFINITY, Vec::new());
            let n = 4000;
            for k in 0..=n {
                let turn = TAU * (2.0 * f64::from(k) / f64::from(n) - 1.0);
                let joint = tip(&trunk, &[turn, 0.0, 0.0]).0
                    - Vector2::new(turn.cos(), turn.sin()) * (lengths[1] + lengths[2]);
                let to = aim - joint;
                let (sin, cos) = turn.sin_cos();
                rest.solutions(cos * to.x + sin * to.y, cos * to.y - sin * to.x, &mut found);
                for f in &found {
                    least = least.min(energy(&trunk, &[turn, f[0], f[1]]));
                }
            }
            assert!(got.energy < least * (1.0 + 1e-6), "{case}: {} {least} {got:?}", got.energy);
            (got.starts, least / got.energy - 1.0)
        })
        .collect();
    let worst = counts.iter().fold(0.0_f64, |most, c| most.max(c.1));
    println!("the scan's least is at most {worst:.1e} above ours");
}

/// Limits hold, and bind where they must.
#[test]
fn limits_hold() {
    let trunk = trunk(&[0.1, 0.1, 0.1, 0.1]);
    let mut u = uniform(64);
    let mut bound = 0;
    for case in 0..300 {
        let limit = [0.6, 1.0, 2.0][case % 3];
        // Near the limits on both sides, where the least energy often does not fit within them.
        let side = |x: f64| if x < 0.0 { -limit } else { limit };
        let made: Vec<f64> = (0..4).map(|_| side(u(-1.0, 1.0)) * u(0.8, 1.0)).collect();
        let (aim, _) = tip(&trunk, &made);
        let got = solve(&trunk, &goal(aim, None, limit));
        assert_eq!(got.status, Status::Converged, "{case} {limit} {made:?} {got:?}");
        assert!(got.turns.iter().all(|t| t.abs() <= limit));
        assert!(got.energy <= energy(&trunk, &made) * (1.0 + 1e-9));
        bound += usize::from(got.turns.iter().any(|t| t.abs() == limit));
    }
    println!("{bound} of 300 at a limit");
    assert!(bound > 20);
}

/// Out of reach: the nearest point, and the gradient of the distance vanishes there.
fn nearest_points() {
    let two = TwoSections::new(0.14, 0.12, TAU).unwrap();
    let (turns, distance) = two.nearest(0.3, 0.0);
    assert!(turns.iter().all(|t| t.abs() < 1e-6) && (distance - 0.04).abs() < 1e-12);
    let two_trunk = trunk(&[0.14, 0.12]);
    let mut u = uniform(65);
    for case in 0..200 {
        let (angle, radius) = (u(-PI, PI), u(0.27, 0.5));
        let aim = Vector2::new(radius * angle.cos(), radius * angle.sin());
        let (turns, distance) = two.nearest(aim.x, aim.y);
        assert!((two.tip(turns) - aim).norm() - distance < 1e-15);
        let mut least = f64::INFINITY;
        for i in -150..=150 {
            for k in -150..=150 {
                let turns = [f64::from(i) * TAU / 150.0, f64::from(k) * TAU / 150.0];
                least = least.min((two.tip(turns) - aim).norm());
            }
        }
        assert!(distance <= least && distance > least - 2e-4, "{case} {distance} {least}");
        let got = solve(&two_trunk, &goal(aim, None, TAU));
        assert_eq!(got.status, Status::Unreachable);
        assert!((got.error - distance).abs() < 1e-12, "{case} {} {distance}", got.error);
    }
    // A reachable target is its own nearest point.
    let aim = two.tip([1.0, -2.0]);
    assert!(two.nearest(aim.x, aim.y).1 < 1e-15);
    // Within limits the answer stays within them.
    let short = TwoSections::new(0.14, 0.12, 0.5).unwrap();
    for _ in 0..100 {
        let aim = Vector2::new(u(-0.3, 0.3), u(-0.3, 0.3));
        let (turns, distance) = short.nearest(aim.x, aim.y);
        assert!(turns.iter().all(|t| t.abs() <= 0.5));
        let got = solve(&two_trunk, &goal(aim, None, 0.5));
        assert!((got.error - distance).abs() < 1e-9, "{aim} {distance} {got:?}");
    }
}

/// One section reaches a curve; its tip is the arc through the target (eq. 12).
#[test]
fn one_section() {
    let trunk = trunk(&[0.2]);
    for turn in [0.0, 0.3, -2.0, 5.0, -6.0] {
        let got = solve(&trunk, &goal(tip(&trunk, &[turn]).0, None, TAU));
        assert_eq!(got.status, Status::Converged, "{turn} {got:?}");
        assert!((got.turns[0] - turn).abs() < 1e-6, "{turn} {got:?}");
    }
    let got = solve(&trunk, &goal(Vector2::new(0.1, 0.0), None, TAU));
    assert_eq!(got.status, Status::Unreachable);
}

#[test]
fn bad_goals_name_the_argument() {
    let trunk = trunk(&[0.1, 0.1]);
    let settings = InverseSettings::default();
    let name = |goal: &Goal, settings: &InverseSettings| {
        inverse(&trunk, goal, settings).unwrap_err().argument
    };
    let fine = goal(Vector2::new(0.1, 0.1), None, 1.0);
    assert_eq!(name(&goal(Vector2::new(f64::NAN, 0.0), None, 1.0), &settings), "x");
    assert_eq!(name(&goal(Vector2::new(0.0, f64::INFINITY), None, 1.0), &settings), "y");
    assert_eq!(name(&goal(Vector2::zeros(), Some(f64::NAN), 1.0), &settings), "heading");
    assert_eq!(name(&goal(Vector2::zeros(), None, 7.0), &settings), "limit");
    assert_eq!(name(&Goal { limits: vec![1.0; 3], ..fine.clone() }, &settings), "limit");
    assert_eq!(name(&fine, &InverseSettings { tolerance: 0.0, ..settings }), "tolerance");
    assert_eq!(name(&fine, &InverseSettings { max_iterations: 0, ..settings }), "max_iterations");
    assert_eq!(name(&fine, &InverseSettings { starts: 0, ..settings }), "starts");
    let error = polish(&trunk, &fine, &[0.0], &settings).unwrap_err();
    assert_eq!(error.argument, "turns");
}

/// All turns on limits of their own: the target is reached, and that is the answer.
#[test]
fn corners_of_the_limits_converge() {
    let mut u = uniform(66);
    for case in 0..201 {
        let m = if case == 0 { 3 } else { 3 + case % 4 };
        let mut lengths: Vec<f64> = (0..m).map(|_| u(0.05, 0.2)).collect();
        let mut limits: Vec<f64> = (0..m).map(|_| u(0.3, 3.0)).collect();
        let mut made: Vec<f64> = limits.iter().map(|l| l.copysign(u(-1.0, 1.0))).collect();
        if case == 0 {
            (lengths, limits) = (vec![0.1, 0.12, 0.08], vec![0.52, 2.72, 1.46]);
            made = vec![-0.52, -2.72, -1.46];
        }
        let trunk = trunk(&lengths);
        let aim = tip(&trunk, &made).0;
        let asked = Goal { point: aim, heading: None, limits: limits.clone() };
        let got = solve(&trunk, &asked);
        assert_eq!(got.status, Status::Converged, "{case} {made:?} {got:?}");
        assert!(got.error <= 1e-12 && got.energy <= energy(&trunk, &made) * (1.0 + 1e-9));
        assert!(got.turns.iter().zip(&limits).all(|(turn, limit)| turn.abs() <= *limit));
    }
}

/// A search of hours ends without an answer once it is told to, alone and in a batch.
#[test]
fn one_long_search_can_be_stopped() {
    let trunk = trunk(&[0.005; 200]);
    let asked = goal(Vector2::new(0.5, 0.3), None, TAU);
    let settings = InverseSettings { starts: 10_000, ..InverseSettings::default() };
    let (control, pool) = (Control::default(), pool(Some(1)).unwrap());
    let begun = AtomicUsize::new(0);
    let few = InverseSettings { starts: 1, ..settings };
    let short = self::trunk(&[0.3, 0.3, 0.4]);
    std::thread::scope(|scope| {
        let (trunk, asked, settings, control, begun) =
            (&trunk, &asked, &settings, &control, &begun);
        let alone = scope.spawn(move || {
            begun.fetch_add(1, Ordering::Relaxed);
            inverse_until(trunk, asked, settings, &control.stop)
        });
        let rows = scope.spawn(|| {
            begun.fetch_add(1, Ordering::Relaxed);
            inverse_rows(trunk, std::slice::from_ref(asked), settings, &pool, control)
        });
        // Both are at work when short searches that begin after them have ended.
        while begun.load(Ordering::Relaxed) < 2 {
            std::thread::yield_now();
        }
        for _ in 0..100 {
            inverse(&short, asked, &few).unwrap();
        }
        control.stop.store(true, Ordering::Relaxed);
        assert_eq!(alone.join().unwrap(), Ok(None));
        assert_eq!(rows.join().unwrap(), Ok(None));
    });
    let free = AtomicBool::new(false);
    let same = inverse_until(&short, &asked, &few, &free).unwrap();
    assert_eq!(same, Some(inverse(&short, &asked, &few).unwrap()));
}

/// Targets whose distances all tie in rounding still have a nearest point: the farthest their way.
#[test]
fn nearest_points_to_far_targets() {
    let two = TwoSections::new(0.1, 0.1, TAU).unwrap();
    for far in [1e3, 1e10, 1e150, 1e300] {
        let (turns, distance) = two.nearest(far, 0.05);
        assert!(turns.iter().all(|turn| turn.abs() < 2e-3), "{far} {turns:?}");
        assert!((distance / (far - 0.2) - 1.0).abs() < 1e-8, "{far} {distance}");
    }
    let mut u = uniform(67);
    for case in 0..50 {
        let angle = u(-PI, PI);
        let way = Vector2::new(angle.cos(), angle.sin());
        let ahead = |turns| two.tip(turns).dot(&way);
        let got = two.nearest(1e100 * way.x, 1e100 * way.y).0;
        let mut most = f64::NEG_INFINITY;
        for i in -100..=100 {
            for k in -100..=100 {
                most = most.max(ahead([f64::from(i), f64::from(k)].map(|c| c * TAU / 100.0)));
            }
        }
        assert!(ahead(got) > most - 1e-6, "{case} {angle} {got:?} {} {most}", ahead(got));
    }
}

crate::common::slow!(nearest_points,);
