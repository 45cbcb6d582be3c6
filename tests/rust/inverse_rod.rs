//! The inverse of the rod, checked by forward solves from rest.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use tdcr::batch::Control;
use tdcr::inverse::{
    Bounds, InverseSettings, Inverter, Range, RodInverse, RodScratch, Target, invert_path,
};
use tdcr::lie::{Pose, so3};
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use tdcr::rod::{Plan, RodSettings, Subsegment, TendonLaw};
use tdcr::{Shape, Status};

use crate::inverse_common::{transform, uniform};
use crate::rod_common::{rod_shape, try_under, under};

pub(crate) const LENGTH: f64 = 0.06;
pub(crate) const RADIUS: f64 = 0.008;

/// Segments of ten subsegments with three tendons each, 40 degrees on from one segment to the next, that wind by so
/// many turns per segment.
pub(crate) fn rod_trunk(segments: usize, turns: f64) -> Robot {
    let mut spec = BackboneSpec::straight(1.0, 1);
    spec.length = vec![LENGTH; segments];
    spec.subsegments = vec![10; segments];
    let of = |k: usize| {
        let end = 10 * (k / 3 + 1);
        let first = TAU * (k % 3) as f64 / 3.0 + TAU / 9.0 * (k / 3) as f64;
        let azimuth = (0..=end).map(|i| first + TAU * turns * i as f64 / 10.0).collect();
        let routing =
            Routing::Angles { azimuth: PerDisk::Each(azimuth), radius: PerDisk::Same(RADIUS) };
        Tendon::new(routing, Some(end), None, None).unwrap()
    };
    let tendons = (0..3 * segments).map(of).collect();
    Robot::new(Backbone::new(spec).unwrap(), tendons, None, None, None).unwrap()
}

/// Tensions that bend every segment by up to so much, with two of its three tendons \[1/m² of EI\].
pub(crate) fn pulls(segments: usize, most: f64, u: &mut impl FnMut(f64, f64) -> f64) -> Vec<f64> {
    let mut tensions = Vec::new();
    for _ in 0..segments {
        let slack = u(0.0, 3.0) as usize;
        for k in 0..3 {
            let bend = if k == slack { 0.0 } else { u(0.0, most) };
            tensions.push(bend / (RADIUS * LENGTH));
        }
    }
    tensions
}

fn away(tool: &Pose, target: &Target) -> (f64, f64) {
    let off = (tool.translation - target.position()).norm();
    let turn = target.rotation().map_or(0.0, |wanted| {
        let error: Vector3<f64> = so3::log(&(tool.rotation.transpose() * wanted));
        error.norm()
    });
    (off, turn)
}

fn target_of(tip: &Pose, posed: bool) -> Target {
    if posed { Target::frame(tip) } else { Target::point(tip.translation).unwrap() }
}

fn rod_plan(robot: &Robot) -> Plan {
    Plan::new(robot, RodSettings::default()).unwrap()
}

fn inverse_of<'a>(
    robot: &'a Robot,
    plan: &'a Plan,
    bounds: &Bounds,
    settings: InverseSettings,
) -> RodInverse<'a> {
    RodInverse::new(robot, plan, bounds, settings).unwrap()
}

fn displacements_of(inverse: &RodInverse<'_>, work: &RodScratch<'_>) -> Vec<f64> {
    let mut displacements = vec![0.0; inverse.robot().tendons().len()];
    inverse.write_displacements(work, &mut displacements);
    displacements
}

fn tensions_of(inverse: &RodInverse<'_>, work: &RodScratch<'_>) -> Vec<f64> {
    let mut tensions = vec![0.0; inverse.robot().tendons().len()];
    inverse.write_tensions(work, &mut tensions);
    tensions
}

/// The shape that a forward solve from rest gives the displacements found; it must have converged.
fn verified(robot: &Robot, settings: RodSettings, displacements: &[f64]) -> Shape {
    let shape = rod_shape(robot, settings, displacements);
    assert_eq!(shape.report.status, Status::Converged, "{} {displacements:?}", shape.message);
    shape
}

