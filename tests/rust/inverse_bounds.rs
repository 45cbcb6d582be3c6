//! The inverse of the constant-curvature model at bounds, out of reach, with weights, on odd robots and at
//! singular targets.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{DVector, Vector3};
use tdcr::Status;
use tdcr::constant_curvature::{Arc, ConstantCurvatureSettings, Coupling, Plan, displacements};
use tdcr::inverse::{Answer, Bounds, ConstantCurvatureInverse, InverseSettings, Range, Target};
use tdcr::lie::{Pose, so3};
use tdcr::robot::Robot;

use crate::inverse_common::{
    LENGTHS, arcs, arcs_of, bounds, differences, inside, misses, placed, plan, robot_of, tendon,
    threes, tool, tool_of, touched, transform, trunk, uniform, unknowns,
};
use crate::optimality::unheld;

/// Solves one target: the answer, its arcs, its displacements.
fn solve(
    robot: &Robot,
    plan: &Plan,
    bounds: &Bounds,
    settings: InverseSettings,
    target: &Target,
) -> (Answer, Vec<Arc>, Vec<f64>) {
    let inverse = ConstantCurvatureInverse::new(robot, plan, bounds, settings).unwrap();
    let mut work = inverse.scratch();
    let answer = inverse.solve(target, None, &mut work);
    let mut found = vec![0.0; robot.tendons().len()];
    inverse.write_displacements(&work, &mut found);
    (answer, inverse.arcs(&work), found)
}

/// Half the squared weighted distance from a pose to a target; the default weight is 0.3 of the length.
fn cost(pose: &Pose, target: &Target, settings: &InverseSettings) -> f64 {
    let off = target.position() - pose.translation;
    let turn = target
        .rotation()
        .map_or_else(Vector3::zeros, |wanted| so3::log(&(pose.rotation.transpose() * wanted)));
    let length = LENGTHS.iter().sum::<f64>();
    let sum: f64 = (0..3)
        .map(|k| {
            let radian = settings.rotation_weight[k].unwrap_or(0.3 * length);
            (settings.position_weight[k] * off[k]).powi(2) + (radian * turn[k]).powi(2)
        })
        .sum();
    0.5 * sum / length.powi(2)
}

fn any_rotation(u: &mut impl FnMut(f64, f64) -> f64) -> nalgebra::Matrix3<f64> {
    so3::exp(&(Vector3::from_fn(|_, _| u(-1.0, 1.0)).normalize() * u(0.0, PI)))
}

/// Out of reach: said so, first-order optimal inside bounds, and nothing feasible is nearer.
fn out_of_reach(extensible: bool, posed: bool) {
    let robot = trunk();
    let plan = plan(&robot, extensible);
    let bounds = bounds(extensible);
    let settings = InverseSettings::default();
    let mut u = uniform(71);
    let samples: Vec<Vec<Arc>> = (0..2000).map(|_| arcs(&LENGTHS, extensible, &mut u)).collect();
    let poses: Vec<Pose> = samples.iter().map(|arcs| tool_of(&robot, &plan, arcs)).collect();
    let (mut worst, mut better, mut held) = (0.0_f64, 0, 0);
    for case in 0..30 {
        let direction = Vector3::from_fn(|_, _| u(-1.0, 1.0)).normalize();
        let translation = direction * u(0.25, 0.5);
        let target = if posed {
            Target::frame(&Pose { rotation: any_rotation(&mut u), translation })
        } else {
            Target::Position(translation)
        };
        let (answer, found, _) = solve(&robot, &plan, &bounds, settings, &target);
        assert_eq!(answer.status, Status::Unreachable, "{case} {answer:?}");
        assert!(inside(&found, &bounds), "{case}");
        let pose = tool_of(&robot, &plan, &found);
        let (distance, angle) = misses(&pose, &target);
        assert!((distance - answer.distance).abs() < 1e-12, "{case}");
        assert!((angle - answer.angle).abs() < 1e-9, "{case} {angle} {answer:?}");
        let here = cost(&pose, &target, &settings);
        let z = unknowns(&found, extensible);
        let at =
            |z: &[f64]| cost(&tool_of(&robot, &plan, &arcs_of(z, extensible)), &target, &settings);
        let slope = differences(&z, 1e-5, |z| DVector::from_element(1, at(z)));
        let touched = touched(&z, extensible, &bounds);
        let left = unheld(&slope[0], &[], &touched);
        worst = worst.max(left);
        held += usize::from(!touched.is_empty());
        assert!(left < 1e-7, "{case} {left:e} {touched:?}");
        for k in 0..2000 {
            assert!(cost(&poses[k], &target, &settings) >= here, "{case} {k}");
            let near: Vec<f64> = z.iter().map(|z| z + u(-0.01, 0.01)).collect();
            if k < 500 && inside(&arcs_of(&near, extensible), &bounds) {
                assert!(at(&near) >= here - 1e-13, "{case}");
            }
        }
        // From other starts: how often is there something nearer?
        let other = InverseSettings { seed: 1, starts: 400, ..settings };
        let (_, others, _) = solve(&robot, &plan, &bounds, other, &target);
        let there = cost(&tool_of(&robot, &plan, &others), &target, &settings);
        better += usize::from(there < here - 1e-9);
    }
    println!(
        "extensible {extensible}, poses {posed}: gradient left {worst:.1e}, {held} of 30 at bounds, \
         {better} nearer from other starts"
    );
}

