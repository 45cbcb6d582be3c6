//! Rotations and rigid motions: golden values, differences, identities.
#![allow(clippy::expect_used, reason = "a test may stop where its data is broken")]
#![allow(clippy::float_cmp, reason = "some results must be exact")]

use std::collections::BTreeMap;
use std::f64::consts::PI;

use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3, Vector6};
use proptest::prelude::*;
use tdcr::lie::{Pose, se3, so3};

const GOLDEN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/lie.json");
/// What the rooms promise, for results of order one or relative to larger ones.
const TOLERANCE: f64 = 1e-14;
/// Angles below which no entry of a generic result is a difference of larger ones, so that every
/// single entry, 1e-300 or not, must be right to `TOLERANCE` of itself.
const TINY: f64 = 1e-3;

fn numbers(value: &serde_json::Value) -> Vec<f64> {
    let text = value.as_str().expect("a string of numbers");
    text.split(' ').map(|number| number.parse().expect("a number")).collect()
}

fn matrix<const R: usize, const C: usize>(
    case: &serde_json::Value,
    key: &str,
) -> SMatrix<f64, R, C> {
    SMatrix::from_row_slice(&numbers(&case[key]))
}

fn golden() -> (Vector3<f64>, Vec<serde_json::Value>) {
    let text = std::fs::read_to_string(GOLDEN).expect("tests/data/lie.json");
    let data: serde_json::Value = serde_json::from_str(&text).expect("valid JSON");
    (matrix(&data, "x"), data["cases"].as_array().expect("a list of cases").clone())
}

/// The largest error, absolute up to 1 and relative to the largest entry beyond.
fn error<const R: usize, const C: usize>(
    got: &SMatrix<f64, R, C>,
    want: &SMatrix<f64, R, C>,
) -> f64 {
    let worst = (got - want).amax() / want.amax().max(1.0);
    if worst.is_nan() { f64::INFINITY } else { worst }
}

/// The largest error of an entry relative to that entry; a zero must be met exactly.
fn entry_error<const R: usize, const C: usize>(
    got: &SMatrix<f64, R, C>,
    want: &SMatrix<f64, R, C>,
) -> f64 {
    let pairs = got.iter().zip(want.iter());
    pairs
        .filter(|(got, want)| got != want)
        .map(|(got, want)| ((got - want) / want).abs())
        .map(|error| if error.is_nan() { f64::INFINITY } else { error })
        .fold(0.0, f64::max)
}

/// The worst error of every quantity; shown by `cargo test lie -- --nocapture`.
#[derive(Default)]
struct Worst(BTreeMap<String, f64>);

impl Worst {
    fn note(&mut self, name: &str, error: f64) {
        let worst = self.0.entry(name.to_owned()).or_insert(0.0);
        *worst = worst.max(error);
    }

    fn compare<const R: usize, const C: usize>(
        &mut self,
        case: &serde_json::Value,
        key: &str,
        got: &SMatrix<f64, R, C>,
    ) {
        let want = matrix::<R, C>(case, key);
        self.note(key, error(got, &want));
        if matrix::<3, 1>(case, "w").norm() < TINY {
            self.note(&format!("{key}, entrywise, tiny"), entry_error(got, &want));
        }
    }

    fn check(&self) {
        for (name, error) in &self.0 {
            println!("{name}: {error:.1e}");
        }
        let bad: Vec<_> = self.0.iter().filter(|(_, error)| **error > TOLERANCE).collect();
        assert!(bad.is_empty(), "above {TOLERANCE:e}: {bad:?}");
    }
}

#[test]
fn rotations_agree_with_50_digit_series() {
    let (x, cases) = golden();
    let mut worst = Worst::default();
    for case in &cases {
        let w: Vector3<f64> = matrix(case, "w");
        worst.compare(case, "exp", &so3::exp(&w));
        worst.compare(case, "left_jacobian", &so3::left_jacobian(&w));
        worst.compare(case, "left_jacobian_inverse", &so3::left_jacobian_inverse(&w));
        worst.compare(case, "exp_derivative", &so3::exp_derivative(&w, &x));
        worst.compare(case, "left_jacobian_derivative", &so3::left_jacobian_derivative(&w, &x));
        worst.compare(
            case,
            "left_jacobian_inverse_derivative",
            &so3::left_jacobian_inverse_derivative(&w, &x),
        );
    }
    worst.check();
}

