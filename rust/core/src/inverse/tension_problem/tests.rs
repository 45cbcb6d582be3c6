//! Derivatives of the problem against differences.

use nalgebra::{Vector3, Vector6};

use super::*;
use crate::inverse::InverseSettings;
use crate::inverse::Target;
use crate::inverse::batch::Inverter;
use crate::inverse::bounds::Bounds;
use crate::inverse::position_goal::PositionGoal;
use crate::inverse::rod::RodInverse;
use crate::lie::{Pose, so3};
use crate::obstacle::{Obstacle, Sphere};
use crate::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use crate::rod::contact::{Loads, Scene};
use crate::rod::{Plan, RodSettings};

fn robot(n: usize) -> Robot {
    let tendon = |k: usize| {
        let at = |i: usize| 2.1 * k as f64 + 0.6 * (k + 1) as f64 * i as f64 / n as f64;
        let azimuth = PerDisk::Each((0..=n).map(at).collect());
        let routing = Routing::Angles { azimuth, radius: PerDisk::Same(0.008) };
        Tendon::new(routing, None, None, None).unwrap()
    };
    let steel = BackboneSpec {
        youngs_modulus: Some(200e9),
        diameter: Some(vec![1e-3]),
        ..BackboneSpec::straight(0.2, n)
    };
    let backbone = Backbone::new(steel).unwrap();
    Robot::new(backbone, (0..4).map(tendon).collect(), None, None, None).unwrap()
}

/// The Jacobian and the slopes of displacements against differences; second derivatives, which leave out how
/// tensions change the stiffness, to a share that falls with the load of a subsegment.
#[test]
fn derivatives_agree_with_differences() {
    let settings = InverseSettings::default();
    for (n, elements, share) in [(12, 1, 0.2), (12, 2, 0.2), (48, 1, 0.02)] {
        let robot = robot(n);
        let plan = Plan::new(&robot, RodSettings { elements, ..RodSettings::default() });
        let plan = plan.unwrap();
        let bounds = Bounds::default();
        let inverse = RodInverse::new(&robot, &plan, &bounds, settings).unwrap();
        let mut work = inverse.buffers(None);
        let problem = &mut work.problem;
        let turn = so3::exp(&Vector3::new(0.5, -0.3, 0.2));
        let translation = Vector3::new(0.05, 0.02, 0.15);
        problem.goal.pose_residual.set_target(Target::Pose(Pose { rotation: turn, translation }));
        check(problem, &[0.9, 0.5, 0.0, 0.7], share, (1e-4, 1e-6));
    }
}

/// Derivatives where the rod leans on a ball, under weight and a force and moment at the tip. What
/// contact bends is not in the second derivatives: they are not compared.
#[test]
fn derivatives_agree_with_differences_in_contact() {
    let settings = InverseSettings::default();
    for (n, elements) in [(12, 1), (12, 2), (48, 1)] {
        let robot = robot(n);
        let plan = Plan::new(&robot, RodSettings { elements, ..RodSettings::default() });
        let plan = plan.unwrap();
        let ball = Sphere::new(&Vector3::new(0.02, 0.025, 0.1), 0.02).unwrap();
        let loads = Loads {
            disk_mass: 1e-3,
            tip_force: Vector3::new(0.05, 0.02, -0.03),
            tip_moment: Vector3::new(1e-3, -2e-3, 1e-3),
            ..Loads::default()
        };
        let balls = [Obstacle::new(ball, false)];
        let scene = Scene::new(&robot, &plan, &balls, Some(&loads), 0.0).unwrap();
        let bounds = Bounds::default();
        let inverse = RodInverse::new(&robot, &plan, &bounds, settings).unwrap();
        let inverse = inverse.among(&scene).unwrap();
        let mut work = inverse.buffers(None);
        let problem = &mut work.problem;
        problem.goal.pose_residual.set_target(Target::Position(Vector3::new(0.05, 0.02, 0.15)));
        let z = [0.9, 0.5, 0.0, 0.7];
        // Shapes are balanced to 5e-11 rad.
        check(problem, &z, f64::INFINITY, (1e-3, 3e-6));
        let tensions: Vec<f64> = z.iter().zip(problem.units).map(|(z, unit)| z * unit).collect();
        assert!(problem.rod.solve_at(&tensions));
        let contacts = problem.rod.state().unwrap().contacts;
        assert!(contacts.iter().any(|c| c.force.norm() > 0.0));
    }
}

