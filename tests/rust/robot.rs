//! What a robot refuses and what it resolves.

use std::collections::HashSet;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Matrix4, Vector3};
use tdcr::InvalidInput;
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};

fn backbone(change: impl FnOnce(&mut BackboneSpec)) -> Result<Backbone, InvalidInput> {
    let mut spec = BackboneSpec::straight(0.2, 4);
    change(&mut spec);
    Backbone::new(spec)
}

fn holes(indices: &[usize], count: usize) -> Result<Tendon, InvalidInput> {
    let radius = PerDisk::Same(0.01);
    let routing = Routing::Holes { indices: indices.to_vec(), count, radius, azimuth: 0.5 };
    Tendon::new(routing, None, None, None)
}

fn angles(azimuth: PerDisk, radius: PerDisk, end: Option<usize>) -> Result<Tendon, InvalidInput> {
    Tendon::new(Routing::Angles { azimuth, radius }, end, None, None)
}

#[test]
fn stretches_become_subsegments() {
    let stretches = backbone(|spec| {
        spec.length = vec![0.06, 0.0625, 0.064];
        spec.subsegments = vec![3, 5, 2];
    })
    .unwrap();
    assert_eq!(stretches.subsegments(), 10);
    assert_eq!(stretches.lengths()[2], 0.02);
    assert_eq!(stretches.lengths()[9], 0.032);
    assert_eq!(stretches.arc_lengths()[3], 0.06);
    assert_eq!(stretches.arc_lengths()[8], 0.06 + 0.0625);
    assert_eq!(stretches.total_length(), 0.06 + 0.0625 + 0.064);
}

#[test]
fn bad_backbones_name_the_argument() {
    type Change = fn(&mut BackboneSpec);
    let cases: [(&str, Change); 18] = [
        ("subsegments", |s| s.subsegments = vec![usize::MAX]),
        ("length", |s| s.length = vec![]),
        ("length", |s| s.length = vec![0.0]),
        ("length", |s| s.length = vec![-0.1]),
        ("length", |s| s.length = vec![f64::NAN]),
        ("length", |s| s.length = vec![f64::INFINITY]),
        ("subsegments", |s| s.subsegments = vec![0]),
        ("subsegments", |s| s.subsegments = vec![1, 2]),
        ("poisson_ratio", |s| s.poisson_ratio = -1.0),
        ("poisson_ratio", |s| s.poisson_ratio = 0.51),
        ("poisson_ratio", |s| s.poisson_ratio = f64::NAN),
        ("rest", |s| s.rest = Some(vec![Vector3::zeros(); 3])),
        ("rest", |s| s.rest = Some(vec![Vector3::new(0.0, 3.2, 0.0); 4])),
        ("rest", |s| s.rest = Some(vec![Vector3::new(0.0, f64::NAN, 0.0); 4])),
        ("diameter", |s| s.youngs_modulus = Some(1e9)),
        ("diameter", |s| s.diameter = Some(vec![0.001; 3])),
        ("youngs_modulus", |s| s.youngs_modulus = Some(-1.0)),
        ("disk_radius", |s| s.disk_radius = Some(0.0)),
    ];
    for (argument, change) in cases {
        assert_eq!(backbone(change).unwrap_err().argument, argument);
    }
}

