//! A segment bent to a circular arc, and its derivatives.

use nalgebra::{Matrix3, Matrix6x3, Vector2, Vector3};

use super::unit_arc::UnitArc;
use crate::lie::Pose;

/// An arc by its bending vector and its length. The bending vector `kappa * ell * (cos phi, sin phi)`
/// is smooth where the arc is straight, where `phi` is not.
///
/// ```
/// use tdcr::constant_curvature::Arc;
///
/// // A quarter circle of 0.1 m towards azimuth 0 ends pointing along x.
/// let arc = Arc::new(std::f64::consts::FRAC_PI_2 / 0.1, 0.0, 0.1);
/// assert!((arc.frame(1.0).rotation.column(2).x - 1.0).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Central angle towards azimuth 0 and towards azimuth pi/2 \[rad\].
    pub bend: Vector2<f64>,
    /// Length of the centre line \[m\].
    pub length: f64,
}

impl Arc {
    /// From the arc parameters: curvature \[1/m\], azimuth of the bending plane \[rad\], length \[m\].
    #[must_use]
    pub fn new(kappa: f64, phi: f64, length: f64) -> Self {
        let angle = kappa * length;
        Self { bend: Vector2::new(angle * phi.cos(), angle * phi.sin()), length }
    }

    /// Curvature \[1/m\], never negative.
    #[must_use]
    pub fn kappa(&self) -> f64 {
        self.bend.x.hypot(self.bend.y) / self.length
    }

    /// True when its length and the square of its bend are finite: what frames and derivatives need.
    pub(super) fn is_finite(&self) -> bool {
        self.bend.norm_squared().is_finite() && self.length.is_finite()
    }

    /// Azimuth of the bending plane \[rad\] in (-pi, pi]; 0 where the arc is straight.
    #[must_use]
    pub fn phi(&self) -> f64 {
        if self.bend == Vector2::zeros() {
            return 0.0;
        }
        // + 0.0: atan2 of a negative zero would say -pi.
        (self.bend.y + 0.0).atan2(self.bend.x)
    }

    /// Rotation vector from the base to a share of the arc, in the base frame \[rad\].
    #[must_use]
    pub fn rotation(&self, share: f64) -> Vector3<f64> {
        Vector3::new(-self.bend.y * share, self.bend.x * share, 0.0)
    }

    /// Frame at a share of the arc, in the frame of its base:
    /// `Rz(phi) [Ry(kappa s) | p(s)] Rz(-phi)`, finite and smooth where it is straight.
    #[must_use]
    pub fn frame(&self, share: f64) -> Pose {
        UnitArc::new(self.bend * share).frame(self.length * share)
    }

    /// Velocity of the arc's end (translation, then rotation, axes of its base) by the bending vector
    /// and the length \[columns: m and rad per rad, per rad, per m\].
    #[must_use]
    pub fn derivative(&self) -> Matrix6x3<f64> {
        UnitArc::new(self.bend).derivative(self.length)
    }

    /// Derivative of the bending vector and the length by (kappa, phi, length).
    #[must_use]
    pub fn by_parameters(kappa: f64, phi: f64, length: f64) -> Matrix3<f64> {
        let (sin, cos) = phi.sin_cos();
        let angle = kappa * length;
        Matrix3::new(
            length * cos,
            -angle * sin,
            kappa * cos, //
            length * sin,
            angle * cos,
            kappa * sin, //
            0.0,
            0.0,
            1.0,
        )
    }
}