/// Sum of squares over target positions of some of the disks: its slope and, but for how tensions change the
/// stiffness, its second derivatives.
#[test]
fn derivatives_of_places_agree_with_differences() {
    let robot = robot(48);
    let plan = Plan::new(&robot, RodSettings::default()).unwrap();
    let bounds = Bounds::default();
    let settings = InverseSettings::default();
    let inverse = RodInverse::new(&robot, &plan, &bounds, settings).unwrap();
    let work = inverse.buffers(None);
    let wanted = (0..6_usize).map(|i| {
        let s = 0.2 * (i + 1) as f64 / 6.0;
        (8 * i + 7, Vector3::new(0.3 * s, -0.4 * s, 0.8 * s))
    });
    let goal = PositionGoal::new(wanted.collect(), 0.2, 1e-10);
    let TensionProblem { units, ranges, rest_lengths, rod, .. } = work.problem;
    let mut problem = TensionProblem::new(rod, goal, rest_lengths, units, ranges);
    let mut at = |z: &[f64]| {
        let (mut residual, mut jacobian) =
            (SVector::<f64, 8>::zeros(), vec![SVector::<f64, 8>::zeros(); 4]);
        problem.evaluate(z, &mut residual, &mut jacobian);
        let squared = Problem::<8>::squared_norm(&mut problem, z);
        assert!((residual.norm_squared() - squared).abs() < 1e-15);
        let slope: Vec<f64> = jacobian.iter().map(|column| column.dot(&residual)).collect();
        let mut hessian: Vec<f64> =
            (0..16).map(|i| jacobian[i / 4].dot(&jacobian[i % 4])).collect();
        problem.add_hessian(z, &residual, &mut hessian);
        (0.5 * squared, slope, hessian)
    };
    let (z, h) = ([0.9, 0.5, 0.3, 0.7], 1e-4);
    let (_, slope, hessian) = at(&z);
    let (mut off, mut whole) = (0.0, 0.0);
    for b in 0..4 {
        let mut moved = |by: f64| {
            let mut z = z;
            z[b] += by;
            at(&z)
        };
        let (ahead, behind) = (moved(h), moved(-h));
        assert!(((ahead.0 - behind.0) / (2.0 * h) - slope[b]).abs() < 1e-8);
        for a in b..4 {
            let bent = (ahead.1[a] - behind.1[a]) / (2.0 * h);
            off += (hessian[4 * a + b] - bent).powi(2);
            whole += bent * bent;
        }
    }
    assert!(off < 0.02 * 0.02 * whole, "{}", (off / whole).sqrt());
}

/// Steps of `h`, differences right to `near`.
fn check(problem: &mut TensionProblem<'_>, z: &[f64], share: f64, (h, near): (f64, f64)) {
    let weights = Vector6::new(0.3, -0.7, 0.5, 0.4, 0.2, -0.6);
    let mut at = |z: &[f64]| {
        let (mut residual, mut jacobian) = (Vector6::zeros(), vec![Vector6::zeros(); 4]);
        problem.evaluate(z, &mut residual, &mut jacobian);
        let mut hessian = vec![0.0; 16];
        problem.add_hessian(z, &weights, &mut hessian);
        let own: Vec<f64> = (0..4).map(|k| problem.rod.displacement(k)).collect();
        let slope = |k: usize, j: usize| problem.rod.displacement_slope(k, j) * problem.units[j];
        let slopes: Vec<f64> = (0..16).map(|i| slope(i / 4, i % 4)).collect();
        (residual, jacobian, hessian, own, slopes)
    };
    let (_, jacobian, hessian, _, slopes) = at(z);
    let (mut off, mut whole) = (0.0, 0.0);
    for b in 0..4 {
        let mut moved = |by: f64| {
            let mut z = z.to_vec();
            z[b] += by;
            at(&z)
        };
        // None is pulled below zero: differences of second order to one side.
        let (once, twice, none) = (moved(h), moved(2.0 * h), moved(0.0));
        let slope = (once.0 * 4.0 - twice.0 - none.0 * 3.0) / (2.0 * h);
        assert!((slope - jacobian[b]).amax() < near, "{b} {slope} {}", jacobian[b]);
        for k in 0..4 {
            let slope = (4.0 * once.3[k] - twice.3[k] - 3.0 * none.3[k]) / (2.0 * h);
            assert!((slope - slopes[4 * k + b]).abs() < 1e-2 * near, "{k} {b} {slope}");
            if k >= b {
                let bent = weights.dot(&(once.1[k] - none.1[k])) / h;
                off += (hessian[4 * k + b] - bent).powi(2);
                whole += bent * bent;
            }
        }
    }
    assert!(off < share * share * whole, "{}", (off / whole).sqrt());
}
