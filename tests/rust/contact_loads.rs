//! Loads: beams in closed form, the elastica, energy and the balance of every free part.

use std::f64::consts::PI;

use nalgebra::Matrix4;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::Shape;
use tdcr::lie::so3;
use tdcr::obstacle::{Obstacle, Sphere};
use tdcr::robot::{Backbone, BackboneSpec, Robot, Routing, Tendon};
use tdcr::rod::Subsegment;
use tdcr::rod::contact::Loads;

use crate::contact_common::{Case, V};

const L: f64 = 0.2;
const E: f64 = 60e9;
const D: f64 = 1e-3;

fn stiffness() -> f64 {
    E * PI * D.powi(4) / 64.0
}

fn still() -> Loads {
    Loads { gravity: V::zeros(), ..Default::default() }
}

/// A straight rod along z whose base is turned by `base`.
fn rod(n: usize, tendons: Vec<Tendon>, base: Option<&Matrix4<f64>>) -> Robot {
    let mut spec = BackboneSpec::straight(L, n);
    (spec.youngs_modulus, spec.diameter) = (Some(E), Some(vec![D]));
    Robot::new(Backbone::new(spec).unwrap(), tendons, base, None, None).unwrap()
}

fn loaded(robot: Robot, loads: Loads) -> Case {
    Case { loads: Some(loads), ..Case::new(robot) }
}

fn tip(shape: &Shape) -> V {
    shape.state.frames.last().unwrap().translation
}

/// Tip of the elastica of length 1 and stiffness 1 under a dead force across it, by shooting with Runge-Kutta:
/// θ″ = −f cos θ, θ(0) = 0, θ′(1) = 0, θ from the undeformed line.
fn elastica(force: f64) -> (f64, f64) {
    let march = |start: f64| {
        let slope = |y: &[f64; 4]| [y[1], -force * y[0].cos(), y[0].cos(), y[0].sin()];
        let steps = 2000;
        let h = 1.0 / f64::from(steps);
        let mut y = [0.0, start, 0.0, 0.0];
        for _ in 0..steps {
            let at = |k: &[f64; 4], s: f64| std::array::from_fn(|i| y[i] + s * k[i]);
            let a = slope(&y);
            let b = slope(&at(&a, 0.5 * h));
            let c = slope(&at(&b, 0.5 * h));
            let d = slope(&at(&c, h));
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        }
        y
    };
    let (mut low, mut high) = (0.0, force);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if march(middle)[1] > 0.0 { high = middle } else { low = middle }
    }
    let end = march(0.5 * (low + high));
    (end[2], end[3])
}

/// Errors at n and 2n subsegments fall by four.
fn second_order(errors: &[f64]) {
    for pair in errors.windows(2) {
        let ratio = pair[0] / pair[1];
        assert!((3.7..4.3).contains(&ratio), "{errors:?}");
    }
}

#[test]
fn a_tip_force_makes_the_elastica() {
    for force in [1.0, 5.0, 10.0] {
        let (along, across) = elastica(force);
        for subsegment in Subsegment::ALL {
            let errors: Vec<f64> = [10, 20, 40, 80]
                .map(|n| {
                    let tip_force = V::x() * (force * stiffness() / (L * L));
                    let mut case = loaded(rod(n, vec![], None), Loads { tip_force, ..still() });
                    case.settings.subsegment = subsegment;
                    let at = tip(&case.solved(&[])) / L;
                    assert!(at.y.abs() < 1e-12);
                    (at.x - across).hypot(at.z - along)
                })
                .to_vec();
            println!("{force} {subsegment:?} {errors:?}");
            second_order(&errors);
            assert!(errors[3] < 1e-3);
        }
    }
    // A textbook value (Bisshopp & Drucker 1945): P L²/EI = 1 moves the tip across by 0.30172 L.
    assert!((elastica(1.0).1 - 0.30172).abs() < 1e-5);
}

