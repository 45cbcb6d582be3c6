//! The rod against the continuum limit of uniform helices, and its stretch and that of its tendons.
//!
//! **The limit.** Many short subsegments make a rod whose strain u(s) (per length, in the frame that moves along)
//! minimises `½ uᵀKu + Σ T_j ‖e3 + u × r_j + r_j'‖` at every s by itself: `r_j(s)` is the hole, and the norm is the
//! tendon's length per length of the backbone. Let the holes wind by τ per length, `r(s) = Rz(τs) r(0)`. K is
//! the same for bending in every direction, so `u(s) = Rz(τs) ū`, where ū minimises the sum at s = 0: a
//! quadratic and norms of affine functions, strictly convex, three unknowns. With `Q = R Rz(τs)`, `R' = R û` becomes
//! `Q' = Q (ū + τ e3)^`, and as `R e3 = Q e3`, the frames are in closed form
//!
//!   `R(s) = Exp(s (ū + τ e3)) Rz(−τs)`,  `p(s) = s V(s (ū + τ e3)) e3`.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector3};
use tdcr::lie::{Pose, so3};
use tdcr::robot::{Backbone, BackboneSpec, Robot, Routing, Tendon};
use tdcr::rod::{RodSettings, Subsegment};
use tdcr::{Shape, Status};

use crate::common::robot;
use crate::rod_common::{rod_shape, solved, under};

const LENGTH: f64 = 0.2;

/// Holes at the base [m], turns over the length, and tensions in units of EI.
struct Helix {
    holes: Vec<(f64, f64)>,
    turns: f64,
    tensions: Vec<f64>,
}

impl Helix {
    fn rate(&self) -> f64 {
        TAU * self.turns / LENGTH
    }

    fn robot(&self, n: usize) -> Robot {
        let tendon = |(radius, azimuth): &(f64, f64)| {
            let (radius, azimuth, turns) = (*radius, *azimuth, self.turns);
            Tendon::new(Routing::Helical { azimuth, radius, turns }, None, None, None).unwrap()
        };
        robot(LENGTH, n, self.holes.iter().map(tendon).collect())
    }

    fn hole((radius, azimuth): (f64, f64)) -> Vector3<f64> {
        Vector3::new(azimuth.cos(), azimuth.sin(), 0.0) * radius
    }

    /// A tendon's tangent per length of the backbone at s = 0.
    fn tangent(&self, j: usize, strain: &Vector3<f64>) -> Vector3<f64> {
        let r = Self::hole(self.holes[j]);
        Vector3::z() + strain.cross(&r) + Vector3::z().cross(&r) * self.rate()
    }

