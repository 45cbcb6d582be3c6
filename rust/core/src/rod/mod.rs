//! The strain-energy rod: general routing, pre-bent backbones, any number of tendons.

mod chain;
mod element;
mod model;
mod plan;
mod settings;
mod subsegment;

pub use model::{Rod, Workspace};
pub use plan::Plan;
pub use settings::{RodSettings, Subsegment, TendonRule};
