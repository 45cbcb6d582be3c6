//! Constant curvature: robots of several segments, their derivatives, what they refuse.

use std::f64::consts::PI;

use nalgebra::{Matrix4, Rotation3, Vector2, Vector3};
use tdcr::constant_curvature::{
    Arc, ConstantCurvature, ConstantCurvatureSettings, Coupling, Plan, Scratch, displacements,
};
use tdcr::lie::so3;
use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use tdcr::{Shape, Status};

use crate::constant_curvature::{FREE, even, uniform};

fn tendon(azimuth: f64, radius: f64, end: usize) -> Tendon {
    let routing =
        Routing::Angles { azimuth: PerDisk::Same(azimuth), radius: PerDisk::Same(radius) };
    Tendon::new(routing, Some(end), None, None).unwrap()
}

/// Three segments of 10 subsegments with three tendons each, 45 degrees apart.
fn three_segments() -> Robot {
    let mut spec = BackboneSpec::straight(0.2, 10);
    spec.length = vec![0.06, 0.0625, 0.064];
    spec.subsegments = vec![10, 12, 8];
    let ends = [10, 22, 30];
    let tendons = (0..9)
        .map(|k| {
            let azimuth = even(3)[k % 3] + (k / 3) as f64 * PI / 4.0;
            tendon(azimuth, 0.0045 - 0.0003 * (k / 3) as f64, ends[k / 3])
        })
        .collect();
    let mut base = Rotation3::new(Vector3::new(0.5, -0.2, 1.0)).to_homogeneous();
    base[(0, 3)] = 0.3;
    let mut tool: Matrix4<f64> = Matrix4::identity();
    tool[(2, 3)] = 0.008;
    Robot::new(Backbone::new(spec).unwrap(), tendons, Some(&base), Some(&tool), None).unwrap()
}

fn solve(robot: &Robot, settings: ConstantCurvatureSettings, displacements: &[f64]) -> Shape {
    let plan = Plan::new(robot, settings).unwrap();
    ConstantCurvature::new(robot, &plan).shape(displacements).unwrap()
}

#[test]
fn robots_reproduce_their_arcs_in_both_readings() {
    let robot = three_segments();
    let mut u = uniform(36);
    for case in 0..400 {
        let coupling = Coupling::ALL[case % 2];
        let extensible = case % 4 >= 2;
        let settings = ConstantCurvatureSettings { coupling, extensible };
        let plan = Plan::new(&robot, settings).unwrap();
        let arcs: Vec<Arc> = [0.06, 0.0625, 0.064]
            .iter()
            .map(|rest| Arc {
                bend: Vector2::new(u(-2.0, 2.0), u(-2.0, 2.0)),
                length: if extensible { rest * u(0.9, 1.2) } else { *rest },
            })
            .collect();
        let given: Vec<f64> = displacements(&plan, &arcs).iter().copied().collect();
        let model = ConstantCurvature::new(&robot, &plan);
        let mut work = Scratch::default();
        let report = model.solve(&given, &mut work).unwrap();
        assert_eq!(report.status, Status::Converged);
        assert!(report.residual < 1e-14, "{}", report.residual);
        assert!(model.message(&given, &work).is_empty());
        for (got, expected) in work.arcs().iter().zip(&arcs) {
            assert!((got.bend - expected.bend).amax() < 1e-12);
            assert!((got.length - expected.length).abs() < 1e-14);
        }
        // Chains end exactly at s = ell.
        let tip = arcs.iter().fold(*robot.base(), |frame, arc| frame.compose(&arc.frame(1.0)));
        let state = model.state(&work);
        assert!((state.frames[30].translation - tip.translation).amax() < 1e-13);
        assert!((state.frames[30].rotation - tip.rotation).amax() < 1e-12);
        assert_eq!(state.frames.len(), 31);
        assert_eq!(state.elongations.len(), if extensible { 30 } else { 0 });
        if coupling == Coupling::Coupled {
            for (k, path) in robot.paths().iter().enumerate() {
                let length = path.rest_length + given[k];
                assert!((state.tendon_lengths[k] - length).abs() < 1e-14);
            }
        }
    }
}

