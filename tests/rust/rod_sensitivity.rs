//! Derivatives of the rod against central differences, at random configurations.

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::Status;
use tdcr::lie::Pose;
use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use tdcr::rod::{Change, Plan, Rod, RodSettings, Scratch, Subsegment, TendonLaw};

/// What a robot is made of, as plain numbers that can be changed.
#[derive(Clone)]
struct Recipe {
    spec: BackboneSpec,
    holes: Vec<Vec<Vector3<f64>>>,
    stiffness: Option<f64>,
}

impl Recipe {
    fn random(draw: &mut ChaCha8Rng, settings: &RodSettings) -> Self {
        let n = draw.random_range(3..8);
        let mut spec = BackboneSpec::straight(1.0, 1);
        spec.length = (0..n).map(|_| draw.random_range(0.015..0.025)).collect();
        spec.subsegments = vec![1; n];
        spec.poisson_ratio = draw.random_range(0.2..0.45);
        let turn = |draw: &mut ChaCha8Rng| {
            Vector3::from_fn(|k, _| draw.random_range(-0.15..0.15) * if k == 2 { 0.5 } else { 1.0 })
        };
        spec.rest = Some((0..n).map(|_| turn(draw)).collect());
        let elastic = settings.axial;
        if elastic {
            spec.youngs_modulus = Some(60e9);
            spec.diameter = Some(vec![1.2e-3]);
        }
        let holes = (0..3).map(|k| {
            let end = if k == 2 { n - 1 } else { n };
            let azimuth = 2.1 * f64::from(k) + draw.random_range(-0.2..0.2);
            let twist = draw.random_range(-0.3..0.3);
            let hole = |i: usize, draw: &mut ChaCha8Rng| {
                let (sin, cos) = (azimuth + twist * i as f64).sin_cos();
                Vector3::new(cos, sin, 0.0) * draw.random_range(6e-3..8e-3)
            };
            (0..=end).map(|i| hole(i, draw)).collect()
        });
        Self { spec, holes: holes.collect(), stiffness: elastic.then_some(2e4) }
    }

    fn robot(&self) -> Robot {
        let tendons = self.holes.iter().map(|holes| {
            let azimuth = PerDisk::Each(holes.iter().map(|h| h.y.atan2(h.x)).collect());
            let radius = PerDisk::Each(holes.iter().map(|h| h.x.hypot(h.y)).collect());
            let routing = Routing::Angles { azimuth, radius };
            Tendon::new(routing, Some(holes.len() - 1), self.stiffness, None).unwrap()
        });
        let tendons = tendons.collect();
        Robot::new(Backbone::new(self.spec.clone()).unwrap(), tendons, None, None, None).unwrap()
    }

    /// This one changed by a share of a change; holes move in their disks' planes. The stiffness per length
    /// of the whole stays: see [`stiffened`].
    fn changed(&self, change: &Change, share: f64) -> Self {
        let mut out = self.clone();
        for (own, d) in out.spec.rest.iter_mut().flatten().zip(&change.rest) {
            *own += d * share;
        }
        for (own, d) in out.spec.length.iter_mut().zip(&change.lengths) {
            *own += d * share;
        }
        out.spec.poisson_ratio += change.poisson_ratio * share;
        for (own, d) in out.holes.iter_mut().flatten().zip(change.holes.iter().flatten()) {
            *own += d * share;
        }
        out
    }
}

fn random_change(draw: &mut ChaCha8Rng, mut change: Change) -> Change {
    let mut vector = |flat: bool| {
        Vector3::from_fn(|k, _| if flat && k == 2 { 0.0 } else { draw.random_range(-1.0..1.0) })
    };
    change.rest.iter_mut().for_each(|v| *v = vector(false));
    change.holes.iter_mut().flatten().for_each(|v| *v = vector(true) * 0.02);
    change.lengths.iter_mut().for_each(|v| *v = vector(false).x * 0.02);
    change.displacements.iter_mut().for_each(|v| *v = vector(false).x * 0.02);
    change.poisson_ratio = vector(false).x;
    change
}

/// Places, tensions and the tool's turn for a recipe.
fn solved(recipe: &Recipe, settings: RodSettings, pulls: &[f64]) -> (Scratch, Robot) {
    let robot = recipe.robot();
    let plan = Plan::new(&robot, settings).unwrap();
    let rod = Rod::new(&robot, &plan);
    let mut work = Scratch::default();
    let report = rod.solve(pulls, &mut work).unwrap();
    assert_eq!(report.status, Status::Converged, "{}", rod.message(pulls, &work));
    (work, robot)
}

fn all_settings() -> Vec<RodSettings> {
    let mut all = Vec::new();
    for subsegment in Subsegment::ALL {
        for tendons in TendonLaw::ALL {
            for elements in [1, 2] {
                for axial in [false, true] {
                    let tolerance = 1e-13;
                    let base = RodSettings::default();
                    all.push(RodSettings {
                        subsegment,
                        tendons,
                        elements,
                        axial,
                        tolerance,
                        ..base
                    });
                }
            }
        }
    }
    all
}

