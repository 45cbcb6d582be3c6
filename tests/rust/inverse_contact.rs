//! The inverse of the rod among obstacles and under weight: targets are tips of random trunks that lean on something.

use nalgebra::Vector3;
use tdcr::Status;
use tdcr::inverse::{Bounds, InverseSettings, Inverter, RodInverse, Target};
use tdcr::lie::so3;
use tdcr::model::Model;
use tdcr::obstacle::{Cuboid, Cylinder, HalfSpace, Obstacle, Sphere};
use tdcr::robot::Robot;
use tdcr::rod::contact::{LoadedRod, Scene, Scratch};
use tdcr::rod::{Plan, RodSettings};

use crate::inverse_common::uniform;
use crate::inverse_rod::{LENGTH, pulls, rod_trunk};
use crate::rod_common::try_under;

type V = Vector3<f64>;

/// Something in the way of a disk.
fn obstacle(at: &V, size: f64, u: &mut impl FnMut(f64, f64) -> f64) -> Obstacle {
    let v = V::new(u(-1.0, 1.0), u(-1.0, 1.0), u(-1.0, 1.0));
    let near = at + v * 0.05 * size;
    match u(0.0, 4.0) as usize {
        0 => Obstacle::new(Sphere::new(&near, u(0.1, 0.3) * size).unwrap(), false),
        1 => Obstacle::new(Cylinder::new(&near, &v, u(0.1, 0.3) * size).unwrap(), false),
        2 => {
            let half = V::new(u(0.1, 0.3), u(0.1, 0.3), u(0.1, 0.3)) * size;
            Obstacle::new(Cuboid::new(&near, &half, &so3::exp(&v)).unwrap(), false)
        }
        _ => Obstacle::new(HalfSpace::new(&near, &(v * 0.2 - at / at.norm())).unwrap(), false),
    }
}

/// Displacements from rest.
fn from_rest(rod: &LoadedRod<'_>, displacements: &[f64]) -> (Status, V) {
    let mut work = Scratch::default();
    let report = rod.solve(displacements, &mut work).unwrap();
    (report.status, rod.state(&work).frames.last().unwrap().translation)
}

fn a_trunk_that_has_to_lean_reaches_its_targets() {
    let mut u = uniform(41);
    let (mut sought, mut met, mut led) = (0, 0, 0);
    while sought < 50 {
        let segments = 1 + u(0.0, 3.0) as usize;
        let robot: Robot = rod_trunk(segments, if u(0.0, 1.0) < 0.5 { 0.0 } else { 0.3 });
        let plan = Plan::new(&robot, RodSettings::default()).unwrap();
        let tensions = pulls(segments, 1.0, &mut u);
        let Some((free, _)) = try_under(&robot, RodSettings::default(), &tensions) else {
            continue;
        };
        let disk = u(0.3, 1.0) * (free.state.frames.len() - 1) as f64;
        let at = free.state.frames[disk as usize].translation;
        let obstacles = [obstacle(&at, LENGTH, &mut u)];
        let scene = Scene::new(&robot, &plan, &obstacles, None, 0.0).unwrap();
        let rod = LoadedRod::new(&robot, &plan, &scene).unwrap();
        let mut work = Scratch::default();
        let report = rod.solve_tensions(&tensions, &mut work).unwrap();
        let touches = rod.state(&work).contacts.iter().any(|c| c.force.norm() > 0.0);
        if report.status != Status::Converged || !touches {
            continue;
        }
        let tip = rod.state(&work).frames.last().unwrap().translation;
        // Where the own displacements lead elsewhere from rest, there may be no answer.
        let (status, own) = from_rest(&rod, &rod.displacements(rod.state(&work)));
        if status != Status::Converged || (own - tip).norm() > 1e-9 {
            continue;
        }
        sought += 1;
        let bounds = Bounds::default();
        let inverse = RodInverse::new(&robot, &plan, &bounds, InverseSettings::default()).unwrap();
        let inverse = inverse.among(&scene).unwrap();
        let mut work = inverse.buffers(None);
        let target = Target::point(tip).unwrap();
        let answer = inverse.solve(&target, None, &mut work);
        if answer.status != Status::Converged {
            continue;
        }
        met += 1;
        assert!(answer.distance <= 1e-10, "{:e}", answer.distance);
        let state = inverse.state(&mut work).unwrap();
        assert!((state.frames.last().unwrap().translation - tip).norm() < 1e-9);
        assert!(state.contacts.iter().all(|c| c.gap > -1e-10));
        let mut displacements = vec![0.0; robot.tendons().len()];
        inverse.write_displacements(&work, &mut displacements);
        let (status, place) = from_rest(&rod, &displacements);
        let leads = status == Status::Converged && (place - tip).norm() < 1e-8;
        led += usize::from(leads);
        // It is said where rest leads elsewhere.
        assert_eq!(inverse.message(&answer, &work).is_empty(), leads);
    }
    println!("met {met} of {sought}, {led} from rest");
    assert!(met >= 49 && led >= 46);
}

crate::common::slow!(a_trunk_that_has_to_lean_reaches_its_targets,);