#[test]
fn small_weight_bends_as_a_beam() {
    // Horizontal: the base's z along the world's x.
    let base = Matrix4::new(
        0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0,
    );
    let area = PI * D * D / 4.0;
    // q L⁴ / 8 EI is 1e-4 L.
    let q = 8e-4 * stiffness() / L.powi(3);
    let errors = [10, 20, 40].map(|n| {
        let backbone_density = q / (9.81 * area);
        let loads = Loads { backbone_density, ..Default::default() };
        let shape = loaded(rod(n, vec![], Some(&base)), loads).solved(&[]);
        // The weight in halves and the even bends err by as much at the tip, to either side.
        assert!((-tip(&shape).z / (1e-4 * L) - 1.0).abs() < 1e-8);
        // In the middle a beam hangs by q L⁴ / 8 EI times 17/48.
        let middle = shape.state.frames[n / 2].translation;
        (-middle.z / (1e-4 * L) * 48.0 / 17.0 - 1.0).abs()
    });
    println!("{errors:?}");
    second_order(&errors);
}

#[test]
fn a_tip_moment_bends_evenly() {
    let (moment, n) = (V::new(0.3, -1.1, 0.0) * stiffness() / L, 12);
    let case = loaded(rod(n, vec![], None), Loads { tip_moment: moment, ..still() });
    let shape = case.solved(&[]);
    for strain in &shape.state.strains {
        assert!((strain - V::new(0.3, -1.1, 0.0) / n as f64).norm() < 1e-10, "{strain:?}");
    }
}

#[test]
fn a_tip_moment_in_space_is_in_balance() {
    let tendons = [0.2, 2.5].map(|azimuth| {
        let routing = Routing::Helical { azimuth, radius: 5e-3, turns: 0.4 };
        Tendon::new(routing, None, None, None).unwrap()
    });
    let tip_moment = V::new(0.4, -0.25, 0.6) * stiffness() / L;
    let loads = Loads { tip_moment, tip_force: V::new(0.1, 0.0, -0.05), ..still() };
    let case = loaded(rod(10, tendons.to_vec(), None), loads);
    let shape = case.solved(&[-3e-3, f64::INFINITY]);
    let unbalance = case.unbalance(&shape);
    assert!(unbalance < 1e-9, "{unbalance:e}");
    assert!(shape.state.tensions[0] > 0.1);
    cuts(&case, &shape);
}

/// They have no potential: without the part of rank two that their derivatives lack in symmetry, 0.6 of these took
/// hundreds of steps or never ended.
#[test]
fn large_tip_moments_in_space_take_few_steps() {
    let draw = &mut ChaCha8Rng::seed_from_u64(7);
    for _ in 0..30 {
        let mut random = |most: f64| V::from_fn(|_, _| draw.random_range(-most..most));
        let (bend, along) = (random(1.0), random(1.0).normalize());
        let loads = Loads {
            tip_moment: along * 2.0 * stiffness() / L,
            tip_force: random(1.0) * stiffness() / (L * L),
            ..still()
        };
        let n = draw.random_range(4..20);
        let tendons = [0.0, 2.1].map(|azimuth| {
            Tendon::new(Routing::Helical { azimuth, radius: 8e-3, turns: 0.0 }, None, None, None)
        });
        let mut spec = rod(n, vec![], None).backbone().spec().clone();
        spec.rest = Some(vec![V::new(bend.x, bend.y, 0.0) / n as f64; n]);
        let tendons = tendons.map(Result::unwrap).to_vec();
        let robot = Robot::new(Backbone::new(spec).unwrap(), tendons, None, None, None).unwrap();
        let case = loaded(robot, loads);
        let shape = case.solved(&[-draw.random_range(0.0..0.01), f64::INFINITY]);
        assert!(shape.report.iterations <= 15, "{:?}", shape.report);
        assert!(case.unbalance(&shape) < 1e-9, "{:e}", case.unbalance(&shape));
    }
}

