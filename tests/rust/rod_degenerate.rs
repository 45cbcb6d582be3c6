//! Rods at the edges: dependent tendons, nothing pulled, too much pulled, and input that is refused.

use std::f64::consts::{PI, TAU};

use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use tdcr::rod::{Plan, Rod, RodSettings, Scratch, Subsegment, TendonLaw};
use tdcr::{InvalidInput, Shape, Status};

use crate::common::{FREE, robot, straight};
use crate::rod_common::{apart, rod_shape, solved, under};

const LENGTH: f64 = 0.2;
const A: f64 = 8e-3;

fn default() -> RodSettings {
    RodSettings::default()
}

fn around(count: usize) -> Vec<f64> {
    (0..count).map(|k| TAU * k as f64 / count as f64).collect()
}

/// Straight tendons, evenly around.
fn ring(n: usize, count: usize) -> Robot {
    robot(LENGTH, n, straight(&around(count), A))
}

/// Every combination of settings that needs no Young's modulus.
fn settings() -> Vec<RodSettings> {
    let mut all = Vec::new();
    for subsegment in Subsegment::ALL {
        for tendons in TendonLaw::ALL {
            all.extend([1, 2].map(|elements| RodSettings {
                subsegment,
                tendons,
                elements,
                ..default()
            }));
        }
    }
    all
}

/// A solve that ended says so: finite, and with words unless it converged.
fn honest(shape: &Shape) {
    assert!(shape.state.frames.iter().all(|f| f.translation.iter().all(|x| x.is_finite())));
    assert!(shape.state.tensions.iter().all(|t| t.is_finite()));
    assert!(shape.report.residual.is_finite());
    let converged = shape.report.status == Status::Converged;
    assert_eq!(shape.message.is_empty(), converged, "{}", shape.message);
}

/// More tendons than bending freedoms: displacements that some shape has are met, whichever of all tensions are
/// found; any others are infeasible and named.
#[test]
fn dependent_tendons_are_met_or_named() {
    for count in [3, 4, 8] {
        for n in [1, 2, 10] {
            let trunk = ring(n, count);
            let l = LENGTH / n as f64;
            for strongest in 0..count {
                let load = |k: usize| if k == strongest { 1.0 } else { 0.3 + 0.02 * k as f64 };
                let tensions: Vec<f64> =
                    (0..count).map(|k| load(k) * 2.0 / (count as f64 * l * l)).collect();
                let (wanted, mut pulls) = under(&trunk, default(), &tensions);
                let shape = solved(&trunk, default(), &pulls);
                assert!(apart(&shape, &wanted) < 1e-9 * LENGTH);
                // Two tendons opposite to the bend are now too short for any shape.
                let opposite = (strongest + count / 2) % count;
                pulls[opposite] -= 2e-3;
                pulls[(opposite + 1) % count] -= 2e-3;
                pulls[strongest] -= 2e-3;
                let shape = rod_shape(&trunk, default(), &pulls);
                honest(&shape);
                assert_eq!(shape.report.status, Status::Infeasible, "{count} {n} {pulls:?}");
                let named = trunk.tendon_names().iter().any(|name| shape.message.contains(name));
                assert!(named, "{}", shape.message);
                let over = shape.message.contains("m too ");
                assert!(over && !shape.message.contains(" 0.000e0 m"), "{}", shape.message);
            }
        }
    }
}

#[test]
fn no_pull_is_no_shape_but_the_rest() {
    let trunk = ring(10, 3);
    let rest = trunk.rest_frames();
    for settings in settings() {
        for pulls in [[0.0; 3], [0.0, FREE, 0.0], [FREE; 3], [1e-3; 3], [0.01, 0.0, FREE]] {
            let shape = solved(&trunk, settings, &pulls);
            for (frame, rest) in shape.state.frames.iter().zip(&rest) {
                assert!((frame.translation - rest.translation).norm() < 1e-15);
            }
            assert_eq!(shape.state.tensions, [0.0; 3]);
            assert_eq!((shape.state.energy, shape.report.iterations), (0.0, 0));
        }
    }
    let (shape, displacements) = under(&trunk, default(), &[0.0; 3]);
    assert_eq!((shape.state.energy, displacements), (0.0, vec![0.0; 3]));
}

/// A release has no limit: not at the tendon's length, nor at any number times that, also from a bent start.
#[test]
fn released_tendons_are_slack() {
    for (n, pull) in [(1, 1e-3), (8, 6e-3)] {
        let trunk = robot(LENGTH, n, straight(&[0.0, 0.7, 1.9, 4.0], A));
        let alone = solved(&trunk, default(), &[-pull, FREE, FREE, FREE]);
        let plan = Plan::new(&trunk, default()).unwrap();
        let rod = Rod::new(&trunk, &plan);
        let mut work = Scratch::default();
        for release in [1.1 * pull, 0.1, LENGTH, 3.0 * LENGTH, 1e3 * LENGTH, 1e14, 1e300] {
            let shape = solved(&trunk, default(), &[-pull, release, release, release]);
            assert!(apart(&shape, &alone) < 1e-9 * LENGTH);
            assert_eq!(shape.state.tensions[1..], [0.0; 3]);
            let back = rod.solve_from(&alone.state, &[release; 4], &mut work).unwrap();
            assert_eq!(back.status, Status::Converged);
            assert!(rod.state(&work).strains.iter().all(|strain| strain.norm() < 1e-9));
        }
    }
}

