//! Volumes of one smooth surface: sphere, cylinder, half-space, capsule.

use std::hash::Hasher;

use nalgebra::{Matrix3, Vector3};

use super::{Fault, Near, Solid, move_point, turn_direction};
use crate::error::{InvalidInput, direction, finite_vector, length};
use crate::hashing::Bits;
use crate::lie::Pose;

/// A ball.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::obstacle::Sphere;
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let ball = Sphere::new(&Vector3::new(0.0, 0.0, 0.1), 0.02)?;
/// assert_eq!(ball.radius(), 0.02);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    center: Vector3<f64>,
    radius: f64,
}

impl Sphere {
    /// From its centre and radius \[m\].
    ///
    /// # Errors
    /// `InvalidInput` naming `center` or `radius`: not finite, or not a length.
    pub fn new(center: &Vector3<f64>, radius: f64) -> Result<Self, InvalidInput> {
        let center = finite_vector("center", "m", center)?;
        Ok(Self { center, radius: length("radius", radius)? })
    }

    /// Its centre \[m\].
    #[must_use]
    pub fn center(&self) -> Vector3<f64> {
        self.center
    }

    /// Its radius \[m\].
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.radius
    }
}

impl Solid for Sphere {
    fn transform(&self, pose: &Pose) -> Self {
        Self { center: move_point(pose, &self.center), ..*self }
    }

    /// At the centre the gradient is the world's x axis.
    fn near(&self, x: &Vector3<f64>) -> Result<Near, Fault> {
        Ok(Near::round(&(x - self.center), &Matrix3::identity(), self.radius, Vector3::x()))
    }

    fn hash_bits<H: Hasher>(&self, bits: &mut Bits<'_, H>) {
        bits.vectors(&[self.center]);
        bits.float(self.radius);
    }
}

/// An infinite round bar.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::obstacle::Cylinder;
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// // The axis may have any length.
/// let bar = Cylinder::new(&Vector3::zeros(), &Vector3::new(0.0, 3.0, 0.0), 0.01)?;
/// assert_eq!(bar.axis(), Vector3::y());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    point: Vector3<f64>,
    axis: Vector3<f64>,
    radius: f64,
}

impl Cylinder {
    /// From a point on its axis \[m\], the direction of its axis (of any length) and its radius \[m\].
    ///
    /// # Errors
    /// `InvalidInput` naming `point`, `axis` or `radius`: not finite, zero, or not a length.
    pub fn new(
        point: &Vector3<f64>,
        axis: &Vector3<f64>,
        radius: f64,
    ) -> Result<Self, InvalidInput> {
        let point = finite_vector("point", "m", point)?;
        Ok(Self { point, axis: direction("axis", axis)?, radius: length("radius", radius)? })
    }

    /// A point on its axis \[m\].
    #[must_use]
    pub fn point(&self) -> Vector3<f64> {
        self.point
    }

    /// The direction of its axis, a unit vector.
    #[must_use]
    pub fn axis(&self) -> Vector3<f64> {
        self.axis
    }

    /// Its radius \[m\].
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.radius
    }
}

impl Solid for Cylinder {
    fn transform(&self, pose: &Pose) -> Self {
        let (point, axis) = (move_point(pose, &self.point), turn_direction(pose, &self.axis));
        Self { point, axis, ..*self }
    }

    /// On the axis the gradient is the part across the axis of the world axis most across it.
    fn near(&self, x: &Vector3<f64>) -> Result<Near, Fault> {
        Ok(around_axis(&(x - self.point), &self.axis, self.radius))
    }

    fn hash_bits<H: Hasher>(&self, bits: &mut Bits<'_, H>) {
        bits.vectors(&[self.point, self.axis]);
        bits.float(self.radius);
    }
}

/// All that lies behind a plane.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::obstacle::HalfSpace;
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let wall = HalfSpace::new(&Vector3::new(0.05, 0.0, 0.0), &Vector3::new(-2.0, 0.0, 0.0))?;
/// assert_eq!(wall.normal(), -Vector3::x());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    point: Vector3<f64>,
    normal: Vector3<f64>,
}

impl HalfSpace {
    /// From a point of the plane \[m\] and the direction (of any length) out of the solid.
    ///
    /// # Errors
    /// `InvalidInput` naming `point` or `normal`: not finite, or zero.
    pub fn new(point: &Vector3<f64>, normal: &Vector3<f64>) -> Result<Self, InvalidInput> {
        let point = finite_vector("point", "m", point)?;
        Ok(Self { point, normal: direction("normal", normal)? })
    }

