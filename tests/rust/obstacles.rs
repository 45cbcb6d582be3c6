//! Obstacles in closed form and by function: distances, derivatives, motions, misuse.

use std::collections::hash_map::DefaultHasher;
use std::f64::consts::PI;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use tdcr::lie::{Pose, so3};
use tdcr::obstacle::{
    Capsule, Cuboid, Cylinder, Fault, HalfSpace, Near, Obstacle, SignedDistance, Sphere,
    by_differences,
};

type V = Vector3<f64>;

fn v(x: f64, y: f64, z: f64) -> V {
    V::new(x, y, z)
}

fn sphere() -> Obstacle {
    Obstacle::new(Sphere::new(&v(0.01, -0.02, 0.03), 0.05).unwrap(), false)
}

/// One of every kind in closed form, none of them aligned with the axes.
fn closed_forms() -> Vec<Obstacle> {
    let turn = so3::exp(&v(0.3, -0.5, 0.8));
    let cuboid = Cuboid::new(&v(0.01, 0.02, -0.01), &v(0.03, 0.05, 0.02), &turn).unwrap();
    let capsule = Capsule::new(&v(-0.03, 0.0, 0.01), &v(0.02, 0.03, 0.0), 0.02).unwrap();
    vec![
        sphere(),
        Obstacle::new(Cylinder::new(&v(0.01, 0.0, 0.1), &v(1.0, 2.0, -0.5), 0.03).unwrap(), false),
        Obstacle::new(HalfSpace::new(&v(0.0, 0.01, 0.02), &v(-3.0, 1.0, 2.0)).unwrap(), false),
        Obstacle::new(capsule, false),
        Obstacle::new(cuboid, false),
    ]
}

fn nearest(obstacle: &Obstacle, x: &V) -> Near {
    obstacle.nearest(x).unwrap()
}

fn point() -> impl Strategy<Value = V> {
    prop::array::uniform3(-0.1..0.1f64).prop_map(V::from)
}

fn pose() -> impl Strategy<Value = Pose> {
    (prop::array::uniform3(-1.8..1.8f64), prop::array::uniform3(-1.0..1.0f64))
        .prop_map(|(w, t)| Pose { rotation: so3::exp(&w.into()), translation: t.into() })
}

/// Derivatives against central differences, away from kinks and from edges' switches.
fn check_derivatives(obstacle: &Obstacle, x: &V) -> Result<(), TestCaseError> {
    let h = 1e-6;
    let near = nearest(obstacle, x);
    for i in 0..3 {
        let mut step = V::zeros();
        step[i] = h;
        let (ahead, behind) = (nearest(obstacle, &(x + step)), nearest(obstacle, &(x - step)));
        if ahead.feature != behind.feature {
            continue;
        }
        // A capsule's Hessian jumps where its tube meets its ends; there it is between the two.
        let jump = (ahead.hessian - behind.hessian).amax() / 2.0;
        let slope = (ahead.distance - behind.distance) / (2.0 * h);
        prop_assert!(
            (slope - near.gradient[i]).abs() < 1e-6 + h * jump / 2.0,
            "{obstacle:?} {x:?}"
        );
        let curve = (ahead.gradient - behind.gradient) / (2.0 * h);
        let error = (curve - near.hessian.column(i)).amax();
        prop_assert!(
            error < 1e-4 * (1.0 + near.hessian.amax()) + jump,
            "{obstacle:?} {x:?} {error:e}"
        );
    }
    prop_assert!((near.gradient.norm() - 1.0).abs() < 1e-15);
    // A distance does not curve along its own gradient. Near an axis both know their direction only to the
    // rounding of where the point is, over how near.
    let size = near.hessian.amax();
    let direction = 1e-14 * (1.0 + 0.1 * size);
    prop_assert!(
        (near.hessian * near.gradient).amax() < direction * (1.0 + size),
        "{obstacle:?} {x:?}"
    );
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn gradients_and_hessians_are_those_of_the_distance(x in point()) {
        for obstacle in closed_forms() {
            // Within 1 mm of a centre or an axis differences of this step see the curvature change.
            prop_assume!(nearest(&obstacle, &x).hessian.amax() < 1e3);
            check_derivatives(&obstacle, &x)?;
        }
    }

    #[test]
    fn moving_obstacle_and_point_together_changes_nothing(x in point(), pose in pose()) {
        for obstacle in closed_forms() {
            let (here, there) = (nearest(&obstacle, &x), nearest(&obstacle.transform(&pose), &pose.transform(&x)));
            prop_assert!((here.distance - there.distance).abs() < 2e-15);
            prop_assume!(here.hessian.amax() < 1e3);
            prop_assert!((pose.rotation * here.gradient - there.gradient).amax() < 1e-11);
            let turned = pose.rotation * here.hessian * pose.rotation.transpose();
            prop_assert!((turned - there.hessian).amax() < 1e-8 * (1.0 + turned.amax()));
        }
    }

    #[test]
    fn a_lumen_is_the_volume_with_the_sign_turned(x in point()) {
        for obstacle in closed_forms() {
            let lumen = Obstacle::new(obstacle.volume().clone(), true);
            let (solid, hollow) = (nearest(&obstacle, &x), nearest(&lumen, &x));
            prop_assert_eq!(hollow.distance, -solid.distance);
            prop_assert_eq!(hollow.gradient, -solid.gradient);
            prop_assert_eq!(hollow.hessian, -solid.hessian);
        }
    }

    #[test]
    fn the_faces_of_a_box_lumen_bound_it_together(x in point()) {
        let boxes = closed_forms().pop().unwrap();
        let lumen = Obstacle::new(boxes.volume().clone(), true);
        let mut faces = Vec::new();
        lumen.constraints(&x, 1.0, &mut faces).unwrap();
        prop_assert_eq!(faces.len(), 6);
        prop_assert!(faces.windows(2).all(|pair| pair[0].distance <= pair[1].distance));
        let depth = nearest(&lumen, &x).distance;
        // Within, the tightest face is the distance; beyond, corners are farther than their planes.
        prop_assert_eq!(faces[0].distance > 0.0, depth > 0.0);
        if depth > 0.0 {
            prop_assert!((faces[0].distance - depth).abs() < 1e-16);
        } else {
            prop_assert!(faces[0].distance >= depth - 1e-16);
            let worst = faces.iter().map(|f| f.distance.min(0.0).powi(2)).sum::<f64>().sqrt();
            prop_assert!((worst + depth).abs() < 1e-15);
        }
        // What is out of reach is left out.
        faces.clear();
        lumen.constraints(&x, 0.01, &mut faces).unwrap();
        let most = depth.max(0.01 - depth.min(0.0));
        prop_assert!(!faces.is_empty() && faces.iter().all(|f| f.distance <= most));
    }
}

