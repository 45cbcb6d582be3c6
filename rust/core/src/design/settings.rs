//! Choices of a pre-bent design, checked.

use crate::error::InvalidInput;
use crate::rod::RodSettings;

/// Choices of a pre-bent design.
///
/// ```
/// use tdcr::design::PrebendSettings;
///
/// let settings = PrebendSettings { max_bend: 0.5, ..PrebendSettings::default() };
/// assert!(settings.validate().is_ok());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrebendSettings {
    /// Settings of the rod model that the design is for.
    pub rod: RodSettings,
    /// Largest bend of a subsegment at rest \[rad\].
    pub max_bend: f64,
    /// Weight of the differences between neighbouring rest strains, against distances over the robot's
    /// length: 0 for none.
    pub smoothness: f64,
    /// Distance of every disk that counts as reached, in shares of the robot's length.
    pub tolerance: f64,
    /// Levenberg-Marquardt steps of a start at most.
    pub max_iterations: usize,
}

impl Default for PrebendSettings {
    fn default() -> Self {
        Self {
            rod: RodSettings::default(),
            max_bend: std::f64::consts::PI,
            smoothness: 0.0,
            tolerance: 1e-10,
            max_iterations: 100,
        }
    }
}

impl PrebendSettings {
    /// Checks the values.
    ///
    /// # Errors
    /// `InvalidInput` for a value out of range.
    pub fn validate(&self) -> Result<(), InvalidInput> {
        self.rod.validate()?;
        let limits = [
            (
                "max_bend",
                self.max_bend,
                self.max_bend > 0.0 && self.max_bend <= std::f64::consts::PI,
            ),
            ("smoothness", self.smoothness, self.smoothness >= 0.0 && self.smoothness.is_finite()),
            ("tolerance", self.tolerance, self.tolerance > 0.0 && self.tolerance <= 1e-2),
        ];
        for (name, value, fits) in limits {
            if !fits {
                let expected = match name {
                    "max_bend" => "an angle in (0, pi] rad",
                    "smoothness" => "0 or more",
                    _ => "a share in (0, 1e-2]",
                };
                return Err(InvalidInput::new(name, expected, format!("{value:?}")));
            }
        }
        if self.max_iterations == 0 {
            return Err(InvalidInput::new("max_iterations", "at least 1", 0));
        }
        Ok(())
    }
}
