//! The rod among obstacles and under loads: minimum of its energy under inequalities, by an augmented Lagrangian.
//!
//! The mathematics is in `docs/contact.md`, whose letters the code uses. From the bottom up: `scene` and `loads`
//! are what surrounds a robot, `potential` and `lagrangian` the function that is minimised, `riccati` its Newton
//! step, `augmented_lagrangian` the minimisation at given multipliers and their updates, `continuation` the way
//! from rest in load steps, whose states are `load_state`, `model` the forward model, and `start` what its solves begin
//! with.

mod augmented_lagrangian;
mod continuation;
mod lagrangian;
mod load_state;
mod loads;
mod model;
mod potential;
mod riccati;
mod scene;
mod start;

pub(super) use load_state::{Checkpoint, TendonTarget};
pub use loads::Loads;
pub use model::{LoadedRod, Scratch};
pub use scene::Scene;
