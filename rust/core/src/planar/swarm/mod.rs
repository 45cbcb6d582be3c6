//! The inverse by particle swarm: any number of sections, headings, limits, circles to stay out of.
//!
//! A swarm finds the neighbourhood of an answer, Newton's method the answer. Unknown are the turns of
//! the sections, whose lengths then hold by construction, or, as in the paper, the platforms between
//! them, with the lengths as penalties. `docs/planar.md` has the mathematics.

mod batch;
mod cost;
mod objective;
mod result;
mod search;
mod watch;

pub use batch::{Row, Rows, solve_rows};
pub use result::SwarmInverse;
pub use search::SwarmSolver;
pub use watch::WatchDecision;

use super::newton_inverse::InverseSettings;
use crate::error::InvalidInput;
use crate::solve::pso::PsoSettings;

/// Unknowns that a particle stands for.
///
/// ```
/// use tdcr::planar::{SwarmSettings, Unknowns};
///
/// let settings = SwarmSettings { unknowns: Unknowns::Points, ..SwarmSettings::default() };
/// assert_eq!(settings.unknowns.as_str(), "points");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Unknowns {
    /// The turns of the sections; the value is the distance of the tip from the target.
    #[default]
    Bends,
    /// The paper's: the platforms between base and target; the value is how far the arcs through them
    /// are from the sections' lengths.
    Points,
}

impl Unknowns {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Bends, Self::Points];

    /// The name used in Python.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Bends => "bends",
            Self::Points => "points",
        }
    }
}

/// The swarm and what follows it.
///
/// ```
/// use tdcr::planar::SwarmSettings;
///
/// let settings = SwarmSettings { restarts: 3, polish: false, ..SwarmSettings::default() };
/// assert!(settings.validate().is_ok());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwarmSettings {
    /// The swarm; its budgets are those of one swarm. Its seed is that of the first.
    pub swarm: PsoSettings,
    /// Unknowns that a particle stands for.
    pub unknowns: Unknowns,
    /// True for Newton's method to take over from the swarm: it tries its best points on the way, and brings
    /// the answer to `tolerance` and the least bending energy nearby.
    pub polish: bool,
    /// Miss of the target that counts as none \[m\]; a heading counts one trunk length per whole turn.
    pub tolerance: f64,
    /// Newton steps per polish at most.
    pub max_iterations: usize,
    /// Further swarms, each with the next seed, where one found no answer.
    pub restarts: usize,
}

impl Default for SwarmSettings {
    fn default() -> Self {
        let InverseSettings { tolerance, max_iterations, .. } = InverseSettings::default();
        Self {
            swarm: PsoSettings::default(),
            unknowns: Unknowns::default(),
            polish: true,
            tolerance,
            max_iterations,
            restarts: 10,
        }
    }
}

impl SwarmSettings {
    /// Refuses settings out of range.
    ///
    /// # Errors
    /// `InvalidInput` that names the field.
    pub fn validate(&self) -> Result<(), InvalidInput> {
        self.swarm.validate()?;
        self.newton().validate()?;
        if self.restarts > 10_000 {
            return Err(InvalidInput::new("restarts", "0 to 10000", self.restarts));
        }
        Ok(())
    }

    pub(super) fn newton(&self) -> InverseSettings {
        let Self { tolerance, max_iterations, .. } = *self;
        InverseSettings { tolerance, max_iterations, ..InverseSettings::default() }
    }
}
