//! Settings of an inverse: tolerances, weights, starts, budgets.

use crate::error::{InvalidInput, positive};
use crate::solve::pso::PsoSettings;

/// Source of the starts of descents.
///
/// ```
/// use tdcr::inverse::Method;
///
/// assert_eq!(Method::ALL.map(Method::as_str), ["newton", "pso"]);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Method {
    /// From given, guessed and random points; a swarm is the last resort.
    #[default]
    Newton,
    /// From the best points of particle swarms.
    Swarm,
}

impl Method {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Newton, Self::Swarm];

    /// The name used in Python.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Newton => "newton",
            Self::Swarm => "pso",
        }
    }
}

/// Choices of an inverse.
///
/// ```
/// use tdcr::inverse::InverseSettings;
///
/// // The tool's roll about its own z axis does not matter.
/// let settings = InverseSettings {
///     rotation_weight: [None, None, Some(0.0)],
///     starts: 20,
///     ..InverseSettings::default()
/// };
/// assert!(settings.validate().is_ok());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseSettings {
    /// Distance to the target that counts as reached \[m\].
    pub position_tolerance: f64,
    /// Angle to the target that counts as reached \[rad\].
    pub rotation_tolerance: f64,
    /// Weight of the distance along each world axis; 0 leaves it out.
    pub position_weight: [f64; 3],
    /// Weight of one radian about each tool axis \[m\]; 0 leaves the axis free; default 0.3 of the
    /// robot's length.
    pub rotation_weight: [Option<f64>; 3],
    /// Source of the starts of descents.
    pub method: Method,
    /// The swarms, if there are any. They minimise the squared weighted miss over the robot's length.
    pub swarm: PsoSettings,
    /// True to spend freedom that the target leaves on the least bending energy; else the answer is the
    /// one nearest to its start, as a path without jumps needs it.
    pub least_energy: bool,
    /// Starts at most before the target counts as out of reach.
    pub starts: usize,
    /// Steps per descent at most.
    pub max_iterations: usize,
    /// Seed of the random starts.
    pub seed: u64,
}

/// A swarm that hands over to descents: 1 % of the robot's length is near enough.
const SWARM: PsoSettings = PsoSettings {
    target: Some(1e-4),
    stagnation: Some(30),
    max_iterations: 300,
    ..PsoSettings::constriction()
};

impl Default for InverseSettings {
    fn default() -> Self {
        Self {
            position_tolerance: 1e-10,
            rotation_tolerance: 1e-10,
            position_weight: [1.0; 3],
            rotation_weight: [None; 3],
            method: Method::Newton,
            swarm: SWARM,
            least_energy: true,
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
        self.swarm.validate().map_err(|error| error.within("swarm"))
    }
}
