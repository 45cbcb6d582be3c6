//! The inverse of the rod, checked by forward solves from rest.

use std::f64::consts::TAU;
use std::time::Instant;

use nalgebra::Vector3;
use tdcr::inverse::{Bounds, InverseSettings, RodInverse, Target};
use tdcr::lie::{Pose, so3};
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use tdcr::rod::{Plan, RodSettings};
use tdcr::Status;

use crate::inverse_common::uniform;
use crate::rod_common::{rod_shape, try_under};

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
        let routing = Routing::Angles {
            azimuth: PerDisk::Each(azimuth),
            radius: PerDisk::Same(RADIUS),
        };
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

#[test]
fn random_targets_are_met() {
    let settings = RodSettings::default();
    for (segments, turns, posed, count) in [
        (1, 0.0, false, 300),
        (2, 0.0, false, 300),
        (3, 0.0, false, 300),
        (1, 0.5, false, 300),
        (2, 0.3, false, 300),
        (3, -0.25, false, 300),
        (3, 0.0, true, 300),
        (3, 0.2, true, 300),
    ] {
        let robot = rod_trunk(segments, turns);
        let plan = Plan::new(&robot, settings).unwrap();
        let mut u = uniform(7);
        let inverse =
            RodInverse::new(&robot, &plan, &Bounds::default(), InverseSettings::default()).unwrap();
        let mut work = inverse.workspace();
        let (mut met, mut worst, mut times, mut starts, mut steps, mut verified) =
            (0, (0.0_f64, 0.0_f64), vec![], vec![], vec![], 0);
        for _ in 0..count {
            let tensions = pulls(segments, 1.2, &mut u);
            let Some((shape, _)) = try_under(&robot, settings, &tensions) else {
                println!("no shape");
                continue;
            };
            let tip = *shape.state.frames.last().unwrap();
            let target =
                if posed { Target::frame(&tip) } else { Target::point(tip.translation).unwrap() };
            let clock = Instant::now();
            let answer = inverse.solve(&target, None, &mut work);
            times.push(clock.elapsed().as_secs_f64() * 1e6);
            starts.push(answer.starts);
            steps.push(answer.iterations);
            if answer.status == Status::Converged {
                met += 1;
                let mut displacements = vec![0.0; 3 * segments];
                inverse.write_displacements(&work, &mut displacements);
                let shape = rod_shape(&robot, settings, &displacements);
                let (off, turn) = away(shape.state.frames.last().unwrap(), &target);
                if off < 1e-8 && turn < 1e-8 {
                    verified += 1;
                } else {
                    println!("{:?} {off:e} {turn:e} {}", shape.report.status, shape.message);
                }
                worst = (worst.0.max(off), worst.1.max(turn));
            } else {
                println!("{:?} {}", answer.status, inverse.message(&answer, &work));
            }
        }
        times.sort_by(f64::total_cmp);
        starts.sort_unstable();
        steps.sort_unstable();
        let n = times.len();
        println!(
            "{segments} {turns} {posed}: {met}/{n} verified {verified} worst {worst:?} median {:.0} p90 {:.0} p99 {:.0} us, starts {} {} {}, steps {} {}",
            times[n / 2], times[n * 9 / 10], times[n * 99 / 100], starts[n / 2], starts[n * 99 / 100], starts[n - 1], steps[n / 2], steps[n * 99 / 100]
        );
    }
}
