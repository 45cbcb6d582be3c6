//! The rod among obstacles and under loads: what it meets, and how that is solved.
//!
//! The mathematics is in `docs/contact.md`.

mod augmented_lagrangian;
pub(in crate::rod) mod continuation;
mod lagrangian;
mod loads;
pub(in crate::rod) mod model;
mod potential;
mod riccati;
mod scene;

pub use loads::Loads;
pub use model::{LoadedRod, Scratch};
pub use scene::Scene;