#[test]
fn coupled_and_per_segment_readings_differ_by_the_proximal_share() {
    let robot = robot_of(&[tendon(0.0, 0.01, 5), tendon(0.3, 0.01, 10)]);
    let per_segment =
        ConstantCurvatureSettings { coupling: Coupling::PerSegment, ..Default::default() };
    // Pull the proximal tendon; the distal one as far as the proximal bend shortens it.
    let proximal = [-0.004, -0.004 * 0.3_f64.cos()];
    let coupled = solve(&robot, ConstantCurvatureSettings::default(), &proximal);
    let bend: Vec<f64> = coupled.state.strains.iter().map(nalgebra::Matrix::norm).collect();
    assert!(bend[..5].iter().all(|b| (b - 0.08).abs() < 1e-12));
    assert!(bend[5..].iter().all(|b| b.abs() < 1e-12));
    let same = solve(&robot, per_segment, &[-0.004, 0.0]);
    let off = coupled.state.frames[10].translation - same.state.frames[10].translation;
    assert!(off.amax() < 1e-14);
}

fn robot_of(tendons: &[Tendon]) -> Robot {
    let backbone = Backbone::new(BackboneSpec::straight(0.2, 10)).unwrap();
    Robot::new(backbone, tendons.to_vec(), None, None, None).unwrap()
}

#[test]
fn free_and_single_released_tendons_do_not_count() {
    let settings = ConstantCurvatureSettings::default();
    let three = robot_of(&even(3).iter().map(|a| tendon(*a, 0.01, 10)).collect::<Vec<_>>());
    let shape = solve(&three, settings, &[-0.004, FREE, FREE]);
    assert!((shape.state.strains[0].y - 0.04).abs() < 1e-14);
    let plan = Plan::new(&three, settings).unwrap();
    let model = ConstantCurvature::new(&three, &plan);
    let mut work = Scratch::default();
    // One workspace through changing patterns gives what fresh ones give.
    for pattern in [
        [-0.004, FREE, FREE],
        [0.004, FREE, FREE],
        [-0.002, -0.002, 0.004],
        [FREE, -0.001, 0.0005],
        [FREE, FREE, FREE],
        [-0.004, FREE, FREE],
    ] {
        model.solve(&pattern, &mut work).unwrap();
        let fresh = solve(&three, settings, &pattern);
        assert_eq!(model.state(&work).frames, fresh.state.frames);
        if pattern[0] == 0.004 || pattern.iter().all(|d| *d == FREE) {
            assert!(fresh.state.strains.iter().all(|w| *w == Vector3::zeros()));
        }
    }
    // Three that no arc satisfies: least squares, and by how much each is off.
    let shape = solve(&three, settings, &[-0.004, 0.0, 0.0]);
    assert_eq!(shape.report.status, Status::Converged);
    assert!((shape.report.residual - 0.004 / 3.0 / 0.2).abs() < 1e-15);
    assert!(shape.message.contains("'t1' by -1.333e-3 m"), "{}", shape.message);
}

