//! The chain of linkages from base to tip: closed form, order, bounds, symmetries.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Matrix4, Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::Status;
use tdcr::linkage::{Linkage, LinkageSettings, Plan};
use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};

use crate::common::{FREE, robot, solve, straight, tip, try_solve};

fn ending(azimuth: f64, radius: f64, end: usize) -> Tendon {
    let routing =
        Routing::Angles { azimuth: PerDisk::Same(azimuth), radius: PerDisk::Same(radius) };
    Tendon::new(routing, Some(end), None, None).unwrap()
}

/// Disk k of a chain of n links of equal bend: link i points along (i + 1/2) beta, and the sum of the
/// unit vectors has length sin(k beta / 2) / sin(beta / 2) at angle k beta / 2.
fn polygon(length: f64, n: usize, beta: f64, azimuth: f64, k: usize) -> Vector3<f64> {
    let middle = 0.5 * beta * k as f64;
    let reach = if beta == 0.0 { k as f64 } else { middle.sin() / (0.5 * beta).sin() };
    let (radial, axial) = (reach * middle.sin(), reach * middle.cos());
    Vector3::new(radial * azimuth.cos(), radial * azimuth.sin(), axial) * (length / n as f64)
}

#[test]
fn chains_meet_the_closed_form() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut u = move |low: f64, high: f64| rng.random_range(low..high);
    let (mut worst, mut solved) = (0.0_f64, 0);
    for case in 0..3000 {
        let (length, radius) = (u(0.05, 2.0), u(0.003, 0.03));
        let azimuth = u(-PI, PI);
        let (second, towards) = (azimuth + u(0.3, 2.8), u(0.0, TAU));
        // Total bend first; then n from the bound up to 1000.
        let total = u(0.01, 12.0_f64.min(1.8 * length / radius));
        let least = (0.5 * total / 0.99).ceil().max(1.0);
        let n = if case % 3 == 0 { least } else { u(least, 1000.0).floor() } as usize;
        let sum = |azimuth: f64| total * radius * (azimuth - towards).cos();
        let pulls = [sum(azimuth), sum(second)];
        if pulls.iter().any(|p| *p < 1e-3 * radius * n as f64 || *p > 0.95 * length) {
            continue;
        }
        let trunk = robot(length, n, straight(&[azimuth, second], radius));
        let shape = solve(&trunk, &[-pulls[0], -pulls[1]]);
        assert_eq!(shape.report.status, Status::Converged, "{}", shape.message);
        solved += 1;
        let beta = 2.0 * (0.5 * total / n as f64).asin();
        for (k, frame) in shape.state.frames.iter().enumerate() {
            let error = (frame.translation - polygon(length, n, beta, towards, k)).amax() / length;
            worst = worst.max(error);
        }
    }
    println!("worst position error of {solved} chains: {worst:.1e} of the length");
    assert!(solved > 500 && worst < 1e-12, "{solved} {worst:e}");
}

#[test]
fn planar_chains_meet_the_closed_form() {
    for n in [1, 2, 10, 100, 1000] {
        for pull in [1e-12, 1e-6, 0.001, 0.015, 0.019] {
            let trunk = robot(0.3, n, straight(&[2.0], 0.01));
            let shape = solve(&trunk, &[-pull]);
            assert_eq!(shape.report.status, Status::Converged, "{}", shape.message);
            let beta = 2.0 * (0.5 * pull / (0.01 * n as f64)).asin();
            for (k, frame) in shape.state.frames.iter().enumerate() {
                let error = (frame.translation - polygon(0.3, n, beta, 2.0, k)).amax();
                assert!(error < 3e-13, "{n} {pull} {k} {error:e}");
            }
            assert!((shape.state.tendon_lengths[0] - (0.3 - pull)).abs() < 1e-14);
        }
    }
}

/// Error of the tip against the arc of curvature bend/length, times n^2: constant for order 2.
#[test]
fn converges_with_order_two_to_the_constant_curvature_arc() {
    let cases: [(&str, &[f64], [f64; 2]); 4] = [
        ("2-D", &[0.0], [0.02, 0.0]),
        ("3-D, equal pulls", &[0.0, FRAC_PI_2], [0.015, 0.015]),
        ("3-D, different pulls", &[0.0, FRAC_PI_2], [0.02, 0.007]),
        ("3-D, 120 degrees", &[0.0, 2.0 * PI / 3.0], [0.012, 0.004]),
    ];
    let (length, radius) = (0.4, 0.01);
    for (name, azimuths, pulls) in cases {
        // a_j (C cos psi_j + S sin psi_j) = pull_j.
        let (bend, towards) = if azimuths.len() == 1 {
            (pulls[0] / radius, azimuths[0])
        } else {
            let c = pulls[0] / radius;
            let s = (pulls[1] / radius - c * azimuths[1].cos()) / azimuths[1].sin();
            (c.hypot(s), s.atan2(c))
        };
        let reach = length / bend;
        let radial = reach * (1.0 - bend.cos());
        let exact =
            Vector3::new(radial * towards.cos(), radial * towards.sin(), reach * bend.sin());
        let error = |n: usize| {
            let trunk = robot(length, n, straight(azimuths, radius));
            let minus: Vec<f64> = pulls[..azimuths.len()].iter().map(|p| -p).collect();
            (tip(&solve(&trunk, &minus)) - exact).norm()
        };
        for n in [8, 16, 32, 64, 128] {
            let ratio = error(n) / error(2 * n);
            println!(
                "{name}: n {n}: error {:.2e} of the length, ratio {ratio:.3}",
                error(n) / length
            );
            assert!((3.9..4.1).contains(&ratio), "{name} {n} {ratio}");
        }
    }
}

