//! Random scenes: every solve ends, and what it calls a minimum is one.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::Matrix3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::lie::so3;
use tdcr::model::Model;
use tdcr::obstacle::{Capsule, Cuboid, Cylinder, HalfSpace, Obstacle, Sphere};
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use tdcr::rod::contact::{LoadedRod, Scratch};
use tdcr::rod::{Rod, Scratch as RodScratch};
use tdcr::{Shape, Status};

use crate::contact_common::{Case, V};
use crate::prism::prism;

const FREE: f64 = f64::INFINITY;

struct Drawn {
    case: Case,
    pulls: Vec<f64>,
    kinds: Vec<&'static str>,
    /// Energy without obstacles.
    energy: f64,
}

fn unit(draw: &mut ChaCha8Rng) -> V {
    loop {
        let v = V::from_fn(|_, _| draw.random_range(-1.0..1.0));
        if (0.01..1.0).contains(&v.norm_squared()) {
            return v.normalize();
        }
    }
}

/// 3 to 30 subsegments, straight, evenly bent or wavy at rest, 1 to 4 tendons, straight or helical.
fn robot(draw: &mut ChaCha8Rng) -> Robot {
    let n = draw.random_range(3..=30);
    let length: f64 = draw.random_range(0.1..0.3);
    let mut spec = BackboneSpec::straight(length, n);
    let bend = draw.random_range(0.2..2.0) / n as f64;
    let around = draw.random_range(0.0..TAU);
    let twist = draw.random_range(-1.0..1.0) / n as f64;
    spec.rest = match draw.random_range(0..3) {
        0 => None,
        1 => Some(vec![V::new(bend * around.cos(), bend * around.sin(), twist); n]),
        _ => {
            let wave = |i: usize| (TAU * i as f64 / n as f64 + around).sin();
            Some((0..n).map(|i| V::new(bend * wave(i), 0.5 * bend, twist)).collect())
        }
    };
    let tendons = (0..draw.random_range(1..=4)).map(|_| {
        let (azimuth, radius) =
            (draw.random_range(0.0..TAU), length * draw.random_range(0.02..0.06));
        let end = if draw.random_bool(0.7) { n } else { draw.random_range(n.div_ceil(2)..=n) };
        let routing = if draw.random_bool(0.5) {
            Routing::Angles { azimuth: PerDisk::Same(azimuth), radius: PerDisk::Same(radius) }
        } else {
            Routing::Helical { azimuth, radius, turns: draw.random_range(-0.6..0.6) }
        };
        Tendon::new(routing, Some(end), None, None).unwrap()
    });
    let tendons = tendons.collect();
    Robot::new(Backbone::new(spec).unwrap(), tendons, None, None, None).unwrap()
}

/// An obstacle that the unobstructed shape goes into at `p`.
fn obstacle(draw: &mut ChaCha8Rng, l: f64, p: &V) -> (&'static str, Obstacle) {
    let (u, r) = (unit(draw), l * draw.random_range(0.03..0.25));
    let depth = r * draw.random_range(0.0..0.4);
    let center = p + u * (r - depth);
    let across = u.cross(&unit(draw)).normalize();
    let turn = so3::exp(&(unit(draw) * draw.random_range(0.0..3.0)));
    match draw.random_range(0..6) {
        0 => ("sphere", Obstacle::new(Sphere::new(&center, r).unwrap(), false)),
        1 => ("cylinder", Obstacle::new(Cylinder::new(&center, &across, r).unwrap(), false)),
        2 => {
            let plane = HalfSpace::new(&(p - u * depth), &-u).unwrap();
            ("half-space", Obstacle::new(plane, false))
        }
        3 => {
            let (a, b) = (center - across * (0.2 * l), center + across * (0.3 * l));
            ("capsule", Obstacle::new(Capsule::new(&a, &b, r).unwrap(), false))
        }
        4 => {
            let half = V::from_fn(|_, _| r * draw.random_range(0.4..1.0));
            ("box", Obstacle::new(Cuboid::new(&center, &half, &turn).unwrap(), false))
        }
        _ => {
            let sides = draw.random_range(3..20);
            let half = r * draw.random_range(0.5..2.0);
            let mesh = prism(sides, 2, r, (-half, half));
            let pose = tdcr::lie::Pose { rotation: turn, translation: center };
            ("mesh", Obstacle::new(mesh, false).transform(&pose))
        }
    }
}

