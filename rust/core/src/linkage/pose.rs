//! The pose of an upper disk against its lower one: a link direction and a rotation.

use nalgebra::{Matrix3, Vector3};

/// A pose of the upper disk: link direction and disk rotation, with what both derivatives need.
///
/// ```
/// use tdcr::linkage::Pose;
///
/// let pose = Pose::from_bend(0.4, 0.0);
/// // The link points at half the bend.
/// assert!((pose.link.x.atan2(pose.link.z) - 0.2).abs() < 1e-15);
/// assert!((pose.rotation_vector().y - 0.4).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    /// Unit vector from the lower to the upper disk centre, in the lower disk's frame.
    pub link: Vector3<f64>,
    /// Unit quaternion `[w, x, y, z]` of the upper disk in the lower disk's frame.
    pub(super) quaternion: [f64; 4],
    /// `R - I`, kept apart so that a small turn keeps its digits.
    pub(super) turn: Matrix3<f64>,
    /// Tangent basis of the sphere at `link`.
    pub(super) basis: [Vector3<f64>; 2],
}

impl Pose {
    /// From a link direction and a rotation vector of the upper disk \[rad\].
    #[must_use]
    pub fn new(link: &Vector3<f64>, rotation: &Vector3<f64>) -> Self {
        let angle = rotation.norm();
        let (sin, cos) = (0.5 * angle).sin_cos();
        let v = if angle > 1e-150 { rotation * (sin / angle) } else { rotation * 0.5 };
        Self::from_parts(link.normalize(), [cos, v.x, v.y, v.z])
    }

    /// The straight subsegment.
    #[must_use]
    pub fn straight() -> Self {
        Self::from_parts(Vector3::z(), [1.0, 0.0, 0.0, 0.0])
    }

    /// Bent by `angle` \[rad\] towards `azimuth` \[rad\] with the link at half the bend.
    #[must_use]
    pub fn from_bend(angle: f64, azimuth: f64) -> Self {
        let (sin, cos) = azimuth.sin_cos();
        Self::from_bend_towards(angle, cos, sin)
    }

    /// Pose bent towards the unit vector `(cos, sin)`.
    #[must_use]
    pub(super) fn from_bend_towards(angle: f64, cos: f64, sin: f64) -> Self {
        let (half_sin, half_cos) = (0.5 * angle).sin_cos();
        Self::from_parts(
            Vector3::new(half_sin * cos, half_sin * sin, half_cos),
            [half_cos, -half_sin * sin, half_sin * cos, 0.0],
        )
    }

    #[inline(always)]
    pub(super) fn from_parts(link: Vector3<f64>, quaternion: [f64; 4]) -> Self {
        let [w, x, y, z] = quaternion;
        let (xx, yy, zz) = (x * x, y * y, z * z);
        let (xy, xz, yz) = (x * y, x * z, y * z);
        let (wx, wy, wz) = (w * x, w * y, w * z);
        let turn = Matrix3::new(
            -2.0 * (yy + zz),
            2.0 * (xy - wz),
            2.0 * (xz + wy), //
            2.0 * (xy + wz),
            -2.0 * (xx + zz),
            2.0 * (yz - wx), //
            2.0 * (xz - wy),
            2.0 * (yz + wx),
            -2.0 * (xx + yy),
        );
        Self { link, quaternion, turn, basis: tangents(&link) }
    }

    /// Rotation matrix of the upper disk in the lower disk's frame.
    #[must_use]
    pub fn rotation(&self) -> Matrix3<f64> {
        self.turn + Matrix3::identity()
    }

    /// Rotation vector of the upper disk in the lower disk's frame \[rad\].
    #[must_use]
    pub fn rotation_vector(&self) -> Vector3<f64> {
        let [w, x, y, z] = self.quaternion;
        let v = if w < 0.0 { -Vector3::new(x, y, z) } else { Vector3::new(x, y, z) };
        let sine = v.norm();
        if sine < 1e-150 {
            return v * 2.0;
        }
        v * (2.0 * sine.atan2(w.abs()) / sine)
    }
}

/// Two unit vectors that complete `n` to a right-handed frame (Duff et al., JCGT 6(1), 2017).
#[inline(always)]
fn tangents(n: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let sign = 1.0_f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [
        Vector3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        Vector3::new(b, sign + n.y * n.y * a, -n.y),
    ]
}
