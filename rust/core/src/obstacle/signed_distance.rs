//! Volumes that a function describes.

use std::fmt;
use std::hash::Hasher;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::{Near, Solid, move_pose};
use crate::error::InvalidInput;
use crate::hashing::Bits;
use crate::lie::Pose;

/// Error of a distance function.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::obstacle::{Obstacle, SignedDistance, by_differences};
///
/// let broken = by_differences(|_: &Vector3<f64>| Err("no map of that place".into()));
/// let obstacle = Obstacle::new(SignedDistance::new(broken), false);
/// let fault = obstacle.nearest(&Vector3::zeros()).unwrap_err();
/// assert_eq!(fault.to_string(), "no map of that place");
/// ```
pub type Fault = Box<dyn std::error::Error + Send + Sync>;

/// A signed distance \[m\] and its gradient at a point.
///
/// ```
/// use nalgebra::Vector3;
/// use std::sync::Arc;
/// use tdcr::obstacle::{DistanceFunction, SignedDistance};
///
/// // Above the plane z = 0.
/// let function: DistanceFunction = Arc::new(|x: &Vector3<f64>| Ok((x.z, Vector3::z())));
/// let floor = SignedDistance::new(function);
/// # drop(floor);
/// ```
pub type DistanceFunction =
    Arc<dyn Fn(&Vector3<f64>) -> Result<(f64, Vector3<f64>), Fault> + Send + Sync>;

/// A gradient from values alone: central differences with a step of ε^(1/3) of the largest of the
/// point's coordinates, the distance and 1 cm, where rounding and the third derivative cost alike.
pub fn by_differences<F>(value: F) -> DistanceFunction
where
    F: Fn(&Vector3<f64>) -> Result<f64, Fault> + Send + Sync + 'static,
{
    Arc::new(move |x| {
        let distance = value(x)?;
        let h = f64::EPSILON.cbrt() * scale(x, distance);
        let mut gradient = Vector3::zeros();
        for i in 0..3 {
            let (ahead, behind) = beside(x, i, h);
            gradient[i] = (value(&ahead)? - value(&behind)?) / (ahead[i] - behind[i]);
        }
        Ok((distance, gradient))
    })
}

/// Length of which the step of a difference is a small share \[m\].
fn scale(x: &Vector3<f64>, distance: f64) -> f64 {
    x.amax().max(distance.abs()).max(0.01)
}

fn beside(x: &Vector3<f64>, axis: usize, h: f64) -> (Vector3<f64>, Vector3<f64>) {
    let (mut ahead, mut behind) = (*x, *x);
    ahead[axis] += h;
    behind[axis] -= h;
    (ahead, behind)
}

/// Whatever a function calls the inside: negative there, positive outside.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::obstacle::{Obstacle, SignedDistance, by_differences};
///
/// // A torus about z, its gradient by differences.
/// let torus = by_differences(|x: &Vector3<f64>| {
///     Ok((x.x.hypot(x.y) - 0.05).hypot(x.z) - 0.01)
/// });
/// let ring = Obstacle::new(SignedDistance::new(torus), false);
/// let near = ring.nearest(&Vector3::new(0.05, 0.0, 0.03)).unwrap();
/// assert!((near.distance - 0.02).abs() < 1e-12);
/// ```
#[derive(Clone)]
pub struct SignedDistance {
    function: DistanceFunction,
    /// The frame in which the function is asked.
    pose: Pose,
}

impl SignedDistance {
    /// From a function of points in the world.
    #[must_use]
    pub fn new(function: DistanceFunction) -> Self {
        Self { function, pose: Pose::identity() }
    }

    /// A number that clones share and no other function has.
    fn address(&self) -> usize {
        Arc::as_ptr(&self.function).cast::<()>().addr()
    }

    fn evaluate(&self, x: &Vector3<f64>) -> Result<Near, Fault> {
        let (distance, gradient) = (self.function)(x)?;
        let at = || format!("at ({:?}, {:?}, {:?})", x.x, x.y, x.z);
        if !distance.is_finite() {
            let got = format!("{distance:?} {}", at());
            return Err(InvalidInput::new("f", "a finite distance [m]", got).into());
        }
        if gradient.iter().any(|component| !component.is_finite()) {
            let [a, b, c] = gradient.into();
            let got = format!("({a:?}, {b:?}, {c:?}) {}", at());
            return Err(InvalidInput::new("gradient", "three finite numbers", got).into());
        }
        Ok(Near::flat(distance, gradient))
    }

    fn local(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.pose.rotation.tr_mul(&(x - self.pose.translation))
    }

    /// Signed distance with its Hessian within reach of the surface: central differences of the gradient, whose step of
    /// ε^(1/4) suits gradients that are differences themselves.
    fn near_with_hessian(&self, x: &Vector3<f64>, reach: f64) -> Result<Near, Fault> {
        let x = self.local(x);
        let mut near = self.evaluate(&x)?;
        if near.distance.abs() <= reach {
            let h = f64::EPSILON.sqrt().sqrt() * scale(&x, near.distance);
            let mut columns = Matrix3::zeros();
            for i in 0..3 {
                let (ahead, behind) = beside(&x, i, h);
                let change = self.evaluate(&ahead)?.gradient - self.evaluate(&behind)?.gradient;
                columns.set_column(i, &(change / (ahead[i] - behind[i])));
            }
            near.hessian = (columns + columns.transpose()) / 2.0;
        }
        Ok(near.rotate(&self.pose.rotation))
    }
}

impl Solid for SignedDistance {
    fn transform(&self, pose: &Pose) -> Self {
        Self { function: self.function.clone(), pose: move_pose(pose, &self.pose) }
    }

    fn near(&self, x: &Vector3<f64>) -> Result<Near, Fault> {
        Ok(self.evaluate(&self.local(x))?.rotate(&self.pose.rotation))
    }

    fn constraints(
        &self,
        x: &Vector3<f64>,
        reach: f64,
        inside: bool,
        out: &mut Vec<Near>,
    ) -> Result<(), Fault> {
        out.push(self.near_with_hessian(x, reach)?.flip_if(inside));
        Ok(())
    }

    fn hash_bits<H: Hasher>(&self, bits: &mut Bits<'_, H>) {
        bits.counts(&[self.address()]);
    }
}

impl PartialEq for SignedDistance {
    fn eq(&self, other: &Self) -> bool {
        self.address() == other.address() && self.pose == other.pose
    }
}

impl fmt::Debug for SignedDistance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SignedDistance").field("pose", &self.pose).finish_non_exhaustive()
    }
}
