//! Contact against golden data of an independent interior-point code, `tests/data/rod_contact.json`.

use nalgebra::Vector3;
use serde_json::Value;
use tdcr::Status;
use tdcr::model::Model;
use tdcr::obstacle::{Obstacle, Sphere};
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use tdcr::rod::contact::{LoadedRod, Scene};
use tdcr::rod::{Plan, RodSettings, Subsegment};

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