fn targets_out_of_reach_get_the_nearest_pose() {
    out_of_reach(false, false);
    out_of_reach(false, true);
    out_of_reach(true, false);
    out_of_reach(true, true);
}

/// Weights say what nearest means; axes of weight 0 do not count.
#[test]
fn weights_choose_what_counts() {
    let robot = trunk();
    let mut u = uniform(72);
    for extensible in [false, true] {
        let plan = plan(&robot, extensible);
        let bounds = bounds(extensible);
        for case in 0..100 {
            let made = arcs(&LENGTHS, extensible, &mut u);
            let pose = tool_of(&robot, &plan, &made);
            let rotation = any_rotation(&mut u);
            let other = Pose { rotation, ..pose };
            // No weight on the rotation: the problem of the position, bit by bit.
            let settings =
                InverseSettings { rotation_weight: [Some(0.0); 3], ..Default::default() };
            let free = solve(&robot, &plan, &bounds, settings, &Target::frame(&other));
            assert_eq!(free.0.status, Status::Converged, "{case}");
            let place = Target::Position(pose.translation);
            let settings = InverseSettings::default();
            assert_eq!(free, solve(&robot, &plan, &bounds, settings, &place), "{case}");
            // Free roll: the tool's z axis as wanted, whatever the turn about it.
            let settings = InverseSettings {
                rotation_weight: [None, None, Some(0.0)],
                ..InverseSettings::default()
            };
            let roll = so3::exp(&Vector3::new(0.0, 0.0, u(-PI, PI)));
            let rolled = Target::frame(&Pose { rotation: pose.rotation * roll, ..pose });
            let (answer, found, given) = solve(&robot, &plan, &bounds, settings, &rolled);
            assert_eq!(answer.status, Status::Converged, "{case} {answer:?}");
            assert!(inside(&found, &bounds), "{case}");
            let got = tool(&robot, &plan, &given);
            assert!((got.translation - pose.translation).norm() < 1e-9, "{case}");
            // What `log` measures about x and y vanishes: only a turn about z is left.
            let left = so3::log(&(got.rotation.transpose() * rolled.rotation().unwrap()));
            assert!(left.xy().norm() < 1e-9, "{case} {left}");
            assert!((got.rotation.column(2) - pose.rotation.column(2)).norm() < 1e-9, "{case}");
            // Only the rotation.
            let settings = InverseSettings { position_weight: [0.0; 3], ..Default::default() };
            let far = Pose { translation: Vector3::new(5.0, 0.0, 0.0), ..pose };
            let (answer, _, given) = solve(&robot, &plan, &bounds, settings, &Target::frame(&far));
            assert_eq!(answer.status, Status::Converged, "{case} {answer:?}");
            let got = tool(&robot, &plan, &given);
            assert!(so3::log(&(got.rotation.transpose() * pose.rotation)).norm() < 1e-9);
        }
    }
}

