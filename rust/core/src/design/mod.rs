//! Design: which robot reaches a wanted shape. The mathematics is in `docs/design.md`.

mod curve;
mod hindrance;
mod march;
mod prebend;
mod routing;

pub use curve::points_on_curve;
pub use prebend::{Prebend, PrebendSettings, prebend, prebend_stopped_by};
pub use routing::{Optimality, Routed, RoutingSettings, routing, routing_rows, routing_stopped_by};

use nalgebra::Vector3;

use crate::error::InvalidInput;
use crate::robot::Robot;

/// Checks wanted places: one per disk from disk 1, finite.
fn check_targets(robot: &Robot, targets: &[Vector3<f64>]) -> Result<(), InvalidInput> {
    let n = robot.backbone().subsegments();
    if targets.len() != n {
        let expected = format!("{n} places, one per disk from disk 1");
        return Err(InvalidInput::new("target_positions", expected, targets.len()));
    }
    if let Some(i) = targets.iter().position(|t| !t.iter().all(|x| x.is_finite())) {
        let got = format!("{:?} at disk {}", targets[i].as_slice(), i + 1);
        return Err(InvalidInput::new("target_positions", "finite places [m]", got));
    }
    Ok(())
}