#[test]
fn changes_do_what_differences_say() {
    let mut draw = ChaCha8Rng::seed_from_u64(5);
    let mut worst = 0.0_f64;
    for settings in all_settings() {
        for _ in 0..4 {
            let recipe = Recipe::random(&mut draw, &settings);
            let pulls = [-2e-3, -1e-3, f64::INFINITY];
            let (work, robot) = solved(&recipe, settings, &pulls);
            let plan = Plan::new(&robot, settings).unwrap();
            let sensitivity = Rod::new(&robot, &plan).sensitivity(&pulls, &work);
            assert!(!sensitivity.dependent());
            let mut change = random_change(&mut draw, sensitivity.no_change());
            change.displacements[2] = 0.0;
            let told = sensitivity.forward(&change);
            let step = 2e-6;
            let at = |share: f64| {
                let moved: Vec<f64> =
                    pulls.iter().zip(&change.displacements).map(|(p, d)| p + share * d).collect();
                solved(&recipe.changed(&change, share), settings, &moved).0
            };
            let rod_state = |work: &Scratch, robot: &Robot, plan: &Plan| {
                Rod::new(robot, plan).state(work).clone()
            };
            let (plus, minus) = (at(step), at(-step));
            let (plus, minus) = (rod_state(&plus, &robot, &plan), rod_state(&minus, &robot, &plan));
            let scale = told.velocities.iter().fold(0.0_f64, |most, v| most.max(v.norm()));
            for (i, velocity) in told.velocities.iter().enumerate() {
                let difference =
                    (plus.frames[i].translation - minus.frames[i].translation) / (2.0 * step);
                worst = worst.max((difference - velocity).norm() / scale);
                let turn = plus.frames[i].rotation * minus.frames[i].rotation.transpose();
                let turn = tdcr::lie::so3::log(&turn) / (2.0 * step);
                worst = worst.max((turn - told.spins[i]).norm() / (1.0 + told.spins[i].norm()));
            }
            for (k, told) in told.tensions.iter().enumerate() {
                let difference = (plus.tensions[k] - minus.tensions[k]) / (2.0 * step);
                worst = worst.max((difference - told).abs() / (1.0 + told.abs()));
            }
        }
    }
    println!("forward derivatives against differences: {worst:.1e}");
    assert!(worst < 1e-6);
}

#[test]
fn adjoint_and_jacobian_agree_with_forward() {
    let mut draw = ChaCha8Rng::seed_from_u64(6);
    let mut worst = 0.0_f64;
    for settings in all_settings() {
        let recipe = Recipe::random(&mut draw, &settings);
        let pulls = [-2e-3, -1e-3, f64::INFINITY];
        let (work, robot) = solved(&recipe, settings, &pulls);
        let plan = Plan::new(&robot, settings).unwrap();
        let sensitivity = Rod::new(&robot, &plan).sensitivity(&pulls, &work);
        let n = robot.backbone().subsegments();
        let change = random_change(&mut draw, sensitivity.no_change());
        let told = sensitivity.forward(&change);
        let mut weights = || -> Vec<Vector3<f64>> {
            (0..=n).map(|_| Vector3::from_fn(|_, _| draw.random_range(-1.0..1.0))).collect()
        };
        let (positions, moments) = (weights(), weights());
        let by = sensitivity.adjoint(&positions, &moments);
        let dots = |a: &[Vector3<f64>], b: &[Vector3<f64>]| -> f64 {
            a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
        };
        let flat = |v: &[Vec<Vector3<f64>>]| v.concat();
        let forward = dots(&positions, &told.velocities) + dots(&moments, &told.spins);
        let numbers = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let backward = dots(&by.rest, &change.rest)
            + dots(&flat(&by.holes), &flat(&change.holes))
            + numbers(&by.lengths, &change.lengths)
            + numbers(&by.displacements, &change.displacements)
            + by.poisson_ratio * change.poisson_ratio;
        worst = worst.max((forward - backward).abs() / forward.abs());
        let tool = Pose {
            rotation: tdcr::lie::so3::exp(&Vector3::new(0.3, 0.2, 0.1)),
            translation: Vector3::new(0.01, -0.02, 0.03),
        };
        let jacobian = sensitivity.jacobian(&tool);
        let tip = Rod::new(&robot, &plan).state(&work).frames[n];
        for k in 0..3 {
            let mut change = sensitivity.no_change();
            change.displacements[k] = 1.0;
            let told = sensitivity.forward(&change);
            let arm = tip.rotation * tool.translation;
            let velocity = told.velocities[n] + told.spins[n].cross(&arm);
            let column = jacobian.column(k);
            let off = (column.fixed_rows::<3>(0) - velocity).norm()
                + (column.fixed_rows::<3>(3) - told.spins[n]).norm();
            worst = worst.max(off / (1.0 + column.norm()));
        }
    }
    println!("adjoint and Jacobian against forward derivatives: {worst:.1e}");
    assert!(worst < 1e-10);
}
