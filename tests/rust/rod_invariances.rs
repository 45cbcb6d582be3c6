//! What must not change the rod, and what its answers must satisfy, at random robots.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::model::Model;
use tdcr::robot::Robot;
use tdcr::rod::{Plan, Rod, RodSettings, Scratch, TendonLaw};
use tdcr::{Shape, Status};

use crate::common::FREE;
use crate::rod_common::{Recipe, apart, rod_shape, solved, try_under};

/// A robot, displacements that exist, and their shape.
struct Case {
    recipe: Recipe,
    displacements: Vec<f64>,
    shape: Shape,
    draw: ChaCha8Rng,
}

impl Case {
    fn length(&self) -> f64 {
        self.recipe.spec.length.iter().sum()
    }

    fn subsegments(&self) -> usize {
        self.recipe.spec.subsegments.iter().sum()
    }
}

/// Robots of up to 20 subsegments under loads that leave one stable shape near rest, and bends within the
/// geometric limit. Tendons that carry nothing are free.
fn cases(count: usize) -> Vec<Case> {
    let mut cases = Vec::new();
    for seed in 0.. {
        let mut draw = ChaCha8Rng::seed_from_u64(seed);
        let recipe = Recipe::random(&mut draw, 20);
        let tensions = recipe.random_tensions(&mut draw, 3.0);
        let robot = recipe.robot();
        let found = try_under(&robot, RodSettings::default(), &tensions);
        let within = |(shape, _): &(Shape, _)| recipe.reach(&shape.state.strains) < 0.8;
        let Some((_, lengths)) = found.filter(within) else {
            continue;
        };
        let given = lengths.iter().zip(&tensions);
        let displacements: Vec<f64> =
            given.map(|(d, tension)| if *tension > 0.0 { *d } else { FREE }).collect();
        let shape = solved(&robot, tight(), &displacements);
        cases.push(Case { recipe, displacements, shape, draw });
        if cases.len() == count {
            break;
        }
    }
    cases
}

/// Two solves of one problem differ by what the tolerance leaves open.
fn tight() -> RodSettings {
    RodSettings { tolerance: 1e-13, ..Default::default() }
}

fn shape(recipe: &Recipe, displacements: &[f64]) -> Shape {
    solved(&recipe.robot(), tight(), displacements)
}

/// Largest distance of places from those of a shape, moved.
fn off(shape: &Shape, from: &Shape, moved: impl Fn(Vector3<f64>) -> Vector3<f64>) -> f64 {
    let pairs = shape.state.frames.iter().zip(&from.state.frames);
    pairs.fold(0.0, |most, (a, b)| f64::max(most, (a.translation - moved(b.translation)).norm()))
}

/// Largest difference of tensions over the largest tension; `by` is what the second ones are multiplied with.
fn tension_off(shape: &Shape, from: &Shape, by: f64) -> f64 {
    let most = shape.state.tensions.iter().fold(f64::MIN_POSITIVE, |most, t| f64::max(most, *t));
    let pairs = shape.state.tensions.iter().zip(&from.state.tensions);
    pairs.fold(0.0, |worst, (a, b)| f64::max(worst, (a - b * by).abs() / most))
}

/// Tensions are determined only where no more tendons are taut than the rod has freedoms to tell them apart:
/// compared are the places, and the tensions of robots with two taut tendons at most.
fn alike(case: &Case, places: f64, tensions: f64) {
    assert!(places < 1e-9 * case.length(), "{places:e} of {}", case.length());
    let taut = case.shape.state.tensions.iter().filter(|t| **t > 0.0).count();
    assert!(taut > 2 || tensions < 1e-6, "{tensions:e}");
}

