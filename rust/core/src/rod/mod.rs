//! The strain-energy rod: general routing, pre-bent backbones, any number of tendons.

pub mod contact;
mod degenerate_rest;
mod dual_newton;
mod elasticity;
pub(crate) mod element;
pub(crate) mod equilibrium;
mod load_stepping;
mod message;
mod model;
mod newton_system;
pub(crate) mod one_subsegment;
mod plan;
mod proportional;
mod sensitivity;
mod settings;
pub(crate) mod stepwise_inverse;
mod subsegment;
mod tendon_law;
mod tip_rates;

pub use model::{Rod, Scratch};
pub use plan::Plan;
pub use sensitivity::{Change, Linearized, Sensitivity, Variation};
pub use settings::{RodSettings, Subsegment};
pub use tendon_law::TendonLaw;