#[test]
fn distances_are_the_closed_forms() {
    let at = |volume: Obstacle, x: V| nearest(&volume, &x).distance;
    assert!((at(sphere(), v(0.01, -0.02, 0.13)) - 0.05).abs() < 1e-16);
    let cylinder = Cylinder::new(&v(0.0, 0.0, 7.0), &v(0.0, 0.0, -2.0), 0.015).unwrap();
    assert!((at(Obstacle::new(cylinder, false), v(0.03, 0.04, -3.0)) - 0.035).abs() < 1e-16);
    let floor = HalfSpace::new(&v(5.0, 5.0, 0.01), &v(0.0, 0.0, 9.0)).unwrap();
    assert!((at(Obstacle::new(floor, false), v(1.0, 2.0, 0.03)) - 0.02).abs() < 1e-16);
    let capsule = Capsule::new(&v(0.0, 0.0, 0.0), &v(0.0, 0.0, 0.1), 0.01).unwrap();
    assert!((at(Obstacle::new(capsule, false), v(0.03, 0.0, 0.14)) - 0.04).abs() < 1e-16);
    assert!((at(Obstacle::new(capsule, false), v(0.03, 0.0, 0.04)) - 0.02).abs() < 1e-16);
    let point = Capsule::new(&v(0.0, 0.0, 0.1), &v(0.0, 0.0, 0.1), 0.01).unwrap();
    assert!((at(Obstacle::new(point, false), v(0.0, 0.03, 0.14)) - 0.04).abs() < 1e-16);
    let cube = Cuboid::new(&v(0.0, 0.0, 0.0), &v(0.01, 0.02, 0.03), &Matrix3::identity()).unwrap();
    let cube = Obstacle::new(cube, false);
    assert_eq!(at(cube.clone(), v(0.002, 0.003, 0.1)), 0.07);
    assert!((at(cube.clone(), v(0.04, -0.06, 0.0)) - 0.05).abs() < 1e-16);
    assert!((at(cube.clone(), v(0.02, -0.04, 0.05)) - 0.03).abs() < 1e-16);
    assert!((at(cube, v(0.002, 0.015, -0.02)) + 0.005).abs() < 1e-16);
}