#[test]
fn no_pull_is_exactly_straight() {
    let trunk = robot(0.2, 7, straight(&[0.3, 1.0, 4.0], 0.01));
    for displacements in [[0.0, 0.0, 0.0], [-0.0, FREE, 0.5], [FREE, FREE, FREE], [1e9, 0.0, 0.1]] {
        let shape = solve(&trunk, &displacements);
        assert_eq!(shape.report.status, Status::Converged);
        for (k, frame) in shape.state.frames.iter().enumerate() {
            let expected = Vector3::z() * (0.2 / 7.0);
            assert_eq!(frame.rotation, nalgebra::Matrix3::identity());
            assert_eq!((frame.translation.x, frame.translation.y), (0.0, 0.0));
            assert!((frame.translation.z - expected.z * k as f64).abs() < 1e-16);
        }
        assert_eq!(shape.state.energy, 0.0);
    }
}

#[test]
fn the_smallest_pull_bends_by_the_linear_theory() {
    let trunk = robot(0.2, 4, straight(&[0.0, FRAC_PI_2], 0.01));
    for pull in [1e-300, 1e-100, 1e-20, 1e-12] {
        let shape = solve(&trunk, &[-pull, -0.5 * pull]);
        assert_eq!(shape.report.status, Status::Converged, "{pull:e}");
        let bend = shape.state.strains[0];
        let expected = pull / 0.01 / 4.0;
        assert!((bend.y / expected - 1.0).abs() < 1e-12, "{bend} {expected:e}");
        assert!((bend.x / expected + 0.5).abs() < 1e-12);
    }
}

/// The message's number of subsegments works, one fewer does not (Ashwin & Ghosal eq. 8 and its
/// two-tendon form).
#[test]
fn the_bound_is_reported_with_the_smallest_count_that_works() {
    let cases: [(&[f64], &[f64]); 3] =
        [(&[0.3], &[0.075]), (&[0.0, FRAC_PI_2], &[0.06, 0.05]), (&[0.0, 2.0], &[0.05, 0.03])];
    for (azimuths, pulls) in cases {
        let minus: Vec<f64> = pulls.iter().map(|p| -p).collect();
        let trunk = |n| robot(0.5, n, straight(azimuths, 0.01));
        let shape = solve(&trunk(1), &minus);
        assert_eq!(shape.report.status, Status::Infeasible);
        assert!(shape.message.starts_with("failed at disk 1:"), "{}", shape.message);
        let words: Vec<&str> = shape.message.split_whitespace().collect();
        let place = words.iter().position(|word| *word == "least").unwrap();
        let least: usize = words[place + 1].parse().unwrap();
        let expected = if let [pull] = pulls {
            0.5 * pull / 0.01
        } else {
            let c = pulls[0] / 0.01;
            let s = (pulls[1] / 0.01 - c * azimuths[1].cos()) / azimuths[1].sin();
            0.5 * c.hypot(s)
        };
        assert_eq!(least, expected.floor() as usize + 1, "{}", shape.message);
        let works = solve(&trunk(least), &minus);
        assert_eq!(works.report.status, Status::Converged, "{} {}", least, works.message);
        assert_eq!(solve(&trunk(least - 1), &minus).report.status, Status::Infeasible);
    }
}

#[test]
fn a_pull_as_long_as_the_tendon_is_infeasible() {
    let trunk = robot(0.1, 10, straight(&[0.0], 0.05));
    let shape = solve(&trunk, &[-0.1]);
    assert_eq!(shape.report.status, Status::Infeasible);
    assert!(
        shape.message.contains("'t0'") && shape.message.contains("no length"),
        "{}",
        shape.message
    );
    assert!(shape.state.frames.iter().all(|f| f.translation.iter().all(|x| x.is_finite())));
    assert_eq!(solve(&trunk, &[-1e300]).report.status, Status::Infeasible);
}

