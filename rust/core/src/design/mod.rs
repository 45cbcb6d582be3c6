//! Design: which robot reaches a wanted shape. The mathematics is in `docs/design.md`.

mod curve;
mod hindrance;
mod march;
mod prebend;

pub use curve::points_on_curve;
pub use prebend::{Prebend, PrebendSettings, prebend, prebend_stopped_by};