fn tip(shape: &Shape) -> &Pose {
    shape.state.frames.last().unwrap()
}

/// 2,000 positions and 1,000 poses of robots with one to three segments, straight and helical: all are met, and
/// forward solves from rest agree.
fn random_targets_are_met() {
    let settings = RodSettings::default();
    for (segments, turns, posed, count) in [
        (1, 0.0, false, 334),
        (2, 0.0, false, 333),
        (3, 0.0, false, 333),
        (1, 0.5, false, 334),
        (2, 0.3, false, 333),
        (3, -0.25, false, 333),
        (3, 0.0, true, 500),
        (3, 0.2, true, 500),
    ] {
        let robot = rod_trunk(segments, turns);
        let plan = rod_plan(&robot);
        let inverse = inverse_of(&robot, &plan, &Bounds::default(), InverseSettings::default());
        let mut u = uniform(7);
        let mut work = inverse.buffers(None);
        let (mut worst, mut starts) = ((0.0_f64, 0.0_f64), 0);
        for _ in 0..count {
            let (shape, _) = under(&robot, settings, &pulls(segments, 1.2, &mut u));
            let target = target_of(tip(&shape), posed);
            let answer = inverse.solve(&target, None, &mut work);
            assert_eq!(answer.status, Status::Converged, "{}", inverse.message(&answer, &work));
            starts = starts.max(answer.starts);
            let shape = verified(&robot, settings, &displacements_of(&inverse, &work));
            let (off, turn) = away(tip(&shape), &target);
            worst = (worst.0.max(off), worst.1.max(turn));
        }
        assert!(worst.0 < 1e-8 && worst.1 < 1e-8, "{worst:?}");
        println!(
            "{segments} segments, {turns} turns each, poses {posed}: {count} met, off by {:.1e} m, \
             {:.1e} rad at most, {starts} starts at most",
            worst.0, worst.1
        );
    }
}

/// A robot of any kind: wandering routing, bent at rest, elastic tendons, elements that stretch.
#[test]
fn general_robots_are_met() {
    let mut u = uniform(8);
    let (mut met, mut worst) = (0, 0.0_f64);
    for case in 0..60 {
        let n = 12;
        let mut spec = BackboneSpec::straight(0.15, n);
        spec.youngs_modulus = Some(60e9);
        spec.diameter = Some(vec![0.0012; n]);
        spec.rest = Some((0..n).map(|_| Vector3::new(u(-0.1, 0.1), u(-0.1, 0.1), 0.0)).collect());
        let mut tendon = |k: usize| {
            let mut at = TAU * k as f64 / 4.0;
            let azimuth = (0..=n).map(|_| {
                at += u(-0.3, 0.3);
                at
            });
            let azimuth = PerDisk::Each(azimuth.collect());
            let radius = PerDisk::Each((0..=n).map(|_| u(0.004, 0.008)).collect());
            let stiffness = (k % 2 == 1).then_some(2e4);
            Tendon::new(Routing::Angles { azimuth, radius }, None, stiffness, None).unwrap()
        };
        let tendons = (0..4).map(&mut tendon).collect();
        let base = transform([0.3, -0.2, 5.0], [1.0, 0.4, -0.3]);
        let tool = transform([0.01, 0.0, 0.03], [0.2, 0.0, 1.0]);
        let robot =
            Robot::new(Backbone::new(spec).unwrap(), tendons, Some(&base), Some(&tool), None);
        let robot = robot.unwrap();
        let settings = RodSettings {
            elements: 1 + case % 3,
            axial: case % 4 == 3,
            subsegment: if case % 5 == 4 { Subsegment::Link } else { Subsegment::Arc },
            ..RodSettings::default()
        };
        let plan = Plan::new(&robot, settings).unwrap();
        let mut tensions: Vec<f64> = (0..4).map(|_| u(0.0, 15.0)).collect();
        tensions[case % 4] = 0.0;
        let Some((shape, _)) = try_under(&robot, settings, &tensions) else { continue };
        let there = tip(&shape).compose(robot.tool());
        let inverse = inverse_of(&robot, &plan, &Bounds::default(), InverseSettings::default());
        let mut work = inverse.buffers(None);
        let target = Target::point(there.translation).unwrap();
        let answer = inverse.solve(&target, None, &mut work);
        assert_eq!(answer.status, Status::Converged, "{case} {}", inverse.message(&answer, &work));
        let shape = verified(&robot, settings, &displacements_of(&inverse, &work));
        worst = worst.max(away(&tip(&shape).compose(robot.tool()), &target).0);
        met += 1;
    }
    println!("{met} general robots, off by {worst:.1e} m at most");
    assert!(met > 50 && worst < 1e-8);
}

