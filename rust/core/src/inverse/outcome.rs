//! How an inverse ended, and in words.

use std::borrow::Borrow;

use super::InverseSettings;
use super::multistart::SearchOutcome;
use crate::status::Status;

/// How an inverse ended; what it found is in the workspace.
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

    /// Of a robot of which no shape was found.
    pub(super) fn without_shape(found: SearchOutcome) -> Self {
        Self::of(SearchOutcome { status: Status::Infeasible, ..found }, (f64::NAN, f64::NAN))
    }

    /// Of a target that was not sought.
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

/// What stood in the way, in a sentence: the bounds that hold back, and what freedom is spent on.
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