#[test]
fn outside_a_box_there_is_one_constraint_by_its_nearest_part() {
    let cube = Cuboid::new(&v(0.0, 0.0, 0.0), &v(1.0, 1.0, 1.0), &Matrix3::identity()).unwrap();
    let cube = Obstacle::new(cube, false);
    let mut features = Vec::new();
    for (x, curved) in [
        (v(2.0, 0.0, 0.5), 0),  // before a face
        (v(2.0, 2.0, 0.5), 1),  // around an edge
        (v(2.0, 2.0, -3.0), 2), // around a vertex
        (v(0.9, 0.2, -0.1), 0), // sunk in
    ] {
        let mut near = Vec::new();
        cube.constraints(&x, 10.0, &mut near).unwrap();
        assert_eq!(near.len(), 1);
        assert_eq!(near[0], nearest(&cube, &x));
        let curvature = near[0].hessian.symmetric_eigenvalues();
        let count = curvature.iter().filter(|k| **k > 1e-12).count();
        assert_eq!(count, curved, "{x:?}");
        features.push(near[0].feature);
    }
    assert!(features[0] == features[3] && features[0] != features[1] && features[1] != features[2]);
}

#[test]
fn kinks_have_an_answer_and_always_the_same() {
    let axis = v(1.0, 2.0, -0.5);
    let bar = Cylinder::new(&v(0.0, 0.0, 0.0), &axis, 0.03).unwrap();
    let capsule = Capsule::new(&v(0.0, 0.0, 0.0), &axis, 0.03).unwrap();
    let ball = Sphere::new(&v(0.0, 0.0, 0.0), 0.03).unwrap();
    let on_kink: [(Obstacle, V); 4] = [
        (Obstacle::new(ball, false), V::zeros()),
        (Obstacle::new(bar, false), V::zeros()),
        (Obstacle::new(capsule, false), V::zeros()),
        (Obstacle::new(capsule, false), axis),
    ];
    for (i, (obstacle, x)) in on_kink.iter().enumerate() {
        let near = nearest(obstacle, x);
        assert!((near.distance + 0.03).abs() < 1e-16 && near.hessian.amax() == 0.0);
        assert!((near.gradient.norm() - 1.0).abs() < 1e-15);
        assert!(i == 0 || near.gradient.dot(&axis).abs() < 1e-15);
        assert_eq!(near, nearest(obstacle, x));
    }
    let cube = Cuboid::new(&V::zeros(), &v(1.0, 1.0, 1.0), &Matrix3::identity()).unwrap();
    let near = nearest(&Obstacle::new(cube, false), &V::zeros());
    assert_eq!((near.distance, near.gradient), (-1.0, V::x()));
}

fn by_function(inside: bool) -> Obstacle {
    let f = |x: &V| -> Result<f64, Fault> { Ok((x - v(0.01, -0.02, 0.03)).norm() - 0.05) };
    Obstacle::new(SignedDistance::new(by_differences(f)), inside)
}

#[test]
fn a_sphere_by_its_function_is_the_sphere() {
    let exact = |x: &V| -> Result<(f64, V), Fault> {
        let from = x - v(0.01, -0.02, 0.03);
        Ok((from.norm() - 0.05, from.normalize()))
    };
    let exact = Obstacle::new(SignedDistance::new(Arc::new(exact)), false);
    let pose = Pose { rotation: so3::exp(&v(0.4, 1.0, -0.7)), translation: v(0.2, -0.1, 0.3) };
    let x = v(0.05, 0.04, 0.06);
    for (f, by_gradient, by_curve) in [(exact, 1e-15, 1e-6), (by_function(false), 1e-9, 1e-3)] {
        for motion in [Pose::identity(), pose] {
            let (f, sphere, x) =
                (f.transform(&motion), sphere().transform(&motion), motion.transform(&x));
            let mut got = Vec::new();
            f.constraints(&x, 0.1, &mut got).unwrap();
            let want = nearest(&sphere, &x);
            assert!((got[0].distance - want.distance).abs() < 1e-15);
            assert!((got[0].gradient - want.gradient).amax() < by_gradient);
            assert!((got[0].hessian - want.hessian).amax() < by_curve * want.hessian.amax());
            // Out of reach nobody asks how it curves.
            got.clear();
            f.constraints(&x, 1e-4, &mut got).unwrap();
            assert_eq!(got[0].hessian.amax(), 0.0);
        }
    }
    assert_eq!(
        nearest(&by_function(true), &x).distance,
        -nearest(&by_function(false), &x).distance
    );
}

#[test]
fn functions_that_fail_say_so() {
    let fail = |bad: fn(&V) -> Result<(f64, V), Fault>| {
        let mut out = Vec::new();
        let obstacle = Obstacle::new(SignedDistance::new(Arc::new(bad)), false);
        let fault = obstacle.constraints(&V::zeros(), 0.1, &mut out).unwrap_err();
        assert!(out.is_empty());
        assert_eq!(fault.to_string(), obstacle.nearest(&V::zeros()).unwrap_err().to_string());
        fault.to_string()
    };
    assert_eq!(fail(|_| Err("no such place".into())), "no such place");
    let text = fail(|_| Ok((f64::NAN, V::x())));
    assert_eq!(text, "f: expected a finite distance [m], got NaN at (0.0, 0.0, 0.0)");
    let text = fail(|_| Ok((0.1, v(0.0, f64::INFINITY, 0.0))));
    assert!(text.starts_with("gradient: expected three finite numbers, got (0.0, inf, 0.0) at"));
}