/// Rows of bounds on displacement, curvature and length, met to 1e-12 of them.
fn active_bounds_are_kept() {
    let robot = trunk();
    let mut u = uniform(73);
    let mut active = [0; 3];
    let mut counts = [0; 2];
    for case in 0..400 {
        let extensible = case % 2 == 1;
        let plan = plan(&robot, extensible);
        let made = arcs(&LENGTHS, extensible, &mut u);
        let target = if case % 4 < 2 {
            Target::frame(&tool_of(&robot, &plan, &made))
        } else {
            Target::Position(tool_of(&robot, &plan, &made).translation * u(0.5, 2.0))
        };
        let curvature: Vec<f64> = (0..3).map(|_| u(5.0, 40.0)).collect();
        let pull: Vec<f64> = (0..9).map(|_| -u(0.001, 0.02)).collect();
        let push: Vec<f64> = (0..9).map(|_| u(0.001, 0.02)).collect();
        let length = LENGTHS.map(|l| (l * u(0.85, 1.0), l * u(1.0, 1.2)));
        let bounds = Bounds {
            displacement: Some(Range::new("d", pull.clone(), push.clone()).unwrap()),
            curvature: Some(Range::new("c", vec![0.0; 3], curvature.clone()).unwrap()),
            length: extensible.then(|| {
                let (low, high) = (length.map(|l| l.0).to_vec(), length.map(|l| l.1).to_vec());
                Range::new("l", low, high).unwrap()
            }),
            tension: None,
        };
        let settings = InverseSettings { starts: 20, ..InverseSettings::default() };
        let (answer, found, given) = solve(&robot, &plan, &bounds, settings, &target);
        let (distance, angle) = misses(&tool(&robot, &plan, &given), &target);
        match answer.status {
            Status::Converged => assert!(distance < 1e-9 && angle < 1e-9, "{case}"),
            Status::Unreachable => assert!(distance > 1e-10 || angle > 1e-10, "{case}"),
            other => panic!("{case} {other:?}"),
        }
        counts[usize::from(answer.status == Status::Converged)] += 1;
        assert!(inside(&found, &bounds), "{case}");
        for k in 0..9 {
            // A displacement is a sum of terms this large.
            let off = 1e-12 * (0.0045 * TAU + 0.2 * f64::from(u8::from(extensible)));
            assert!(given[k] >= pull[k] - off && given[k] <= push[k] + off, "{case} {k}");
            active[0] += usize::from(given[k] < pull[k] + 1e-9 || given[k] > push[k] - 1e-9);
        }
        for (i, arc) in found.iter().enumerate() {
            active[1] += usize::from(arc.kappa() > curvature[i] * (1.0 - 1e-9));
            let (low, high) = length[i];
            let at = arc.length < low * (1.0 + 1e-9) || arc.length > high * (1.0 - 1e-9);
            active[2] += usize::from(extensible && at);
        }
    }
    println!(
        "out of reach and met: {counts:?}; bounds on displacement, curvature, length: {active:?}"
    );
    assert!(active.iter().all(|count| *count > 100) && counts.iter().all(|count| *count > 20));
}

