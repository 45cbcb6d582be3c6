//! Routing design: holes that were forgotten, every routing of a small robot, bounds, what cannot be reached.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::Status;
use tdcr::design::{Optimality, RoutingSettings, routing, routing_stopped_by};
use tdcr::inverse::Range;
use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use tdcr::rod::{Plan, Rod, RodSettings, Scratch};

const PIECE: f64 = 0.02;

/// A straight backbone with tendons through holes given by number, one list per tendon.
fn robot(subsegments: usize, holes: &[Vec<usize>], count: usize) -> Robot {
    let length = PIECE * subsegments as f64;
    let backbone = Backbone::new(BackboneSpec::straight(length, subsegments)).unwrap();
    let tendons = holes.iter().map(|indices| {
        let radius = PerDisk::Same(8e-3);
        let routing = Routing::Holes { indices: indices.clone(), count, radius, azimuth: 0.0 };
        Tendon::new(routing, None, None, None).unwrap()
    });
    Robot::new(backbone, tendons.collect(), None, None, None).unwrap()
}

/// Holes, pulls, and the places of the disks.
type Known = (Vec<Vec<usize>>, Vec<f64>, Vec<Vector3<f64>>);

/// Holes that move on by up to `jump` of 12 from disk to disk, and the places of the disks when they are pulled by
/// 2 to 8 % of the length; none if the rod does not follow, or a tendon is slack.
fn known(draw: &mut ChaCha8Rng, tendons: usize, jump: i32) -> Option<Known> {
    let holes: Vec<Vec<usize>> = (0..tendons)
        .map(|_| {
            let mut hole = draw.random_range(0..12_i32);
            let mut next = || {
                hole = (hole + draw.random_range(-jump..=jump)).rem_euclid(12);
                usize::try_from(hole).unwrap()
            };
            (0..10).map(|_| next()).collect()
        })
        .collect();
    let pulls: Vec<f64> = (0..tendons).map(|_| -0.18 * draw.random_range(0.02..0.08)).collect();
    let real = robot(9, &holes, 12);
    let plan = Plan::new(&real, RodSettings::default()).unwrap();
    let shape = Rod::new(&real, &plan).shape(&pulls).unwrap();
    let follows = shape.report.status == Status::Converged;
    let places = shape.state.frames[1..].iter().map(|frame| frame.translation).collect();
    (follows && !shape.state.tensions.contains(&0.0)).then_some((holes, pulls, places))
}

fn blank(tendons: usize) -> Robot {
    robot(9, &vec![vec![0; 10]; tendons], 12)
}

fn known_holes_are_found() {
    for (jump, wanted) in [(1, 40), (2, 200), (3, 40), (6, 40)] {
        let mut draw = ChaCha8Rng::seed_from_u64(1);
        let (mut drawn, mut reached, mut same) = (0, 0, 0);
        while drawn < wanted {
            let Some((holes, _, places)) = known(&mut draw, 1, jump) else { continue };
            drawn += 1;
            let answer =
                routing(&blank(1), &places, None, None, &RoutingSettings::default()).unwrap();
            let worst = answer.errors.iter().copied().fold(0.0_f64, f64::max);
            assert!(worst <= 5e-3 * 0.18, "{worst}");
            if answer.status == Status::Converged {
                reached += 1;
                assert!(worst <= 1e-8 * 0.18);
                assert_eq!(answer.optimality, Optimality::Reached);
            }
            same += usize::from(answer.holes == Some(holes));
        }
        println!("jumps to {jump}: {reached} of {drawn} shapes, {same} the same holes");
        assert!(reached * 100 >= drawn * 95);
    }
}

