//! Tendons that cross from one side of the backbone to the other: no leverage at rest, two mirror images.

use std::f64::consts::PI;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::Status;
use tdcr::lie::so3;
use tdcr::model::Model;
use tdcr::robot::{PerDisk, Robot, Routing, Tendon};
use tdcr::rod::{Plan, Rod, RodSettings, Scratch, Subsegment, TendonLaw};

use crate::common::robot;

const LENGTH: f64 = 0.2;
const RADIUS: f64 = 0.01;

/// One tendon through holes at azimuth 0 or pi.
fn crossing(crossed: &[bool]) -> Robot {
    through(LENGTH, RADIUS, 0.0, crossed)
}

fn through(length: f64, radius: f64, azimuth: f64, crossed: &[bool]) -> Robot {
    let azimuth = crossed.iter().map(|crossed| azimuth + if *crossed { PI } else { 0.0 }).collect();
    let routing =
        Routing::Angles { azimuth: PerDisk::Each(azimuth), radius: PerDisk::Same(radius) };
    robot(length, crossed.len() - 1, vec![Tendon::new(routing, None, None, None).unwrap()])
}

fn zigzag(n: usize) -> Robot {
    crossing(&(0..=n).map(|i| i % 2 == 1).collect::<Vec<_>>())
}

fn once(n: usize) -> Robot {
    crossing(&(0..=n).map(|i| i > n / 2).collect::<Vec<_>>())
}

/// Energy and tendon length of arcs, computed from their definitions.
fn energy_and_length(robot: &Robot, strains: &[Vector3<f64>]) -> (f64, f64) {
    let path = &robot.paths()[0];
    let torsion = 1.0 / (1.0 + robot.backbone().spec().poisson_ratio);
    let (mut energy, mut length) = (0.0, 0.0);
    for (i, w) in strains.iter().enumerate() {
        let own = robot.backbone().lengths()[i];
        energy += 0.5 * (w.x * w.x + w.y * w.y + torsion * w.z * w.z) / own;
        let end = so3::left_jacobian(w).column(2) * own + so3::exp(w) * path.holes[i + 1];
        length += (end - path.holes[i]).norm();
    }
    (energy, length)
}

#[test]
fn crossing_tendons_pull_into_a_true_minimum() {
    let mut draw = ChaCha8Rng::seed_from_u64(3);
    for (robot, n) in [(zigzag(10), 10), (zigzag(1), 1), (once(10), 10), (once(9), 9)] {
        let plan = Plan::new(&robot, RodSettings::default()).unwrap();
        let rod = Rod::new(&robot, &plan);
        for share in [1e-4, 0.01, 0.05] {
            let rest = rod.rest_lengths()[0];
            let shape = rod.shape(&[-share * rest]).unwrap();
            assert_eq!(shape.report.status, Status::Converged, "{n} {share}: {}", shape.message);
            assert!(shape.message.is_empty());
            let (state, tension) = (&shape.state, shape.state.tensions[0]);
            let (energy, length) = energy_and_length(&robot, &state.strains);
            assert!((length / (rest * (1.0 - share)) - 1.0).abs() < 1e-10);
            assert!((energy - state.energy).abs() < 1e-9 * energy);
            assert!(tension > 0.0);
            // A minimum of energy and tension's work: then one of the energy among those as short.
            let least = energy + tension * length;
            for size in [3e-3, 1e-2, 3e-2] {
                for _ in 0..200 {
                    let moved: Vec<_> = (state.strains.iter())
                        .map(|w| w + Vector3::from_fn(|_, _| draw.random_range(-size..size)))
                        .collect();
                    let (energy, length) = energy_and_length(&robot, &moved);
                    assert!(energy + tension * length > least, "{n} {share} {size}");
                }
            }
        }
    }
}

