//! Obstacles: volumes with signed distances that a robot stays out of, or inside of.
//!
//! A point's signed distance is positive outside the volume; `inside` turns the volume into a lumen and
//! the sign around. [`Obstacle::nearest`] gives it with its derivatives, [`Obstacle::constraints`] the
//! conditions whose conjunction is, near a point, "outside the obstacle". The mathematics is in
//! `docs/obstacles.md`.

mod cuboid;
mod first_fault;
mod mesh;
mod signed_distance;
mod smooth;

use std::hash::Hasher;

use nalgebra::{Matrix3, Vector3};

pub use cuboid::Cuboid;
pub use first_fault::FirstFault;
pub use mesh::Mesh;
pub use signed_distance::{DistanceFunction, Fault, SignedDistance, by_differences};
pub use smooth::{Capsule, Cylinder, HalfSpace, Sphere};

use crate::hashing::{Bits, hash_by_bits};
use crate::lie::Pose;

/// Points nearer to a centre, an axis or an edge than this have no direction away from it \[m\]: squares
/// of their distance vanish.
const KINK: f64 = 1e-150;

/// A condition near a point: its value, to be kept at or above zero, with derivatives by the point.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::obstacle::{Obstacle, Sphere};
///
/// let ball = Obstacle::new(Sphere::new(&Vector3::zeros(), 0.02).unwrap(), false);
/// let near = ball.nearest(&Vector3::new(0.0, 0.0, 0.05)).unwrap();
/// assert!((near.distance - 0.03).abs() < 1e-15);
/// assert_eq!(near.gradient, Vector3::z());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// Signed distance, positive where the robot may be \[m\].
    pub distance: f64,
    /// Its gradient, a unit vector that points to where the robot may be (of a [`SignedDistance`]: as
    /// long as the function's).
    pub gradient: Vector3<f64>,
    /// Its Hessian \[1/m\]: zero before flat faces, (I - n nᵀ)/r before a corner at distance r.
    pub hessian: Matrix3<f64>,
    /// Which part of the obstacle this is: the same number for the same face, edge or vertex, from
    /// wherever it is looked at; 0 for a volume of one part.
    pub feature: u32,
}

impl Near {
    /// Before a plane through which `distance` is measured.
    fn flat(distance: f64, normal: Vector3<f64>) -> Self {
        Self { distance, gradient: normal, hessian: Matrix3::zeros(), feature: 0 }
    }

    /// Around a point, a line or a sphere, tube or rounding of `radius` about it. `from` leads to the
    /// point, across the line; `across` projects on what can curve (I, or I - t tᵀ).
    fn round(from: &Vector3<f64>, across: &Matrix3<f64>, radius: f64, kink: Vector3<f64>) -> Self {
        let r = from.norm();
        if r < KINK {
            return Self::flat(-radius, kink);
        }
        let normal = from / r;
        let hessian = (across - normal * normal.transpose()) / r;
        Self { distance: r - radius, gradient: normal, hessian, feature: 0 }
    }

    /// Condition seen from the other side.
    fn flip_if(self, flip: bool) -> Self {
        if !flip {
            return self;
        }
        let (gradient, hessian) = (-self.gradient, -self.hessian);
        Self { distance: -self.distance, gradient, hessian, feature: self.feature }
    }

    fn rotate(self, rotation: &Matrix3<f64>) -> Self {
        let gradient = rotation * self.gradient;
        Self { gradient, hessian: rotation * self.hessian * rotation.transpose(), ..self }
    }

    fn of(self, feature: usize) -> Self {
        // Meshes are checked to have fewer parts than u32 counts.
        Self { feature: u32::try_from(feature).unwrap_or(u32::MAX), ..self }
    }
}

/// Solid of an obstacle. A new one is a file that implements this, and a line in the list of [`Volume`].
trait Solid: Sized {
    /// Solid moved with its frame.
    fn transform(&self, pose: &Pose) -> Self;

    /// Signed distance of a point, positive outside, with its derivatives.
    fn near(&self, x: &Vector3<f64>) -> Result<Near, Fault>;

    /// Conditions for [`Obstacle::constraints`]: the nearest place, unless the solid has several parts.
    fn constraints(
        &self,
        x: &Vector3<f64>,
        _reach: f64,
        inside: bool,
        out: &mut Vec<Near>,
    ) -> Result<(), Fault> {
        out.push(self.near(x)?.flip_if(inside));
        Ok(())
    }