/// A lumen about the robot at rest.
fn lumen(draw: &mut ChaCha8Rng, l: f64) -> (&'static str, Obstacle) {
    let r = l * draw.random_range(0.08..0.4);
    let center = V::new(0.0, 0.0, 0.5 * l);
    match draw.random_range(0..4) {
        0 => ("in cylinder", Obstacle::new(Cylinder::new(&center, &V::z(), r).unwrap(), true)),
        1 => ("in sphere", Obstacle::new(Sphere::new(&center, 0.6 * l + r).unwrap(), true)),
        2 => {
            let half = V::new(r, 0.8 * r, 1.2 * l);
            (
                "in box",
                Obstacle::new(Cuboid::new(&center, &half, &Matrix3::identity()).unwrap(), true),
            )
        }
        _ => {
            let mesh = prism(draw.random_range(5..24), 6, r, (-1.2 * l, 1.2 * l));
            ("in mesh", Obstacle::new(mesh, true))
        }
    }
}

/// A robot, pulls that exist without obstacles, and obstacles in the way; none if the draw gives none.
fn scene(seed: u64) -> Option<Drawn> {
    let draw = &mut ChaCha8Rng::seed_from_u64(seed);
    let robot = robot(draw);
    let l = robot.backbone().total_length();
    let n = robot.backbone().subsegments();
    let count = robot.paths().len();
    let pulled = draw.random_range(1..=2.min(count));
    let piece = l / n as f64;
    let mut tensions = vec![0.0; count];
    for tension in &mut tensions[..pulled] {
        let bend = draw.random_range(0.3..3.0) / n as f64;
        *tension = bend / (piece * 0.04 * l);
    }
    let mut case = Case::new(robot);
    let plan = case.plan();
    let rod = Rod::new(&case.robot, &plan);
    let mut work = RodScratch::default();
    let report = rod.solve_tensions(&tensions, &mut work).unwrap();
    if report.status != Status::Converged {
        return None;
    }
    let state = rod.state(&work).clone();
    let lengths = state.tendon_lengths.iter().zip(rod.rest_lengths());
    let pulls: Vec<f64> = (lengths.zip(&tensions))
        .map(|((length, rest), tension)| {
            if *tension > 0.0 {
                length - rest
            } else if draw.random_bool(0.5) {
                FREE
            } else {
                (length - rest).max(0.0) + 0.01 * l
            }
        })
        .collect();
    let rest = case.robot.rest_frames();
    let mut kinds = Vec::new();
    for _ in 0..draw.random_range(1..=3) {
        for _ in 0..50 {
            let disk = draw.random_range(n.div_ceil(3)..=n);
            let (kind, own) = if draw.random_bool(0.2) {
                lumen(draw, l)
            } else {
                obstacle(draw, l, &state.frames[disk].translation)
            };
            let others = std::mem::replace(&mut case.obstacles, vec![own]);
            let clear = case.clearance(&rest) > 2e-3 * l;
            let own = std::mem::replace(&mut case.obstacles, others);
            if clear {
                case.obstacles.extend(own);
                kinds.push(kind);
                break;
            }
        }
    }
    (!kinds.is_empty()).then_some(Drawn { case, pulls, kinds, energy: state.energy })
}

