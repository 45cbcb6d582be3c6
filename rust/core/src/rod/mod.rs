//! The strain-energy rod: general routing, pre-bent backbones, any number of tendons.

mod ascent;
pub(crate) mod balance;
mod chain;
pub mod contact;
pub(crate) mod element;
pub(crate) mod march;
mod message;
mod model;
mod nudge;
mod plan;
mod proportional;
pub(crate) mod pulled;
mod sensitivity;
mod settings;
pub(crate) mod stage;
mod subsegment;
mod sweep;

pub use model::{Rod, Workspace};
pub use plan::Plan;
pub use sensitivity::{Change, Linearized, Sensitivity, Variation};
pub use settings::{RodSettings, Subsegment, TendonRule};
