//! Pre-bent design: round trips, the sphere finger, the same shape by different pulls.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::Status;
use tdcr::design::{PrebendSettings, points_on_curve, prebend, prebend_stopped_by};
use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use tdcr::rod::{Plan, Rod, RodSettings, Subsegment, TendonLaw};

use crate::finger::finger;

fn straightened(robot: &Robot, keep_twist: bool) -> Robot {
    let mut spec = robot.backbone().spec().clone();
    if let Some(rest) = &mut spec.rest {
        for own in rest {
            *own = Vector3::new(0.0, 0.0, if keep_twist { own.z } else { 0.0 });
        }
    }
    robot.with_backbone(Backbone::new(spec).unwrap()).unwrap()
}

fn random_robot(draw: &mut ChaCha8Rng) -> Robot {
    let n = draw.random_range(4..20);
    let mut spec = BackboneSpec::straight(0.02 * f64::from(n), 1);
    spec.subsegments = vec![usize::try_from(n).unwrap()];
    let planar = draw.random::<f64>() < 0.4;
    let (a, b, phase): (f64, f64, f64) =
        (draw.random_range(-0.2..0.2), draw.random_range(-0.15..0.15), draw.random_range(0.0..TAU));
    let rest = (0..n).map(|i| {
        let s = f64::from(i) / f64::from(n);
        let bend = a + b * (TAU * s + phase).sin();
        let angle = if planar { 0.0 } else { phase + 2.0 * s };
        Vector3::new(-bend * angle.sin(), bend * angle.cos(), 0.0)
    });
    spec.rest = Some(rest.collect());
    let count = if planar { 1 } else { draw.random_range(1..3) };
    let tendons = (0..count).map(|k| {
        let start = if planar { 0.0 } else { 1.7 * f64::from(k) + draw.random_range(0.0..1.0) };
        let mut azimuth = start;
        let wander = if planar { 0.0 } else { draw.random_range(0.0..0.5) };
        let azimuths = (0..=n).map(|_| {
            azimuth += wander * draw.random_range(-0.3..1.0);
            azimuth
        });
        let azimuth = PerDisk::Each(azimuths.collect());
        Tendon::new(Routing::Angles { azimuth, radius: PerDisk::Same(8e-3) }, None, None, None)
            .unwrap()
    });
    let tendons = tendons.collect();
    Robot::new(Backbone::new(spec).unwrap(), tendons, None, None, None).unwrap()
}

#[test]
fn a_rest_shape_that_was_forgotten_is_designed_back() {
    let mut draw = ChaCha8Rng::seed_from_u64(1);
    let (mut solved, mut back, mut worst) = (0, 0, 0.0_f64);
    for _ in 0..1000 {
        let robot = random_robot(&mut draw);
        let length = robot.backbone().total_length();
        let pulls: Vec<f64> =
            robot.tendons().iter().map(|_| -length * draw.random_range(0.01..0.05)).collect();
        let plan = Plan::new(&robot, RodSettings::default()).unwrap();
        let shape = Rod::new(&robot, &plan).shape(&pulls).unwrap();
        if shape.report.status != Status::Converged || shape.state.tensions.contains(&0.0) {
            continue;
        }
        solved += 1;
        let targets: Vec<_> = shape.state.frames[1..].iter().map(|f| f.translation).collect();
        let settings = PrebendSettings::default();
        let answer = prebend(&straightened(&robot, true), &targets, &pulls, &settings).unwrap();
        let off = answer.errors.iter().copied().fold(0.0_f64, f64::max) / length;
        if answer.status == Status::Converged && off <= 1e-10 {
            back += 1;
            worst = worst.max(off);
        }
    }
    println!("{back} of {solved} designed back, to {worst:.1e} of the length");
    assert!(solved > 900 && back * 1000 >= solved * 999);
}

