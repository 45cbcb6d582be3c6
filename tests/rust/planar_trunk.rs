//! Planar trunks: cables to turns, platforms, angle functions and their curves.

use std::f64::consts::PI;

use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::planar::{AngleFunction, Cables, Trunk};

fn uniform(seed: u64) -> impl FnMut(f64, f64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    move |low, high| rng.random_range(low..high)
}

/// End of an arc of unit length.
fn arc(turn: f64) -> Vector2<f64> {
    if turn == 0.0 {
        return Vector2::x();
    }
    Vector2::new(turn.sin(), 1.0 - turn.cos()) / turn
}

/// The paper's three sections of 200, 150 and 100 mm with cables 60 mm apart: platform 1 as printed;
/// platforms 2 and 3 from the printed headings, read as absolute.
#[test]
fn the_platforms_of_the_paper() {
    let trunk = Trunk::new(vec![0.200, 0.150, 0.100], 0.060).unwrap();
    let cables = [[0.170, 0.230], [0.170, 0.130], [0.130, 0.070]];
    let bent = trunk.turns(&cables, Cables::Chords).unwrap();
    assert!((bent.turns[0] - PI / 3.0).abs() < 1e-15);
    let (first, heading) = trunk.platforms(&bent.turns)[0];
    assert!((first * 1e3 - Vector2::new(165.40, 95.49)).amax() < 5e-3);
    assert!((heading - PI / 3.0).abs() < 1e-15);
    // The printed sums are those of the sections, not of chords that bend: 9 mm off in section 1.
    assert!((bent.misfit[0] - (0.2 - 0.2 * 3.0 / PI)).abs() < 1e-15);
    // The cables of sections 2 and 3 give other headings than those printed.
    let headings: Vec<f64> = trunk.platforms(&bent.turns).iter().map(|p| p.1).collect();
    assert!((headings[1] + 0.486).abs() > 0.5 && (headings[2] - PI / 3.0).abs() > 0.5);

    let absolute = [PI / 3.0, -0.486, PI / 3.0];
    let turns = [absolute[0], absolute[1] - absolute[0], absolute[2] - absolute[1]];
    let at = trunk.platforms(&turns);
    assert!((at[2].0 * 1e3 - Vector2::new(382.77, 158.14)).amax() < 5e-3, "{at:?}");
    // Platform 2 as printed lies on the curve at s = 348 mm.
    let printed = Vector2::new(294.05, 133.97);
    let curve = trunk.curve(&turns, 1501);
    let nearest = (curve.iter())
        .map(|row| (row[0] * 1e3, (Vector2::new(row[1], row[2]) * 1e3 - printed).norm()))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap();
    assert!((nearest.0 - 348.0).abs() < 0.15 && nearest.1 < 0.03, "{nearest:?}");
    assert!((at[1].0 * 1e3 - printed).norm() > 1.5);
}

#[test]
fn cables_and_turns_undo_each_other() {
    let mut u = uniform(51);
    for case in 0..2000 {
        let lengths = vec![u(0.05, 0.3), u(0.05, 0.3)];
        let trunk = Trunk::new(lengths.clone(), u(0.002, 0.02)).unwrap();
        let reading = Cables::ALL[case % 2];
        let turns = [u(-2.2, 2.2), if case % 5 == 0 { 0.0 } else { u(-2.2, 2.2) }];
        let cables = trunk.cable_lengths(&turns, reading).unwrap();
        let bent = trunk.turns(&cables, reading).unwrap();
        for (got, turn) in bent.turns.iter().zip(turns) {
            assert!((got - turn).abs() < 1e-12, "{got} {turn}");
        }
        assert!(bent.misfit.iter().all(|m| m.abs() < 1e-13));
        // Cable 1 is on the left: a left turn shortens it, by the parallel arc or its chord.
        assert_eq!(turns[0] > 0.0, cables[0][0] < cables[0][1]);
    }
}

/// The heading's integral, platforms at the ends of sections.
/// Half a circle comes back although the cable lengths are rounded.
#[test]
fn half_circles_are_chords() {
    let mut uniform = uniform(11);
    for _ in 0..2000 {
        let length = 10.0_f64.powf(uniform(-2.0, 3.0));
        let trunk = Trunk::new(vec![length], length * 10.0_f64.powf(uniform(-6.0, -0.5))).unwrap();
        for turn in [-PI, PI] {
            let cables = trunk.cable_lengths(&[turn], Cables::Chords).unwrap();
            let back = trunk.turns(&cables, Cables::Chords).unwrap().turns[0];
            // The sine is flat there: the turn is known to the root of its rounding.
            let share = cables[0][0].max(cables[0][1]) / (cables[0][1] - cables[0][0]).abs();
            let known = 8.0 * (f64::EPSILON * (1.0 + share)).sqrt();
            assert!((back - turn).abs() <= known, "{back} for {turn}");
        }
    }
    let trunk = Trunk::new(vec![0.21], 0.0342).unwrap();
    let apart = |share: f64| trunk.turns(&[[0.1, 0.1 + 0.0342 * share]], Cables::Chords);
    assert!(apart(2.0 + 1e-13).is_ok());
    assert_eq!(apart(2.0 + 1e-11).unwrap_err().argument, "cable_lengths[0]");
}

