//! The rod against closed forms: straight tendons and links.
//!
//! **Tendon chords.** Let all holes of a tendon lie at radius a and azimuth ψ, and a subsegment of length l be
//! an arc that bends by β towards azimuth φ. In the plane of bending the hole runs on a circle of radius
//! l/β − a cos(ψ − φ) through the angle β, and its offset from that plane is the same at both ends, so that the
//! tendon's piece is a chord of that circle:
//!
//!   `c = (l/β − a cos(ψ − φ)) 2 sin(β/2) = l S(β) − a X·e(ψ)`,  `S = sin(β/2) / (β/2)`,  `X = 2 sin(β/2) e(φ)`.
//!
//! Reflection in the plane that halves the subsegment swaps its ends, keeps bending and changes the sign of
//! torsion: every chord is even in torsion, which is therefore zero in a balance. With EI = 1 the balance of
//! bending is, for tensions `T_j` of tendons at `a_j`, `ψ_j`,
//!
//!   across φ:  `Σ T_j a_j sin(ψ_j − φ) = 0`  (c changes with φ by `−2 sin(β/2) a sin(ψ − φ)`),
//!   along φ:   `β/l = Σ T_j (a_j cos(β/2) cos(ψ_j − φ) − l S'(β))`.
//!
//! One tendon thus bends towards itself, φ = ψ, with `T = β / (l (a cos(β/2) − l S'))`. Two tendons are both taut
//! (T > 0) exactly for the φ between ψ₁ and ψ₂, and their two chords determine (β, φ) without any energy; with φ
//! outside, one is slack and the other alone decides. All subsegments alike take equal shares of a displacement.

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Vector2, Vector3};
use tdcr::lie::Pose;
use tdcr::lie::so3;
use tdcr::linkage::{self, Linkage, LinkageSettings};
use tdcr::model::Model;
use tdcr::robot::{Robot, Tendon};
use tdcr::rod::{RodSettings, Subsegment, TendonLaw};
use tdcr::{Shape, Status};

use crate::common::{robot, straight};
use crate::rod_common::{apart, solved};

/// Of the solver: an error of this share of a length is one of the bend by TOLERANCE l/a.
const TOLERANCE: f64 = 1e-11;

/// Straight tendons: radius and azimuth of each.
fn parallel(length: f64, n: usize, holes: &[(f64, f64)]) -> Robot {
    let tendons = holes.iter().map(|(a, psi)| Tendon::straight(*psi, *a).unwrap()).collect();
    robot(length, n, tendons)
}

/// S and its slope, by series where the difference would cancel.
fn chord_factor(beta: f64) -> (f64, f64) {
    let (half, square) = (0.5 * beta, beta * beta);
    if beta < 0.05 {
        let series = 1.0 - square / 24.0 + square * square / 1920.0;
        (series, beta * (-1.0 / 12.0 + square / 480.0 - square * square / 53760.0))
    } else {
        (half.sin() / half, half.cos() / beta - half.sin() / (half * beta))
    }
}

/// Shortening of a piece.
fn shortening(l: f64, (a, psi): (f64, f64), beta: f64, phi: f64) -> f64 {
    // 1 - S without the cancellation.
    let gap = if beta < 0.05 {
        beta * beta / 24.0 * (1.0 - beta * beta / 80.0)
    } else {
        1.0 - chord_factor(beta).0
    };
    l * gap + 2.0 * (0.5 * beta).sin() * a * (psi - phi).cos()
}

/// Disks of n arcs (or links) of bend beta towards phi.
fn alike(kind: Subsegment, l: f64, n: usize, beta: f64, phi: f64) -> Vec<Pose> {
    let turn = Vector3::new(-phi.sin(), phi.cos(), 0.0) * beta;
    let along = Vector3::z() * l;
    let translation = match kind {
        Subsegment::Arc => so3::left_jacobian(&turn) * along,
        Subsegment::Link => so3::exp(&(0.5 * turn)) * along,
    };
    let step = Pose { rotation: so3::exp(&turn), translation };
    let mut frames = vec![Pose::identity()];
    for i in 0..n {
        frames.push(frames[i].compose(&step));
    }
    frames
}