#[test]
fn misuse_is_named() {
    let zero = V::zeros();
    let nan = v(0.0, f64::NAN, 0.0);
    let ones = v(1.0, 1.0, 1.0);
    let identity = Matrix3::identity();
    let cases = [
        (Sphere::new(&nan, 1.0).map(drop), "center"),
        (Sphere::new(&zero, 0.0).map(drop), "radius"),
        (Sphere::new(&zero, -1.0).map(drop), "radius"),
        (Sphere::new(&zero, f64::INFINITY).map(drop), "radius"),
        (Cylinder::new(&nan, &ones, 1.0).map(drop), "point"),
        (Cylinder::new(&zero, &zero, 1.0).map(drop), "axis"),
        (Cylinder::new(&zero, &ones, f64::NAN).map(drop), "radius"),
        (HalfSpace::new(&nan, &ones).map(drop), "point"),
        (HalfSpace::new(&zero, &zero).map(drop), "normal"),
        (HalfSpace::new(&zero, &nan).map(drop), "normal"),
        (Capsule::new(&nan, &ones, 1.0).map(drop), "a"),
        (Capsule::new(&zero, &nan, 1.0).map(drop), "b"),
        (Capsule::new(&zero, &(1e300 * ones), 1.0).map(drop), "b"),
        (Capsule::new(&zero, &ones, 0.0).map(drop), "radius"),
        (Cuboid::new(&nan, &ones, &identity).map(drop), "center"),
        (Cuboid::new(&zero, &v(1.0, 0.0, 1.0), &identity).map(drop), "half_extents"),
        (Cuboid::new(&zero, &ones, &(2.0 * identity)).map(drop), "rotation"),
        (Cuboid::new(&zero, &ones, &(-identity)).map(drop), "rotation"),
        (Cuboid::new(&zero, &ones, &(f64::NAN * identity)).map(drop), "rotation"),
    ];
    for (i, (result, argument)) in cases.into_iter().enumerate() {
        assert_eq!(result.unwrap_err().argument, argument, "case {i}");
    }
}

#[test]
fn directions_and_rotations_are_made_exact_once() {
    for length in [1e-200, 1e-3, 1.0, 1e200] {
        let axis = HalfSpace::new(&V::zeros(), &(v(1.0, 2.0, 3.0) * length)).unwrap().normal();
        assert!((axis - v(1.0, 2.0, 3.0).normalize()).amax() < 1e-15);
        // What is exact stays as it is: a copy made from it is equal.
        assert_eq!(HalfSpace::new(&V::zeros(), &axis).unwrap().normal(), axis);
    }
    let turn = so3::exp(&v(0.0, PI / 3.0, 1.0)).map(|entry| (entry * 1e10).round() / 1e10);
    let made = Cuboid::new(&V::zeros(), &v(1.0, 1.0, 1.0), &turn).unwrap();
    let exact = made.rotation();
    assert!((exact.transpose() * exact - Matrix3::identity()).amax() < 1e-15);
    assert!((exact - turn).amax() < 1e-9);
    assert_eq!(Cuboid::new(&V::zeros(), &v(1.0, 1.0, 1.0), &exact).unwrap(), made);
}

#[test]
fn equal_obstacles_have_equal_hashes() {
    let hash = |obstacle: &Obstacle| {
        let mut hasher = DefaultHasher::new();
        obstacle.hash(&mut hasher);
        hasher.finish()
    };
    let (all, again) = (closed_forms(), closed_forms());
    for (i, one) in all.iter().enumerate() {
        assert!(*one == again[i] && hash(one) == hash(&again[i]));
        assert!(*one != Obstacle::new(one.volume().clone(), true));
        assert!(all.iter().enumerate().all(|(j, other)| (i == j) == (one == other)));
        assert!(all.iter().enumerate().all(|(j, other)| (i == j) == (hash(one) == hash(other))));
    }
    let f = by_function(false);
    assert!(f == f.clone() && hash(&f) == hash(&f.clone()) && f != by_function(false));
    let signed = Obstacle::new(Sphere::new(&v(0.0, -0.0, 0.0), 1.0).unwrap(), false);
    let plain = Obstacle::new(Sphere::new(&V::zeros(), 1.0).unwrap(), false);
    assert!(signed == plain && hash(&signed) == hash(&plain));
}