/// The oracle is the logarithm of the very matrix given, rounded entries and all, so the tolerance
/// needs no room for the conditioning of the input. Nearer to half a turn than rounding can tell,
/// either sign of the axis is right.
#[test]
fn logarithms_agree_with_50_digits() {
    let (_, cases) = golden();
    let mut worst = Worst::default();
    let mut seen = 0;
    for case in cases.iter().filter(|case| case.get("log").is_some()) {
        let w: Vector3<f64> = matrix(case, "w");
        let want: Vector3<f64> = matrix(case, "log");
        let rotation: Matrix3<f64> = matrix(case, "exp");
        let mut got = so3::log(&rotation);
        assert!(got.norm() <= PI * (1.0 + 4.0 * f64::EPSILON));
        if w.norm() > PI - 1e-14 && got.dot(&want) < 0.0 {
            got = -got;
        }
        worst.note("log", error(&got, &want));
        // The rounding of the nine entries moves the logarithm by less than 1e-15 itself.
        let mut back = so3::log(&so3::exp(&w));
        if w.norm() > PI - 1e-14 && back.dot(&w) < 0.0 {
            back = -back;
        }
        worst.note("log(exp)", error(&back, &w));
        if w.norm() < TINY {
            worst.note("log, entrywise, tiny", entry_error(&got, &want));
            worst.note("log(exp), entrywise, tiny", entry_error(&back, &w));
        }
        let derivative: Matrix3<f64> = matrix(case, "left_jacobian_inverse");
        if w.norm() < PI - 1e-14 {
            worst.note("log_derivative", error(&so3::log_derivative(&rotation), &derivative));
        }
        seen += 1;
    }
    assert!(seen > 80);
    worst.check();
}

#[test]
fn rigid_motions_agree_with_50_digit_series() {
    let (x, cases) = golden();
    let mut worst = Worst::default();
    for case in &cases {
        let w: Vector3<f64> = matrix(case, "w");
        let twist = Vector6::new(x.x, x.y, x.z, w.x, w.y, w.z);
        let pose = se3::exp(&twist);
        assert_eq!(pose.rotation, so3::exp(&w));
        worst.compare(case, "translation", &pose.translation);
        let (jacobian, inverse) = (se3::left_jacobian(&twist), se3::left_jacobian_inverse(&twist));
        worst.compare(case, "coupling", &corner(&jacobian));
        worst.compare(case, "coupling_inverse", &corner(&inverse));
        for (block, want) in
            [(jacobian, so3::left_jacobian(&w)), (inverse, so3::left_jacobian_inverse(&w))]
        {
            assert_eq!(block.fixed_view::<3, 3>(0, 0), want);
            assert_eq!(block.fixed_view::<3, 3>(3, 3), want);
            assert_eq!(block.fixed_view::<3, 3>(3, 0), Matrix3::zeros());
        }
        if w.norm() < PI - 1e-14 {
            worst.note("log(exp)", error(&se3::log(&pose), &twist));
        }
    }
    worst.check();
}

fn corner(jacobian: &Matrix6<f64>) -> Matrix3<f64> {
    jacobian.fixed_view::<3, 3>(0, 3).into()
}

/// Angles no square can hold, and the smallest numbers there are, come back as they went in.
#[test]
fn the_smallest_rotations_survive() {
    for size in [f64::MIN_POSITIVE, 1e-308, 1e-200, 1e-163, 1e-162, 1e-161, 1e-154, 1e-20] {
        for w in [Vector3::new(size, -2.0 * size, 0.5 * size), Vector3::y() * size] {
            assert!(entry_error(&so3::log(&so3::exp(&w)), &w) < 1e-15, "{w}");
        }
    }
    assert_eq!(so3::log(&Matrix3::identity()), Vector3::zeros());
    assert_eq!(so3::exp(&Vector3::zeros()), Matrix3::identity());
}

