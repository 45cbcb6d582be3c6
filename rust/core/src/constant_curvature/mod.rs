//! Constant curvature: every segment an arc of a circle (opencontinuumrobotics.com).

mod arc;
mod kinematics;
mod mapping;
mod model;
mod plan;
pub(crate) mod unit_arc;

pub use arc::Arc;
pub use kinematics::{frames, tip_derivative};
pub use mapping::{Fit, Length, Mapping, Pattern};
pub use model::{ConstantCurvature, Scratch};
pub use plan::{ConstantCurvatureSettings, Coupling, Plan, displacements};