#[test]
fn the_finger_lies_on_a_circle_around_the_sphere() {
    for radius in [0.056, 0.064] {
        for subsegment in Subsegment::ALL {
            let (robot, curve) = finger(radius);
            let targets = points_on_curve(&robot, &curve, subsegment).unwrap();
            let rod = RodSettings { subsegment, ..Default::default() };
            let settings = PrebendSettings { rod, ..Default::default() };
            let answer = prebend(&robot, &targets, &[-0.03 * 0.18], &settings).unwrap();
            assert_eq!(answer.status, Status::Converged, "{}", answer.message);
            let squared: f64 = answer.errors.iter().map(|e| e * e).sum();
            println!("{radius} {subsegment:?}: {squared:.1e} m², {} marches", answer.iterations);
            assert!(squared <= 1e-16);
        }
    }
}

#[test]
fn different_pulls_need_different_rest_shapes() {
    let (robot, curve) = finger(0.064);
    let targets = points_on_curve(&robot, &curve, Subsegment::Arc).unwrap();
    let mut bends = Vec::new();
    for share in [0.0, 0.01, 0.02, 0.03, 0.04] {
        let answer =
            prebend(&robot, &targets, &[-share * 0.18], &PrebendSettings::default()).unwrap();
        assert_eq!(answer.status, Status::Converged, "{}", answer.message);
        bends.push((0..9).map(|i| answer.robot.backbone().rest(i).y).sum::<f64>());
    }
    assert!(bends.windows(2).all(|pair| (pair[1] - pair[0]).abs() > 0.05), "{bends:?}");
}

#[test]
fn other_settings_are_met_by_descent() {
    let (robot, curve) = finger(0.064);
    for (elements, tendons) in [(3, TendonLaw::Sliding), (1, TendonLaw::Proportional)] {
        let targets = points_on_curve(&robot, &curve, Subsegment::Arc).unwrap();
        let rod = RodSettings { elements, tendons, ..Default::default() };
        let settings = PrebendSettings { rod, tolerance: 1e-3, ..Default::default() };
        let answer = prebend(&robot, &targets, &[-0.03 * 0.18], &settings).unwrap();
        println!("{elements} {tendons:?}: {} {:?}", answer.message, answer.errors);
        assert_eq!(answer.status, Status::Converged, "{}", answer.message);
    }
}

/// Length of a tendon's piece at a distance `to` on the inner side of a planar bend: chord of the backbone, less
/// what the disks, half the bend off it, take on both sides.
fn piece(kind: Subsegment, length: f64, to: f64, bend: f64) -> f64 {
    let half = 0.5 * bend;
    let chord = match kind {
        Subsegment::Link => length,
        Subsegment::Arc => length * if half == 0.0 { 1.0 } else { half.sin() / half },
    };
    chord - 2.0 * to * half.sin()
}