/// Exactly symmetric matrices have two logarithms; the largest component decides.
#[test]
fn half_turns_have_the_documented_sign() {
    let half_turn = |axis: Vector3<f64>| 2.0 * axis * axis.transpose() - Matrix3::identity();
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        assert_eq!(so3::log(&half_turn(axis)), PI * axis);
        assert_eq!(so3::log(&half_turn(-axis)), PI * axis);
    }
    let axis = Vector3::new(0.48, -0.64, 0.6);
    assert!((so3::log(&half_turn(axis)) + PI * axis).amax() < 1e-14);
}

#[test]
fn nan_gives_nan_and_nothing_worse() {
    let nan = Vector3::new(f64::NAN, 0.0, 0.0);
    assert!(so3::exp(&nan).iter().all(|entry| entry.is_nan()));
    assert!(so3::log(&Matrix3::from_element(f64::NAN)).iter().all(|w| w.is_nan()));
}

#[test]
fn hat_and_vee_undo_each_other() {
    let (v, x) = (Vector3::new(0.5, -0.75, 3.0), Vector3::new(2.0, 0.25, -1.0));
    assert_eq!(so3::vee(&so3::hat(&v)), v);
    assert_eq!(so3::hat(&v) * x, v.cross(&x));
    let symmetric = Matrix3::new(1.0, 2.0, 3.0, 2.0, 4.0, 5.0, 3.0, 5.0, 6.0);
    assert_eq!(so3::vee(&(symmetric + so3::hat(&v))), v);
}

/// Central differences of a vector function of N numbers; with this step good to about 1e-10.
fn differences<const R: usize, const N: usize>(
    f: impl Fn(&SMatrix<f64, N, 1>) -> SMatrix<f64, R, 1>,
    at: &SMatrix<f64, N, 1>,
) -> SMatrix<f64, R, N> {
    const STEP: f64 = 1e-5;
    let mut jacobian = SMatrix::<f64, R, N>::zeros();
    for i in 0..N {
        let (mut above, mut below) = (*at, *at);
        above[i] += STEP;
        below[i] -= STEP;
        jacobian.set_column(i, &((f(&above) - f(&below)) / (above[i] - below[i])));
    }
    jacobian
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-size..size).prop_map(Vector3::from)
}

/// Rotation vectors of every angle up to `limit`, small ones as often as large ones.
fn rotation_vector(limit: f64) -> impl Strategy<Value = Vector3<f64>> {
    let angle = prop_oneof![0.0..limit, (-12.0..0.0_f64).prop_map(|power| 10_f64.powf(power))];
    (angle, vector(1.0))
        .prop_filter("needs a direction", |(_, axis)| axis.norm() > 0.1)
        .prop_map(|(angle, axis)| angle * axis.normalize())
}