#[test]
fn a_base_moves_the_shape_and_nothing_else() {
    for mut case in cases(60) {
        let turn = Rotation3::new(Vector3::from_fn(|_, _| case.draw.random_range(-2.0..2.0)));
        let shift = Vector3::from_fn(|_, _| case.draw.random_range(-0.5..0.5));
        let mut base = turn.to_homogeneous();
        base.fixed_view_mut::<3, 1>(0, 3).copy_from(&shift);
        let recipe = Recipe { base: Some(base), ..case.recipe.clone() };
        let moved = shape(&recipe, &case.displacements);
        assert_eq!(moved.state.strains, case.shape.state.strains);
        assert_eq!(moved.state.tensions, case.shape.state.tensions);
        assert!(off(&moved, &case.shape, |p| turn * p + shift) < 1e-14);
    }
}

#[test]
fn a_mirrored_robot_takes_the_mirrored_shape() {
    for case in cases(60) {
        let mut recipe = case.recipe.clone();
        for azimuth in recipe.holes.iter_mut().flat_map(|(azimuth, _)| azimuth) {
            *azimuth = -*azimuth;
        }
        // Rotation vectors are axial: in the mirror y -> -y they turn the other way as well.
        for rest in recipe.spec.rest.iter_mut().flatten() {
            *rest = Vector3::new(-rest.x, rest.y, -rest.z);
        }
        let mirrored = shape(&recipe, &case.displacements);
        let places = off(&mirrored, &case.shape, |p| Vector3::new(p.x, -p.y, p.z));
        alike(&case, places, tension_off(&mirrored, &case.shape, 1.0));
    }
}

#[test]
fn the_zero_of_azimuths_is_a_choice() {
    for mut case in cases(60) {
        let angle = case.draw.random_range(-PI..PI);
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
        let mut recipe = case.recipe.clone();
        for azimuth in recipe.holes.iter_mut().flat_map(|(azimuth, _)| azimuth) {
            *azimuth += angle;
        }
        for rest in recipe.spec.rest.iter_mut().flatten() {
            *rest = turn * *rest;
        }
        let turned = shape(&recipe, &case.displacements);
        let places = off(&turned, &case.shape, |p| turn * p);
        alike(&case, places, tension_off(&turned, &case.shape, 1.0));
    }
}

#[test]
fn the_order_of_tendons_is_a_choice() {
    for case in cases(60) {
        let mut recipe = case.recipe.clone();
        recipe.holes.reverse();
        let mut displacements = case.displacements.clone();
        displacements.reverse();
        let mut other = shape(&recipe, &displacements);
        other.state.tensions.reverse();
        let tensions = tension_off(&other, &case.shape, 1.0);
        alike(&case, apart(&other, &case.shape), tensions);
    }
}

/// A backbone of one stretch is one of many; and disks may be counted from the tip where all tendons end there:
/// half a turn about x puts the tip at the base, arcs keep their bends about x and their torsion.
#[test]
fn the_numbers_of_disks_are_a_choice() {
    let mut turned = 0;
    for case in cases(120) {
        let n = case.subsegments();
        let mut recipe = case.recipe.clone();
        recipe.spec.length = vec![case.recipe.piece(); n];
        recipe.spec.subsegments = vec![1; n];
        let other = shape(&recipe, &case.displacements);
        alike(&case, apart(&other, &case.shape), tension_off(&other, &case.shape, 1.0));
        if case.recipe.holes.iter().any(|(azimuth, _)| azimuth.len() != n + 1) {
            continue;
        }
        for (azimuth, radius) in &mut recipe.holes {
            azimuth.reverse();
            radius.reverse();
            for azimuth in azimuth.iter_mut() {
                *azimuth = -*azimuth;
            }
        }
        if let Some(rest) = &mut recipe.spec.rest {
            rest.reverse();
            for rest in rest {
                rest.x = -rest.x;
            }
        }
        let mut other = shape(&recipe, &case.displacements);
        other.state.frames.reverse();
        let tip = case.shape.state.frames[n];
        let flip = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        let seen = |p| flip * tip.rotation.transpose() * (p - tip.translation);
        let places = off(&other, &case.shape, seen);
        alike(&case, places, tension_off(&other, &case.shape, 1.0));
        turned += 1;
    }
    assert!(turned > 10, "{turned}");
}