#[test]
fn the_tip_jacobian_agrees_with_differences() {
    let robot = three_segments();
    let mut u = uniform(37);
    for case in 0..120 {
        let extensible = case % 2 == 1;
        let coupling = Coupling::ALL[case / 2 % 2];
        let plan = Plan::new(&robot, ConstantCurvatureSettings { coupling, extensible }).unwrap();
        let model = ConstantCurvature::new(&robot, &plan);
        let size = if case % 3 == 0 { 0.0 } else { 0.003 };
        let mut given: Vec<f64> = (0..9).map(|_| size * u(-1.0, 1.0)).collect();
        if case % 5 == 0 && !extensible {
            given[4] = FREE;
        }
        let mut work = Scratch::default();
        let jacobian = model.jacobian(&given, &mut work).unwrap();
        let tip =
            |given: &[f64]| model.shape(given).unwrap().state.frames[30].compose(robot.tool());
        let here = tip(&given);
        for k in 0..9 {
            let h = 1e-7;
            let moved = |by: f64| {
                let mut given = given.clone();
                given[k] += by;
                tip(&given)
            };
            let (up, down) = (moved(h), moved(-h));
            let velocity = (up.translation - down.translation) / (2.0 * h);
            let spin = so3::vee(&((up.rotation - down.rotation) * here.rotation.transpose()));
            let column = jacobian.column(k);
            assert!((column.fixed_rows::<3>(0) - velocity).amax() < 1e-6, "{case} {k}");
            assert!((column.fixed_rows::<3>(3) - spin / (2.0 * h)).amax() < 1e-5, "{case} {k}");
        }
    }
}

#[test]
fn other_routings_and_pre_bent_backbones_are_refused() {
    let settings = ConstantCurvatureSettings::default();
    let helix =
        Tendon::new(Routing::Helical { azimuth: 0.0, radius: 0.01, turns: 0.1 }, None, None, None);
    let error =
        Plan::new(&robot_of(&[tendon(0.0, 0.01, 10), helix.unwrap()]), settings).unwrap_err();
    assert_eq!(error.argument, "robot.tendons[1]");
    assert!(error.expected.contains("\"linkage\""));
    let mut spec = BackboneSpec::straight(0.2, 2);
    spec.rest = Some(vec![Vector3::new(0.0, 0.1, 0.0); 2]);
    let bent = Robot::new(Backbone::new(spec).unwrap(), vec![], None, None, None).unwrap();
    assert_eq!(Plan::new(&bent, settings).unwrap_err().argument, "robot.backbone.rest");
    let two = robot_of(&[tendon(0.0, 0.01, 10), tendon(1.0, 0.01, 10)]);
    let extensible = ConstantCurvatureSettings { extensible: true, ..settings };
    assert_eq!(Plan::new(&two, extensible).unwrap_err().argument, "settings.extensible");
}

#[test]
fn displacements_that_leave_no_length_are_infeasible() {
    let three = robot_of(&even(3).iter().map(|a| tendon(*a, 0.01, 10)).collect::<Vec<_>>());
    let settings = ConstantCurvatureSettings { extensible: true, ..Default::default() };
    let shape = solve(&three, settings, &[-0.25, -0.25, -0.25]);
    assert_eq!(shape.report.status, Status::Infeasible);
    assert!(shape.message.contains("segment 0 no length"), "{}", shape.message);
}

/// Numbers that overflow end as an outcome of `solve` and as an error of `jacobian`.
#[test]
fn overflow_is_told() {
    let three = robot_of(&even(3).iter().map(|a| tendon(*a, 0.01, 10)).collect::<Vec<_>>());
    for extensible in [false, true] {
        let settings = ConstantCurvatureSettings { extensible, ..Default::default() };
        let plan = Plan::new(&three, settings).unwrap();
        let model = ConstantCurvature::new(&three, &plan);
        for given in [[1e308, -1e308, 0.0], [f64::MAX, f64::MAX, 0.0], [1e200, 0.0, 0.0]] {
            let shape = model.shape(&given).unwrap();
            assert_eq!(shape.report.status, Status::NumericalError, "{given:?}");
            assert!(shape.message.contains("segment 0 overflow"), "{}", shape.message);
            assert!(shape.report.residual.is_infinite());
            let error = model.jacobian(&given, &mut Scratch::default()).unwrap_err();
            assert_eq!(error.argument, "displacements");
        }
        let error = model.jacobian(&[-0.25; 3], &mut Scratch::default());
        assert_eq!(error.is_err(), extensible);
    }
}