fn twist(limit: f64) -> impl Strategy<Value = Vector6<f64>> {
    (vector(1.0), rotation_vector(limit))
        .prop_map(|(v, w)| Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn derivatives_agree_with_differences(w in rotation_vector(5.0), x in vector(2.0)) {
        let pairs = [
            (so3::exp_derivative(&w, &x), differences(|w| so3::exp(w) * x, &w)),
            (so3::left_jacobian_derivative(&w, &x), differences(|w| so3::left_jacobian(w) * x, &w)),
            (
                so3::left_jacobian_inverse_derivative(&w, &x),
                differences(|w| so3::left_jacobian_inverse(w) * x, &w),
            ),
        ];
        for (got, want) in pairs {
            prop_assert!(error(&got, &want) < 1e-8, "{got} {want}");
        }
    }

    #[test]
    fn logarithm_derivatives_agree_with_differences(twist in twist(3.1)) {
        let pose = se3::exp(&twist);
        let zero = Vector6::zeros();
        let want = differences(|d| se3::log(&se3::exp(d).compose(&pose)), &zero);
        prop_assert!(error(&se3::left_jacobian_inverse(&twist), &want) < 1e-8);
        let got = so3::log_derivative(&pose.rotation);
        let want = differences(|d| so3::log(&(so3::exp(d) * pose.rotation)), &Vector3::zeros());
        prop_assert!(error(&got, &want) < 1e-8);
    }

    #[test]
    fn left_jacobian_is_the_derivative_of_exp(twist in twist(6.0)) {
        let back = se3::exp(&twist).inverse();
        let want = differences(|t| se3::log(&se3::exp(t).compose(&back)), &twist);
        prop_assert!(error(&se3::left_jacobian(&twist), &want) < 1e-8);
    }

    #[test]
    fn exponentials_and_logarithms_undo_each_other(twist in twist(PI)) {
        let pose = se3::exp(&twist);
        let rotation = pose.rotation;
        prop_assert!((rotation * rotation.transpose() - Matrix3::identity()).amax() < 4e-15);
        prop_assert!(error(&se3::log(&pose), &twist) < TOLERANCE);
        let again = se3::exp(&se3::log(&pose));
        prop_assert!((again.to_matrix() - pose.to_matrix()).amax() < TOLERANCE);
    }

    #[test]
    fn large_angles_are_taken_modulo_a_turn(w in rotation_vector(50.0)) {
        let (rotation, w_short) = (so3::exp(&w), so3::log(&so3::exp(&w)));
        prop_assert!(w_short.norm() <= PI * (1.0 + 4.0 * f64::EPSILON));
        prop_assert!((so3::exp(&w_short) - rotation).amax() < TOLERANCE);
    }

    #[test]
    fn rotations_about_one_axis_add_up(w in rotation_vector(1.0), a in -3.0..3.0, b in -3.0..3.0) {
        let product = so3::exp(&(a * w)) * so3::exp(&(b * w));
        prop_assert!((product - so3::exp(&((a + b) * w))).amax() < 4e-15);
    }

    #[test]
    fn left_jacobian_keeps_the_axis_and_has_its_inverse(twist in twist(5.5)) {
        let w: Vector3<f64> = twist.fixed_rows::<3>(3).into();
        prop_assert!((so3::left_jacobian(&w) * w - w).norm() < 1e-15 * (1.0 + 4.0 * w.norm()));
        let product = so3::left_jacobian(&w) * so3::left_jacobian_inverse(&w);
        prop_assert!((product - Matrix3::identity()).amax() < TOLERANCE);
        // Exp(w) = I + W V(w): an identity between coefficients evaluated in different ways.
        let rotation = Matrix3::identity() + so3::hat(&w) * so3::left_jacobian(&w);
        prop_assert!((rotation - so3::exp(&w)).amax() < TOLERANCE);
        let product = se3::left_jacobian(&twist) * se3::left_jacobian_inverse(&twist);
        prop_assert!((product - Matrix6::identity()).amax() < 4.0 * TOLERANCE);
    }

    #[test]
    fn adjoint_moves_twists_through_poses(pose in twist(PI), other in twist(PI), inner in twist(1.0)) {
        let (pose, other) = (se3::exp(&pose), se3::exp(&other));
        let adjoint = se3::adjoint(&pose);
        let left = pose.compose(&se3::exp(&inner));
        let right = se3::exp(&(adjoint * inner)).compose(&pose);
        prop_assert!((left.to_matrix() - right.to_matrix()).amax() < 5.0 * TOLERANCE);
        let both = se3::adjoint(&pose.compose(&other));
        prop_assert!((both - adjoint * se3::adjoint(&other)).amax() < TOLERANCE);
        prop_assert!((se3::adjoint(&pose.inverse()) * adjoint - Matrix6::identity()).amax() < TOLERANCE);
    }

    #[test]
    fn a_twist_without_translation_is_a_rotation(w in rotation_vector(PI)) {
        let twist = Vector6::new(0.0, 0.0, 0.0, w.x, w.y, w.z);
        let pose = se3::exp(&twist);
        prop_assert_eq!(pose, Pose { rotation: so3::exp(&w), translation: Vector3::zeros() });
        prop_assert_eq!(corner(&se3::left_jacobian(&twist)), Matrix3::zeros());
        let logarithm: Vector3<f64> = se3::log(&pose).fixed_rows::<3>(3).into();
        prop_assert_eq!(logarithm, so3::log(&pose.rotation));
    }
}
