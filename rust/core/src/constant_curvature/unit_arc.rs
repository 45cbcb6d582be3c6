//! An arc of unit length as a function of its bending vector, with first and second derivatives.
//!
//! The rotation vector `w = (-y, x, 0)` lies in the base plane, which leaves few terms of the general maps
//! of `lie::so3`: with `a = sin t / t`, `b = (1 - cos t) / t²`, `c = (t - sin t) / t³` at the angle
//! `t = |(x, y)|`, the arc ends at `(x b, y b, a)`.

use nalgebra::{Matrix3, Matrix6x3, Vector2, Vector3};

use crate::lie::Pose;
use crate::lie::coefficients::Angle;

/// The arc and the coefficients that everything else is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UnitArc {
    x: f64,
    y: f64,
    a: f64,
    b: f64,
    c: f64,
    /// `b'(t) / t`.
    b_slope: f64,
}

/// Second derivatives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SecondDerivatives {
    /// Second derivatives of the end: by x twice, by x and y, by y twice.
    pub(crate) end: [Vector3<f64>; 3],
    /// `turned[i][j]`: derivative of the i-th angular velocity by the j-th component.
    pub(crate) turned: [[Vector3<f64>; 2]; 2],
}

impl UnitArc {
    #[inline(always)]
    pub(crate) fn new(bend: Vector2<f64>) -> Self {
        let angle = Angle::of_square(bend.norm_squared());
        Self {
            x: bend.x,
            y: bend.y,
            a: angle.a(),
            b: angle.b(),
            c: angle.c(),
            b_slope: angle.b_slope(),
        }
    }

    /// Rotation of the end.
    #[inline(always)]
    #[rustfmt::skip] // the matrix looks like one
    pub(crate) fn rotation(&self) -> Matrix3<f64> {
        let Self { x, y, a, b, .. } = *self;
        Matrix3::new(
            1.0 - b * x * x, -b * x * y, a * x,
            -b * x * y, 1.0 - b * y * y, a * y,
            -a * x, -a * y, 1.0 - b * (x * x + y * y),
        )
    }

    /// Place of the end.
    #[inline(always)]
    pub(crate) fn end(&self) -> Vector3<f64> {
        Vector3::new(self.x * self.b, self.y * self.b, self.a)
    }

    /// Frame of the end of an arc of this length.
    #[inline(always)]
    pub(crate) fn frame(&self, length: f64) -> Pose {
        Pose { rotation: self.rotation(), translation: self.end() * length }
    }

    /// Velocity of the end of an arc of this length (translation, then rotation, base axes) by x, by y
    /// and by the length.
    pub(crate) fn derivative(&self, length: f64) -> Matrix6x3<f64> {
        let mut out = Matrix6x3::zeros();
        for (j, (moved, turned)) in
            self.end_derivatives().iter().zip(self.rotation_derivatives()).enumerate()
        {
            out.fixed_view_mut::<3, 1>(0, j).copy_from(&(moved * length));
            out.fixed_view_mut::<3, 1>(3, j).copy_from(&turned);
        }
        out.fixed_view_mut::<3, 1>(0, 2).copy_from(&self.end());
        out
    }

    /// Derivatives of the end by x and by y.
    #[inline(always)]
    pub(crate) fn end_derivatives(&self) -> [Vector3<f64>; 2] {
        let Self { x, y, b, c, b_slope, .. } = *self;
        // a'(t) / t = c - b.
        let (cross, a_slope) = (x * y * b_slope, c - b);
        [
            Vector3::new(b + x * x * b_slope, cross, x * a_slope),
            Vector3::new(cross, b + y * y * b_slope, y * a_slope),
        ]
    }

    /// Angular velocities of the end, base axes, by x and by y: the columns of the left Jacobian.
    #[inline(always)]
    pub(crate) fn rotation_derivatives(&self) -> [Vector3<f64>; 2] {
        let Self { x, y, b, c, .. } = *self;
        [
            Vector3::new(-c * x * y, 1.0 - c * y * y, -b * y),
            Vector3::new(c * x * x - 1.0, c * x * y, b * x),
        ]
    }

    /// Second derivatives.
    #[rustfmt::skip] // the vectors are read side by side
    pub(crate) fn second(&self) -> SecondDerivatives {
        let Self { x, y, b, c, b_slope: b1, .. } = *self;
        let angle = Angle::of_square(x * x + y * y);
        let (b2, c1) = (angle.b_bend(), angle.c_slope());
        let (a1, a2) = (c - b, c1 - b1);
        SecondDerivatives {
            end: [
                Vector3::new(x * (3.0 * b1 + x * x * b2), y * (b1 + x * x * b2), a1 + x * x * a2),
                Vector3::new(y * (b1 + x * x * b2), x * (b1 + y * y * b2), x * y * a2),
                Vector3::new(x * (b1 + y * y * b2), y * (3.0 * b1 + y * y * b2), a1 + y * y * a2),
            ],
            turned: [
                [
                    Vector3::new(-y * (c + x * x * c1), -x * y * y * c1, -x * y * b1),
                    Vector3::new(-x * (c + y * y * c1), -y * (2.0 * c + y * y * c1), -b - y * y * b1),
                ],
                [
                    Vector3::new(x * (2.0 * c + x * x * c1), y * (c + x * x * c1), b + x * x * b1),
                    Vector3::new(x * x * y * c1, x * (c + y * y * c1), x * y * b1),
                ],
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Straight, tiny, around both switches of the series, beyond a turn; in any direction.
    #[test]
    fn second_derivatives_agree_with_differences() {
        let h = 1e-5;
        for angle in [0.0, 1e-9, 1e-3, 0.4999, 0.5001, 1.0, 3.0, 3.4999, 3.5001, 5.0, 6.2, 9.0] {
            for k in 0..12 {
                let (sin, cos) = (0.1 + 0.55 * f64::from(k)).sin_cos();
                let bend = Vector2::new(angle * cos, angle * sin);
                let second = UnitArc::new(bend).second();
                for j in 0..2 {
                    let mut step = Vector2::zeros();
                    step[j] = h;
                    let (up, down) = (UnitArc::new(bend + step), UnitArc::new(bend - step));
                    for i in 0..2 {
                        let moved =
                            (up.end_derivatives()[i] - down.end_derivatives()[i]) / (2.0 * h);
                        let turned = (up.rotation_derivatives()[i]
                            - down.rotation_derivatives()[i])
                            / (2.0 * h);
                        assert!((second.end[i + j] - moved).amax() < 1e-9, "{angle} {k}");
                        assert!((second.turned[i][j] - turned).amax() < 1e-9, "{angle} {k}");
                    }
                }
            }
        }
    }
}
