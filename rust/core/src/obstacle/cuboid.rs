//! A box with any axes: six faces, twelve edges, eight vertices, in closed form.

use std::hash::Hasher;

use nalgebra::{Matrix3, Vector3};

use super::{Fault, Near, Solid, move_pose, tightest_first, within};
use crate::error::{self, InvalidInput, finite_vector, length};
use crate::hashing::Bits;
use crate::lie::Pose;

/// A box with any axes.
///
/// ```
/// use nalgebra::{Matrix3, Vector3};
/// use tdcr::obstacle::{Cuboid, Obstacle};
///
/// let half = Vector3::new(0.02, 0.02, 0.05);
/// let block = Cuboid::new(&Vector3::zeros(), &half, &Matrix3::identity()).unwrap();
/// let near = Obstacle::new(block, false).nearest(&Vector3::new(0.05, 0.0, 0.0)).unwrap();
/// assert!((near.distance - 0.03).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    /// The frame of its centre, axes along its edges.
    pose: Pose,
    half_extents: Vector3<f64>,
}

impl Cuboid {
    /// From its centre \[m\], half its lengths \[m\] and its axes as columns.
    ///
    /// # Errors
    /// `InvalidInput` naming `center`, `half_extents` or `rotation`: not finite, not a length, no rotation.
    pub fn new(
        center: &Vector3<f64>,
        half_extents: &Vector3<f64>,
        rotation: &Matrix3<f64>,
    ) -> Result<Self, InvalidInput> {
        let translation = finite_vector("center", "m", center)?;
        for half in half_extents {
            length("half_extents", *half)?;
        }
        let mut rotation = *rotation;
        let error = error::rotation("rotation", "a rotation matrix", &rotation)?;
        if error > 4.0 * f64::EPSILON {
            // Newton's step to the nearest rotation: an error of 1e-9 squares to nothing.
            rotation *= (Matrix3::identity() * 3.0 - rotation.transpose() * rotation) / 2.0;
        }
        let pose = Pose { rotation: rotation.map(|entry| entry + 0.0), translation };
        Ok(Self { pose, half_extents: *half_extents })
    }

    /// Its centre \[m\].
    #[must_use]
    pub fn center(&self) -> Vector3<f64> {
        self.pose.translation
    }

    /// Half its lengths \[m\].
    #[must_use]
    pub fn half_extents(&self) -> Vector3<f64> {
        self.half_extents
    }

    /// Its axes as columns.
    #[must_use]
    pub fn rotation(&self) -> Matrix3<f64> {
        self.pose.rotation
    }

    fn local(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.pose.rotation.tr_mul(&(x - self.pose.translation))
    }

    /// Before a face outwards along ± an axis: the distance from its plane, on either side.
    fn face(&self, x: &Vector3<f64>, axis: usize, sign: f64) -> Near {
        let normal = self.pose.rotation.column(axis) * sign;
        let step = if sign > 0.0 { 1 } else { -1 };
        let mut side = [0; 3];
        side[axis] = step;
        Near::flat(sign * x[axis] - self.half_extents[axis], normal).of(code(side))
    }

    /// Inside, the nearest face; of equally near ones the first axis, and its positive side.
    fn nearest(&self, x: &Vector3<f64>) -> Near {
        let x = self.local(x);
        let mut side = [0; 3];
        let mut from = Vector3::zeros();
        let mut across = Matrix3::zeros();
        for i in 0..3 {
            let beyond = x[i].abs() - self.half_extents[i];
            if beyond > 0.0 {
                side[i] = if x[i] > 0.0 { 1 } else { -1 };
                from[i] = beyond.copysign(x[i]);
                across[(i, i)] = 1.0;
            }
        }
        let beyond = [0, 1, 2].map(|i| x[i].abs() - self.half_extents[i]);
        let nearest = usize::from(beyond[1] > beyond[0]);
        let nearest = if beyond[2] > beyond[nearest] { 2 } else { nearest };
        let sign = if x[nearest] < 0.0 { -1.0 } else { 1.0 };
        let clear = side.iter().filter(|s| **s != 0).count();
        // Hypotenuses so short that their squares vanish have no direction: the face's will do.
        if clear < 2 || from.norm() < super::KINK {
            return self.face(&x, nearest, sign);
        }
        Near::round(&from, &across, 0.0, from).rotate(&self.pose.rotation).of(code(side))
    }

    /// Every face of the lumen within reach, or the nearest: the inside is their intersection.
    fn lumen(&self, x: &Vector3<f64>, reach: f64, out: &mut Vec<Near>) {
        let nearest = self.nearest(x).flip_if(true);
        let within = within(nearest.distance, reach);
        let x = self.local(x);
        let start = out.len();
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let face = self.face(&x, axis, sign).flip_if(true);
                if face.distance <= within {
                    out.push(face);
                }
            }
        }
        if out.len() == start {
            out.push(nearest);
        }
        tightest_first(&mut out[start..]);
    }
}

impl Solid for Cuboid {
    fn transform(&self, pose: &Pose) -> Self {
        Self { pose: move_pose(pose, &self.pose), ..*self }
    }

    fn near(&self, x: &Vector3<f64>) -> Result<Near, Fault> {
        Ok(self.nearest(x))
    }

    fn constraints(
        &self,
        x: &Vector3<f64>,
        reach: f64,
        inside: bool,
        out: &mut Vec<Near>,
    ) -> Result<(), Fault> {
        if inside {
            self.lumen(x, reach, out);
        } else {
            out.push(self.nearest(x));
        }
        Ok(())
    }

    fn hash_bits<H: Hasher>(&self, bits: &mut Bits<'_, H>) {
        bits.vectors(&[self.center(), self.half_extents]);
        bits.floats(self.pose.rotation.as_slice());
    }
}

/// A number for a face, edge or vertex from the sides it lies on.
fn code(side: [i8; 3]) -> usize {
    side.iter().fold(0, |code, s| 3 * code + usize::try_from(s + 1).unwrap_or(0))
}
