//! Contact and loads against golden data of independent interior-point codes: `tests/data/rod_contact.json`, and
//! `rod_loads.json`, which `make_rod_loads.py` beside it makes.

use nalgebra::{Matrix3x4, Matrix4, Vector3};
use serde_json::Value;
use tdcr::model::Model;
use tdcr::obstacle::{Cylinder, Obstacle, Sphere};
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use tdcr::rod::contact::{LoadedRod, Loads, Scene};
use tdcr::rod::{Plan, RodSettings, Subsegment};
use tdcr::{Shape, Status};

use crate::contact_common::Case;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_vec(numbers(value))
}

fn robot(case: &Value) -> Robot {
    let n = usize::try_from(case["n"].as_u64().unwrap()).unwrap();
    let mut spec = BackboneSpec::straight(case["backbone_length"].as_f64().unwrap(), n);
    spec.poisson_ratio = case["poisson"].as_f64().unwrap();
    if let Some(rest) = case["rest"].as_array() {
        spec.rest = Some(rest.iter().map(vector).collect());
    }
    let azimuth = PerDisk::Each(numbers(&case["azimuth"]));
    let radius = PerDisk::Same(case["radius"].as_f64().unwrap());
    let tendon = Tendon::new(Routing::Angles { azimuth, radius }, None, None, None).unwrap();
    Robot::new(Backbone::new(spec).unwrap(), vec![tendon], None, None, None).unwrap()
}

#[test]
fn every_case_is_met_at_every_disk() {
    let data: Value = serde_json::from_str(include_str!("../data/rod_contact.json")).unwrap();
    for case in data["cases"].as_array().unwrap() {
        let name = format!("{} {}", case["name"], case["kind"]);
        let robot = robot(case);
        let link = case["kind"] == "link";
        let subsegment = if link { Subsegment::Link } else { Subsegment::Arc };
        let plan = Plan::new(&robot, RodSettings { subsegment, ..Default::default() }).unwrap();
        let obstacles: Vec<Obstacle> = case["obstacles"]
            .as_array()
            .unwrap()
            .iter()
            .map(|o| {
                let radius = o["radius"].as_f64().unwrap();
                Obstacle::new(Sphere::new(&vector(&o["center"]), radius).unwrap(), false)
            })
            .collect();
        let scene = Scene::new(&robot, &plan, &obstacles, None, 0.0).unwrap();
        let model = LoadedRod::new(&robot, &plan, &scene).unwrap();
        let shape = model.shape(&[case["displacement"].as_f64().unwrap()]).unwrap();
        assert_eq!(shape.report.status, Status::Converged, "{name}: {}", shape.message);
        let places = case["positions"].as_array().unwrap();
        let off = (shape.state.frames.iter().zip(places))
            .map(|(frame, place)| (frame.translation - vector(place)).norm());
        let off = off.fold(0.0_f64, f64::max);
        let tension = shape.state.tensions[0] / case["tension"].as_f64().unwrap() - 1.0;
        let mut worst_force = 0.0_f64;
        if let Some(forces) = case["contact"].as_array() {
            for (i, disk) in forces.iter().enumerate() {
                for (j, force) in numbers(&disk.as_array().unwrap()[0]).into_iter().enumerate() {
                    let own = shape
                        .state
                        .contacts
                        .iter()
                        .find(|c| c.disk == i + 1 && c.kind as usize == j);
                    let own = own.map_or(0.0, |c| c.force.norm());
                    worst_force = worst_force.max((own - force).abs());
                }
            }
            assert!(!shape.state.contacts.is_empty());
        }
        println!(
            "{name}: places {off:.1e} m, tension {tension:.1e}, forces {worst_force:.1e}, {:?}",
            shape.report
        );
        assert!(off < 1e-9 && tension.abs() < 1e-7 && worst_force < 1e-4, "{name}");
    }
}

// --- loads, tendons and obstacles together -------------------------------------------------------

fn optional(value: &Value, key: &str) -> Option<Vec<Vector3<f64>>> {
    value[key].as_array().map(|rows| rows.iter().map(vector).collect())
}

fn count(value: &Value) -> usize {
    usize::try_from(value.as_u64().unwrap()).unwrap()
}