/// A turn of a helix in space, 1,000 positions, and 1,000 poses of a moving trunk: no jumps.
#[test]
fn a_helix_is_tracked_without_jumps() {
    let settings = RodSettings::default();
    for (turns, posed) in [(0.0, false), (0.2, false), (0.0, true)] {
        let robot = rod_trunk(3, turns);
        let plan = rod_plan(&robot);
        let inverse = inverse_of(&robot, &plan, &Bounds::default(), InverseSettings::default());
        let pulled = |s: f64| {
            let swing = |base: f64, at: f64| base * (1.0 + 0.4 * (TAU * s + at).sin());
            let tensions = [(3000.0, 0.0), (0.0, 0.0), (0.0, 0.0), (2500.0, 1.0), (500.0, 2.0)];
            let more = [(0.0, 0.0), (1500.0, 3.0), (0.0, 0.0), (0.0, 0.0)];
            let all = tensions.iter().chain(&more);
            let tensions: Vec<f64> = all.map(|(base, at)| swing(*base, *at)).collect();
            *tip(&under(&robot, settings, &tensions).0)
        };
        let from = pulled(0.0);
        let targets: Vec<Target> = (0..1000)
            .map(|i| {
                let s = f64::from(i) / 999.0;
                let (sin, cos) = (TAU * s).sin_cos();
                let off = Vector3::new(cos - 1.0, sin, -0.5 * s) * 0.02;
                let on_helix = Target::point(from.translation + off).unwrap();
                if posed { Target::frame(&pulled(s)) } else { on_helix }
            })
            .collect();
        let rows = invert_path(&inverse, &targets, None, &Control::default()).unwrap().unwrap();
        let mut jump = 0.0_f64;
        for (i, answer) in rows.answers.iter().enumerate() {
            // The first row may take several starts.
            let starts = if i == 0 { 1 } else { answer.starts };
            assert_eq!((answer.status, starts), (Status::Converged, 1), "row {i}");
            let row = &rows.displacements[9 * i..9 * (i + 1)];
            if i > 0 {
                let before = &rows.displacements[9 * (i - 1)..9 * i];
                let moved = row.iter().zip(before).map(|(a, b)| (a - b).abs());
                jump = jump.max(moved.fold(0.0, f64::max));
            }
            if i % 50 == 0 {
                let shape = verified(&robot, settings, row);
                let (off, turn) = away(tip(&shape), &targets[i]);
                assert!(off < 1e-8 && turn < 1e-8, "{i} {off:e} {turn:e}");
            }
        }
        // The tool moves by 0.13 mm from row to row.
        let steps: usize = rows.answers.iter().map(|a| a.iterations).sum();
        println!(
            "path, {turns} turns each, poses {posed}: {steps} steps, largest change {jump:.1e} m"
        );
        assert!(jump < 5e-4);
    }
}