#[test]
fn bad_tendons_name_the_argument() {
    use PerDisk::{Each, Same};
    let helical = |azimuth, radius, turns| {
        Tendon::new(Routing::Helical { azimuth, radius, turns }, None, None, None)
    };
    let cases: [(&str, Result<Tendon, InvalidInput>); 13] = [
        ("azimuth", Tendon::straight(f64::NAN, 0.01)),
        ("radius", Tendon::straight(0.0, 0.0)),
        ("radius", Tendon::straight(0.0, -0.01)),
        ("radius", angles(Same(0.0), Each(vec![0.01, f64::NAN]), None)),
        ("radius", angles(Each(vec![0.0; 3]), Each(vec![0.01; 4]), None)),
        ("azimuth", angles(Each(vec![0.0; 3]), Same(0.01), Some(3))),
        ("azimuth", angles(Each(vec![]), Same(0.01), None)),
        ("end", angles(Same(0.0), Same(0.01), Some(0))),
        ("turns", helical(0.0, 0.01, f64::INFINITY)),
        ("indices", holes(&[0, 1, 12], 12)),
        ("count", holes(&[0, 1], 0)),
        (
            "stiffness",
            Tendon::new(
                Routing::Helical { azimuth: 0.0, radius: 0.01, turns: 1.0 },
                None,
                Some(0.0),
                None,
            ),
        ),
        (
            "name",
            Tendon::new(
                Routing::Helical { azimuth: 0.0, radius: 0.01, turns: 1.0 },
                None,
                None,
                Some(" ".into()),
            ),
        ),
    ];
    for (argument, tendon) in cases {
        assert_eq!(tendon.unwrap_err().argument, argument);
    }
}

#[test]
fn bad_robots_name_the_argument() {
    use PerDisk::{Each, Same};
    let build = |tendons: Vec<Tendon>, base: Option<Matrix4<f64>>| {
        let spec = backbone(|s| s.disk_radius = Some(0.012)).unwrap();
        Robot::new(spec, tendons, base.as_ref(), None, None).unwrap_err()
    };
    let good = || Tendon::straight(0.0, 0.01).unwrap();
    let end = angles(Same(0.0), Same(0.01), Some(5)).unwrap();
    let error = build(vec![good(), end], None);
    assert_eq!(error.to_string(), "tendons[1].end: expected a disk from 1 to 4 (the tip), got 5");
    let short = angles(Each(vec![0.0; 4]), Same(0.01), None).unwrap();
    assert_eq!(build(vec![short], None).argument, "tendons[0].azimuth");
    assert_eq!(build(vec![holes(&[0, 1, 2], 12).unwrap()], None).argument, "tendons[0].indices");
    let outside = Tendon::straight(0.0, 0.0121).unwrap();
    assert_eq!(build(vec![outside], None).argument, "tendons[0].radius");
    let named = |name: &str| {
        let routing = Routing::Angles { azimuth: Same(0.0), radius: Same(0.01) };
        Tendon::new(routing, None, None, Some(name.into())).unwrap()
    };
    assert_eq!(build(vec![named("a"), named("a")], None).argument, "tendons[1].name");
    // A default name may not collide either.
    assert_eq!(build(vec![named("t1"), good()], None).argument, "tendons[1].name");
    let mut sheared = Matrix4::identity();
    sheared[(0, 1)] = 1e-3;
    let mut mirror = Matrix4::identity();
    mirror[(2, 2)] = -1.0;
    let mut scaled = Matrix4::identity();
    scaled[(3, 3)] = 2.0;
    let mut lost = Matrix4::identity();
    lost[(0, 3)] = f64::NAN;
    for base in [sheared, mirror, scaled, lost] {
        assert_eq!(build(vec![good()], Some(base)).argument, "base");
    }
}

#[test]
fn recipes_resolve_to_holes() {
    let uneven = backbone(|spec| {
        spec.length = vec![0.1, 0.3];
        spec.subsegments = vec![2, 2];
    })
    .unwrap();
    let helix = Routing::Helical { azimuth: 0.25, radius: 0.01, turns: -0.5 };
    let tendons = vec![
        Tendon::new(helix, None, None, None).unwrap(),
        holes(&[0, 3, 6, 9, 0], 12).unwrap(),
        angles(PerDisk::Same(1.0), PerDisk::Each(vec![0.01, 0.02]), Some(1)).unwrap(),
    ];
    let robot = Robot::new(uneven, tendons, None, None, None).unwrap();
    let [helix, holes, short] = robot.paths() else { panic!() };
    // Linear in arc length: disk 2 is at a quarter of it.
    assert!((helix.azimuths[2] - (0.25 - PI * 0.25)).abs() < 1e-15);
    assert!((helix.azimuths[4] - (0.25 - PI)).abs() < 1e-15);
    assert!((holes.azimuths[1] - (0.5 + FRAC_PI_2)).abs() < 1e-15);
    assert_eq!(holes.azimuths[0], holes.azimuths[4]);
    assert_eq!(short.end(), 1);
    assert!((short.rest_length - 0.05_f64.hypot(0.01)).abs() < 1e-17);
    assert!(
        (short.holes[1] - Vector3::new(0.02 * 1.0_f64.cos(), 0.02 * 1.0_f64.sin(), 0.0)).amax()
            < 1e-17
    );
}