    /// The strain ū by Newton's method, to rounding. Poisson's ratio is the default, 0.35.
    fn strain(&self) -> Vector3<f64> {
        let stiffness = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.0 / 1.35));
        let value = |u: &Vector3<f64>| {
            let work = self.tensions.iter().enumerate();
            let work = work.map(|(j, t)| t * self.tangent(j, u).norm()).sum::<f64>();
            0.5 * u.dot(&(stiffness * u)) + work
        };
        let mut u = Vector3::zeros();
        for _ in 0..60 {
            let (mut slope, mut curvature) = (stiffness * u, stiffness);
            for (j, tension) in self.tensions.iter().enumerate() {
                let (v, r) = (self.tangent(j, &u), Self::hole(self.holes[j]));
                let (length, along) = (v.norm(), v.normalize());
                slope += r.cross(&along) * *tension;
                let turn = so3::hat(&r);
                let across = Matrix3::identity() - along * along.transpose();
                curvature += turn.transpose() * across * turn * (tension / length);
            }
            let step = -curvature.cholesky().unwrap().solve(&slope);
            let mut share = 1.0;
            while share > 1e-6 && value(&(u + step * share)) > value(&u) * (1.0 + 1e-14) {
                share *= 0.5;
            }
            u += step * share;
            if step.norm() < 1e-13 * u.norm() {
                return u;
            }
        }
        panic!("the limit was not found");
    }

    fn displacements(&self, strain: &Vector3<f64>) -> Vec<f64> {
        let rest = Vector3::zeros();
        let length = |j: usize, u: &Vector3<f64>| self.tangent(j, u).norm() * LENGTH;
        (0..self.holes.len()).map(|j| length(j, strain) - length(j, &rest)).collect()
    }

    fn frame(&self, strain: &Vector3<f64>, s: f64) -> Pose {
        let turn = (strain + Vector3::z() * self.rate()) * s;
        let back = so3::exp(&(-Vector3::z() * self.rate() * s));
        Pose {
            rotation: so3::exp(&turn) * back,
            translation: so3::left_jacobian(&turn) * Vector3::z() * s,
        }
    }

    /// Largest error of a place [m], of a rotation, and relative of a tension.
    fn errors(&self, shape: &Shape, strain: &Vector3<f64>) -> [f64; 3] {
        let n = shape.state.frames.len() - 1;
        let mut worst = [0.0_f64; 3];
        for (i, frame) in shape.state.frames.iter().enumerate() {
            let wanted = self.frame(strain, LENGTH * i as f64 / n as f64);
            worst[0] = worst[0].max((frame.translation - wanted.translation).norm());
            worst[1] = worst[1].max((frame.rotation - wanted.rotation).amax());
        }
        for (own, exact) in shape.state.tensions.iter().zip(&self.tensions) {
            worst[2] = worst[2].max((own / exact - 1.0).abs());
        }
        worst
    }
}

/// Windings of 0 to 2 turns with one tendon and with two.
fn helices() -> Vec<Helix> {
    let mut all = Vec::new();
    for turns in [0.0, 0.25, 0.5, -1.0, 1.0, 1.5, 2.0] {
        for (holes, tensions) in [
            (vec![(8e-3, 0.4)], vec![600.0]),
            (vec![(8e-3, -2.0), (6e-3, 0.3)], vec![300.0, 500.0]),
        ] {
            all.push(Helix { holes, turns, tensions });
        }
    }
    all
}

#[test]
fn uniform_helices_converge_with_order_two() {
    let (mut low, mut high, mut finest) = (f64::INFINITY, 0.0_f64, 0.0_f64);
    for helix in helices() {
        let strain = helix.strain();
        let pulls = helix.displacements(&strain);
        for subsegment in Subsegment::ALL {
            let settings = RodSettings { subsegment, ..Default::default() };
            let errors: Vec<[f64; 3]> = [40, 80, 160, 320]
                .map(|n| helix.errors(&solved(&helix.robot(n), settings, &pulls), &strain))
                .to_vec();
            for pair in errors.windows(2) {
                for (coarse, fine) in pair[0].iter().zip(&pair[1]) {
                    let ratio = coarse / fine;
                    assert!((3.9..4.1).contains(&ratio), "{} turns: {ratio}", helix.turns);
                    (low, high) = (low.min(ratio), high.max(ratio));
                }
            }
            finest = finest.max(errors[3][0] / LENGTH);
        }
    }
    println!(
        "ratios of errors {low:.2} to {high:.2}; at n = 320 within {finest:.1e} of the length"
    );
    assert!(finest < 1e-4);
}

/// Under given tensions subsegments know nothing of each other: all have the strain, in the axes of their own
/// first holes, of one that stands alone.
#[test]
fn subsegments_of_a_helix_are_alike_and_independent() {
    let n = 20;
    for helix in helices() {
        for elements in [1, 3] {
            let settings = RodSettings { elements, ..Default::default() };
            let whole = helix.robot(n);
            let (shape, pulls) = under(&whole, settings, &helix.tensions);
            let l = LENGTH / n as f64;
            let part = Helix {
                holes: helix.holes.clone(),
                turns: helix.turns / n as f64,
                tensions: helix.tensions.clone(),
            };
            let tendons = part.robot(1).tendons().to_vec();
            let (alone, share) = under(&robot(l, 1, tendons), settings, &helix.tensions);
            for (i, strain) in shape.state.strains.iter().enumerate() {
                let back = so3::exp(&(-Vector3::z() * helix.rate() * l * (i / elements) as f64));
                let off = back * strain - alone.state.strains[i % elements];
                assert!(off.norm() < 1e-11, "{off}");
            }
            for (pull, share) in pulls.iter().zip(share) {
                assert!((pull - n as f64 * share).abs() < 1e-12 * LENGTH);
            }
            // The same the other way round: the displacements find the tensions.
            let again = solved(&whole, settings, &pulls);
            for (own, given) in again.state.tensions.iter().zip(&helix.tensions) {
                assert!((own / given - 1.0).abs() < 1e-8);
            }
        }
    }
}

