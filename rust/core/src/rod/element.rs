//! One element: a piece of constant strain, its end and the derivatives of its end.
//!
//! With `W = hat(w)`, `Exp(w) = I + a W + b W²` and `V(w) = I + b W + c W²`, whose coefficients depend on
//! the angle alone. What a force does to the end, contracted, is therefore `g + α w·n + ½ β w·Q w` with a
//! vector `n` and a symmetric matrix `Q` that all tendons share, and its second derivatives take one
//! formula for any number of tendons.

use nalgebra::{Matrix3, Vector3};

use super::settings::Subsegment;
use crate::lie::coefficients::Angle;
use crate::lie::{Pose, so3};

/// A coefficient of the maps and its derivatives: `f`, `f' / t`, `(f' / t)' / t`.
#[derive(Clone, Copy, Debug)]
struct Coefficient(f64, f64, f64);

/// An element at its strain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Element {
    strain: Vector3<f64>,
    /// Stretched \[m\]
    length: f64,
    elongation: f64,
    kind: Subsegment,
    a: Coefficient,
    b: Coefficient,
    c: Coefficient,
    /// Frame of its end in that of its base.
    pub(crate) end: Pose,
    /// Angular velocity of its end by the strain: the left Jacobian.
    pub(crate) spin: Matrix3<f64>,
    /// Velocity of its end's origin by the strain \[m/rad\].
    pub(crate) sweep: Matrix3<f64>,
}

impl Default for Element {
    fn default() -> Self {
        Self::new(Subsegment::Arc, 1.0, Vector3::zeros(), 0.0)
    }
}

impl Element {
    /// An element of a rest length \[m\] that turns by a rotation vector \[rad\] and becomes longer by a
    /// share `elongation`.
    #[inline]
    pub(crate) fn new(
        kind: Subsegment,
        length: f64,
        strain: Vector3<f64>,
        elongation: f64,
    ) -> Self {
        let length = length * (1.0 + elongation);
        let angle = Angle::of(&strain);
        let (a, b, c) = (angle.a(), angle.b(), angle.c());
        let (b1, c1) = (angle.b_slope(), angle.c_slope());
        // a'(t) / t = c - b.
        let a = Coefficient(a, c - b, c1 - b1);
        let b = Coefficient(b, b1, angle.b_bend());
        let c = Coefficient(c, c1, angle.c_bend());
        let rotation = so3::quadratic(&strain, a.0, b.0);
        let spin = so3::quadratic(&strain, b.0, c.0);
        let (translation, sweep) = match kind {
            Subsegment::Arc => (spin.column(2) * length, arc_sweep(&strain, b, c) * length),
            Subsegment::Link => {
                let half = strain * 0.5;
                let turned = so3::exp(&half);
                (
                    turned.column(2) * length,
                    so3::exp_derivative(&half, &Vector3::z()) * (0.5 * length),
                )
            }
        };
        let end = Pose { rotation, translation };
        Self { strain, length, elongation, kind, a, b, c, end, spin, sweep }
    }

    /// Velocity of its end by the elongation \[m\].
    #[inline]
    pub(super) fn stretch(&self) -> Vector3<f64> {
        self.end.translation / (1.0 + self.elongation)
    }

    /// Derivative by the strain of the work of a force on [`Self::stretch`].
    #[inline]
    pub(super) fn stretch_slope(&self, force: &Vector3<f64>) -> Vector3<f64> {
        self.sweep.tr_mul(force) / (1.0 + self.elongation)
    }

    /// Second derivatives by the strain of a moment's work on the rotation of its end, in exponential
    /// coordinates: the symmetric part of the derivative of `spinᵀ moment`.
    pub(super) fn spin_curvature(&self, moment: &Vector3<f64>) -> Matrix3<f64> {
        let w = &self.strain;
        let along = w.dot(moment);
        let bent = w * along - moment * w.norm_squared();
        let rows = (moment.cross(w) * self.b.1 + bent * self.c.1) * w.transpose()
            - moment * w.transpose() * self.c.0;
        (rows + rows.transpose()) * 0.5 + Matrix3::from_diagonal_element(self.c.0 * along)
    }