#[test]
fn rest_frames_of_a_pre_bent_backbone_are_arcs() {
    // A quarter circle towards +x in four arcs.
    let bent = backbone(|s| s.rest = Some(vec![Vector3::y() * (FRAC_PI_2 / 4.0); 4])).unwrap();
    assert!(!bent.is_straight());
    let tendon = Tendon::straight(PI, 0.01).unwrap();
    let robot = Robot::new(bent, vec![tendon], None, None, None).unwrap();
    let radius = 0.2 / FRAC_PI_2;
    for (i, frame) in robot.rest_frames().iter().enumerate() {
        let angle = FRAC_PI_2 * i as f64 / 4.0;
        let expected = Vector3::new(radius * (1.0 - angle.cos()), 0.0, radius * angle.sin());
        assert!((frame.translation - expected).amax() < 1e-16);
    }
    // The tendon outside runs along chords of a circle of radius + 0.01.
    let chord = 2.0 * (radius + 0.01) * (FRAC_PI_2 / 8.0).sin();
    assert!((robot.paths()[0].rest_length - 4.0 * chord).abs() < 1e-15);
}

#[test]
fn displacements_are_checked() {
    let tendons = vec![Tendon::straight(0.0, 0.01).unwrap(), Tendon::straight(1.0, 0.01).unwrap()];
    let robot = Robot::new(backbone(|_| {}).unwrap(), tendons, None, None, None).unwrap();
    for good in [[0.0, 0.0], [-0.1, f64::INFINITY], [1e9, -1e9]] {
        assert!(robot.check_displacements(&good).is_ok());
    }
    for bad in [&[0.0][..], &[0.0; 3], &[f64::NAN, 0.0], &[0.0, f64::NEG_INFINITY]] {
        assert_eq!(robot.check_displacements(bad).unwrap_err().argument, "displacements");
    }
}

#[test]
#[allow(clippy::mutable_key_type)] // The plans kept with a robot are no part of its value.
fn equality_and_hash_are_by_value() {
    let build = |azimuth: f64, name: Option<&str>| {
        let tendons = vec![Tendon::straight(azimuth, 0.01).unwrap()];
        let spec = backbone(|_| {}).unwrap();
        Robot::new(spec, tendons, None, None, name.map(str::to_owned)).unwrap()
    };
    let set: HashSet<Robot> =
        [build(0.0, None), build(-0.0, None), build(0.1, None), build(0.0, Some("a"))].into();
    assert_eq!(set.len(), 3);
    assert_ne!(build(0.0, None), build(TAU, None));
}

#[test]
fn stiffness_follows_the_diameter() {
    let known = backbone(|s| {
        s.youngs_modulus = Some(2e9);
        s.diameter = Some(vec![0.002]);
    })
    .unwrap();
    let expected = 2e9 * PI * 0.002_f64.powi(4) / 64.0;
    assert!((known.bending_stiffness(3) / expected - 1.0).abs() < 1e-15);
    let relative = backbone(|s| s.diameter = Some(vec![0.002, 0.002, 0.001, 0.001])).unwrap();
    assert_eq!(relative.bending_stiffness(0), 1.0);
    assert_eq!(relative.bending_stiffness(3), 1.0 / 16.0);
    // Bending 1 rad over 0.05 m with EI = 1, and torsion softer by 1 + nu.
    let plain = backbone(|_| {}).unwrap();
    assert!((plain.strain_energy(0, &Vector3::x()) - 10.0).abs() < 1e-14);
    assert!((plain.strain_energy(0, &Vector3::z()) - 10.0 / 1.35).abs() < 1e-14);
}

