//! The second-order model of loads is exact: equilibria by differences of the energy, and Newton's pace.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
use tdcr::rod::contact::Loads;
use tdcr::rod::{RodSettings, Subsegment};

use crate::contact_common::{Case, V};

fn vector(draw: &mut ChaCha8Rng, size: f64) -> V {
    V::from_fn(|_, _| draw.random_range(-size..size))
}

fn loaded(draw: &mut ChaCha8Rng, settings: RodSettings, size: f64) -> Case {
    let n = draw.random_range(2..=8);
    let (length, modulus, diameter): (f64, f64, f64) = (0.1, 2e9, 1.5e-3);
    let mut spec = BackboneSpec::straight(length, n);
    (spec.youngs_modulus, spec.diameter) = (Some(modulus), Some(vec![diameter]));
    spec.rest = Some((0..n).map(|_| vector(draw, 1.5 / n as f64)).collect());
    let scale = size * modulus * diameter.powi(4) / 20.0 / length.powi(2);
    let loads = Loads {
        gravity: vector(draw, 9.81),
        backbone_density: 1200.0,
        disk_mass: 1e-4,
        tip_force: vector(draw, scale),
        tip_moment: V::zeros(),
        disk_forces: (0..=n).map(|_| vector(draw, scale / n as f64)).collect(),
    };
    let tendon = Tendon::straight(0.4, 5e-3).unwrap();
    let robot = Robot::new(Backbone::new(spec).unwrap(), vec![tendon], None, None, None).unwrap();
    Case { loads: Some(loads), settings, ..Case::new(robot) }
}

fn every() -> Vec<RodSettings> {
    let mut all = Vec::new();
    for subsegment in Subsegment::ALL {
        for axial in [false, true] {
            for elements in [1, 2, 3] {
                all.push(RodSettings { subsegment, axial, elements, ..Default::default() });
            }
        }
    }
    all
}

#[test]
fn loads_alone_are_met_exactly_and_stably() {
    let draw = &mut ChaCha8Rng::seed_from_u64(6);
    let mut steps = Vec::new();
    for settings in every() {
        for _ in 0..6 {
            let case = loaded(draw, settings, 1.0);
            let shape = case.solved(&[f64::INFINITY]);
            let unbalance = case.unbalance(&shape);
            assert!(unbalance < 1e-9, "{settings:?}: {unbalance:e}");
            let least = case.least_curvature(&shape);
            assert!(least > 0.0, "{settings:?}: {least:e}");
            steps.push(shape.report.iterations);
        }
    }
    steps.sort_unstable();
    println!("steps: median {}, most {}", steps[steps.len() / 2], steps[steps.len() - 1]);
    assert!(steps[steps.len() / 2] <= 8);
}

/// From a load nearby, each Newton step squares the error: 1e-2 of the load is gone in three or four.
#[test]
fn newton_squares_the_error() {
    let draw = &mut ChaCha8Rng::seed_from_u64(7);
    for settings in every() {
        for _ in 0..4 {
            let case = loaded(draw, settings, 0.02);
            let shape = case.solved(&[f64::INFINITY]);
            assert!(shape.report.iterations <= 4, "{settings:?} {:?}", shape.report);
        }
    }
}