/// The bend of one tendon is, to first order, its pull over its radius.
#[test]
fn tiny_pulls_bend_tinily() {
    let trunk = ring(10, 2);
    for settings in settings() {
        for pull in [1e-15, 1e-14, 1e-12, 1e-9] {
            let shape = solved(&trunk, settings, &[-pull, FREE]);
            let bend: f64 = shape.state.strains.iter().map(|strain| strain.y).sum();
            // Lengths are solved to a share of 1e-11.
            assert!((bend - pull / A).abs() < 1.1e-11 * LENGTH / A + 1e-6 * bend, "{bend:e}");
            assert!(shape.state.strains.iter().all(|strain| strain.x.abs() < 1e-15));
        }
    }
}

/// No shape is shorter than nothing.
#[test]
fn huge_pulls_end_honestly() {
    for settings in settings() {
        for n in [1, 10] {
            for pull in [0.5 * LENGTH, LENGTH, 1.5 * LENGTH, 10.0, 1e9] {
                let shape = rod_shape(&ring(n, 2), settings, &[-pull, FREE]);
                honest(&shape);
                // One arc may close to a circle, in which the tendon is a point.
                if shape.report.status == Status::Converged {
                    assert!(pull <= LENGTH);
                    let over = shape.state.tendon_lengths[0] - (LENGTH - pull);
                    assert!(over < 1e-11 * LENGTH);
                }
                let words = shape.message.contains("'t0'") || shape.message.is_empty();
                assert!(words, "{}", shape.message);
            }
        }
    }
}

/// A hole at the centre cannot bend the rod, and only elements that stretch can shorten.
#[test]
fn holes_at_the_centre_do_not_bend() {
    for radius in [1e-15, 1e-12] {
        let trunk = robot(LENGTH, 5, straight(&[0.3], radius));
        let shape = rod_shape(&trunk, default(), &[-1e-3]);
        honest(&shape);
        assert_eq!(solved(&trunk, default(), &[0.0]).state.tensions, [0.0]);
        assert!(solved(&trunk, default(), &[1e-3]).state.energy < 1e-30);
        let (under, pulls) = under(&trunk, default(), &[100.0]);
        assert!(under.state.energy < 1e-15 && pulls[0].abs() < 1e-12);
    }
}

/// Tendons may share holes: together they pull as one.
#[test]
fn identical_tendons_are_one() {
    for settings in settings() {
        let twins = robot(LENGTH, 10, straight(&[0.4, 0.4, 2.5], A));
        let one = solved(&robot(LENGTH, 10, straight(&[0.4], A)), settings, &[-5e-3]);
        for pulls in [[-5e-3, -5e-3, FREE], [-5e-3, FREE, FREE]] {
            let shape = solved(&twins, settings, &pulls);
            assert!(apart(&shape, &one) < 1e-9 * LENGTH);
            let sum = shape.state.tensions[0] + shape.state.tensions[1];
            assert!((sum / one.state.tensions[0] - 1.0).abs() < 1e-7);
        }
    }
    // The one that is pulled less hangs loose where lengths are bounds.
    let twins = robot(LENGTH, 10, straight(&[0.4, 0.4], A));
    let one = solved(&robot(LENGTH, 10, straight(&[0.4], A)), default(), &[-5e-3]);
    let shape = solved(&twins, default(), &[-3e-3, -5e-3]);
    assert!(apart(&shape, &one) < 1e-9 * LENGTH && shape.state.tensions[0] == 0.0);
}

/// A tendon that ends at disk 1 bends the first subsegment, and no other.
#[test]
fn a_tendon_to_the_first_disk_bends_the_first_subsegment() {
    let short = Tendon::straight(0.0, A).unwrap();
    let short = Tendon::new(short.routing().clone(), Some(1), None, None).unwrap();
    for settings in settings() {
        let shape = solved(&robot(LENGTH, 10, vec![short.clone()]), settings, &[-1e-3]);
        let (bent, others) = shape.state.strains.split_at(settings.elements);
        let bend: f64 = bent.iter().map(|strain| strain.y).sum();
        assert!((bend - 1e-3 / A).abs() < 1e-3 / A * 0.05, "{bend}");
        assert!(others.iter().all(|strain| strain.norm() < 1e-15));
    }
}