/// What must hold of a minimum; what is wrong, if anything.
fn wrong(drawn: &Drawn, shape: &Shape, sample: bool) -> Option<String> {
    let case = &drawn.case;
    let l = case.robot.backbone().total_length();
    let strains = case.strains(shape);
    let frames = case.frames(&strains);
    let clearance = case.clearance(&frames);
    if clearance < -1e-10 * l {
        return Some(format!("a point is {:.1e} L in an obstacle", -clearance / l));
    }
    for contact in &shape.state.contacts {
        let force = contact.force.dot(&contact.normal);
        if force < 0.0 || (force > 0.0 && contact.gap.abs() > 1e-10 * l) {
            return Some(format!("contact {contact:?}"));
        }
        let near = case.obstacles[contact.obstacle].nearest(&contact.point).unwrap().distance;
        if force > 0.0 && near.abs() > 2e-10 * l {
            return Some(format!("{near:e} m off: {contact:?}"));
        }
    }
    for ((path, pull), tension) in
        case.robot.paths().iter().zip(&drawn.pulls).zip(&shape.state.tensions)
    {
        let over = path.length(&frames) - path.rest_length - pull;
        let taut = *tension > 0.0;
        if *tension < 0.0 || over > 2e-10 * l || (taut && over.abs() > 2e-10 * l) {
            return Some(format!("tendon over {over:.1e} m, tension {tension:.1e}"));
        }
    }
    let unbalance = case.unbalance(shape);
    if unbalance > 1e-9 {
        return Some(format!("unbalanced by {unbalance:.1e}"));
    }
    // Bounds are met to 1e-10 of the lengths.
    let slack = shape.state.tensions.iter().sum::<f64>() * 2e-10 * l;
    if shape.state.energy < drawn.energy * (1.0 - 1e-12) - slack {
        return Some(format!("energy {:e} below {:e}", shape.state.energy, drawn.energy));
    }
    if sample {
        let least = case.least_curvature(shape);
        if least < -1e-5 {
            return Some(format!("a saddle: {least:.1e}"));
        }
    }
    None
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share) as usize]
}

/// Draws, solves, checks; the share that converged.
fn many(count: usize, every: usize) -> f64 {
    let mut iterations = Vec::new();
    let mut table: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
    let (mut done, mut good, mut touching) = (0, 0_usize, 0);
    let mut ends: BTreeMap<String, usize> = BTreeMap::new();
    let mut seed = 0;
    let mut bad = Vec::new();
    while done < count {
        seed += 1;
        let Some(drawn) = scene(seed) else { continue };
        done += 1;
        let plan = drawn.case.plan();
        let scene = drawn.case.scene(&plan);
        let model = LoadedRod::new(&drawn.case.robot, &plan, &scene).unwrap();
        let mut work = Scratch::default();
        let report = model.solve(&drawn.pulls, &mut work).unwrap();
        iterations.push(report.iterations as f64);
        let shape = model.result(&drawn.pulls, report, work);
        let ok = report.status == Status::Converged;
        *ends.entry(format!("{:?}", report.status)).or_default() += 1;
        for kind in &drawn.kinds {
            let row = table.entry(kind).or_default();
            row[0] += usize::from(ok);
            row[1] += 1;
        }
        if ok {
            good += 1;
            touching += usize::from(!shape.state.contacts.is_empty());
            if let Some(what) = wrong(&drawn, &shape, done % every == 0) {
                bad.push(format!("seed {seed} {:?}: {what}", drawn.kinds));
            }
        } else {
            let n = drawn.case.robot.backbone().subsegments();
            assert!(!shape.message.is_empty());
            println!("seed {seed} n {n} {:?} {:?} {}", drawn.kinds, report, shape.message);
        }
    }
    println!("{good} of {done} converged, {touching} in contact; {ends:?}");
    for (kind, [ok, all]) in &table {
        println!("  {kind}: {ok} of {all}, {:.2} %", 1e2 * *ok as f64 / *all as f64);
    }
    let [half, most, max] = [0.5, 0.99, 1.0].map(|share| quantile(&mut iterations, share));
    println!("  steps: median {half:.3}, 99 % {most:.3}, most {max:.3}");
    for line in &bad {
        println!("{line}");
    }
    assert!(bad.is_empty(), "{} of {good} are no minima", bad.len());
    good as f64 / done as f64
}

fn a_thousand_random_scenes() {
    // 997 as measured; the rest is flagged.
    assert!(many(300, 10) > 0.99);
}

#[test]
#[ignore = "minutes"]
fn ten_thousand_random_scenes() {
    assert!(many(10_000, 50) > 0.99);
}

crate::common::slow!(a_thousand_random_scenes,);
