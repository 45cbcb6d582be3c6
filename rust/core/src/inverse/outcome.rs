//! Outcome of an inverse, and its message.

use std::borrow::Borrow;

use super::InverseSettings;
use super::multistart::SearchOutcome;
use crate::status::Status;

/// Outcome of an inverse; the unknowns are in its buffers.
///
/// ```
/// # use nalgebra::Vector3;
/// # use tdcr::constant_curvature::{ConstantCurvatureSettings, Plan};
/// # use tdcr::inverse::{Bounds, ConstantCurvatureInverse, InverseSettings, Target};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// # let plan = Plan::new(&robot, ConstantCurvatureSettings::default())?;
/// # let (bounds, settings) = (Bounds::default(), InverseSettings::default());
/// # let inverse = ConstantCurvatureInverse::new(&robot, &plan, &bounds, settings)?;
/// let mut scratch = inverse.scratch();
/// // Twice as far as the robot is long.
/// let answer = inverse.solve(&Target::Position(Vector3::new(0.0, 0.0, 0.4)), None, &mut scratch);
/// assert_eq!(answer.status, tdcr::Status::Unreachable);
/// assert!((answer.distance - 0.2).abs() < 1e-6);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Converged: the target is met, with the least bending energy nearby where there is freedom.
    /// Unreachable: the nearest pose that the starts led to. Infeasible: the bounds exclude each
    /// other, or, where distance and angle are NaN, no shape of the robot was found at all.
    pub status: Status,
    /// Distance from the tool to the target over the axes that count \[m\].
    pub distance: f64,
    /// Angle from the tool to the target over the axes that count \[rad\]; 0 for a position.
    pub angle: f64,
    /// Steps taken from all starts.
    pub iterations: usize,
    /// Starts tried.
    pub starts: usize,
}

impl Answer {
    pub(super) fn of(found: SearchOutcome, (distance, angle): (f64, f64)) -> Self {
        let SearchOutcome { status, iterations, starts } = found;
        Self { status, distance, angle, iterations, starts }
    }

    /// Answer for a robot of which no shape was found.
    pub(super) fn without_shape(found: SearchOutcome) -> Self {
        Self::of(SearchOutcome { status: Status::Infeasible, ..found }, (f64::NAN, f64::NAN))
    }

    /// Answer for a target that was not tried.
    pub(super) fn none() -> Self {
        Self {
            status: Status::NumericalError,
            distance: f64::NAN,
            angle: f64::NAN,
            iterations: 0,
            starts: 0,
        }
    }
}

/// Reason why a solve did not converge, in a sentence: the active bounds, and the freedom not yet spent.
pub(super) fn message_of<S: Borrow<str>>(
    answer: &Answer,
    settings: &InverseSettings,
    active: &[S],
    least: &str,
) -> String {
    let Answer { distance, angle, .. } = *answer;
    let met = distance <= settings.position_tolerance && angle <= settings.rotation_tolerance;
    let angle = if angle > 0.0 { format!(" and {angle:.2e} rad") } else { String::new() };
    let off = format!("{distance:.2e} m{angle} off the target");
    let active = if active.is_empty() {
        String::new()
    } else {
        format!("; at its bound: {}", active.join(", "))
    };
    match answer.status {
        Status::Converged => String::new(),
        Status::Unreachable => {
            format!("the nearest answer of {} starts is {off}{active}", answer.starts)
        }
        Status::Infeasible => "the bounds leave the robot no shape".to_owned(),
        Status::IterationLimit if met => {
            format!("the target is met, but not with the least {least} nearby")
        }
        Status::IterationLimit | Status::NumericalError => {
            format!("stopped before a nearest answer was found: {off}{active}")
        }
    }
}
