//! Constant curvature: every segment an arc of a circle (opencontinuumrobotics.com).

mod arc;
pub(crate) mod bent;
mod chain;
mod kinematics;
mod mapping;

pub use arc::Arc;
pub use chain::{
    ConstantCurvature, ConstantCurvatureSettings, Coupling, Plan, Workspace, displacements,
};
pub use kinematics::{frames, tip_derivative};
pub use mapping::{Fit, Length, Mapping};