#[test]
fn elements_converge_with_order_two() {
    for helix in helices().iter().filter(|helix| helix.turns.abs() <= 1.0) {
        let (pulls, robot) = (helix.displacements(&helix.strain()), helix.robot(6));
        for subsegment in Subsegment::ALL {
            let tip = |elements| {
                let settings = RodSettings { subsegment, elements, ..Default::default() };
                solved(&robot, settings, &pulls).state.frames[6].translation
            };
            let tips = [4, 8, 16, 32].map(tip);
            let steps = [0, 1, 2].map(|i| (tips[i + 1] - tips[i]).norm());
            for pair in steps.windows(2) {
                let ratio = pair[0] / pair[1];
                assert!((3.8..4.2).contains(&ratio), "{} turns: {steps:?}", helix.turns);
            }
        }
    }
}

const MODULUS: f64 = 60e9;
const DIAMETER: f64 = 1.2e-3;
const N: usize = 10;

/// A wire of 0.2 m with straight tendons: radius, azimuth and stiffness [N] of each.
fn wire(tendons: &[(f64, f64)], stiffness: Option<f64>) -> Robot {
    let mut spec = BackboneSpec::straight(LENGTH, N);
    spec.youngs_modulus = Some(MODULUS);
    spec.diameter = Some(vec![DIAMETER]);
    let tendon = |(radius, azimuth): &(f64, f64)| {
        let straight = Tendon::straight(*azimuth, *radius).unwrap();
        Tendon::new(straight.routing().clone(), None, stiffness, None).unwrap()
    };
    let tendons = tendons.iter().map(tendon).collect();
    Robot::new(Backbone::new(spec).unwrap(), tendons, None, None, None).unwrap()
}

/// EI [N m²] and EA [N].
fn stiffnesses() -> (f64, f64) {
    (MODULUS * PI * DIAMETER.powi(4) / 64.0, MODULUS * PI * DIAMETER * DIAMETER / 4.0)
}

/// A tendon in the middle, or equal ones all around, only shorten the rod: by T L/EA.
#[test]
fn a_straight_rod_is_compressed_by_its_tendons() {
    let (_, ea) = stiffnesses();
    let around: Vec<(f64, f64)> = (0..3).map(|k| (8e-3, TAU * f64::from(k) / 3.0)).collect();
    for elements in [1, 3] {
        let settings = RodSettings { axial: true, elements, ..Default::default() };
        for (tendons, tension) in [(vec![(1e-15, 0.0)], 30.0), (around.clone(), 10.0)] {
            let robot = wire(&tendons, None);
            let total = tension * tendons.len() as f64;
            let (shape, pulls) = under(&robot, settings, &vec![tension; tendons.len()]);
            let again = solved(&robot, settings, &pulls);
            for shape in [&shape, &again] {
                assert_eq!(shape.state.elongations.len(), N * elements);
                for elongation in &shape.state.elongations {
                    // Lengths are within 1e-11, of which the elongation is 2e-4.
                    assert!((elongation * ea / total + 1.0).abs() < 1e-7, "{elongation}");
                }
                let tip = shape.state.frames[N].translation;
                assert!((tip - Vector3::z() * LENGTH * (1.0 - total / ea)).norm() < 1e-11);
            }
            for (pull, own) in pulls.iter().zip(&again.state.tensions) {
                assert!((pull * ea / (total * LENGTH) + 1.0).abs() < 1e-9);
                // Three tendons and one freedom: only the sum is determined.
                assert!(tendons.len() > 1 || (own / tension - 1.0).abs() < 1e-7);
            }
            let sum = again.state.tensions.iter().sum::<f64>();
            assert!((sum / total - 1.0).abs() < 1e-7);
        }
    }
}

