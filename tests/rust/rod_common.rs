//! What the tests of the rod share.

use tdcr::model::Model;
use tdcr::robot::Robot;
use tdcr::rod::{Plan, Rod, RodSettings, Workspace};
use tdcr::{Shape, Status};

pub(crate) fn rod_shape(robot: &Robot, settings: RodSettings, displacements: &[f64]) -> Shape {
    let plan = Plan::new(robot, settings).unwrap();
    Rod::new(robot, &plan).shape(displacements).unwrap()
}

/// The shape, which must have converged.
pub(crate) fn solved(robot: &Robot, settings: RodSettings, displacements: &[f64]) -> Shape {
    let shape = rod_shape(robot, settings, displacements);
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

/// The shape under given tensions, and the displacements that go with them.
pub(crate) fn under(robot: &Robot, settings: RodSettings, tensions: &[f64]) -> (Shape, Vec<f64>) {
    let plan = Plan::new(robot, settings).unwrap();
    let rod = Rod::new(robot, &plan);
    let mut work = Workspace::default();
    let report = rod.solve_tensions(tensions, &mut work).unwrap();
    let shape = rod.result(&[], report, work);
    assert_eq!(shape.report.status, Status::Converged, "{}", shape.message);
    let lengths = shape.state.tendon_lengths.iter().zip(rod.rest_lengths());
    let displacements = lengths.map(|(length, rest)| length - rest).collect();
    (shape, displacements)
}