    /// A point of its plane \[m\].
    #[must_use]
    pub fn point(&self) -> Vector3<f64> {
        self.point
    }

    /// The direction out of the solid, a unit vector.
    #[must_use]
    pub fn normal(&self) -> Vector3<f64> {
        self.normal
    }
}

impl Solid for HalfSpace {
    fn transform(&self, pose: &Pose) -> Self {
        Self { point: move_point(pose, &self.point), normal: turn_direction(pose, &self.normal) }
    }

    fn near(&self, x: &Vector3<f64>) -> Result<Near, Fault> {
        Ok(Near::flat(self.normal.dot(&(x - self.point)), self.normal))
    }

    fn hash_bits<H: Hasher>(&self, bits: &mut Bits<'_, H>) {
        bits.vectors(&[self.point, self.normal]);
    }
}

/// A bar with round ends: all points within the radius of a segment.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::obstacle::{Capsule, Obstacle};
///
/// let capsule = Capsule::new(&Vector3::zeros(), &Vector3::new(0.0, 0.0, 0.1), 0.01).unwrap();
/// let near = Obstacle::new(capsule, false).nearest(&Vector3::new(0.0, 0.0, 0.15)).unwrap();
/// assert!((near.distance - 0.04).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    a: Vector3<f64>,
    b: Vector3<f64>,
    radius: f64,
}

impl Capsule {
    /// From the ends of its segment \[m\], which may be one point, and its radius \[m\].
    ///
    /// # Errors
    /// `InvalidInput` naming `a`, `b` or `radius`: not finite, farther apart than 1e15 m, or not a length.
    pub fn new(a: &Vector3<f64>, b: &Vector3<f64>, radius: f64) -> Result<Self, InvalidInput> {
        let a = finite_vector("a", "m", a)?;
        let b = finite_vector("b", "m", b)?;
        let apart = (b - a).amax();
        if apart > 1e15 {
            let expected = "a point within 1e15 m of a";
            return Err(InvalidInput::new("b", expected, format!("one {apart:e} m away")));
        }
        Ok(Self { a, b, radius: length("radius", radius)? })
    }

    /// The first end of its segment \[m\].
    #[must_use]
    pub fn a(&self) -> Vector3<f64> {
        self.a
    }

    /// The other end of its segment \[m\].
    #[must_use]
    pub fn b(&self) -> Vector3<f64> {
        self.b
    }

    /// Its radius \[m\].
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.radius
    }
}

impl Solid for Capsule {
    fn transform(&self, pose: &Pose) -> Self {
        Self { a: move_point(pose, &self.a), b: move_point(pose, &self.b), ..*self }
    }

    /// On the segment the gradient is as on a cylinder's axis; of a single point, as in a sphere's centre.
    fn near(&self, x: &Vector3<f64>) -> Result<Near, Fault> {
        let along = self.b - self.a;
        let span = along.norm();
        let from = x - self.a;
        if span < super::KINK {
            return Ok(Near::round(&from, &Matrix3::identity(), self.radius, Vector3::x()));
        }
        let axis = along / span;
        let t = axis.dot(&from);
        if t > 0.0 && t < span {
            return Ok(around_axis(&from, &axis, self.radius));
        }
        let end = if t <= 0.0 { self.a } else { self.b };
        Ok(Near::round(&(x - end), &Matrix3::identity(), self.radius, across(&axis)))
    }

    fn hash_bits<H: Hasher>(&self, bits: &mut Bits<'_, H>) {
        bits.vectors(&[self.a, self.b]);
        bits.float(self.radius);
    }
}

/// The tube of a radius about an axis through the origin.
fn around_axis(x: &Vector3<f64>, axis: &Vector3<f64>, radius: f64) -> Near {
    let projector = Matrix3::identity() - axis * axis.transpose();
    Near::round(&(x - axis * axis.dot(x)), &projector, radius, across(axis))
}

/// A unit vector across another: from the world axis most across it, the first of equals.
fn across(axis: &Vector3<f64>) -> Vector3<f64> {
    let mut least = 0;
    for i in 1..3 {
        if axis[i].abs() < axis[least].abs() {
            least = i;
        }
    }
    let mut unit = Vector3::zeros();
    unit[least] = 1.0;
    (unit - axis * axis[least]).normalize()
}
