//! What the tests of the rod share.

use tdcr::model::Model;
use tdcr::robot::Robot;
use tdcr::rod::{Plan, Rod, RodSettings};
use tdcr::{Shape, Status};

/// The shape, which must have converged.
pub(crate) fn solved(robot: &Robot, settings: RodSettings, displacements: &[f64]) -> Shape {
    let plan = Plan::new(robot, settings).unwrap();
    let shape = Rod::new(robot, &plan).shape(displacements).unwrap();
    assert_eq!(shape.report.status, Status::Converged, "{} ({displacements:?})", shape.message);
    assert!(shape.message.is_empty());
    shape
}

/// Largest distance between disks.
pub(crate) fn apart(one: &Shape, other: &Shape) -> f64 {
    assert_eq!(one.state.frames.len(), other.state.frames.len());
    let pairs = one.state.frames.iter().zip(&other.state.frames);
    pairs.fold(0.0, |most, (a, b)| f64::max(most, (a.translation - b.translation).norm()))
}