    /// Feeds all that tells it from others to a hasher.
    fn hash_bits<H: Hasher>(&self, bits: &mut Bits<'_, H>);
}

/// Writes [`Volume`], a solid of any kind, from a list of solids.
macro_rules! volume {
    ($($(#[$doc:meta])* $name:ident,)*) => {
        /// The shapes an obstacle can have.
        ///
        /// ```
        /// use nalgebra::Vector3;
        /// use tdcr::obstacle::{HalfSpace, Volume};
        ///
        /// # fn main() -> Result<(), tdcr::InvalidInput> {
        /// let floor = Volume::from(HalfSpace::new(&Vector3::zeros(), &Vector3::z())?);
        /// assert!(matches!(floor, Volume::HalfSpace(_)));
        /// # Ok(())
        /// # }
        /// ```
        #[derive(Clone, Debug, PartialEq)]
        pub enum Volume {
            $($(#[$doc])* $name($name),)*
        }

        $(impl From<$name> for Volume {
            fn from(volume: $name) -> Self {
                Self::$name(volume)
            }
        })*

        impl Solid for Volume {
            fn transform(&self, pose: &Pose) -> Self {
                match self {
                    $(Self::$name(v) => v.transform(pose).into(),)*
                }
            }

            fn near(&self, x: &Vector3<f64>) -> Result<Near, Fault> {
                match self {
                    $(Self::$name(v) => v.near(x),)*
                }
            }

            fn constraints(
                &self,
                x: &Vector3<f64>,
                reach: f64,
                inside: bool,
                out: &mut Vec<Near>,
            ) -> Result<(), Fault> {
                match self {
                    $(Self::$name(v) => v.constraints(x, reach, inside, out),)*
                }
            }

            fn hash_bits<H: Hasher>(&self, bits: &mut Bits<'_, H>) {
                match self {
                    $(Self::$name(v) => v.hash_bits(bits),)*
                }
            }
        }
    };
}

volume! {
    /// A ball.
    Sphere,
    /// An infinite round bar.
    Cylinder,
    /// All that lies behind a plane.
    HalfSpace,
    /// A bar with round ends.
    Capsule,
    /// A box with any axes.
    Cuboid,
    /// The inside of a closed surface of triangles.
    Mesh,
    /// Whatever a function calls the inside.
    SignedDistance,
}

/// A volume that the robot stays out of, or inside of. Cheap to clone.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::obstacle::{Cylinder, Obstacle};
///
/// // A lumen of 30 mm: the robot stays inside.
/// let tube = Cylinder::new(&Vector3::zeros(), &Vector3::z(), 0.015).unwrap();
/// let lumen = Obstacle::new(tube, true);
/// let near = lumen.nearest(&Vector3::new(0.010, 0.0, 0.1)).unwrap();
/// assert!((near.distance - 0.005).abs() < 1e-15);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Obstacle {
    volume: Volume,
    inside: bool,
}

impl Obstacle {
    /// A checked volume; with `inside` the robot has to stay in it.
    #[must_use]
    pub fn new(volume: impl Into<Volume>, inside: bool) -> Self {
        Self { volume: volume.into(), inside }
    }

    /// Its shape.
    #[must_use]
    pub fn volume(&self) -> &Volume {
        &self.volume
    }

    /// True when the robot has to stay in it.
    #[must_use]
    pub fn inside(&self) -> bool {
        self.inside
    }

    /// Obstacle moved with its frame: given in the frame `pose`, seen from outside that frame.
    #[must_use]
    pub fn transform(&self, pose: &Pose) -> Self {
        Self { volume: self.volume.transform(pose), inside: self.inside }
    }

    /// The signed distance of a point \[m\] with its derivatives.
    ///
    /// Where the nearest place is not unique one of them is taken, always the same. The Hessian of a
    /// [`SignedDistance`] is left zero here.
    ///
    /// # Errors
    /// A [`SignedDistance`] that failed; no other volume can.
    pub fn nearest(&self, x: &Vector3<f64>) -> Result<Near, Fault> {
        Ok(self.volume.near(x)?.flip_if(self.inside))
    }

    /// Appends the conditions that together say, near `x`, that a point is where it may be: all that a
    /// step of up to `reach` \[m\] can meet, and the nearest in any case; tightest first. A body around
    /// the point adds its radius to the reach.
    ///
    /// One for a smooth volume; for a box or a mesh one for every face, edge or vertex that is a nearest
    /// place of its neighbourhood, or meets such a one in a hollow of the obstacle. They hold together
    /// (and), never in the alternative; where `x` has sunk into the obstacle the nearest way out is
    /// taken, and the reach counts from there.
    ///
    /// # Errors
    /// A [`SignedDistance`] that failed; no other volume can. `out` is then as it was.
    pub fn constraints(
        &self,
        x: &Vector3<f64>,
        reach: f64,
        out: &mut Vec<Near>,
    ) -> Result<(), Fault> {
        self.volume.constraints(x, reach, self.inside, out)
    }
}

hash_by_bits!(Obstacle, |obstacle, bits| {
    bits.counts(&[usize::from(obstacle.inside)]);
    obstacle.volume.hash_bits(&mut bits);
});

/// Distance from a point within which others count.
fn within(distance: f64, reach: f64) -> f64 {
    reach - distance.min(0.0)
}

/// In the order of their distances, and of their places among equals.
fn tightest_first(entries: &mut [Near]) {
    entries
        .sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance).then(a.feature.cmp(&b.feature)));
}

/// A rigid motion without negative zeros, so that equal obstacles have equal bits.
fn move_pose(pose: &Pose, inner: &Pose) -> Pose {
    let pose = pose.compose(inner);
    let (rotation, translation) =
        (pose.rotation.map(|e| e + 0.0), pose.translation.map(|e| e + 0.0));
    Pose { rotation, translation }
}

/// A place moved by a pose, without negative zeros.
fn move_point(pose: &Pose, point: &Vector3<f64>) -> Vector3<f64> {
    pose.transform(point).map(|e| e + 0.0)
}

/// A direction turned by a pose, without negative zeros.
fn turn_direction(pose: &Pose, direction: &Vector3<f64>) -> Vector3<f64> {
    (pose.rotation * direction).map(|e| e + 0.0)
}
