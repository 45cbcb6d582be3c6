//! Positions and frames that the tool shall reach.

use nalgebra::{Matrix3, Vector3};

use crate::error::InvalidInput;
use crate::lie::{Pose, so3};

/// Target of the tool, in the world.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::inverse::Target;
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let target = Target::point(Vector3::new(0.05, 0.03, 0.17))?;
/// assert!(target.rotation().is_none());
/// assert!(Target::point(Vector3::new(f64::NAN, 0.0, 0.0)).is_err());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// Its point \[m\].
    Position(Vector3<f64>),
    /// Its point and its axes.
    Pose(Pose),
}

impl Target {
    /// A point.
    ///
    /// # Errors
    /// `InvalidInput` when it is not finite.
    pub fn point(position: Vector3<f64>) -> Result<Self, InvalidInput> {
        if let Some(entry) = position.iter().find(|entry| !entry.is_finite()) {
            return Err(InvalidInput::new("target", "a finite position [m]", entry));
        }
        Ok(Self::Position(position))
    }

    /// A frame, its rotation freed of rounding.
    #[must_use]
    pub fn frame(pose: &Pose) -> Self {
        Self::Pose(Pose { rotation: so3::exp(&so3::log(&pose.rotation)), ..*pose })
    }

    /// The point \[m\].
    #[must_use]
    pub fn position(&self) -> Vector3<f64> {
        match self {
            Self::Position(position) => *position,
            Self::Pose(pose) => pose.translation,
        }
    }

    /// The axes, if they matter.
    #[must_use]
    pub fn rotation(&self) -> Option<&Matrix3<f64>> {
        match self {
            Self::Position(_) => None,
            Self::Pose(pose) => Some(&pose.rotation),
        }
    }
}