fn holes_of_two_tendons_come_near() {
    let mut draw = ChaCha8Rng::seed_from_u64(2);
    let (mut drawn, mut near, mut reached, mut left) = (0, 0, 0, Vec::new());
    while drawn < 12 {
        let Some((_, _, places)) = known(&mut draw, 2, 2) else { continue };
        drawn += 1;
        let answer = routing(&blank(2), &places, None, None, &RoutingSettings::default()).unwrap();
        near += usize::from(answer.errors.iter().all(|e| *e <= 5e-3 * 0.18));
        assert!(answer.relaxed_rms <= answer.rms);
        if answer.status == Status::Converged {
            reached += 1;
        } else {
            left.push((1e3 * answer.rms, 1e6 * answer.relaxed_rms));
        }
    }
    println!("two tendons: {near} of {drawn} within 0.5 % of the length, {reached} reached");
    left.sort_by(|a, b| a.0.total_cmp(&b.0));
    println!("the others, mm left and um by any azimuth: {left:.3?}");
    assert!(near * 10 >= drawn * 9);
}

/// The least root mean square over all holes and a fine row of tensions, by the forward model alone.
fn brute(places: &[Vector3<f64>], count: usize) -> f64 {
    let disks = places.len() + 1;
    let mut least = f64::INFINITY;
    for number in 0..count.pow(u32::try_from(disks).unwrap()) {
        let holes = (0..disks).map(|i| number / count.pow(u32::try_from(i).unwrap()) % count);
        let own = robot(places.len(), &[holes.collect()], count);
        let plan = Plan::new(&own, RodSettings::default()).unwrap();
        let rod = Rod::new(&own, &plan);
        let mut work = Scratch::default();
        let mut value = |tension: f64| {
            let report = rod.solve_tensions(&[tension], &mut work).unwrap();
            if report.status != Status::Converged {
                return f64::INFINITY;
            }
            let frames = rod.state(&work).frames[1..].iter().zip(places);
            frames.map(|(frame, place)| (frame.translation - place).norm_squared()).sum()
        };
        let (mut at, mut stride) = (0.0, 100.0);
        let mut own = value(at);
        for i in 1..60 {
            let tried = value(f64::from(i) * stride);
            if tried < own {
                (at, own) = (f64::from(i) * stride, tried);
            }
        }
        while stride > 1e-3 {
            stride *= 0.5;
            for tension in [at - stride, at + stride] {
                let tried = if tension > 0.0 { value(tension) } else { f64::INFINITY };
                if tried < own {
                    (at, own) = (tension, tried);
                }
            }
        }
        least = least.min(own);
    }
    (least / places.len() as f64).sqrt()
}

#[test]
fn every_routing_of_a_small_robot_is_tried() {
    let mut draw = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..4 {
        let mut places = vec![Vector3::new(0.0, 0.0, PIECE), Vector3::new(0.0, 0.0, 2.0 * PIECE)];
        for (i, place) in places.iter_mut().enumerate() {
            let far = 2e-3 * (i + 1) as f64;
            *place += Vector3::from_fn(|_, _| draw.random_range(-far..far));
        }
        let settings = RoutingSettings { holes: Some(6), ..Default::default() };
        let blank = robot(2, &[vec![0; 3]], 6);
        let answer = routing(&blank, &places, None, None, &settings).unwrap();
        assert_eq!(answer.status, Status::Unreachable);
        assert_eq!(answer.optimality, Optimality::Exhaustive);
        let least = brute(&places, 6);
        println!("{:.6e} {least:.6e}", answer.rms);
        assert!((answer.rms - least).abs() <= 1e-6 * least);
    }
}

fn wider_beams_find_nothing_nearer() {
    let mut draw = ChaCha8Rng::seed_from_u64(4);
    for _ in 0..6 {
        let Some((_, _, mut places)) = known(&mut draw, 1, 2) else { continue };
        for place in &mut places {
            *place += Vector3::from_fn(|_, _| draw.random_range(-1e-3..1e-3));
        }
        let by = |beam_width| {
            let settings = RoutingSettings { beam_width, ..Default::default() };
            routing(&blank(1), &places, None, None, &settings).unwrap()
        };
        let (narrow, wide) = (by(256), by(2048));
        assert_eq!(narrow.optimality, Optimality::Searched);
        assert!(narrow.relaxed_rms <= narrow.rms);
        assert!(narrow.rms <= wide.rms * (1.0 + 1e-3), "{} {}", narrow.rms, wide.rms);
    }
}

