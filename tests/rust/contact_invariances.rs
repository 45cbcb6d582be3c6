//! What must not change the answer, and what must: places, mirrors, starts; saddles, sunk starts, the paper's trunk.

use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::{Rotation3, Vector3};
use tdcr::lie::Pose;
use tdcr::model::Model;
use tdcr::obstacle::{Cylinder, FirstFault, Obstacle, SignedDistance, Sphere, by_differences};
use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
use tdcr::rod::contact::{LoadedRod, Scratch};
use tdcr::{Shape, Status};

use crate::contact_common::{Case, V};

/// 180 mm, 9 subsegments; the tendon pulls towards -x, which is "left" here.
fn trunk(rest: Option<Vec<V>>, base: &Pose) -> Robot {
    let mut spec = BackboneSpec::straight(0.18, 9);
    spec.rest = rest;
    let tendon = Tendon::straight(std::f64::consts::PI, 8e-3).unwrap();
    Robot::new(Backbone::new(spec).unwrap(), vec![tendon], Some(&base.to_matrix()), None, None)
        .unwrap()
}

fn ball(x: f64, y: f64, base: &Pose) -> Case {
    let mut case = Case::new(trunk(None, base));
    let sphere = Obstacle::new(Sphere::new(&V::new(x, y, 0.13), 0.02).unwrap(), false);
    case.obstacles.push(sphere.transform(base));
    case
}

fn tip(shape: &Shape) -> V {
    shape.state.frames.last().unwrap().translation
}

#[test]
fn a_moved_scene_gives_the_moved_answer() {
    let turn = Rotation3::from_scaled_axis(V::new(0.7, -1.9, 0.4)).into_inner();
    let base = Pose { rotation: turn, translation: V::new(1.0, -2.0, 0.5) };
    let one = ball(-0.045, 0.006, &Pose::identity()).solved(&[-6e-3]);
    let other = ball(-0.045, 0.006, &base).solved(&[-6e-3]);
    assert!(one.state.contacts.iter().any(|c| c.force.norm() > 1.0));
    assert!((base.transform(&tip(&one)) - tip(&other)).norm() < 1e-9);
    for (a, b) in one.state.contacts.iter().zip(&other.state.contacts) {
        assert!((turn * a.force - b.force).norm() < 1e-6 * (1.0 + a.force.norm()));
    }
}

#[test]
fn a_mirrored_scene_gives_the_mirrored_answer() {
    let [one, other] = [0.006, -0.006].map(|y| ball(-0.045, y, &Pose::identity()).solved(&[-6e-3]));
    let mirrored = tip(&one).component_mul(&Vector3::new(1.0, -1.0, 1.0));
    assert!((mirrored - tip(&other)).norm() < 1e-9);
    assert!((one.state.energy - other.state.energy).abs() < 1e-7 * one.state.energy);
}

/// dE/dc = -F, F the force on the robot from an obstacle at c: the robot leans the other way on it.
#[test]
fn forces_are_slopes_of_the_energy() {
    let energy = |x: f64, y: f64| ball(x, y, &Pose::identity()).solved(&[-6e-3]).state.energy;
    let force: V = (ball(-0.045, 0.006, &Pose::identity()).solved(&[-6e-3]).state.contacts.iter())
        .map(|c| c.force)
        .sum();
    let h = 1e-5;
    let along = (energy(-0.045 + h, 0.006) - energy(-0.045 - h, 0.006)) / (2.0 * h);
    let across = (energy(-0.045, 0.006 + h) - energy(-0.045, 0.006 - h)) / (2.0 * h);
    assert!((along - force.x).abs() < 1e-3 * force.norm(), "{along} {force:?}");
    assert!((across - force.y).abs() < 1e-3 * force.norm(), "{across} {force:?}");
}

#[test]
fn a_ball_in_the_plane_is_slid_off_to_one_side() {
    let case = ball(-0.045, 0.0, &Pose::identity());
    let [one, again] = [0, 1].map(|_| case.solved(&[-6e-3]));
    assert_eq!(tip(&one), tip(&again));
    assert!(tip(&one).y.abs() > 1e-3, "{:?}", tip(&one));
    assert!(case.unbalance(&one) < 1e-9);
    assert!(case.least_curvature(&one) > 0.0);
}

#[test]
fn a_sunk_start_is_solved_out_and_told() {
    let case = ball(-0.015, 0.003, &Pose::identity());
    let shape = case.solved(&[f64::INFINITY]);
    assert!(shape.message.contains("deep in obstacles[0]"), "{}", shape.message);
    assert!(case.clearance(&shape.state.frames) > -1e-10 * 0.18);
    assert!(case.unbalance(&shape) < 1e-9);
    assert_eq!(shape.state.tensions[0], 0.0);
}

/// Its own rest shape is not in the text; here an S of two smooth bends. Zero before touch, one sign after.
#[test]
fn the_first_fault_goes_to_its_cell_and_stops_other_solves() {
    let calls = AtomicUsize::new(0);
    let broken = by_differences(move |_: &V| {
        Err(format!("fault {}", calls.fetch_add(1, Ordering::Relaxed)).into())
    });
    let mut case = Case::new(trunk(None, &Pose::identity()));
    case.obstacles.push(Obstacle::new(SignedDistance::new(broken), false));
    let (plan, first_fault) = (case.plan(), FirstFault::default());
    let scene = case.scene(&plan);
    let rod = LoadedRod::new(&case.robot, &plan, &scene).unwrap().reporting_to(&first_fault);
    for _ in 0..2 {
        let mut work = Scratch::default();
        let report = rod.solve(&[-6e-3], &mut work).unwrap();
        assert_ne!(report.status, Status::Converged);
        assert!(work.take_fault().is_none());
    }
    assert!(first_fault.is_set() && first_fault.stop().load(Ordering::Relaxed));
    assert_eq!(first_fault.take().unwrap().to_string(), "fault 0");
    assert!(!first_fault.is_set());
}

#[test]
fn the_papers_cylinder() {
    let rest = (0..9).map(|i| V::new(0.0, 0.12 * (0.7 * f64::from(i)).cos(), 0.0)).collect();
    let mut case = Case::new(trunk(Some(rest), &Pose::identity()));
    let bar = Cylinder::new(&V::new(-0.016, 0.0, 0.136), &V::y(), 0.015).unwrap();
    case.obstacles.push(Obstacle::new(bar, false));
    let plan = case.plan();
    let scene = case.scene(&plan);
    let model = LoadedRod::new(&case.robot, &plan, &scene).unwrap();
    let mut work = Scratch::default();
    let mut touched = false;
    let mut first = None;
    for step in 1..=20 {
        let pull = [-5e-4 * f64::from(step)];
        let report = model.resume(&pull, &mut work).unwrap();
        assert_eq!(report.status, Status::Converged, "step {step}");
        let state = model.state(&work).clone();
        let cold = case.solved(&pull);
        assert!((state.energy - cold.state.energy).abs() < 1e-6 * state.energy, "step {step}");
        let pushing: Vec<_> = state.contacts.iter().filter(|c| c.force.norm() > 0.0).collect();
        assert!(pushing.iter().all(|c| c.force.dot(&c.normal) > 0.0));
        let own: Vec<_> = pushing.iter().map(|c| (c.disk, c.kind, c.force.norm())).collect();
        println!("{:.1} mm: {own:?}", -1e3 * pull[0]);
        assert!(!touched || !own.is_empty());
        touched = !own.is_empty();
        first = first.or(own.first().map(|(disk, _, _)| *disk));
    }
    // Third from the tip, counted with it.
    assert_eq!(first, Some(7));
}
