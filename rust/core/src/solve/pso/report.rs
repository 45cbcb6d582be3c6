//! Outcome of a run.

use crate::status::Status;

/// Why a run ended.
///
/// ```
/// use tdcr::solve::pso::Stop;
///
/// assert_eq!(Stop::Stagnation.as_str(), "stagnation");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The best value is as low as wanted.
    Target,
    /// No progress for the iterations allowed without.
    Stagnation,
    /// The moves are used up.
    Iterations,
    /// The next move would exceed the evaluations.
    Evaluations,
    /// Whoever watched ended it.
    Callback,
}

impl Stop {
    /// The name used in Python.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Target => "target",
            Self::Stagnation => "stagnation",
            Self::Iterations => "iterations",
            Self::Evaluations => "evaluations",
            Self::Callback => "callback",
        }
    }

    /// The status of a run that ended so.
    ///
    /// Converged is what met a stated condition: the target, or, where none was stated, stagnation.
    /// A swarm that stagnates above its target has used up the iterations it had without progress; a
    /// swarm cannot know whether the target is out of reach, so it never says so. A run that has seen
    /// no value below infinity is a numerical error.
    pub(super) fn status(self, value: f64, with_target: bool) -> Status {
        match self {
            Self::Target => Status::Converged,
            _ if value == f64::INFINITY => Status::NumericalError,
            Self::Stagnation if !with_target => Status::Converged,
            _ => Status::IterationLimit,
        }
    }
}

/// Outcome of a run.
///
/// ```
/// use tdcr::solve::pso::{Pointwise, PsoSettings, Stop, Swarm};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let settings = PsoSettings { max_iterations: 2, target: Some(0.0), ..PsoSettings::default() };
/// let mut swarm = Swarm::new(settings, &[-1.0], &[1.0])?;
/// let Ok(report) = swarm.run(&mut Pointwise(|x: &[f64]| x[0] * x[0] + 1.0));
/// assert_eq!((report.stop, report.evaluations), (Stop::Iterations, 3 * 30));
/// assert!(report.message(settings.target).contains("the most allowed"));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// The outcome: converged at the target, or stagnated without one; iteration limit when it
    /// ended above its target, or by a budget; numerical error without any value below infinity.
    pub status: Status,
    /// Why it ended.
    pub stop: Stop,
    /// The lowest value.
    pub value: f64,
    /// Moves of the whole swarm.
    pub iterations: usize,
    /// Evaluations, the start included.
    pub evaluations: usize,
    /// Evaluations that gave NaN.
    pub nan_count: usize,
    /// The seed of the run.
    pub seed: u64,
}

impl Report {
    /// Reason why a run did not converge, in a sentence; empty when it did.
    #[must_use]
    pub fn message(&self, target: Option<f64>) -> String {
        if self.status == Status::Converged {
            return String::new();
        }
        if self.status == Status::NumericalError {
            let Self { evaluations, nan_count, .. } = self;
            return format!(
                "none of {evaluations} evaluations gave a value below infinity, {nan_count} gave NaN"
            );
        }
        let end = match self.stop {
            Stop::Target => "",
            Stop::Stagnation => " and makes no progress",
            Stop::Iterations => ", the most allowed",
            Stop::Evaluations => ", no evaluations left for another",
            Stop::Callback => ", ended by the callback",
        };
        let aim = target.map_or(String::new(), |target| format!(", target {target:e}"));
        format!(
            "the best value is {:e}{aim}, after {} iterations{end}",
            self.value, self.iterations
        )
    }
}