/// A case of `rod_loads.json` but for its displacements.
fn loaded(case: &Value) -> Case {
    let mut spec = BackboneSpec::straight(case["length"].as_f64().unwrap(), count(&case["n"]));
    spec.poisson_ratio = case["poisson_ratio"].as_f64().unwrap();
    spec.youngs_modulus = case["youngs_modulus"].as_f64();
    spec.diameter = Some(vec![case["diameter"].as_f64().unwrap()]);
    spec.rest = optional(case, "rest");
    let tendons = case["tendons"].as_array().unwrap().iter().map(|tendon| {
        let azimuth = PerDisk::Each(numbers(&tendon["azimuth"]));
        let radius = PerDisk::Same(tendon["radius"].as_f64().unwrap());
        let end = Some(count(&tendon["end"]));
        let routing = Routing::Angles { azimuth, radius };
        Tendon::new(routing, end, tendon["stiffness"].as_f64(), None).unwrap()
    });
    let tendons = tendons.collect();
    let rows: Vec<f64> = case["base"].as_array().unwrap().iter().flat_map(numbers).collect();
    let base = Matrix4::from_row_slice(&rows);
    let robot = Robot::new(Backbone::new(spec).unwrap(), tendons, Some(&base), None, None);
    let given = &case["loads"];
    let loads = Loads {
        gravity: vector(&given["gravity"]),
        backbone_density: given["backbone_density"].as_f64().unwrap(),
        disk_mass: given["disk_mass"].as_f64().unwrap(),
        tip_force: vector(&given["tip_force"]),
        tip_moment: vector(&given["tip_moment"]),
        disk_forces: optional(given, "disk_forces").unwrap_or_default(),
    };
    let mut own = Case { loads: Some(loads), ..Case::new(robot.unwrap()) };
    let link = case["subsegment"] == "link";
    own.settings.subsegment = if link { Subsegment::Link } else { Subsegment::Arc };
    own.settings.elements = count(&case["elements"]);
    own.settings.axial = case["axial"].as_bool().unwrap();
    let obstacles = case["obstacles"].as_array().unwrap().iter();
    own.obstacles.extend(obstacles.map(|o| {
        let radius = o["radius"].as_f64().unwrap();
        if o["kind"] == "sphere" {
            Obstacle::new(Sphere::new(&vector(&o["center"]), radius).unwrap(), false)
        } else {
            let (point, axis) = (vector(&o["point"]), vector(&o["axis"]));
            Obstacle::new(Cylinder::new(&point, &axis, radius).unwrap(), false)
        }
    }));
    own
}

/// Largest difference of contact forces, and the largest of them.
fn forces_off(shape: &Shape, wanted: &Value) -> (f64, f64) {
    let wanted = wanted.as_array().unwrap();
    let pushing: Vec<_> = shape.state.contacts.iter().filter(|c| c.force.norm() > 0.0).collect();
    assert_eq!(pushing.len(), wanted.len(), "{pushing:?}");
    let (mut off, mut most) = (0.0_f64, 0.0_f64);
    for theirs in wanted {
        let place = vector(&theirs["point"]);
        let mine = pushing
            .iter()
            .find(|c| {
                c.disk == count(&theirs["disk"])
                    && c.kind.as_str() == theirs["kind"]
                    && c.tendon == theirs["tendon"].as_u64().map(|k| k as usize)
                    && c.obstacle == count(&theirs["obstacle"])
            })
            .unwrap();
        assert!((mine.point - place).norm() < 1e-9 * 0.2, "{mine:?}");
        let force = vector(&theirs["force"]);
        off = off.max((mine.force - force).norm());
        most = most.max(force.norm());
    }
    (off, most)
}

#[test]
fn loads_tendons_and_obstacles_together_are_met() {
    let data: Value = serde_json::from_str(include_str!("../data/rod_loads.json")).unwrap();
    let cases = data["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 19);
    for case in cases {
        let name = format!("{} {}", case["name"], case["subsegment"]);
        let (own, answer) = (loaded(case), &case["answer"]);
        let pulls = case["displacements"].as_array().unwrap().iter();
        let pulls: Vec<f64> = pulls.map(|d| d.as_f64().unwrap_or(f64::INFINITY)).collect();
        let shape = own.solved(&pulls);
        let (mut place, mut turn) = (0.0_f64, 0.0_f64);
        let frames = answer["frames"].as_array().unwrap();
        assert_eq!(frames.len(), shape.state.frames.len());
        for (frame, wanted) in shape.state.frames.iter().zip(frames) {
            let rows: Vec<f64> = wanted.as_array().unwrap().iter().flat_map(numbers).collect();
            let wanted = Matrix3x4::from_row_slice(&rows);
            place = place.max((frame.translation - wanted.column(3)).norm() / 0.2);
            turn = turn.max((frame.rotation - wanted.fixed_columns::<3>(0)).amax());
        }
        let wanted = numbers(&answer["tensions"]);
        let most = wanted.iter().fold(0.0_f64, |most, t| most.max(*t));
        let tension = (shape.state.tensions.iter().zip(&wanted))
            .fold(0.0_f64, |off, (mine, theirs)| off.max((mine - theirs).abs()));
        let (force, push) = forces_off(&shape, &answer["contacts"]);
        let energy = shape.state.energy / answer["energy"].as_f64().unwrap() - 1.0;
        println!(
            "{name}: places {place:.1e}, turns {turn:.1e}, tensions {tension:.1e} of {most:.2} N, forces \
             {force:.1e} of {push:.2} N, energy {energy:.1e}, {} steps",
            shape.report.iterations
        );
        assert!(place < 1e-9 && turn < 1e-8 && energy.abs() < 1e-8, "{name}");
        assert!(tension <= 1e-7 * most && force <= 1e-7 * push, "{name}");
    }
}
