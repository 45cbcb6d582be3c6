//! Rigid motions as twists, and the derivatives of the maps between the two.
//!
//! A twist is `(v, w)`, **translation first**: `v` \[m\] is the velocity of the point at the origin,
//! `w` \[rad\] the angular velocity, for one unit of time. Jacobians and adjoints use the same order.
//! Formulas: J. Solà, J. Deray, D. Atchuthan, "A micro Lie theory for state estimation in robotics",
//! arXiv:1812.01537, appendix D. Its block `Q`, and the accuracy of all this, are in `docs/lie.md`.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::{Pose, so3};

/// The rigid motion of the twist `(v, w)`: rotation `Exp(w)`, translation `V(w) v`
/// (see [`so3::left_jacobian`]).
///
/// ```
/// use nalgebra::{Vector3, Vector6};
/// use tdcr::lie::se3;
///
/// // Half a turn of a circle with radius 1 m, from the origin along +x, turning about +z.
/// let half_turn = std::f64::consts::PI;
/// let end = se3::exp(&Vector6::new(half_turn, 0.0, 0.0, 0.0, 0.0, half_turn));
/// assert!((end.translation - Vector3::new(0.0, 2.0, 0.0)).norm() < 1e-15);
/// ```
#[must_use]
pub fn exp(twist: &Vector6<f64>) -> Pose {
    let (v, w) = split(twist);
    Pose { rotation: so3::exp(&w), translation: so3::left_jacobian(&w) * v }
}

/// The twist `(v, w)` of a rigid motion, with an angle in \[0, π\]; at half a turn the sign of the
/// axis is that of [`so3::log`].
#[must_use]
pub fn log(pose: &Pose) -> Vector6<f64> {
    let w = so3::log(&pose.rotation);
    let v = so3::left_jacobian_inverse(&w) * pose.translation;
    Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
}

/// The matrix that carries a twist from the inner frame to the outer one:
/// `pose Exp(twist) = Exp(adjoint(pose) twist) pose`; blocks `[R, hat(p) R; 0, R]`.
#[must_use]
pub fn adjoint(pose: &Pose) -> Matrix6<f64> {
    let coupling = so3::hat(&pose.translation) * pose.rotation;
    upper_triangular(&pose.rotation, &coupling)
}

/// `J(twist) = ∫₀¹ adjoint(Exp(s twist)) ds`, so that `Exp(twist + d) ≈ Exp(J d) Exp(twist)`; blocks
/// `[V, Q; 0, V]`.
#[must_use]
pub fn left_jacobian(twist: &Vector6<f64>) -> Matrix6<f64> {
    let (v, w) = split(twist);
    let rotational = so3::left_jacobian(&w);
    upper_triangular(&rotational, &coupling(&v, &w, &rotational))
}

/// The inverse of [`left_jacobian`]: the derivative of `log(Exp(d) Exp(twist))` by `d` at `d = 0`;
/// blocks `[V⁻¹, −V⁻¹ Q V⁻¹; 0, V⁻¹]`, for angles below 2π.
#[must_use]
pub fn left_jacobian_inverse(twist: &Vector6<f64>) -> Matrix6<f64> {
    let (v, w) = split(twist);
    let inverse = so3::left_jacobian_inverse(&w);
    let coupling = coupling(&v, &w, &so3::left_jacobian(&w));
    upper_triangular(&inverse, &(-inverse * coupling * inverse))
}

/// The block `Q` of [`left_jacobian`]: `Q = ∂(V(w) v)/∂w + hat(V(w) v) V(w)`.
///
/// A change of `w` by `dw` moves the origin by `∂(V v)/∂w dw`. The left perturbation `(Q dw, V dw)`
/// that does the same moves it by `Q dw + (V dw) × (V v)`. Both agree for this `Q`, which therefore
/// needs no series of its own.
fn coupling(v: &Vector3<f64>, w: &Vector3<f64>, rotational: &Matrix3<f64>) -> Matrix3<f64> {
    so3::left_jacobian_derivative(w, v) + so3::hat(&(rotational * v)) * rotational
}

fn split(twist: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (twist.fixed_rows::<3>(0).into(), twist.fixed_rows::<3>(3).into())
}

fn upper_triangular(diagonal: &Matrix3<f64>, corner: &Matrix3<f64>) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(diagonal);
    matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(corner);
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(diagonal);
    matrix
}
