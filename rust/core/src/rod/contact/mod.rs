//! The rod among obstacles and under loads: what it meets, and how that is solved.
//!
//! The mathematics is in `docs/contact.md`.

mod climb;
mod descent;
mod field;
mod leaning;
mod loads;
mod merit;
mod model;
mod scene;
mod sweep;

pub(crate) use leaning::Leaning;
pub use loads::Loads;
pub use model::{LoadedRod, Workspace};
pub use scene::Scene;