#[test]
fn random_ones_all_pull() {
    let mut draw = ChaCha8Rng::seed_from_u64(4);
    let (mut found, all) = (0, 3000);
    for _ in 0..all {
        let n = draw.random_range(1..15);
        let zigzag = draw.random_bool(0.7);
        let crossed: Vec<_> =
            (0..=n).map(|i| if zigzag { i % 2 == 1 } else { i > n / 2 }).collect();
        // Against the distance of the disks.
        let radius = 10.0_f64.powf(draw.random_range(-1.3..0.2));
        let robot = through(f64::from(n), radius, draw.random_range(0.0..6.0), &crossed);
        let plan = Plan::new(&robot, RodSettings::default()).unwrap();
        let rod = Rod::new(&robot, &plan);
        let share = 10.0_f64.powf(draw.random_range(-6.0..-1.0));
        let shape = rod.shape(&[-share * rod.rest_lengths()[0]]).unwrap();
        found += usize::from(shape.report.status == Status::Converged);
    }
    println!("{found} of {all} random crossing tendons converged");
    assert_eq!(found, all);
}

#[test]
fn both_mirror_images_have_the_same_energy() {
    let robot = zigzag(8);
    let plan = Plan::new(&robot, RodSettings::default()).unwrap();
    let rod = Rod::new(&robot, &plan);
    for share in [0.01, 0.05] {
        let pull = [-share * rod.rest_lengths()[0]];
        let shape = rod.shape(&pull).unwrap();
        // Of the two, the one whose largest strain is positive; the same every time.
        for w in &shape.state.strains {
            assert!(w[w.iamax()] > 0.0, "{w}");
        }
        assert_eq!(rod.shape(&pull).unwrap().state.frames, shape.state.frames);
        let mut mirrored = shape.state.clone();
        for w in &mut mirrored.strains {
            *w = -*w;
        }
        let mut work = Scratch::default();
        let report = rod.solve_from(&mirrored, &pull, &mut work).unwrap();
        assert_eq!(report.status, Status::Converged);
        let other = rod.state(&work);
        assert!((other.energy / shape.state.energy - 1.0).abs() < 1e-12);
        for (own, other) in shape.state.strains.iter().zip(&other.strains) {
            assert!((own + other).amax() < 1e-10);
        }
    }
}

#[test]
fn every_kind_of_element_and_rule_gets_there() {
    for subsegment in Subsegment::ALL {
        for tendons in TendonLaw::ALL {
            for elements in [1, 2, 3] {
                let settings =
                    RodSettings { subsegment, tendons, elements, ..RodSettings::default() };
                for robot in [zigzag(10), once(10)] {
                    let plan = Plan::new(&robot, settings).unwrap();
                    let rod = Rod::new(&robot, &plan);
                    for share in [0.01, 0.05] {
                        let shape = rod.shape(&[-share * rod.rest_lengths()[0]]).unwrap();
                        let status = shape.report.status;
                        assert_eq!(status, Status::Converged, "{settings:?} {share}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_tendon_next_to_the_centre_bends_no_way_before_another() {
    let robot = robot(LENGTH, 10, vec![Tendon::straight(0.0, 1e-7).unwrap()]);
    let plan = Plan::new(&robot, RodSettings::default()).unwrap();
    let shape = Rod::new(&robot, &plan).shape(&[-0.01 * LENGTH]).unwrap();
    assert_eq!(shape.report.status, Status::Infeasible);
    assert!(shape.message.starts_with("no shape near rest"), "{}", shape.message);
}

#[test]
fn a_pull_of_all_the_path_says_so() {
    let robot = robot(LENGTH, 10, vec![Tendon::straight(0.0, 0.01).unwrap()]);
    let plan = Plan::new(&robot, RodSettings::default()).unwrap();
    let shape = Rod::new(&robot, &plan).shape(&[-12.0]).unwrap();
    assert_eq!(shape.report.status, Status::Infeasible);
    let expected = "tendon 't0' is pulled by 1.200e1 m, its path of 2.000e-1 m or more";
    assert_eq!(shape.message, expected);
}