fn any_azimuth_and_radius_reach_what_holes_do() {
    let mut draw = ChaCha8Rng::seed_from_u64(5);
    for radius in [None, Some((4e-3, 12e-3))] {
        let mut drawn = 0;
        while drawn < 5 {
            let Some((_, _, places)) = known(&mut draw, 1, 2) else { continue };
            drawn += 1;
            let settings = RoutingSettings { holes: None, radius, ..Default::default() };
            let answer = routing(&blank(1), &places, None, None, &settings).unwrap();
            assert_eq!(answer.status, Status::Converged, "{}", answer.message);
            assert_eq!(answer.holes, None);
        }
    }
}

fn displacements_stay_within_bounds() {
    let mut draw = ChaCha8Rng::seed_from_u64(6);
    let (_, pulls, places) = known(&mut draw, 1, 2).unwrap();
    let bounds = Range::new("bounds", vec![0.8 * pulls[0]], vec![0.0]).unwrap();
    for holes in [Some(12), None] {
        let settings = RoutingSettings { holes, ..Default::default() };
        let answer = routing(&blank(1), &places, Some(&bounds), None, &settings).unwrap();
        assert_eq!(answer.status, Status::Unreachable);
        assert!(answer.displacements[0] >= 0.8 * pulls[0]);
        // Other holes need less of a pull: they bend as much through a detour.
        assert!(answer.rms <= 0.01 * 0.18, "{}", answer.rms);
    }
}

#[test]
fn an_earlier_answer_is_looked_at_first() {
    let mut draw = ChaCha8Rng::seed_from_u64(7);
    let (_, _, places) = known(&mut draw, 1, 2).unwrap();
    let settings = RoutingSettings::default();
    let first = routing(&blank(1), &places, None, None, &settings).unwrap();
    let start = (&first.robot, first.shape.state.tensions.as_slice());
    let again = routing(&blank(1), &places, None, Some(start), &settings).unwrap();
    assert_eq!(again.holes, first.holes);
    assert!(again.evaluations < first.evaluations);
}

#[test]
fn what_cannot_be_reached_is_said() {
    let places: Vec<_> = (1..=9).map(|i| Vector3::new(0.05 * f64::from(i), 0.0, 0.1)).collect();
    let settings = RoutingSettings::default();
    let answer = routing(&blank(1), &places, None, None, &settings).unwrap();
    assert_eq!(answer.status, Status::Unreachable);
    assert!(answer.message.contains("from disk 0 to disk 1"), "{}", answer.message);
    let wrong = |robot: &Robot, places: &[_], settings| {
        routing(robot, places, None, None, &settings).unwrap_err().argument
    };
    assert_eq!(wrong(&blank(1), &places[1..], settings), "target_positions");
    assert_eq!(wrong(&blank(0), &places, settings), "robot");
    let none = RoutingSettings { holes: Some(0), ..settings };
    assert_eq!(wrong(&blank(1), &places, none), "holes");
}

#[test]
fn a_flag_ends_a_design() {
    let mut draw = ChaCha8Rng::seed_from_u64(8);
    let (_, _, places) = known(&mut draw, 2, 2).unwrap();
    let stop = Arc::new(AtomicBool::new(true));
    for holes in [Some(12), None] {
        let settings = RoutingSettings { holes, ..Default::default() };
        let answer = routing_stopped_by(&blank(2), &places, None, None, &settings, &stop).unwrap();
        assert_eq!(answer.status, Status::IterationLimit);
    }
}

crate::common::slow!(
    any_azimuth_and_radius_reach_what_holes_do,
    displacements_stay_within_bounds,
    holes_of_two_tendons_come_near,
    known_holes_are_found,
    wider_beams_find_nothing_nearer,
);