/// Largest distance of disks from where they should be, and of rotations.
fn off(shape: &Shape, wanted: &[Pose]) -> (f64, f64) {
    assert_eq!(shape.state.frames.len(), wanted.len());
    let mut worst = (0.0_f64, 0.0_f64);
    for (frame, wanted) in shape.state.frames.iter().zip(wanted) {
        worst.0 = worst.0.max((frame.translation - wanted.translation).norm());
        worst.1 = worst.1.max((frame.rotation - wanted.rotation).amax());
    }
    worst
}

/// Bends to try: from tiny to 0.9 of the geometric limit.
fn bends(l: f64, a: f64) -> [f64; 6] {
    let limit = (0.9 * l / a).min(1.4);
    [1e-7, 1e-3, 0.1, 0.4, 0.7, 1.0].map(|share| share * limit)
}

#[test]
fn one_straight_tendon_is_the_theory_of_chords() {
    let (mut place, mut turn, mut tension, mut cases) = (0.0_f64, 0.0_f64, 0.0_f64, 0);
    for n in [1, 2, 3, 7, 10, 25, 40] {
        for ratio in [0.1, 0.4, 0.9] {
            for k in 0..7 {
                let (length, phi) = (0.3, TAU * f64::from(k) / 7.0 - 3.0);
                let l = length / n as f64;
                let hole = (ratio * l, phi);
                let robot = parallel(length, n, &[hole]);
                for beta in bends(l, hole.0) {
                    let pull = -(n as f64) * shortening(l, hole, beta, phi);
                    let shape = solved(&robot, RodSettings::default(), &[pull]);
                    let (p, t) = off(&shape, &alike(Subsegment::Arc, l, n, beta, phi));
                    place = place.max(p / length);
                    let bend = TOLERANCE * l / hole.0;
                    turn = turn.max(t / (n as f64 * bend));
                    let slope = chord_factor(beta).1;
                    let exact = beta / (l * (hole.0 * (0.5 * beta).cos() - l * slope));
                    let relative = (shape.state.tensions[0] / exact - 1.0).abs();
                    tension = tension.max(relative / (bend / beta + TOLERANCE));
                    cases += 1;
                }
            }
        }
    }
    println!(
        "{cases} cases: places {place:.1e}; rotations {turn:.1}, tensions {tension:.1} of what"
    );
    println!("a length within its tolerance leaves open");
    assert!(place < 1e-10 && turn < 1.0 && tension < 4.0);
}

#[test]
fn two_straight_tendons_are_the_theory_of_chords() {
    let (mut place, mut turn, mut tension, mut cases) = (0.0_f64, 0.0_f64, 0.0_f64, 0);
    for n in [1, 2, 5, 12, 40] {
        for (ratios, between) in [((0.4, 0.4), 0.5), ((0.4, 0.25), 1.6), ((0.2, 0.8), 2.6)] {
            for share in [0.1, 0.5, 0.8] {
                let (length, psi) = (0.25, 0.7);
                let (l, phi) = (length / n as f64, psi + share * between);
                let holes = [(ratios.0 * l, psi), (ratios.1 * l, psi + between)];
                let robot = parallel(length, n, &holes);
                for beta in bends(l, f64::max(holes[0].0, holes[1].0)) {
                    let pull = holes.map(|hole| -(n as f64) * shortening(l, hole, beta, phi));
                    let shape = solved(&robot, RodSettings::default(), &pull);
                    let (p, t) = off(&shape, &alike(Subsegment::Arc, l, n, beta, phi));
                    place = place.max(p / length);
                    let bend = TOLERANCE * l / f64::min(holes[0].0, holes[1].0);
                    turn = turn.max(t / (n as f64 * bend));
                    let slope = chord_factor(beta).1;
                    let row = |f: &dyn Fn((f64, f64)) -> f64| [f(holes[0]), f(holes[1])];
                    let across = row(&|(a, psi)| a * (psi - phi).sin());
                    let along =
                        row(&|(a, psi)| a * (0.5 * beta).cos() * (psi - phi).cos() - l * slope);
                    let balance = Matrix2::new(across[0], across[1], along[0], along[1]);
                    let exact = balance.lu().solve(&Vector2::new(0.0, beta / l)).unwrap();
                    assert!(exact.min() > 0.0);
                    for (own, exact) in shape.state.tensions.iter().zip(&exact) {
                        let relative = (own - exact).abs() / exact;
                        tension = tension.max(relative / (bend / beta + TOLERANCE));
                    }
                    cases += 1;
                }
            }
        }
    }
    println!(
        "{cases} cases: places {place:.1e}; rotations {turn:.1}, tensions {tension:.1} of what"
    );
    println!("a length within its tolerance leaves open");
    assert!(place < 1e-10 && turn < 1.0 && tension < 4.0);
}