#[test]
fn the_unit_of_length_is_a_choice() {
    for case in cases(60) {
        for unit in [1000.0, 1.0 / 0.0254] {
            let mut recipe = case.recipe.clone();
            recipe.spec.length[0] *= unit;
            for radius in recipe.holes.iter_mut().flat_map(|(_, radius)| radius) {
                *radius *= unit;
            }
            let displacements: Vec<f64> = case.displacements.iter().map(|d| d * unit).collect();
            let other = shape(&recipe, &displacements);
            let places = off(&other, &case.shape, |p| p * unit) / unit;
            // In units of EI: per square of a length.
            let tensions = tension_off(&other, &case.shape, 1.0 / (unit * unit));
            alike(&case, places, tensions);
            let energy = other.state.energy * unit;
            assert!((energy - case.shape.state.energy).abs() <= 1e-9 * energy);
        }
    }
}

#[test]
fn youngs_modulus_scales_forces_alone() {
    for case in cases(60) {
        let mut recipe = case.recipe.clone();
        recipe.spec.diameter = Some(vec![1.1e-3]);
        for modulus in [2e6, 210e9] {
            recipe.spec.youngs_modulus = Some(modulus);
            let stiffness = modulus * PI * 1.1e-3_f64.powi(4) / 64.0;
            let other = shape(&recipe, &case.displacements);
            let tensions = tension_off(&other, &case.shape, stiffness);
            alike(&case, apart(&other, &case.shape), tensions);
            let energy = case.shape.state.energy * stiffness;
            assert!((other.state.energy - energy).abs() <= 1e-9 * energy);
        }
    }
}

/// A tendon that carries nothing may as well hang loose by any amount; and at the solution lengths are within
/// bounds, tensions pull, and one of the two is at its end.
#[test]
fn slack_tendons_do_not_matter() {
    let mut loose = 0;
    for mut case in cases(150) {
        let robot = case.recipe.robot();
        let plan = Plan::new(&robot, tight()).unwrap();
        let rod = Rod::new(&robot, &plan);
        let mut work = Scratch::default();
        for more in [1e-4, 0.01, 10.0] {
            let mut given = case.displacements.clone();
            for (k, d) in given.iter_mut().enumerate().filter(|(_, d)| !d.is_finite()) {
                let length = case.shape.state.tendon_lengths[k];
                *d = length - rod.rest_lengths()[k] + case.draw.random_range(0.5..1.0) * more;
                loose += 1;
            }
            let report = rod.solve(&given, &mut work).unwrap();
            assert_eq!(report.status, Status::Converged, "{}", rod.message(&given, &work));
            for (k, (d, rest)) in given.iter().zip(rod.rest_lengths()).enumerate() {
                let state = rod.state(&work);
                let (tension, gap) = (state.tensions[k], rest + d - state.tendon_lengths[k]);
                assert!(tension >= 0.0 && gap > -1e-12 * rest);
                let load = tension * case.recipe.piece().powi(2);
                assert!(load * gap < 1e-12 * rest, "{load} at {gap:e}");
                assert!(gap < 0.4 * more || tension == 0.0);
            }
            let other = shape(&case.recipe, &given);
            alike(&case, apart(&other, &case.shape), tension_off(&other, &case.shape, 1.0));
        }
    }
    assert!(loose > 200, "{loose}");
}