/// Points of a helix of radius r and pitch 2 pi h that starts along z, by arc length.
fn helix(r: f64, h: f64, s: f64) -> Vector3<f64> {
    let rate = r.hypot(h);
    let t = s / rate;
    // Axis, binormal and radius of the helix in a frame whose z is its first tangent.
    let (along, across) = (h / rate, r / rate);
    let local = Vector3::new(r * (1.0 - t.cos()), r * t.sin(), h * t);
    Vector3::new(local.x, along * local.y - across * local.z, across * local.y + along * local.z)
}

/// Order 4 in the spacing of the points, order 2 in the subsegments, and no twist.
#[test]
fn backbones_follow_curves() {
    let (r, h, length) = (0.05, 0.03, 0.3);
    let sample = |m: usize| -> Vec<Vector3<f64>> {
        (0..m).map(|i| helix(r, h, length * i as f64 / (m - 1) as f64)).collect()
    };
    let build = |m: usize, n: usize| {
        let backbone = Backbone::from_curve(&sample(m), BackboneSpec::straight(1.0, n)).unwrap();
        Robot::new(backbone, vec![], None, None, None).unwrap()
    };
    let length_error = |m| (build(m, 4).backbone().total_length() - length).abs() / length;
    for m in [20, 40, 80, 160, 320] {
        println!("{m} points: length off by {:.1e}", length_error(m));
    }
    // Order 4: its two parts, from the ends and from within, differ in sign and cancel on the way.
    assert!(length_error(160) / length_error(320) > 14.0);
    assert!(length_error(20) < 1e-5 && length_error(160) < 1e-9);
    let tip_error = |n: usize| {
        let robot = build(2000, n);
        (robot.rest_frames()[n].translation - helix(r, h, length)).norm() / length
    };
    for n in [10, 20, 40] {
        let ratio = tip_error(n) / tip_error(2 * n);
        assert!((3.8..4.2).contains(&ratio), "{n} {ratio} {:e}", tip_error(n));
    }
    // Rotation-minimising: hardly any torsion, though the helix has some; curvature r / (r^2 + h^2).
    let robot = build(400, 50);
    let bend = r / (r * r + h * h) * length / 50.0;
    for i in 0..50 {
        let rest = robot.backbone().rest(i);
        assert!(rest.z.abs() < 0.02 * bend && (rest.norm() / bend - 1.0).abs() < 2e-3, "{rest}");
    }
}

#[test]
fn curves_of_few_points_and_bad_ones() {
    let spec = || BackboneSpec::straight(1.0, 3);
    let line = [Vector3::zeros(), Vector3::new(0.0, 0.0, 0.2)];
    let backbone = Backbone::from_curve(&line, spec()).unwrap();
    assert!((backbone.total_length() - 0.2).abs() < 1e-16 && backbone.is_straight());
    // A line in another direction is a straight backbone too, up to rounding.
    let oblique = [Vector3::new(1.0, 1.0, 1.0), Vector3::new(0.9, 1.2, 1.3)];
    let backbone = Backbone::from_curve(&oblique, spec()).unwrap();
    assert!((0..3).all(|i| backbone.rest(i).amax() < 1e-15));
    let down = [Vector3::zeros(), Vector3::new(0.0, 0.0, -0.2)];
    assert!(Backbone::from_curve(&down, spec()).unwrap().rest(0).amax() < 1e-15);
    let nan = Vector3::new(f64::NAN, 0.0, 0.0);
    let bad: [&[Vector3<f64>]; 4] =
        [&[], &line[..1], &[line[0], line[0], line[1]], &[line[0], nan]];
    for points in bad {
        assert_eq!(Backbone::from_curve(points, spec()).unwrap_err().argument, "points");
    }
    let none = BackboneSpec::straight(1.0, 0);
    assert_eq!(Backbone::from_curve(&line, none).unwrap_err().argument, "subsegments");
}
