//! Instruction counts of five hot paths, for `make instructions`.
//!
//! `instructions CASE TIMES` solves one case so often and nothing else; benches/instructions.py runs it under
//! callgrind for two numbers of times and takes the difference. Without a case every one is solved once, which
//! proves that it converges.
#![allow(missing_docs, clippy::unwrap_used)] // a bench may stop on a bad answer.

use std::env::args;
use std::f64::consts::{PI, TAU};
use std::hint::black_box;

use nalgebra::Vector3;
use tdcr::Status;
use tdcr::inverse::{Bounds, InverseSettings, Inverter, RodInverse, Target};
use tdcr::linkage::LinkageSettings;
use tdcr::linkage::seven_bar::{Hole, SevenBar};
use tdcr::model::Model;
use tdcr::obstacle::{Cylinder, Obstacle};
use tdcr::robot::{Backbone, BackboneSpec, Robot, Routing, Tendon};
use tdcr::rod::contact::{self, LoadedRod, Scene};
use tdcr::rod::{Plan, Rod, RodSettings, Scratch};
use tdcr::solve::sqp::{Ending, minimize};

/// Three tendons to every end; the first of the three ones is pulled, the second by less, the third is free.
fn robot(n: usize, ends: &[usize], turns: f64) -> Robot {
    let tendon = |k: usize, end: usize| {
        let azimuth = TAU * k as f64 / 3.0 + 0.2 * end as f64;
        let routing = Routing::Helical { azimuth, radius: 8e-3, turns };
        Tendon::new(routing, Some(end), None, None).unwrap()
    };
    let tendons = ends.iter().flat_map(|end| (0..3).map(move |k| tendon(k, *end)));
    let backbone = Backbone::new(BackboneSpec::straight(0.02 * n as f64, n)).unwrap();
    Robot::new(backbone, tendons.collect(), None, None, None).unwrap()
}

fn tensions(robot: &Robot) -> Vec<f64> {
    (0..robot.tendons().len()).map(|k| [200.0, 80.0, 0.0][k % 3]).collect()
}

/// The rod from rest, pulled as far as tensions pull it; a tendon without tension is released.
fn forward(n: usize, ends: &[usize], turns: f64, times: usize) {
    let robot = robot(n, ends, turns);
    let plan = Plan::new(&robot, RodSettings::default()).unwrap();
    let (rod, mut work, tensions) = (Rod::new(&robot, &plan), Scratch::default(), tensions(&robot));
    assert_eq!(rod.solve_tensions(&tensions, &mut work).unwrap().status, Status::Converged);
    let mut pulls = rod.displacements(rod.state(&work));
    for (pull, tension) in pulls.iter_mut().zip(&tensions) {
        *pull += if *tension > 0.0 { 0.0 } else { 5e-3 };
    }
    for _ in 0..times {
        let report = rod.solve(black_box(&pulls), &mut work).unwrap();
        assert_eq!(report.status, Status::Converged);
    }
}

/// A pull in 20 steps around a bar.
fn around_bar(times: usize) {
    let mut spec = BackboneSpec::straight(0.18, 30);
    (spec.youngs_modulus, spec.diameter) = (Some(60e9), Some(vec![1e-3]));
    let tendon = Tendon::straight(PI, 8e-3).unwrap();
    let robot = Robot::new(Backbone::new(spec).unwrap(), vec![tendon], None, None, None).unwrap();
    let axis = Vector3::new(-0.045, 0.0, 0.13);
    let bar = Obstacle::new(Cylinder::new(&axis, &Vector3::y(), 0.02).unwrap(), false);
    let plan = Plan::new(&robot, RodSettings::default()).unwrap();
    let scene = Scene::new(&robot, &plan, &[bar], None, 0.0).unwrap();
    let rod = LoadedRod::new(&robot, &plan, &scene).unwrap();
    let mut work = contact::Scratch::default();
    for _ in 0..times {
        rod.solve(&[0.0], &mut work).unwrap();
        for step in 1..=20 {
            let report = rod.resume(&[-6e-3 * f64::from(step) / 20.0], &mut work).unwrap();
            assert_eq!(report.status, Status::Converged);
        }
        assert!(rod.state(&work).contacts.iter().any(|c| c.force.norm() > 0.0));
    }
}

/// The tip of a solved rod of two segments as the target: its point, then its pose.
fn inverse(times: usize) {
    let robot = robot(10, &[5, 10], 0.0);
    let plan = Plan::new(&robot, RodSettings::default()).unwrap();
    let (rod, mut work) = (Rod::new(&robot, &plan), Scratch::default());
    let report = rod.solve_tensions(&tensions(&robot), &mut work).unwrap();
    assert_eq!(report.status, Status::Converged);
    let tip = *rod.state(&work).frames.last().unwrap();
    let (bounds, settings) = (Bounds::default(), InverseSettings::default());
    let inverse = RodInverse::new(&robot, &plan, &bounds, settings).unwrap();
    let mut buffers = inverse.buffers(None);
    for _ in 0..times {
        for target in [Target::Position(tip.translation), Target::frame(&tip)] {
            let answer = inverse.solve(black_box(&target), None, &mut buffers);
            assert_eq!(answer.status, Status::Converged);
        }
    }
}

/// One subsegment of a linkage with differing holes.
fn seven_bar(times: usize) {
    let polar = |radius: f64, azimuth: f64| {
        Vector3::new(radius * azimuth.cos(), radius * azimuth.sin(), 0.0)
    };
    let holes = [(0.0, 0.06), (1.6, 0.04)]
        .map(|(azimuth, pull)| Hole::new(polar(0.5, azimuth), polar(0.49, azimuth), pull));
    let settings = LinkageSettings::default().sqp();
    for _ in 0..times {
        let problem = SevenBar::<2>::new(black_box(&holes));
        let found = minimize(&problem, problem.point(problem.start()), &settings);
        assert_eq!(found.ending, Ending::Converged);
    }
}

type Case = (&'static str, fn(usize));
const CASES: [Case; 5] = [
    ("forward-10", |times| forward(10, &[10], 0.25, times)),
    ("forward-30", |times| forward(30, &[10, 20, 30], 0.0, times)),
    ("contact-30", around_bar),
    ("inverse", inverse),
    ("seven-bar", seven_bar),
];

fn main() {
    let given: Vec<String> = args().skip(1).collect();
    // Cargo adds options of its own, which name no case.
    let case = CASES.iter().find(|(name, _)| given.first().is_some_and(|first| first == name));
    if let Some((_, run)) = case {
        run(given[1].parse().unwrap());
    } else {
        for (_, run) in CASES {
            run(1);
        }
    }
}