#[test]
fn curves_end_on_the_platforms() {
    let trunk = Trunk::new(vec![0.2, 0.15, 0.1], 0.06).unwrap();
    let turns = [1.0, -2.5, 0.0];
    let curve = trunk.curve(&turns, 11);
    assert_eq!(curve.len(), 33);
    for (k, (point, heading)) in trunk.platforms(&turns).iter().enumerate() {
        let [_, x, y, end] = curve[11 * k + 10];
        assert!((Vector2::new(x, y) - point).norm() < 1e-16 && (end - heading).abs() < 1e-15);
    }
    assert!((trunk.platforms(&turns)[0].0 - arc(1.0) * 0.2).norm() < 1e-16);
}

/// A linear angle: the spline is exact, and Simpson's rule with 1000 intervals gives the arc to 1e-12.
#[test]
fn a_linear_angle_gives_the_arc() {
    for (length, nodes) in [(0.2, 2), (0.2, 5), (1.0, 11), (3.0, 41)] {
        for k in -8..=8 {
            let turn = PI * f64::from(k) / 8.0;
            let s: Vec<f64> =
                (0..nodes).map(|i| length * f64::from(i) / f64::from(nodes - 1)).collect();
            let angles: Vec<f64> = s.iter().map(|s| turn * s / length).collect();
            let angle = AngleFunction::new(s.clone(), &angles).unwrap();
            for (s, expected) in [(0.0, 0.0), (0.37 * length, 0.37 * turn), (length, turn)] {
                assert!((angle.at(s) - expected).abs() < 1e-14);
            }
            for (intervals, goal) in [(100, 4e-9), (1000, 1e-12)] {
                let curve = angle.curve(intervals).unwrap();
                assert!(curve.error < 1.6 * goal * length);
                let mut worst = 0.0_f64;
                for (s, point) in curve.s.iter().zip(&curve.points) {
                    let share = s / length;
                    worst = worst.max((point - arc(turn * share) * *s).norm() / length);
                }
                assert!(worst < goal, "{turn} {intervals} {worst:e}");
                assert!(worst * length <= curve.error + 1e-14 * length, "{worst:e}");
                if k == 8 && nodes == 2 {
                    println!("{intervals} intervals, turn pi: {worst:.1e} of the length");
                }
            }
        }
    }
}

