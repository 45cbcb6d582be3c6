//! Constant curvature: every segment an arc of a circle (opencontinuumrobotics.com).

mod arc;
mod arc_rates;
mod kinematics;
mod mapping;
mod model;
mod plan;
pub(crate) mod unit_arc;

pub use arc::Arc;
pub use arc_rates::ArcRates;
pub use kinematics::{frames, tip_derivative};
pub use mapping::{Fit, Length, Mapping, Pattern};
pub use model::{ConstantCurvature, Scratch};
pub use plan::{ConstantCurvatureSettings, Coupling, Plan, displacements};