/// In the plane, a proportional tendon alone says what every subsegment bends to, energy or not: its piece is
/// `1 + d / Σ l_rest` times as long as at rest. So the rest bends of wanted ones have a closed form: the rest lengths
/// sum up to `Σ l - d`, and each is its share of that.
#[test]
fn planar_proportional_designs_have_the_closed_form() {
    let (radius, ell, n) = (8e-3, 0.02, 9);
    for (kind, azimuth, pull) in [
        (Subsegment::Link, PI, -0.004),
        (Subsegment::Link, 0.0, -0.006),
        (Subsegment::Arc, PI, -0.004),
        (Subsegment::Arc, 0.0, -0.006),
    ] {
        let side = if azimuth == 0.0 { radius } else { -radius };
        let wanted: Vec<f64> = (0..n).map(|i| 0.12 + 0.03 * f64::from(i).sin()).collect();
        let bent = |bends: &[f64]| {
            let mut spec = BackboneSpec::straight(ell * f64::from(n), usize::try_from(n).unwrap());
            spec.rest = Some(bends.iter().map(|bend| Vector3::new(0.0, *bend, 0.0)).collect());
            let tendon = Tendon::straight(azimuth, radius).unwrap();
            Robot::new(Backbone::new(spec).unwrap(), vec![tendon], None, None, None).unwrap()
        };
        // Where disks are when the wanted bends are at rest.
        let free = RodSettings { subsegment: kind, ..Default::default() };
        let final_robot = bent(&wanted);
        let plan = Plan::new(&final_robot, free).unwrap();
        let shape = Rod::new(&final_robot, &plan).shape(&[f64::INFINITY]).unwrap();
        let targets: Vec<_> = shape.state.frames[1..].iter().map(|f| f.translation).collect();

        let lengths: Vec<f64> = wanted.iter().map(|bend| piece(kind, ell, side, *bend)).collect();
        let ratio = 1.0 + pull / (lengths.iter().sum::<f64>() - pull);
        let closed = lengths.iter().map(|length| {
            let off = |bend: f64| piece(kind, ell, side, bend) - length / ratio;
            // Monotone near straight: the tendon's side is shorter the more it bends that way.
            let (mut low, mut high) = (-0.6_f64, 0.6_f64);
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                if (off(middle) > 0.0) == (off(low) > 0.0) { low = middle } else { high = middle }
            }
            0.5 * (low + high)
        });
        let closed: Vec<f64> = closed.collect();

        let rod = RodSettings { tendons: TendonLaw::Proportional, ..free };
        let settings = PrebendSettings { rod, ..Default::default() };
        let answer = prebend(&bent(&[0.0; 9]), &targets, &[pull], &settings).unwrap();
        assert_eq!(answer.status, Status::Converged, "{}", answer.message);
        for (i, closed) in closed.iter().enumerate() {
            let own = answer.robot.backbone().rest(i);
            assert!((own.y - closed).abs() < 1e-7, "{kind:?} {i}: {} {closed}", own.y);
            assert!(own.x.abs() < 1e-7 && own.z.abs() < 1e-7);
        }
    }
}

#[test]
fn what_cannot_be_reached_is_said() {
    let (robot, _) = finger(0.064);
    let far: Vec<_> = (1..=9).map(|i| Vector3::new(0.05 * f64::from(i), 0.0, 0.1)).collect();
    let answer = prebend(&robot, &far, &[-0.005], &PrebendSettings::default()).unwrap();
    assert_ne!(answer.status, Status::Converged);
    assert!(answer.message.contains("from disk 0 to disk 1"), "{}", answer.message);
    let error = prebend(&robot, &far[1..], &[-0.005], &PrebendSettings::default()).unwrap_err();
    assert_eq!(error.argument, "target_positions");
}

#[test]
fn places_nearer_than_the_rod_is_long_are_folded_to() {
    let spec = BackboneSpec::straight(0.18, 9);
    let tendon = Tendon::straight(PI, 8e-3).unwrap();
    let robot = Robot::new(Backbone::new(spec).unwrap(), vec![tendon], None, None, None).unwrap();
    let short: Vec<_> = (1..=9).map(|i| Vector3::new(0.0, 0.0, 0.016 * f64::from(i))).collect();
    let answer = prebend(&robot, &short, &[-0.005], &PrebendSettings::default()).unwrap();
    assert_eq!(answer.status, Status::Unreachable);
    let rms = (answer.errors.iter().map(|e| e * e).sum::<f64>() / 9.0).sqrt();
    // The least of 40 descents of scipy from random rest shapes.
    assert!(rms < 1.01 * 2.3442e-3, "{rms}");
    let far = vec![Vector3::new(1e200, 0.0, 0.0); 9];
    let error = prebend(&robot, &far, &[-0.005], &PrebendSettings::default()).unwrap_err();
    assert_eq!(error.argument, "target_positions");
}

#[test]
fn a_flag_ends_a_design() {
    let (robot, curve) = finger(0.064);
    let targets = points_on_curve(&robot, &curve, Subsegment::Arc).unwrap();
    let rod = RodSettings { tendons: TendonLaw::Proportional, ..Default::default() };
    let settings = PrebendSettings { rod, ..Default::default() };
    let stop = Arc::new(AtomicBool::new(true));
    let answer = prebend_stopped_by(&robot, &targets, &[-0.005], &settings, &stop).unwrap();
    assert_eq!(answer.status, Status::IterationLimit);
}
