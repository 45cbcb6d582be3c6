//! From where the tool should be to tendon displacements.
//!
//! [`ConstantCurvatureInverse`] finds the arcs by descents from many starts ([`crate::solve::levenberg_marquardt`]),
//! inside bounds, and spends what freedom is left on the least bending energy; [`RodInverse`] finds tensions
//! likewise, none below zero, and spends it on the least of them.

mod arc_problem;
mod batch;
mod bounds;
mod cartesian_path;
mod constant_curvature;
mod multistart;
mod outcome;
mod pose_goal;
mod pose_residual;
mod position_goal;
mod rod;
mod settings;
mod single;
mod swarm_starts;
mod tension_problem;

use nalgebra::{Matrix3, Vector3};

pub use batch::{InverseRows, Inverter, invert_path, invert_rows};
pub use bounds::{Bounds, Range};
pub use cartesian_path::cartesian_path;
pub use constant_curvature::{ConstantCurvatureInverse, Scratch, Solution};
pub use outcome::Answer;
pub use rod::{RodInverse, RodScratch};
pub use settings::{InverseSettings, Method};
pub use single::{Inversion, invert};

use crate::error::InvalidInput;
use crate::lie::{Pose, so3};

/// Where the tool should be, in the world.
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
