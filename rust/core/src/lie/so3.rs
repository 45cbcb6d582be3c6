//! Rotations as rotation vectors, and the derivatives of the maps between the two.
//!
//! A rotation vector `w` \[rad\] points along the axis of the rotation and is as long as its angle
//! `t`. With `W = hat(w)`, every map here is a polynomial in `W` whose coefficients are smooth
//! functions of `t`; [`exp`] is Rodrigues' formula. Formulas: J. Solà, J. Deray, D. Atchuthan, "A
//! micro Lie theory for state estimation in robotics", arXiv:1812.01537, section IV and appendix B,
//! where [`left_jacobian`] is called the left Jacobian of SO(3). How the coefficients are evaluated,
//! and how accurate they are, is in `docs/lie.md`.

use nalgebra::{Matrix3, Vector3};

use super::coefficients::Angle;

/// The matrix of the cross product: `hat(v) * x = v × x`.
#[must_use]
pub fn hat(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(
        0.0, -v.z, v.y, //
        v.z, 0.0, -v.x, //
        -v.y, v.x, 0.0,
    )
}

/// The vector of the skew-symmetric part of `m`; undoes [`hat`].
#[must_use]
pub fn vee(m: &Matrix3<f64>) -> Vector3<f64> {
    0.5 * twice_vee(m)
}

/// The rotation matrix of the rotation vector `w` \[rad\]:
/// `Exp(w) = I + (sin t / t) W + ((1 − cos t) / t²) W²`.
///
/// Any angle, with an error of about 1e-16 `t` beyond one turn; a component that is NaN, infinite or
/// too large to square gives NaN.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::lie::so3;
///
/// let quarter_turn = so3::exp(&Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
/// assert!((quarter_turn * Vector3::x() - Vector3::y()).norm() < 1e-15);
/// ```
#[must_use]
pub fn exp(w: &Vector3<f64>) -> Matrix3<f64> {
    let angle = Angle::of(w);
    quadratic(w, angle.a(), angle.b())
}

/// The rotation vector \[rad\] of a rotation matrix; its norm is in \[0, π\] (to rounding).
///
/// Accurate for every angle: the rotation matrix is read as a quaternion through its largest
/// component (S. W. Shepperd, J. Guidance and Control 1(3), 1978, doi:10.2514/3.55767b), so nothing
/// is divided by a small number near 0 or π. Half a turn has two rotation vectors: when the matrix
/// is exactly symmetric, the answer is the one whose largest component is positive (the first one
/// when several are equally large). A matrix that is off a rotation by rounding gives a rotation
/// vector off by as much.
#[must_use]
pub fn log(rotation: &Matrix3<f64>) -> Vector3<f64> {
    let (scalar, vector) = quaternion(rotation);
    let norm = vector.norm();
    // Below 1e-162 the squared norm underflows: there atan(norm / scalar) is norm / scalar.
    let per_norm = if norm > 0.0 { norm.atan2(scalar) / norm } else { 1.0 / scalar };
    2.0 * per_norm * vector
}

/// The derivative of `Log(Exp(d) rotation)` by `d` at `d = 0`: `V⁻¹(Log(rotation))`.
///
/// `d` is a small rotation in the outer frame. Half a turn is where [`log`] jumps; the derivative
/// there is that of the branch [`log`] returns.
#[must_use]
pub fn log_derivative(rotation: &Matrix3<f64>) -> Matrix3<f64> {
    left_jacobian_inverse(&log(rotation))
}

/// `V(w) = ∫₀¹ Exp(s w) ds = I + ((1 − cos t) / t²) W + ((t − sin t) / t³) W²`.
///
/// Two readings: `V(w) u` is where a curve ends that starts along `u` and turns evenly by `w`; and
/// `Exp(w + dw) ≈ Exp(V(w) dw) Exp(w)`.
#[must_use]
pub fn left_jacobian(w: &Vector3<f64>) -> Matrix3<f64> {
    let angle = Angle::of(w);
    quadratic(w, angle.b(), angle.c())
}

/// `V⁻¹(w) = I − W / 2 + ((1 − (t/2) cot(t/2)) / t²) W²`, for angles below 2π, where `V` is singular.
#[must_use]
pub fn left_jacobian_inverse(w: &Vector3<f64>) -> Matrix3<f64> {
    quadratic(w, -0.5, Angle::of(w).d())
}