/// A second tendon that is pulled by less than the first one shortens it hangs slack.
#[test]
fn a_tendon_pulled_by_too_little_is_slack() {
    let (length, n, a) = (0.2, 10, 0.008);
    let l = length / n as f64;
    let holes = [(a, 0.3), (a, 1.1)];
    let robot = parallel(length, n, &holes);
    for beta in bends(l, a) {
        let need = holes.map(|hole| -(n as f64) * shortening(l, hole, beta, 0.3));
        let shape = solved(&robot, RodSettings::default(), &[need[0], 0.9 * need[1]]);
        let (place, turn) = off(&shape, &alike(Subsegment::Arc, l, n, beta, 0.3));
        assert!(place < 1e-10 * length && turn < 1e-10);
        assert!(shape.state.tensions[0] > 0.0 && shape.state.tensions[1] == 0.0);
    }
}

/// With links and equal holes a piece, seen from the halved bend, is `(0, 0, l) + k w × h` with
/// `k = 2 sin(|w|/2) / |w|`: its square is `(l − a X·e(ψ))² + k² a² w_z²` with `X = k (w_y, −w_x)`. Without torsion
/// that is the linkage's `a_j X·e(ψ_j) = l − l_j`, with `|X| = 2 sin(β/2)`.
///
/// One tendon: the shape needs `X·e(ψ) ≥ (l − l₁)/a`, torsion only lengthens the piece and lowers k, and the bend is
/// least towards ψ. The least strain energy and the least coupler angle (half the bend) thus agree. Two tendons: two
/// equations for X, and both minima are without torsion while that is stable.
#[test]
fn links_in_proportion_are_the_linkage() {
    let settings = RodSettings {
        subsegment: Subsegment::Link,
        tendons: TendonLaw::Proportional,
        ..Default::default()
    };
    let (length, mut place, mut turn, mut beside) = (0.2_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    for n in [1, 4, 10, 40] {
        let l = length / n as f64;
        let a = 0.4 * l;
        for (between, shares) in
            [(0.0, [0.3_f64, 0.0]), (1.2, [0.2, 0.25]), (2.1, [0.4, 0.1]), (1.6, [0.3, 0.02])]
        {
            for psi in [-2.0_f64, 0.4, 3.0] {
                for scale in [1e-6, 0.1, 1.0] {
                    let azimuths = [psi, psi + between];
                    let count = if between == 0.0 { 1 } else { 2 };
                    let pulls = [0, 1].map(|j| scale * shares[j] * a);
                    let x = if count == 1 {
                        Vector2::new(psi.cos(), psi.sin()) * (pulls[0] / a)
                    } else {
                        let row = |psi: f64| [a * psi.cos(), a * psi.sin()];
                        let rows = azimuths.map(row);
                        let matrix = Matrix2::new(rows[0][0], rows[0][1], rows[1][0], rows[1][1]);
                        matrix.lu().solve(&Vector2::from(pulls)).unwrap()
                    };
                    let (beta, phi) = (2.0 * (0.5 * x.norm()).asin(), x.y.atan2(x.x));
                    let robot = robot(length, n, straight(&azimuths[..count], a));
                    let displacements = &pulls.map(|pull| -pull * n as f64)[..count];
                    let shape = solved(&robot, settings, displacements);
                    let (p, t) = off(&shape, &alike(Subsegment::Link, l, n, beta, phi));
                    (place, turn) = (place.max(p / length), turn.max(t));
                    let plan = linkage::Plan::new(&robot).unwrap();
                    let model = Linkage::new(&robot, &plan, LinkageSettings::default()).unwrap();
                    let other = model.shape(displacements).unwrap();
                    assert_eq!(other.report.status, Status::Converged);
                    beside = beside.max(apart(&shape, &other) / length);
                }
            }
        }
    }
    println!("places {place:.1e}, rotations {turn:.1e}, beside the linkage model {beside:.1e}");
    assert!(place < 1e-10 && turn < 1e-10 && beside < 1e-10);
}
