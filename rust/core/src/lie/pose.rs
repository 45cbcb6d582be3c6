//! A rigid motion as a rotation matrix and a translation.

use nalgebra::{Matrix3, Matrix4, Vector3};

use super::so3;

/// A frame in another frame: `x_outer = rotation * x_inner + translation`.
///
/// A rotation matrix, not a quaternion: chains of frames are composed and applied to points far
/// more often than they are renormalised.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::lie::{Pose, so3};
///
/// let rotation = so3::exp(&Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
/// let frame = Pose { rotation, translation: Vector3::new(1.0, 0.0, 0.0) };
/// assert!((frame.transform(&Vector3::x()) - Vector3::new(1.0, 1.0, 0.0)).norm() < 1e-15);
/// let back = frame.compose(&frame.inverse());
/// assert!(back.translation.norm() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Axes of the inner frame as columns, in the outer frame.
    pub rotation: Matrix3<f64>,
    /// Origin of the inner frame in the outer frame \[m\].
    pub translation: Vector3<f64>,
}

impl Pose {
    /// The frame that coincides with its outer frame.
    #[must_use]
    pub fn identity() -> Self {
        Self { rotation: Matrix3::identity(), translation: Vector3::zeros() }
    }

    /// `self` followed by `inner`: the frame of `inner`, given in `self`, seen from outside.
    #[must_use]
    pub fn compose(&self, inner: &Self) -> Self {
        Self {
            rotation: self.rotation * inner.rotation,
            translation: self.transform(&inner.translation),
        }
    }

    /// A point of the inner frame in outer coordinates.
    #[must_use]
    pub fn transform(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point + self.translation
    }

    /// The outer frame seen from the inner one.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, translation: -(rotation * self.translation) }
    }

    /// A share of the way to another frame, both in one outer frame: the origin evenly along the straight
    /// line, the axes evenly about one axis, as [`so3::log`] has it.
    #[must_use]
    pub fn toward(&self, other: &Self, share: f64) -> Self {
        let turn = so3::log(&self.rotation.tr_mul(&other.rotation)) * share;
        Self {
            rotation: self.rotation * so3::exp(&turn),
            translation: self.translation.lerp(&other.translation, share),
        }
    }

    /// The homogeneous 4x4 matrix.
    #[must_use]
    pub fn to_matrix(&self) -> Matrix4<f64> {
        let mut matrix = Matrix4::identity();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.rotation);
        matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&self.translation);
        matrix
    }

    /// The homogeneous matrix, row by row, as numpy lays it out.
    #[must_use]
    pub fn to_row_major(&self) -> [f64; 16] {
        let (r, t) = (&self.rotation, &self.translation);
        [
            r[(0, 0)],
            r[(0, 1)],
            r[(0, 2)],
            t[0], //
            r[(1, 0)],
            r[(1, 1)],
            r[(1, 2)],
            t[1], //
            r[(2, 0)],
            r[(2, 1)],
            r[(2, 2)],
            t[2], //
            0.0,
            0.0,
            0.0,
            1.0,
        ]
    }
}