#[test]
fn contradictory_bounds_are_infeasible() {
    let robot = trunk();
    let plan = plan(&robot, false);
    let settings = InverseSettings::default();
    let target = Target::Position(Vector3::new(0.05, 0.0, 0.1));
    let range = |low: Vec<f64>, high: Vec<f64>| Some(Range::new("b", low, high).unwrap());
    let of = |displacement, curvature| {
        let bounds = Bounds { displacement, curvature, ..Bounds::default() };
        solve(&robot, &plan, &bounds, settings, &target).0
    };
    // Three that would all have to be pulled; a bend beyond the curvature.
    let mut pulled = vec![0.05; 9];
    pulled[..3].fill(-0.001);
    assert_eq!(of(range(vec![-0.05; 9], pulled), None).status, Status::Infeasible);
    let mut most = vec![0.05; 9];
    most[0] = -0.006;
    let bent = range(vec![-0.05; 9], most);
    assert_eq!(of(bent.clone(), range(vec![0.0], vec![10.0])).status, Status::Infeasible);
    assert_ne!(of(bent, range(vec![0.0], vec![40.0])).status, Status::Infeasible);
    // Whatever was solved before, the answer describes its own arcs.
    let mut pulled = vec![0.05; 9];
    pulled[..3].fill(-0.001);
    let bounds = Bounds { displacement: range(vec![-0.05; 9], pulled), ..Bounds::default() };
    let inverse = ConstantCurvatureInverse::new(&robot, &plan, &bounds, settings).unwrap();
    let mut work = inverse.scratch();
    let first = inverse.solve(&target, None, &mut work);
    inverse.solve(&Target::Position(Vector3::new(0.0, 0.1, 0.0)), None, &mut work);
    assert_eq!(inverse.solve(&target, None, &mut work), first);
    // A start however far outside is no contradiction.
    let free = Bounds::default();
    let inverse = ConstantCurvatureInverse::new(&robot, &plan, &free, settings).unwrap();
    let mut work = inverse.scratch();
    for far in [10.0, 1e3, 1e6] {
        let start = LENGTHS.map(|length| Arc::new(far / length, 1.0, length));
        let answer = inverse.solve(&target, Some(&start), &mut work);
        assert_eq!(answer.status, Status::Converged, "{far} {answer:?}");
    }
    // No room at all is still a region: straight.
    let (answer, found, _) = solve(
        &robot,
        &plan,
        &Bounds { curvature: range(vec![0.0], vec![0.0]), ..Bounds::default() },
        settings,
        &target,
    );
    assert_eq!(answer.status, Status::Unreachable);
    assert!(found.iter().all(|arc| arc.bend.norm() < 1e-12));
}

/// One tendon, antagonists, a passive end, another coupling, other radii: targets that the tendons can reach
/// are met, and the displacements give what was asked for.
#[test]
fn odd_robots_reach_what_their_tendons_can() {
    let two = [0.1, 0.08];
    let base = transform([0.1, 0.2, -0.3], [0.3, 0.2, 1.0]);
    let beyond = transform([0.004, 0.0, 0.01], [0.1, 0.0, 0.5]);
    let robots = [
        ("one tendon", robot_of(&[0.1], vec![tendon(0.7, 0.01, 2)])),
        ("antagonists", robot_of(&[0.1], vec![tendon(0.7, 0.01, 2), tendon(0.7 + PI, 0.01, 2)])),
        ("one each", robot_of(&two, vec![tendon(0.7, 0.01, 2), tendon(2.0, 0.008, 4)])),
        ("passive end", placed(&two, threes(&[0.01]), Some(&base), Some(&beyond))),
        ("radii", placed(&two, threes(&[0.01, 0.006]), Some(&base), Some(&beyond))),
        (
            "four and two",
            robot_of(
                &two,
                (0..6)
                    .map(|k| {
                        tendon(
                            FRAC_PI_2 * f64::from(k),
                            0.01 - 0.001 * f64::from(k),
                            if k < 4 { 4 } else { 2 },
                        )
                    })
                    .collect(),
            ),
        ),
    ];
    let mut u = uniform(74);
    for (name, robot) in &robots {
        for coupling in Coupling::ALL {
            let settings = ConstantCurvatureSettings { coupling, extensible: false };
            let plan = Plan::new(robot, settings).unwrap();
            let count = robot.tendons().len();
            let (mut met, mut starts) = (0, 0);
            for case in 0..200 {
                // Arcs of displacements that tendons can have: only the pulled bend one-tendon segments.
                let given = DVector::from_fn(count, |_, _| u(-0.01, 0.0));
                let model = tdcr::constant_curvature::ConstantCurvature::new(robot, &plan);
                let mut forward = tdcr::constant_curvature::Scratch::default();
                tdcr::model::Model::solve(&model, given.as_slice(), &mut forward).unwrap();
                let made = forward.arcs().to_vec();
                let exact = displacements(&plan, &made);
                let pose = tool(robot, &plan, exact.as_slice());
                let target = if case % 2 == 0 {
                    Target::frame(&pose)
                } else {
                    Target::Position(pose.translation)
                };
                let choices = InverseSettings::default();
                let (answer, _, found) = solve(robot, &plan, &Bounds::default(), choices, &target);
                let (distance, angle) = misses(&tool(robot, &plan, &found), &target);
                assert_eq!(answer.status, Status::Converged, "{name} {coupling:?} {case} {made:?}");
                assert!(distance < 1e-9 && angle < 1e-9, "{name} {case}");
                met += 1;
                starts = starts.max(answer.starts);
            }
            println!("{name}, {coupling:?}: {met} met, {starts} starts at most");
        }
    }
    // A released single tendon does not push: its side alone is in reach.
    let (_, robot) = &robots[0];
    let plan = plan(robot, false);
    for (side, status) in [(1.0, Status::Converged), (-1.0, Status::Unreachable)] {
        let frame = Arc::new(side * 8.0, 0.7, 0.1).frame(1.0);
        let (answer, found, given) = solve(
            robot,
            &plan,
            &Bounds::default(),
            InverseSettings::default(),
            &Target::frame(&frame),
        );
        assert_eq!(answer.status, status);
        let towards = nalgebra::Vector2::new(0.7_f64.cos(), 0.7_f64.sin());
        assert!(given[0] <= 1e-15 && found[0].bend.dot(&towards) >= -1e-12, "{given:?}");
    }
}

