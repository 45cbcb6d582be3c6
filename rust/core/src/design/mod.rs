//! Design: which robot reaches a wanted shape. The mathematics is in `docs/design.md`.

mod bend_descent;
mod feasibility;
mod fit;
mod nearest_rod;
mod points_on_curve;
mod prebend;
mod routing;
mod settings;
mod stepwise_tensions;

pub use fit::{Fit, FitSettings, Measured, Parameter, fit};
pub use points_on_curve::{angle_at_base, points_on_curve};
pub use prebend::{Prebend, prebend, prebend_stopped_by};
pub use routing::{Optimality, Routed, RoutingSettings, routing, routing_rows, routing_stopped_by};
pub use settings::PrebendSettings;

use nalgebra::Vector3;

use crate::error::InvalidInput;
use crate::robot::Robot;

/// Farthest place from the base, in lengths of the robot: squares of distances keep what a robot changes in them.
const FAR: f64 = 1e6;

/// Checks wanted places: one per disk from disk 1, finite, not too far to compare.
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
    let most = FAR * robot.backbone().total_length();
    let far = |t: &Vector3<f64>| (t - robot.base().translation).amax() > most;
    if let Some(i) = targets.iter().position(far) {
        let expected =
            format!("places within {FAR:e} lengths of the robot ({most:.3e} m) of its base");
        let got = format!("{:?} at disk {}", targets[i].as_slice(), i + 1);
        return Err(InvalidInput::new("target_positions", expected, got));
    }
    Ok(())
}
