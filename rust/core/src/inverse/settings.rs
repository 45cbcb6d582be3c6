//! How precisely, how long and with which weights an inverse is sought.

use crate::error::{InvalidInput, positive};

/// Choices of an inverse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseSettings {
    /// Distance to the target that counts as reached \[m\].
    pub position_tolerance: f64,
    /// Angle to the target that counts as reached \[rad\].
    pub rotation_tolerance: f64,
    /// Weight of the distance along each world axis; 0 leaves it out.
    pub position_weight: [f64; 3],
    /// What one radian about each tool axis counts \[m\]; 0 leaves the axis free; default 0.3 of the
    /// robot's length.
    pub rotation_weight: [Option<f64>; 3],
    /// Starts at most before the target counts as out of reach.
    pub starts: usize,
    /// Steps per descent at most.
    pub max_iterations: usize,
    /// Seed of the random starts.
    pub seed: u64,
}

impl Default for InverseSettings {
    fn default() -> Self {
        Self {
            position_tolerance: 1e-10,
            rotation_tolerance: 1e-10,
            position_weight: [1.0; 3],
            rotation_weight: [None; 3],
            starts: 200,
            max_iterations: 50,
            seed: 0,
        }
    }
}

impl InverseSettings {
    /// Checks the values.
    ///
    /// # Errors
    /// `InvalidInput` for tolerances that are not positive, weights that are negative, not finite or all
    /// zero, no starts or no iterations.
    pub fn validate(&self) -> Result<(), InvalidInput> {
        positive("position_tolerance", "m", self.position_tolerance)?;
        positive("rotation_tolerance", "rad", self.rotation_tolerance)?;
        let sound = |argument: &str, weight: f64| {
            if weight.is_finite() && weight >= 0.0 {
                return Ok(());
            }
            Err(InvalidInput::new(argument, "finite weights of 0 or more", format!("{weight:?}")))
        };
        for weight in self.position_weight {
            sound("position_weight", weight)?;
        }
        for weight in self.rotation_weight.into_iter().flatten() {
            sound("rotation_weight", weight)?;
        }
        if self.position_weight == [0.0; 3] && self.rotation_weight == [Some(0.0); 3] {
            let expected = "a positive weight for something";
            return Err(InvalidInput::new("position_weight", expected, "zeros everywhere"));
        }
        for (argument, value) in [("starts", self.starts), ("max_iterations", self.max_iterations)]
        {
            if value == 0 {
                return Err(InvalidInput::new(argument, "1 or more", value));
            }
        }
        Ok(())
    }
}
