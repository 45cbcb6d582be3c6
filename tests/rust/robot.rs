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