/// One subsegment, eight tendons of any holes: every pair alone, and all of them at once.
#[test]
fn one_subsegment_takes_eight_tendons() {
    let tendons: Vec<Tendon> = (0..8)
        .map(|k| {
            let azimuth = PerDisk::Each(vec![0.8 * f64::from(k), 0.8 * f64::from(k) + 0.3]);
            let routing = Routing::Angles { azimuth, radius: PerDisk::Same(A) };
            Tendon::new(routing, None, None, None).unwrap()
        })
        .collect();
    let trunk = robot(0.03, 1, tendons);
    for first in 0..8 {
        for second in 0..first {
            let mut tensions = [0.0; 8];
            (tensions[first], tensions[second]) = (400.0, 250.0);
            let (wanted, lengths) = under(&trunk, default(), &tensions);
            let mut pulls = [FREE; 8];
            (pulls[first], pulls[second]) = (lengths[first], lengths[second]);
            assert!(apart(&solved(&trunk, default(), &pulls), &wanted) < 1e-9);
            // With the others as long as they are, nothing changes.
            assert!(apart(&solved(&trunk, default(), &lengths), &wanted) < 1e-9);
        }
    }
    let shape = rod_shape(&trunk, default(), &[-1e-3; 8]);
    honest(&shape);
}

/// A hole that jumps by half a turn between neighbours has no slope at rest; pulls of it are met all the same, and
/// held tendons hold.
#[test]
fn holes_that_jump_by_half_a_turn_pull() {
    let azimuth = (0..=6).map(|i| if i % 2 == 0 { 0.0 } else { PI }).collect();
    let routing = Routing::Angles { azimuth: PerDisk::Each(azimuth), radius: PerDisk::Same(A) };
    let trunk = robot(LENGTH, 6, vec![Tendon::new(routing, None, None, None).unwrap()]);
    for pull in [0.0, 1e-6, 1e-3, 1e-2] {
        let shape = rod_shape(&trunk, default(), &[-pull]);
        honest(&shape);
        let over = shape.state.tendon_lengths[0] - trunk.paths()[0].rest_length + pull;
        assert!(over < 1e-11 * LENGTH);
        assert_eq!(shape.report.status, Status::Converged);
    }
}

#[test]
fn input_that_makes_no_sense_is_refused() {
    let trunk = ring(4, 2);
    let refused = |result: Result<Plan, InvalidInput>| result.unwrap_err().to_string();
    let axial = refused(Plan::new(&trunk, RodSettings { axial: true, ..default() }));
    assert!(axial.starts_with("youngs_modulus: expected Young's modulus"), "{axial}");
    let elastic = Tendon::straight(0.0, A).unwrap();
    let elastic = Tendon::new(elastic.routing().clone(), None, Some(1e4), None).unwrap();
    let elastic = refused(Plan::new(&robot(LENGTH, 4, vec![elastic]), default()));
    assert!(elastic.contains("tendon 't0' has a stiffness"), "{elastic}");
    for (wrong, name) in [
        (RodSettings { elements: 0, ..default() }, "elements"),
        (RodSettings { elements: 101, ..default() }, "elements"),
        (RodSettings { tolerance: 0.0, ..default() }, "tolerance"),
        (RodSettings { tolerance: 1e-16, ..default() }, "tolerance"),
        (RodSettings { tolerance: f64::NAN, ..default() }, "tolerance"),
        (RodSettings { max_iterations: 0, ..default() }, "max_iterations"),
        (RodSettings { body_radius: -1e-9, ..default() }, "body_radius"),
        (RodSettings { body_radius: f64::NAN, ..default() }, "body_radius"),
    ] {
        assert_eq!(Plan::new(&trunk, wrong).unwrap_err().argument, name);
    }
    let plan = Plan::new(&trunk, default()).unwrap();
    let rod = Rod::new(&trunk, &plan);
    let mut work = Scratch::default();
    for wrong in [&[1.0][..], &[1.0; 3], &[-1.0, 0.0], &[f64::NAN, 0.0], &[FREE, 0.0]] {
        assert_eq!(rod.solve_tensions(wrong, &mut work).unwrap_err().argument, "tensions");
    }
    for wrong in [&[0.0][..], &[0.0; 3], &[f64::NAN, 0.0], &[-FREE, 0.0]] {
        assert_eq!(rod.shape(wrong).unwrap_err().argument, "displacements");
    }
    let settings = RodSettings { tendons: TendonLaw::Proportional, ..default() };
    let proportional = Plan::new(&trunk, settings).unwrap();
    let error = Rod::new(&trunk, &proportional).solve_tensions(&[0.0; 2], &mut work).unwrap_err();
    assert_eq!(error.argument, "tendons");
    let other = solved(&ring(5, 2), default(), &[-1e-3, FREE]);
    let error = rod.solve_from(&other.state, &[0.0; 2], &mut work).unwrap_err();
    assert!(error.to_string().contains("4 strains, one per element, got 5"), "{error}");
    let mut spec = BackboneSpec::straight(LENGTH, 4);
    spec.youngs_modulus = Some(1e9);
    assert_eq!(Backbone::new(spec).unwrap_err().argument, "diameter");
}