#[test]
fn out_of_reach_is_the_nearest_answer() {
    let robot = rod_trunk(2, 0.0);
    let plan = rod_plan(&robot);
    let search = InverseSettings { starts: 12, ..InverseSettings::default() };
    let inverse = inverse_of(&robot, &plan, &Bounds::default(), search);
    let mut work = inverse.buffers(None);
    // Straight ahead, and so far aside that the arm stretches towards it.
    let ahead = Target::point(Vector3::new(0.0, 0.0, 0.2)).unwrap();
    let answer = inverse.solve(&ahead, None, &mut work);
    assert_eq!(answer.status, Status::Unreachable);
    assert!((answer.distance - 0.08).abs() < 1e-9);
    assert!(inverse.message(&answer, &work).contains("nearest answer of 12 starts"));
    let aside = Target::point(Vector3::new(0.2, 0.0, 0.1)).unwrap();
    let answer = inverse.solve(&aside, None, &mut work);
    assert_eq!(answer.status, Status::Unreachable);
    // No tensions nearby bring the tool nearer.
    let displacements = displacements_of(&inverse, &work);
    let shape = verified(&robot, RodSettings::default(), &displacements);
    let best = away(tip(&shape), &aside).0;
    assert!((best - answer.distance).abs() < 1e-9);
    let mut u = uniform(9);
    for _ in 0..200 {
        let near = |t: &f64| (t + 20.0 * u(-1.0, 1.0)).max(0.0);
        let tensions: Vec<f64> = shape.state.tensions.iter().map(near).collect();
        let (other, _) = under(&robot, RodSettings::default(), &tensions);
        assert!(away(tip(&other), &aside).0 > best - 1e-12);
    }
}

/// Bounds on displacements and tensions hold, whether the target is met or not; what they leave is used.
fn bounds_hold() {
    let robot = rod_trunk(3, 0.0);
    let plan = rod_plan(&robot);
    let settings = RodSettings::default();
    let range = |lower, upper| Some(Range::new("b", vec![lower], vec![upper]).unwrap());
    let mut u = uniform(10);
    let mut counts = [0; 3];
    for case in 0..60 {
        let (shape, _) = under(&robot, settings, &pulls(3, 1.0, &mut u));
        let target = target_of(tip(&shape), false);
        let bounds = Bounds {
            displacement: (case % 3 != 1).then(|| range(-0.008, 0.009)).flatten(),
            tension: (case % 3 != 0).then(|| range(100.0, 2500.0)).flatten(),
            ..Bounds::default()
        };
        let search = InverseSettings { starts: 8, ..InverseSettings::default() };
        let inverse = inverse_of(&robot, &plan, &bounds, search);
        let mut work = inverse.buffers(None);
        let answer = inverse.solve(&target, None, &mut work);
        let message = inverse.message(&answer, &work);
        counts[0] += usize::from(answer.status == Status::Converged);
        counts[1] += usize::from(answer.status == Status::Unreachable);
        counts[2] += usize::from(message.contains("at its bound"));
        let displacements = displacements_of(&inverse, &work);
        // Of dependent tendons a solve for displacements may find other tensions.
        for (k, (d, t)) in displacements.iter().zip(tensions_of(&inverse, &work)).enumerate() {
            let inside = bounds.displacement.is_none() || (-0.008..=0.009).contains(d);
            assert!(inside, "{case} {k} {d} {answer:?}");
            let within = 100.0 - 1e-6..2500.0 + 1e-6;
            assert!(bounds.tension.is_none() || within.contains(&t), "{case} {k} {t}");
        }
        let shape = verified(&robot, settings, &displacements);
        let (off, _) = away(tip(&shape), &target);
        assert!((off - answer.distance).abs() < 1e-8, "{case} {off:e} {}", answer.distance);
    }
    println!("met, unreachable, at bounds: {counts:?}");
    assert_eq!(counts[0] + counts[1], 60);
    assert!(counts[0] > 20 && counts[1] > 0 && counts[2] > 0);

    let nothing = Bounds { displacement: range(0.03, 0.04), ..Bounds::default() };
    let search = InverseSettings { starts: 3, ..InverseSettings::default() };
    let inverse = inverse_of(&robot, &plan, &nothing, search);
    let mut work = inverse.buffers(None);
    let target = Target::point(Vector3::new(0.0, 0.0, 0.17)).unwrap();
    let answer = inverse.solve(&target, None, &mut work);
    assert_eq!(answer.status, Status::Infeasible, "{answer:?}");
}