/// Energy, and the tendons' lengths, by kinematics of its own.
fn evaluate(recipe: &Recipe, strains: &DVector<f64>) -> (f64, Vec<f64>) {
    let (l, poisson) = (recipe.piece(), recipe.spec.poisson_ratio);
    let mut energy = 0.0;
    let mut lengths = vec![0.0; recipe.holes.len()];
    for i in 0..strains.len() / 3 {
        let strain = strains.fixed_rows::<3>(3 * i).into_owned();
        let bent = strain - recipe.spec.rest.as_ref().map_or(Vector3::zeros(), |rest| rest[i]);
        energy += 0.5 * (bent.xy().norm_squared() + bent.z * bent.z / (1.0 + poisson)) / l;
        let (angle, turn) = (strain.norm(), strain.cross_matrix());
        let (first, second) = if angle < 1e-3 {
            (0.5 - angle.powi(2) / 24.0, 1.0 / 6.0 - angle.powi(2) / 120.0)
        } else {
            let cube = angle.powi(3);
            ((1.0 - angle.cos()) / angle.powi(2), (angle - angle.sin()) / cube)
        };
        let end = (Matrix3::identity() + turn * first + turn * turn * second) * Vector3::z() * l;
        for ((azimuth, radius), length) in recipe.holes.iter().zip(&mut lengths) {
            if azimuth.len() > i + 1 {
                let hole = |i: usize| {
                    let (sin, cos) = azimuth[i].sin_cos();
                    Vector3::new(cos, sin, 0.0) * radius[i]
                };
                *length += (end + Rotation3::new(strain) * hole(i + 1) - hole(i)).norm();
            }
        }
    }
    (energy, lengths)
}

/// Every small change of the strains that keeps the lengths of taut tendons costs energy, and that of second
/// order.
#[test]
fn the_energy_is_least_among_shapes_of_these_lengths() {
    let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
    for mut case in cases(60) {
        let recipe = &case.recipe;
        let flat = case.shape.state.strains.iter().flat_map(|w| [w.x, w.y, w.z]);
        let at = DVector::from_iterator(3 * case.subsegments(), flat);
        let (energy, wanted) = evaluate(recipe, &at);
        assert!((energy - case.shape.state.energy).abs() < 1e-11 * (1.0 + energy));
        let taut: Vec<usize> =
            (0..wanted.len()).filter(|k| case.shape.state.tensions[*k] > 0.0).collect();
        if taut.is_empty() || 3 * case.subsegments() <= taut.len() {
            continue;
        }
        let step = 1e-5;
        let slopes = DMatrix::from_fn(taut.len(), at.len(), |row, column| {
            let length = |side: f64| {
                let mut strains = at.clone();
                strains[column] += side * step;
                evaluate(recipe, &strains).1[taut[row]]
            };
            (length(1.0) - length(-1.0)) / (2.0 * step)
        });
        let back = slopes.clone().pseudo_inverse(1e-9 * slopes.amax().max(1e-300)).unwrap();
        for _ in 0..10 {
            let any = DVector::from_fn(at.len(), |_, _| case.draw.random_range(-1.0..1.0));
            let along = &any - &back * (&slopes * &any);
            let rise = |size: f64| {
                let mut strains = &at + &along * size;
                for _ in 0..20 {
                    let lengths = evaluate(recipe, &strains).1;
                    let off = taut.iter().map(|k| lengths[*k] - wanted[*k]);
                    strains -= &back * DVector::from_iterator(taut.len(), off);
                }
                evaluate(recipe, &strains).0 - energy
            };
            let (far, near) = (rise(4e-3), rise(2e-3));
            assert!(near > 0.0, "{near:e} at an energy of {energy:e}");
            (low, high) = (low.min(far / near), high.max(far / near));
        }
    }
    println!("the energy's rise, twice as far: {low:.3} to {high:.3} times");
    assert!(low > 3.0 && high < 5.0);
}

#[test]
fn nothing_pulled_is_the_rest_shape() {
    for case in cases(40) {
        let robot: Robot = case.recipe.robot();
        let rest = robot.rest_frames();
        for tendons in TendonLaw::ALL {
            for elements in [1, 3] {
                let settings = RodSettings { tendons, elements, ..Default::default() };
                for displacement in [0.0, FREE] {
                    let pulls = vec![displacement; robot.tendons().len()];
                    let shape = rod_shape(&robot, settings, &pulls);
                    for (frame, rest) in shape.state.frames.iter().zip(&rest) {
                        let off = (frame.translation - rest.translation).norm();
                        assert!(off < 1e-13 * case.length());
                    }
                    assert!(shape.message.is_empty() && shape.report.iterations == 0);
                    assert!(shape.state.tensions.iter().all(|t| *t == 0.0));
                    assert!(shape.state.energy < 1e-25);
                }
            }
        }
    }
}