/// Radii and azimuths that change from disk to disk: lengths are met piece by piece.
#[test]
fn changing_holes_meet_every_piece() {
    let n = 24;
    let taper: Vec<f64> = (0..=n).map(|i| 0.02 - 0.0004 * f64::from(i)).collect();
    let tapered = |azimuth| {
        let routing = Routing::Angles {
            azimuth: PerDisk::Same(azimuth),
            radius: PerDisk::Each(taper.clone()),
        };
        Tendon::new(routing, None, None, None).unwrap()
    };
    let helix = |azimuth, turns| {
        Tendon::new(Routing::Helical { azimuth, radius: 0.01, turns }, None, None, None).unwrap()
    };
    let cases: [(Vec<Tendon>, Vec<f64>); 5] = [
        (vec![tapered(0.4)], vec![-0.015]),
        (vec![tapered(0.0), tapered(2.0)], vec![-0.012, -0.008]),
        (vec![helix(0.0, 0.7)], vec![-0.01]),
        (vec![helix(0.0, -0.5), helix(1.5, 0.2)], vec![-0.01, -0.006]),
        (straight(&[0.0], 0.01).into_iter().chain([helix(0.5, 0.3)]).collect(), vec![-0.01, -0.01]),
    ];
    for (case, (tendons, displacements)) in cases.into_iter().enumerate() {
        let trunk = robot(0.3, n as usize, tendons);
        let shape = solve(&trunk, &displacements);
        assert_eq!(shape.report.status, Status::Converged, "{case}: {}", shape.message);
        for (k, path) in trunk.paths().iter().enumerate() {
            let points = shape.tendon_points(&trunk, k);
            let rest: Vec<Vector3<f64>> = path.points(&trunk.rest_frames()).collect();
            let ratio = 1.0 + displacements[k] / path.rest_length;
            for (now, before) in points.windows(2).zip(rest.windows(2)) {
                let (now, before) = ((now[1] - now[0]).norm(), (before[1] - before[0]).norm());
                assert!(
                    (now / before - ratio).abs() < 1e-12,
                    "{case} {k} {}",
                    now / before - ratio
                );
            }
        }
        for frame in &shape.state.frames {
            let error = frame.rotation.transpose() * frame.rotation - nalgebra::Matrix3::identity();
            assert!(error.amax() < 1e-14);
        }
        // Links keep their length.
        for pair in shape.state.frames.windows(2) {
            let link = (pair[1].translation - pair[0].translation).norm();
            assert!((link / (0.3 / f64::from(n)) - 1.0).abs() < 1e-13);
        }
    }
}

#[test]
fn rigid_motions_and_mirrors_carry_over() {
    let tendons = || {
        let radius: Vec<f64> = (0..=8).map(|i| 0.012 - 0.0005 * f64::from(i)).collect();
        let routing =
            Routing::Angles { azimuth: PerDisk::Same(0.4), radius: PerDisk::Each(radius) };
        let helix = Routing::Helical { azimuth: 1.9, radius: 0.01, turns: 0.25 };
        [routing, helix].map(|r| Tendon::new(r, None, None, None).unwrap()).to_vec()
    };
    let displacements = [-0.008, -0.005];
    let plain = solve(&robot(0.2, 8, tendons()), &displacements);
    let turn = Rotation3::new(Vector3::new(0.3, -1.0, 0.7));
    let shift = Vector3::new(0.1, -0.4, 2.0);
    let base: Matrix4<f64> = turn.to_homogeneous().append_translation(&shift);
    let backbone = Backbone::new(BackboneSpec::straight(0.2, 8)).unwrap();
    let placed = Robot::new(backbone, tendons(), Some(&base), None, None).unwrap();
    let moved = solve(&placed, &displacements);
    for (a, b) in plain.state.frames.iter().zip(&moved.state.frames) {
        assert!((turn * a.translation + shift - b.translation).amax() < 1e-14);
        assert!((turn.matrix() * a.rotation - b.rotation).amax() < 1e-14);
    }
    // y -> -y: azimuths and turns change sign, positions too.
    let mirrored: Vec<Tendon> = tendons()
        .iter()
        .map(|tendon| {
            let routing = match tendon.routing().clone() {
                Routing::Angles { azimuth: PerDisk::Same(azimuth), radius } => {
                    Routing::Angles { azimuth: PerDisk::Same(-azimuth), radius }
                }
                Routing::Helical { azimuth, radius, turns } => {
                    Routing::Helical { azimuth: -azimuth, radius, turns: -turns }
                }
                other => other,
            };
            Tendon::new(routing, None, None, None).unwrap()
        })
        .collect();
    let mirror = solve(&robot(0.2, 8, mirrored), &displacements);
    for (a, b) in plain.state.frames.iter().zip(&mirror.state.frames) {
        let (a, b) = (a.translation, b.translation);
        assert!((Vector3::new(a.x, -a.y, a.z) - b).amax() < 1e-13);
    }
}