    /// Second derivatives by the strain of `sum u·(origin + Exp(w) x)` over tendons, given the sums of
    /// `u`, of `x × u` and of `u xᵀ`.
    #[inline]
    pub(super) fn curvature(
        &self,
        force: &Vector3<f64>,
        moment: &Vector3<f64>,
        dyad: &Matrix3<f64>,
    ) -> Matrix3<f64> {
        let turned = second(&self.strain, self.a, self.b, moment, &symmetric(dyad));
        let z = Vector3::z();
        let (moment, dyad) = (z.cross(force), symmetric(&(force * z.transpose())));
        let moved = match self.kind {
            Subsegment::Arc => second(&self.strain, self.b, self.c, &moment, &dyad) * self.length,
            Subsegment::Link => {
                let half = Angle::of(&(self.strain * 0.5));
                let (b, b1, c1) = (half.b(), half.b_slope(), half.c_slope());
                let a = Coefficient(half.a(), half.c() - b, c1 - b1);
                let b = Coefficient(b, b1, half.b_bend());
                second(&(self.strain * 0.5), a, b, &moment, &dyad) * (0.25 * self.length)
            }
        };
        turned + moved
    }
}

/// `M + Mᵀ − 2 tr(M) I`: `½ w·Q w` is then `u·(w × (w × x))` for `M = u xᵀ`.
fn symmetric(dyad: &Matrix3<f64>) -> Matrix3<f64> {
    dyad + dyad.transpose() - Matrix3::from_diagonal_element(2.0 * dyad.trace())
}

/// Derivative of `V(w) z` by `w`.
fn arc_sweep(w: &Vector3<f64>, b: Coefficient, c: Coefficient) -> Matrix3<f64> {
    let z = Vector3::z();
    let once = w.cross(&z);
    let along = once * b.1 + w.cross(&once) * c.1;
    let mut out = along * w.transpose() - so3::hat(&z) * b.0 + (w * z.transpose()) * c.0
        - (z * w.transpose()) * (2.0 * c.0);
    for k in 0..3 {
        out[(k, k)] += c.0 * w.z;
    }
    out
}

/// Second derivatives of `α w·n + ½ β w·Q w`.
fn second(
    w: &Vector3<f64>,
    alpha: Coefficient,
    beta: Coefficient,
    n: &Vector3<f64>,
    q: &Matrix3<f64>,
) -> Matrix3<f64> {
    let (along, bent) = (w.dot(n), q * w);
    let square = 0.5 * w.dot(&bent);
    // The gradients of the coefficients are along w.
    let cross = n * alpha.1 + bent * beta.1 + w * (0.5 * (along * alpha.2 + square * beta.2));
    let mut out = cross * w.transpose() + w * cross.transpose() + q * beta.0;
    let diagonal = along * alpha.1 + square * beta.1;
    for k in 0..3 {
        out[(k, k)] += diagonal;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draws(seed: &mut u64) -> f64 {
        // A small generator is enough for places of a derivative check.
        *seed =
            seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
    }

    fn vector(seed: &mut u64) -> Vector3<f64> {
        Vector3::new(draws(seed), draws(seed), draws(seed))
    }

    #[test]
    fn derivatives_are_those_of_the_end() {
        let mut seed = 1;
        for kind in [Subsegment::Arc, Subsegment::Link] {
            for size in [0.0, 1e-5, 0.3, 2.0] {
                let (strain, u, x) =
                    (vector(&mut seed) * size, vector(&mut seed), vector(&mut seed));
                let at = |w: Vector3<f64>| Element::new(kind, 0.7, w, -0.1);
                let value = |w: Vector3<f64>| u.dot(&at(w).end.transform(&x));
                let slope = |w: Vector3<f64>| {
                    let e = at(w);
                    e.spin.transpose() * (e.end.rotation * x).cross(&u) + e.sweep.transpose() * u
                };
                let stretched = Element::new(kind, 0.7, strain, -0.1 + 1e-5).end.translation;
                let difference = (stretched - at(strain).end.translation) / 1e-5;
                assert!((difference - at(strain).stretch()).amax() < 1e-9, "{kind:?} {size}");
                let hessian = at(strain).curvature(&u, &x.cross(&u), &(u * x.transpose()));
                for k in 0..3 {
                    let step = Vector3::ith(k, 1e-5);
                    let difference = (value(strain + step) - value(strain - step)) / 2e-5;
                    assert!((difference - slope(strain)[k]).abs() < 1e-9, "{kind:?} {size}");
                    let difference = (slope(strain + step) - slope(strain - step)) / 2e-5;
                    assert!((difference - hessian.column(k)).amax() < 1e-9, "{kind:?} {size}");
                }
            }
        }
    }
}