/// Cuts the robot in every subsegment: what the rod there carries balances all that acts beyond.
fn cuts(case: &Case, shape: &Shape) {
    let frames = &shape.state.frames;
    let loads = case.loads.clone().unwrap_or(still());
    let (forces, tip_moment) = loads.forces(&case.robot).unwrap();
    let n = frames.len() - 1;
    for i in 0..n {
        let (mut force, mut moment) = (V::zeros(), tip_moment);
        let mut act = |at: &V, own: &V| {
            force += own;
            moment += at.cross(own);
        };
        for j in i + 1..=n {
            act(&frames[j].translation, &forces[j]);
        }
        for contact in shape.state.contacts.iter().filter(|c| c.disk > i) {
            act(&contact.point, &contact.force);
        }
        for (path, tension) in case.robot.paths().iter().zip(&shape.state.tensions) {
            if path.end() > i {
                let from = frames[i].transform(&path.holes[i]);
                let to = frames[i + 1].transform(&path.holes[i + 1]);
                act(&to, &((from - to).normalize() * *tension));
            }
        }
        // Work of that wrench on the far end as the strain grows is the rod's own moment.
        let strain = shape.state.strains[i];
        let far = &frames[i + 1];
        for k in 0..3 {
            let h = 1e-5;
            let moved = |sign: f64| {
                let mut strains = case.strains(shape);
                strains[3 * i + k] += sign * h;
                case.frames(&strains)[i + 1]
            };
            let (plus, minus) = (moved(1.0), moved(-1.0));
            let velocity = (plus.translation - minus.translation) / (2.0 * h);
            let turn = plus.rotation * minus.rotation.transpose();
            let spin = so3::log(&turn) / (2.0 * h);
            let about = moment - far.translation.cross(&force);
            let wanted = force.dot(&velocity) + about.dot(&spin);
            let own = case.stiffness(3 * i + k) * (strain[k] - case.robot.backbone().rest(i)[k]);
            let off = (own - wanted).abs() / case.stiffness(3 * i);
            assert!(off < 1e-8, "cut {i}, {k}: {own:e} {wanted:e}");
        }
    }
}

#[test]
fn every_free_part_is_in_balance() {
    let tendon = Tendon::straight(0.0, 6e-3).unwrap();
    let disk_forces = (0..13).map(|i| V::new(0.0, 2e-4 * f64::from(i), -3e-4)).collect();
    let loads =
        Loads { disk_mass: 1e-3, backbone_density: 6450.0, disk_forces, ..Default::default() };
    let mut case = loaded(rod(12, vec![tendon], None), loads);
    let ball = Sphere::new(&V::new(0.05, 0.006, 0.14), 0.03).unwrap();
    case.obstacles.push(Obstacle::new(ball, false));
    let shape = case.solved(&[-8e-3]);
    assert!(
        shape.state.contacts.iter().any(|c| c.force.norm() > 1e-2),
        "{:?}",
        shape.state.contacts
    );
    assert!(case.unbalance(&shape) < 1e-9);
    cuts(&case, &shape);
}

/// Everything at once: loads on all disks and the tip, a ball, two tendons of which one ends half way and one stretches.
fn everything(subsegment: Subsegment) -> Case {
    let helix = Routing::Helical { azimuth: 1.2, radius: 6e-3, turns: 0.2 };
    let tendons = vec![
        Tendon::straight(0.0, 8e-3).unwrap(),
        Tendon::new(helix, Some(7), Some(400.0), None).unwrap(),
    ];
    let unit = stiffness() / (L * L);
    let loads = Loads {
        disk_mass: 2e-4,
        backbone_density: 6450.0,
        tip_force: V::new(0.8, 0.2, -0.3) * unit,
        disk_forces: (0..13).map(|i| V::new(0.01, 0.004 * f64::from(i), 0.0) * unit).collect(),
        ..Default::default()
    };
    let mut case = loaded(rod(12, tendons, None), loads);
    case.settings.subsegment = subsegment;
    let ball = Sphere::new(&V::new(0.05, 0.006, 0.14), 0.03).unwrap();
    case.obstacles.push(Obstacle::new(ball, false));
    case
}

