//! The trunk as a chain of rigid linkages (Ashwin & Ghosal, *Forward kinematics of cable-driven
//! continuum robot using optimization method*).
//!
//! Every subsegment is a four-bar linkage (one tendon) or two adjoined ones (two tendons: a
//! seven-bar), and its pose is the constrained minimum of the coupler angles, base to tip. Each
//! tendon's shortening is shared by its pieces in proportion to their rest lengths.

mod angle;
mod driving_tendons;
pub mod four_bar;
mod message;
mod model;
mod pose;
pub mod seven_bar;
mod subsegment;

pub use model::{Linkage, Plan, Scratch};
pub use pose::Pose;
pub use subsegment::{solve_four_bar, solve_seven_bar};

use crate::error::InvalidInput;
use crate::solve::sqp;

/// Settings of the linkage model: tolerance and budget of a subsegment.
///
/// ```
/// use tdcr::linkage::LinkageSettings;
///
/// let settings = LinkageSettings { max_iterations: 20, ..LinkageSettings::default() };
/// assert!(settings.validate().is_ok());
/// assert!(LinkageSettings { max_iterations: 0, ..settings }.validate().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkageSettings {
    /// The solve of a subsegment ends with the first full Newton step below this \[rad\]; the error
    /// that remains is about its square.
    pub step_tolerance: f64,
    /// Newton steps per subsegment at most.
    pub max_iterations: usize,
}

/// Newton steps per subsegment that can be asked for: one that needs more never ends.
const MOST_ITERATIONS: usize = 10_000;

impl Default for LinkageSettings {
    fn default() -> Self {
        Self { step_tolerance: 1e-9, max_iterations: 50 }
    }
}

impl LinkageSettings {
    /// Checks the values.
    ///
    /// # Errors
    /// `InvalidInput` when the tolerance is not in (0, 1e-3] or no iteration is allowed.
    pub fn validate(&self) -> Result<(), InvalidInput> {
        if !(self.step_tolerance > 0.0 && self.step_tolerance <= 1e-3) {
            let got = self.step_tolerance;
            return Err(InvalidInput::new("step_tolerance", "a number in (0, 1e-3] [rad]", got));
        }
        if self.max_iterations == 0 || self.max_iterations > MOST_ITERATIONS {
            let expected = format!("1 to {MOST_ITERATIONS}");
            return Err(InvalidInput::new("max_iterations", expected, self.max_iterations));
        }
        Ok(())
    }

    /// The solver's settings behind these.
    #[must_use]
    pub fn sqp(&self) -> sqp::Settings {
        sqp::Settings {
            step_tolerance: self.step_tolerance,
            step_bound: 0.5,
            constraint_tolerance: 1e-12,
            max_iterations: self.max_iterations,
        }
    }
}