/// The derivative of `Exp(w) x` by `w` (row: component of the result, column: component of `w`):
/// `−hat(Exp(w) x) V(w)`, in units of `x` per rad.
#[must_use]
pub fn exp_derivative(w: &Vector3<f64>, x: &Vector3<f64>) -> Matrix3<f64> {
    let angle = Angle::of(w);
    let rotated = quadratic(w, angle.a(), angle.b()) * x;
    -hat(&rotated) * quadratic(w, angle.b(), angle.c())
}

/// The derivative of `V(w) x` by `w` (row: component of the result, column: component of `w`), in
/// units of `x` per rad.
#[must_use]
pub fn left_jacobian_derivative(w: &Vector3<f64>, x: &Vector3<f64>) -> Matrix3<f64> {
    let angle = Angle::of(w);
    let once = w.cross(x);
    let along_w = angle.b_slope() * once + angle.c_slope() * w.cross(&once);
    along_w * w.transpose() - angle.b() * hat(x) + angle.c() * double_cross_derivative(w, x)
}

/// The derivative of `V⁻¹(w) x` by `w` (row: component of the result, column: component of `w`), in
/// units of `x` per rad, for angles below 2π.
#[must_use]
pub fn left_jacobian_inverse_derivative(w: &Vector3<f64>, x: &Vector3<f64>) -> Matrix3<f64> {
    let angle = Angle::of(w);
    let along_w = angle.d_slope() * w.cross(&w.cross(x));
    along_w * w.transpose() + 0.5 * hat(x) + angle.d() * double_cross_derivative(w, x)
}

/// `I + linear W + square W²`.
///
/// Written out so that the diagonal is `1 − square (y² + z²)`: a rotation about a coordinate axis
/// then leaves that axis exactly alone.
#[rustfmt::skip] // the matrix looks like one
pub(crate) fn quadratic(w: &Vector3<f64>, linear: f64, square: f64) -> Matrix3<f64> {
    let (xx, yy, zz) = (w.x * w.x, w.y * w.y, w.z * w.z);
    let (xy, yz, zx) = (square * w.x * w.y, square * w.y * w.z, square * w.z * w.x);
    let turn = linear * w;
    Matrix3::new(
        1.0 - square * (yy + zz), xy - turn.z, zx + turn.y, //
        xy + turn.z, 1.0 - square * (zz + xx), yz - turn.x, //
        zx - turn.y, yz + turn.x, 1.0 - square * (xx + yy),
    )
}

/// The derivative of `w × (w × x) = w (w·x) − x (w·w)` by `w`.
fn double_cross_derivative(w: &Vector3<f64>, x: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_diagonal_element(w.dot(x)) + w * x.transpose() - 2.0 * x * w.transpose()
}

fn twice_vee(m: &Matrix3<f64>) -> Vector3<f64> {
    Vector3::new(m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)])
}

/// The quaternion of a rotation matrix, scalar part not negative.
///
/// The squares of the four components, times four, add up to 4 for any matrix, so the largest is at
/// least 1: the root is real and the division safe.
fn quaternion(r: &Matrix3<f64>) -> (f64, Vector3<f64>) {
    let skew = twice_vee(r);
    let trace = r.trace();
    let i = r.diagonal().imax();
    if trace >= r[(i, i)] {
        let scalar = 0.5 * (1.0 + trace).sqrt();
        return (scalar, skew / (4.0 * scalar));
    }
    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
    let largest = 0.5 * (1.0 + r[(i, i)] - r[(j, j)] - r[(k, k)]).sqrt();
    let per_largest = 0.25 / largest;
    let mut vector = Vector3::zeros();
    vector[i] = largest;
    vector[j] = per_largest * (r[(i, j)] + r[(j, i)]);
    vector[k] = per_largest * (r[(i, k)] + r[(k, i)]);
    let scalar = per_largest * skew[i];
    // q and −q are the same rotation; the one with the positive scalar part turns by at most π.
    if scalar < 0.0 { (-scalar, -vector) } else { (scalar, vector) }
}
