//! The rod among obstacles and under loads: what it meets, and how that is solved.
//!
//! The mathematics is in `docs/contact.md`.

mod descent;
mod field;
mod loads;
mod merit;
mod model;
mod scene;
mod sweep;

pub use loads::Loads;
pub use model::{LoadedRod, Workspace};
pub use scene::Scene;