/// Straight, on the base axis, at the base's origin, at the end of the reach.
#[test]
fn singular_targets_are_solved() {
    let robot = trunk();
    let rest: f64 = LENGTHS.iter().sum();
    for extensible in [false, true] {
        let plan = plan(&robot, extensible);
        let bounds = bounds(extensible);
        let longest = if extensible { 1.25 * rest } else { rest };
        let turned = |angle: f64| so3::exp(&Vector3::new(0.0, 0.0, angle));
        let on_axis = |z: f64| Vector3::new(0.0, 0.0, z);
        let pose = |rotation, z| Target::frame(&Pose { rotation, translation: on_axis(z) });
        let upside_down = so3::exp(&Vector3::new(PI, 0.0, 0.0));
        let cases = [
            ("straight", pose(turned(0.0), rest), true),
            ("straight, a place", Target::Position(on_axis(rest)), true),
            ("axis", Target::Position(on_axis(0.6 * rest)), true),
            ("below the base", Target::Position(on_axis(-0.2 * rest)), true),
            ("base origin", Target::Position(Vector3::zeros()), true),
            ("base frame", pose(turned(0.0), 0.0), true),
            ("end of the reach", Target::Position(on_axis(longest)), true),
            ("just beyond", Target::Position(on_axis(longest * (1.0 + 1e-6))), false),
            ("just within", Target::Position(on_axis(longest * (1.0 - 1e-9))), true),
            ("end of the reach, a pose", pose(turned(0.0), longest), true),
            ("twisted", pose(turned(1.0), rest), false),
            ("half a turn about z", pose(turned(PI), longest), false),
            ("upside down, far", pose(upside_down, longest), false),
        ];
        for (name, target, reached) in cases {
            let settings = InverseSettings::default();
            let (answer, found, given) = solve(&robot, &plan, &bounds, settings, &target);
            let (distance, angle) = misses(&tool(&robot, &plan, &given), &target);
            assert!(inside(&found, &bounds), "{name}");
            if answer.status == Status::Converged {
                assert!(distance < 1e-9 && angle < 1e-9, "{name}");
            }
            let wanted = if reached { Status::Converged } else { Status::Unreachable };
            assert_eq!(answer.status, wanted, "{name}, extensible {extensible}: {answer:?}");
        }
    }
}

crate::common::slow!(active_bounds_are_kept, targets_out_of_reach_get_the_nearest_pose,);
