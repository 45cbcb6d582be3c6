//! Constant curvature: every segment an arc of a circle (opencontinuumrobotics.com).

mod arc;
pub(crate) mod bent;
mod chain;
mod kinematics;
mod mapping;
mod plan;

pub use arc::Arc;
pub use chain::{ConstantCurvature, Workspace};
pub use kinematics::{frames, tip_derivative};
pub use mapping::{Fit, Length, Mapping, Pattern};
pub use plan::{ConstantCurvatureSettings, Coupling, Plan, displacements};