fn pushes(shape: &Shape) -> Vec<(usize, Option<usize>)> {
    let contacts = shape.state.contacts.iter().filter(|c| c.force.norm() > 1e-3);
    contacts.map(|c| (c.disk, c.tendon)).collect()
}

#[test]
fn every_free_part_is_in_balance_with_all_that_acts() {
    for subsegment in Subsegment::ALL {
        for moment in [0.0, 0.3] {
            let mut case = everything(subsegment);
            let tip_moment = V::new(0.5, -0.2, 1.0) * (moment * stiffness() / L);
            case.loads.as_mut().unwrap().tip_moment = tip_moment;
            let shape = case.solved(&[-9e-3, -1e-3]);
            println!("{subsegment:?} {:?} {:?}", pushes(&shape), shape.state.tensions);
            assert!(!pushes(&shape).is_empty());
            assert!(shape.state.tensions.iter().all(|t| *t > 0.05), "{:?}", shape.state.tensions);
            assert!(case.unbalance(&shape) < 1e-9);
            cuts(&case, &shape);
        }
    }
}

/// The work of a growing load is what the rod stores: by the trapezoid, order 2.
#[test]
fn work_is_stored() {
    let full = V::new(1.5, 0.8, -1.0) * stiffness() / (L * L);
    let errors = [8, 16, 32].map(|steps| {
        let (mut work, mut stored) = (0.0, 0.0);
        let mut last = (V::zeros(), V::z() * L);
        for step in 1..=steps {
            let tip_force = full * (f64::from(step) / f64::from(steps));
            let shape = loaded(rod(10, vec![], None), Loads { tip_force, ..still() }).solved(&[]);
            work += 0.5 * (tip_force + last.0).dot(&(tip(&shape) - last.1));
            last = (tip_force, tip(&shape));
            stored = shape.state.energy;
        }
        (work / stored - 1.0).abs()
    });
    println!("{errors:?}");
    second_order(&errors);
}

/// On a ball, with tendons pulled further meanwhile: what the load and the pulls do is what rod and tendons store;
/// the ball, which does not move, does nothing. By the trapezoid, order 2.
#[test]
fn work_is_stored_in_contact_too() {
    for subsegment in Subsegment::ALL {
        let mut touching = None;
        let errors = [8, 16, 32].map(|steps| {
            let (mut work, mut first, mut stored) = (0.0, 0.0, 0.0);
            let mut last: Option<(Vec<V>, [f64; 2], Shape)> = None;
            for step in 0..=steps {
                let share = f64::from(step) / f64::from(steps);
                let mut case = everything(subsegment);
                case.loads.as_mut().unwrap().tip_force *= 0.6 + 0.4 * share;
                let pulls = [-9e-3 - 2e-4 * share, -1e-3 - 5e-5 * share];
                let shape = case.solved(&pulls);
                let now = pushes(&shape);
                assert!(!now.is_empty() && shape.state.tensions.iter().all(|t| *t > 0.01));
                // The same points all the way, or the work would have kinks.
                assert_eq!(*touching.get_or_insert_with(|| now.clone()), now, "{share}");
                let (forces, _) = case.loads.as_ref().unwrap().forces(&case.robot).unwrap();
                let stretch = 0.5 * case.robot.paths()[1].rest_length / 400.0;
                stored = shape.state.energy + stretch * shape.state.tensions[1].powi(2);
                if let Some((forces_before, pulls_before, before)) = last {
                    for (i, force) in forces.iter().enumerate() {
                        let moved =
                            shape.state.frames[i].translation - before.state.frames[i].translation;
                        work += 0.5 * (force + forces_before[i]).dot(&moved);
                    }
                    for k in 0..2 {
                        let mean = 0.5 * (shape.state.tensions[k] + before.state.tensions[k]);
                        work -= mean * (pulls[k] - pulls_before[k]);
                    }
                } else {
                    first = stored;
                }
                last = Some((forces, pulls, shape));
            }
            (work / (stored - first) - 1.0).abs()
        });
        println!("{subsegment:?} {errors:?} {touching:?}");
        second_order(&errors);
    }
}