/// Ends of curves through 10, 20, ... nodes of a smooth angle against a fine one.
fn orders(angle: fn(f64) -> f64) -> Vec<f64> {
    let end = |n: usize| {
        let s: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
        let angles: Vec<f64> = s.iter().map(|s| angle(*s)).collect();
        let curve = AngleFunction::new(s, &angles).unwrap().curve(40_000).unwrap();
        *curve.points.last().unwrap()
    };
    let exact = {
        // Simpson's rule on the angle itself.
        let n = 20_000;
        let direction = |k: usize| {
            let a = angle(k as f64 / (2 * n) as f64);
            Vector2::new(a.cos(), a.sin())
        };
        (0..n).fold(Vector2::zeros(), |sum, k| {
            sum + (direction(2 * k) + direction(2 * k + 1) * 4.0 + direction(2 * k + 2))
                / (6 * n) as f64
        })
    };
    let errors: Vec<f64> = [20, 40, 80, 160].iter().map(|n| (end(*n) - exact).norm()).collect();
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

/// Order 3 with natural ends, 4 where the second derivative of the angle vanishes at both.
#[test]
fn nonlinear_angles_converge() {
    let natural = orders(|s| 1.5 * s * s + 0.3 * (2.0 * s).sin());
    let flat = orders(|s| 0.8 * s + 0.7 * (2.0 * PI * s).sin());
    println!("orders: natural ends {natural:.2?}, vanishing second derivative {flat:.2?}");
    assert!((natural[2] - 3.0).abs() < 0.1, "{natural:?}");
    assert!((flat[2] - 4.0).abs() < 0.1, "{flat:?}");
}

/// The stated error bounds the actual one, and is of its size.
#[test]
fn the_stated_error_is_a_bound() {
    let mut u = uniform(52);
    for _ in 0..200 {
        let n = 3 + u(0.0, 6.0) as usize;
        let mut s = vec![0.0];
        for _ in 0..n {
            s.push(s[s.len() - 1] + u(0.05, 0.3));
        }
        let angles: Vec<f64> = s.iter().map(|_| u(-1.0, 1.0)).collect();
        let angle = AngleFunction::new(s, &angles).unwrap();
        let (coarse, fine) = (angle.curve(60).unwrap(), angle.curve(6000).unwrap());
        let off = (coarse.points.last().unwrap() - fine.points.last().unwrap()).norm();
        assert!(off <= coarse.error && coarse.error < 1e-2, "{off:e} {:e}", coarse.error);
    }
}

/// Interpolation, continuity up to the second derivative, natural ends.
#[test]
fn splines_are_natural() {
    let s = vec![0.0, 0.1, 0.25, 0.3, 0.5];
    let angles = [0.2, -0.3, 0.5, 0.4, 1.0];
    let spline = AngleFunction::new(s.clone(), &angles).unwrap();
    let pieces = spline.coefficients();
    for i in 0..4 {
        let [a, b, c, d] = pieces[i];
        assert!((d - angles[i]).abs() < 1e-15 && (a + b + c + d - angles[i + 1]).abs() < 1e-14);
        let h = s[i + 1] - s[i];
        if i < 3 {
            let [_, next_b, next_c, _] = pieces[i + 1];
            let next = s[i + 2] - s[i + 1];
            assert!(((3.0 * a + 2.0 * b + c) / h - next_c / next).abs() < 1e-12);
            assert!(((6.0 * a + 2.0 * b) / (h * h) - 2.0 * next_b / (next * next)).abs() < 1e-10);
        }
    }
    assert_eq!(pieces[0][1], 0.0);
    assert!((6.0 * pieces[3][0] + 2.0 * pieces[3][1]).abs() < 1e-14);
}

#[test]
fn bad_trunks_name_the_argument() {
    assert_eq!(Trunk::new(vec![], 0.1).unwrap_err().argument, "lengths");
    assert_eq!(Trunk::new(vec![0.1, -0.1], 0.1).unwrap_err().argument, "lengths[1]");
    assert_eq!(Trunk::new(vec![0.1], 0.0).unwrap_err().argument, "cable_distance");
    let trunk = Trunk::new(vec![0.2], 0.06).unwrap();
    let name = |cables: &[[f64; 2]], reading| trunk.turns(cables, reading).unwrap_err().argument;
    assert_eq!(name(&[], Cables::Chords), "cable_lengths");
    assert_eq!(name(&[[0.1, 0.0]], Cables::Arcs), "cable_lengths[0][1]");
    assert_eq!(name(&[[0.1, 0.3]], Cables::Chords), "cable_lengths[0]");
    assert!(trunk.turns(&[[0.1, 0.3]], Cables::Arcs).is_ok());
    assert_eq!(trunk.cable_lengths(&[3.2], Cables::Chords).unwrap_err().argument, "turns[0]");
    assert_eq!(trunk.check_turns(&[f64::NAN]).unwrap_err().argument, "turns[0]");
    let name = |s: &[f64], a: &[f64]| AngleFunction::new(s.to_vec(), a).unwrap_err().argument;
    assert_eq!(name(&[0.0], &[0.0]), "s");
    assert_eq!(name(&[0.0, 0.0], &[0.0, 0.0]), "s[1]");
    assert_eq!(name(&[0.0, 1.0], &[0.0]), "angles");
    assert_eq!(name(&[0.0, 1.0], &[0.0, f64::NAN]), "angles[1]");
    // Splines that overflow, or whose error would.
    assert_eq!(name(&[-1.7e308, 1.7e308], &[0.0, 1.0]), "s");
    assert_eq!(name(&[0.0, 4e307, 8e307], &[0.0, 1.0, 0.0]), "s");
    assert_eq!(name(&[0.0, 1e-300, 1.0], &[0.0, 1.0, 2.0]), "s");
    assert_eq!(name(&[0.0, 1.0, 2.0], &[-1e308, 1e308, 0.0]), "s");
    for (s, angles) in [([0.0, 1e100], [0.0, 0.0]), ([0.0, 1e-300], [0.0, 3.0])] {
        let curve = AngleFunction::new(s.to_vec(), &angles).unwrap().curve(10).unwrap();
        assert!(curve.error.is_finite() && curve.error <= 0.01 * s[1], "{}", curve.error);
        assert!(curve.points.iter().all(|point| point.iter().all(|x| x.is_finite())));
    }
    let angle = AngleFunction::new(vec![0.0, 1.0], &[0.0, 1.0]).unwrap();
    assert_eq!(angle.curve(1).unwrap_err().argument, "intervals");
}