/// One tendon bends and compresses. With the chord `c = l (1 + ε) S(β) − 2 a sin(β/2)`, the balances are
/// `EA ε = −T S` and `EI β/l = T (a cos(β/2) − l (1 + ε) S'(β))`; an elastic tendon takes `T L/EA` besides.
#[test]
fn stretch_and_elastic_tendons_meet_the_theory_of_chords() {
    let ((ei, ea), a, l) = (stiffnesses(), 8e-3, LENGTH / N as f64);
    for beta in [1e-3, 0.05, 0.2, 0.6] {
        let half = 0.5_f64 * beta;
        let chord = half.sin() / half;
        let slope = if beta < 0.01 {
            -beta / 12.0 + beta.powi(3) / 480.0
        } else {
            (half.cos() - chord) / beta
        };
        for (axial, stiffness) in [(true, None), (false, Some(5e3)), (true, Some(5e3))] {
            let (mut tension, mut elongation) = (0.0, 0.0);
            // A contraction: the elongation is of order 1e-4.
            for _ in 0..20 {
                elongation = if axial { -tension * chord / ea } else { 0.0 };
                tension = ei * beta / l / (a * half.cos() - l * (1.0 + elongation) * slope);
            }
            let piece = l * (1.0 + elongation) * chord - 2.0 * a * half.sin();
            let give = stiffness.map_or(0.0, |ea| tension * LENGTH / ea);
            let pull = (piece - l) * N as f64 - give;
            let settings = RodSettings { axial, ..Default::default() };
            let shape = solved(&wire(&[(a, 0.0)], stiffness), settings, &[pull]);
            assert!((shape.state.tensions[0] / tension - 1.0).abs() < 1e-8);
            for strain in &shape.state.strains {
                assert!((strain - Vector3::y() * beta).norm() < 1e-10);
            }
            for own in &shape.state.elongations {
                assert!((own - elongation).abs() < 1e-12);
            }
            let long = shape.state.tendon_lengths[0];
            assert!((long - piece * N as f64).abs() < 1e-11 * LENGTH);
        }
    }
}

/// Three tendons of one segment over-determine it: rigid ones are infeasible and named, elastic ones share.
#[test]
fn three_tendons_at_once_need_elasticity() {
    let around: Vec<(f64, f64)> = (0..3).map(|k| (8e-3, TAU * f64::from(k) / 3.0)).collect();
    for pulls in [[-4e-3, 0.0, 0.0], [-2e-3, -2e-3, -2e-3], [-3e-3, -2e-3, -1e-3]] {
        let rigid = rod_shape(&wire(&around, None), RodSettings::default(), &pulls);
        assert_eq!(rigid.report.status, Status::Infeasible, "{pulls:?}");
        assert!(rigid.message.contains("'t") && rigid.message.contains("stiffness"));
        println!("{pulls:?}: {}", rigid.message);
        if pulls[1] == 0.0 {
            let held = "held at their rest length: 't1', 't2'; free them (inf), release them";
            assert!(rigid.message.contains(held), "{}", rigid.message);
        }
        for axial in [false, true] {
            let settings = RodSettings { axial, ..Default::default() };
            let stiffness = 1e3;
            let shape = solved(&wire(&around, Some(stiffness)), settings, &pulls);
            for (k, pull) in pulls.iter().enumerate() {
                let tension = shape.state.tensions[k];
                let stretched = shape.state.tendon_lengths[k] - tension * LENGTH / stiffness;
                let over = stretched - LENGTH - pull;
                assert!(tension >= 0.0 && over < 1e-11 * LENGTH);
                assert!(tension == 0.0 || over > -1e-11 * LENGTH);
            }
            assert!(shape.state.tensions[0] > 0.0);
        }
    }
}