#[test]
fn what_does_not_fit_is_refused() {
    let robot = rod_trunk(2, 0.0);
    let plan = rod_plan(&robot);
    let range = |lower, upper| Some(Range::new("b", lower, upper).unwrap());
    let refused = |bounds: Bounds| {
        let error = RodInverse::new(&robot, &plan, &bounds, InverseSettings::default());
        error.err().map(|error| error.argument)
    };
    let length = range(vec![0.1], vec![0.2]);
    let got = refused(Bounds { length, ..Bounds::default() });
    assert_eq!(got.as_deref(), Some("bounds.length"));
    let tension = range(vec![0.0; 5], vec![1.0; 5]);
    let got = refused(Bounds { tension, ..Bounds::default() });
    assert_eq!(got.as_deref(), Some("bounds.tension"));
    let tension = range(vec![-2.0], vec![-1.0]);
    let got = refused(Bounds { tension, ..Bounds::default() });
    assert_eq!(got.as_deref(), Some("bounds.tension"));
    let proportional = RodSettings { tendons: TendonLaw::Proportional, ..RodSettings::default() };
    let plan = Plan::new(&robot, proportional).unwrap();
    let error = RodInverse::new(&robot, &plan, &Bounds::default(), InverseSettings::default());
    assert_eq!(error.unwrap_err().argument, "settings.tendons");
}

/// Freedom goes to the least sum of squared tensions: none of the answers that other starts lead to without it is
/// lower, and it is lower than that of the tensions that the target was made with.
#[test]
fn freedom_goes_to_the_least_tensions() {
    let settings = RodSettings::default();
    for turns in [0.0, 0.2] {
        let robot = rod_trunk(3, turns);
        let plan = rod_plan(&robot);
        let least = inverse_of(&robot, &plan, &Bounds::default(), InverseSettings::default());
        let any = InverseSettings { least_energy: false, ..InverseSettings::default() };
        let any = inverse_of(&robot, &plan, &Bounds::default(), any);
        let (mut work, mut other) = (least.buffers(None), any.buffers(None));
        let sum = |inverse: &RodInverse<'_>, work: &RodScratch<'_>| -> f64 {
            tensions_of(inverse, work).iter().map(|t| t * t).sum()
        };
        let mut u = uniform(11);
        for _ in 0..20 {
            let made = pulls(3, 1.0, &mut u);
            let (shape, displacements) = under(&robot, settings, &made);
            let target = target_of(tip(&shape), false);
            assert_eq!(least.solve(&target, None, &mut work).status, Status::Converged);
            let lowest = sum(&least, &work);
            assert!(lowest <= made.iter().map(|t| t * t).sum::<f64>() * (1.0 + 1e-9));
            // From there again: the least does not depend on how near the start is.
            let start = least.start(&displacements, None).unwrap();
            assert_eq!(any.solve(&target, Some(&start), &mut other).status, Status::Converged);
            assert!(lowest <= sum(&any, &other) * (1.0 + 1e-9));
            // Steps that the target allows change the sum by second order at most.
            for _ in 0..5 {
                let near: Vec<f64> = tensions_of(&least, &work)
                    .iter()
                    .map(|t| (t + 5.0 * u(-1.0, 1.0)).max(0.0))
                    .collect();
                let start = under(&robot, settings, &near).0.state;
                any.solve(&target, Some(&start), &mut other);
                assert!(lowest <= sum(&any, &other) * (1.0 + 1e-7));
            }
        }
    }
}

crate::common::slow!(bounds_hold, random_targets_are_met,);