#[test]
fn tendons_that_end_early_leave_the_rest_straight() {
    let trunk = robot(0.3, 30, vec![ending(0.0, 0.01, 10), ending(FRAC_PI_2, 0.01, 20)]);
    let shape = solve(&trunk, &[-0.004, -0.006]);
    assert_eq!(shape.report.status, Status::Converged, "{}", shape.message);
    for (i, strain) in shape.state.strains.iter().enumerate() {
        // t0 shortens by 0.004 over 10 subsegments, t1 by 0.006 over 20.
        let c: f64 = if i < 10 { 0.04 } else { 0.0 };
        let s: f64 = if i < 20 { 0.03 } else { 0.0 };
        let bend = 2.0 * (0.5 * c.hypot(s)).asin();
        assert!((strain.norm() - bend).abs() < 1e-13, "{i} {strain}");
        if bend > 0.0 {
            assert!((strain.y / bend - c / c.hypot(s)).abs() < 1e-12);
        }
    }
}

#[test]
fn pre_bent_backbones_and_bad_settings_are_refused() {
    let mut spec = BackboneSpec::straight(0.2, 2);
    spec.rest = Some(vec![Vector3::new(0.0, 0.1, 0.0); 2]);
    let tendons = straight(&[0.0], 0.01);
    let bent = Robot::new(Backbone::new(spec).unwrap(), tendons, None, None, None).unwrap();
    assert_eq!(try_solve(&bent, &[-0.001]).unwrap_err().argument, "robot.backbone.rest");
    let trunk = robot(0.2, 2, straight(&[0.0], 0.01));
    let plan = Plan::new(&trunk).unwrap();
    for (step_tolerance, max_iterations) in [(0.0, 50), (f64::NAN, 50), (1.0, 50), (1e-9, 0)] {
        let settings = LinkageSettings { step_tolerance, max_iterations };
        assert!(Linkage::new(&trunk, &plan, settings).is_err());
    }
}

#[test]
fn running_out_of_iterations_is_said_with_the_disk() {
    let trunk = robot(0.2, 3, straight(&[0.0, 1.0], 0.01));
    let settings = LinkageSettings { max_iterations: 1, ..LinkageSettings::default() };
    let plan = Plan::new(&trunk).unwrap();
    let shape = Linkage::new(&trunk, &plan, settings).unwrap().shape(&[-0.02, -0.01]).unwrap();
    assert_eq!(shape.report.status, Status::IterationLimit);
    assert!(shape.message.starts_with("failed at disk 1"), "{}", shape.message);
}

/// At and around pulls of exactly 2 a n the count named is never the one there is.
#[test]
fn the_count_named_at_the_bound_is_not_the_one_there_is() {
    for n in 1..200 {
        for change in [1.0, 1.0 - 1e-15, 1.0 + 1e-15, 1.0 + 1e-9] {
            let trunk = robot(10.0, n, straight(&[0.7], 0.01));
            let shape = solve(&trunk, &[-0.02 * n as f64 * change]);
            assert_eq!(shape.report.status, Status::Infeasible);
            assert!(
                shape.message.contains(&format!("at least {} sub", n + 1)),
                "{}",
                shape.message
            );
            assert!(shape.report.residual.is_finite());
        }
    }
    // Azimuths a full turn apart are one azimuth, also here.
    let turns: Vec<f64> = (0..=20).map(|i| TAU * f64::from(i)).collect();
    let routing = Routing::Angles { azimuth: PerDisk::Each(turns), radius: PerDisk::Same(0.01) };
    let tendon = Tendon::new(routing, None, None, None).unwrap();
    let shape = solve(&robot(10.0, 20, vec![tendon]), &[-0.41]);
    assert!(shape.message.contains("at least 21 subsegments"), "{}", shape.message);
    // No number of subsegments helps where the pull is longer than the tendon.
    let shape = solve(&robot(0.2, 20, straight(&[0.0], 0.01)), &[-0.4]);
    assert!(shape.message.contains("no length is left"), "{}", shape.message);
}

#[test]
fn sizes_at_the_limits_keep_their_digits() {
    for (length, radius, pull) in [(1e15, 1e14, 1e13), (1e-15, 1e-15, 1e-17), (1e15, 1e-15, 1e-17)]
    {
        let shape = solve(&robot(length, 30, straight(&[0.0, 1.0], radius)), &[-pull, -0.9 * pull]);
        assert_eq!(shape.report.status, Status::Converged, "{length:e} {}", shape.message);
        let c = pull / radius / 30.0;
        let strain = shape.state.strains[0];
        assert!((strain.y / c - 1.0).abs() < 1e-2 * (1.0 + c), "{length:e} {strain}");
    }
}
