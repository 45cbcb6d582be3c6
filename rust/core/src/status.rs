//! Outcomes of a solve.

use std::fmt;

/// Outcome of a solve: data, not an error.
///
/// ```
/// use tdcr::Status;
///
/// assert_eq!(Status::IterationLimit.as_str(), "iteration_limit");
/// assert_eq!(Status::ALL.len(), 5);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Status {
    /// The conditions of the model hold to the stated tolerance.
    Converged,
    /// Nothing satisfies the request; the message says why.
    Infeasible,
    /// The nearest answer is given; the target itself is out of reach.
    Unreachable,
    /// The iteration budget ran out before the tolerance was met.
    IterationLimit,
    /// The arithmetic broke down.
    NumericalError,
}

impl Status {
    /// Every status, in the order of their discriminants.
    pub const ALL: [Self; 5] = [
        Self::Converged,
        Self::Infeasible,
        Self::Unreachable,
        Self::IterationLimit,
        Self::NumericalError,
    ];

    /// The name used in Python, files and messages.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::Infeasible => "infeasible",
            Self::Unreachable => "unreachable",
            Self::IterationLimit => "iteration_limit",
            Self::NumericalError => "numerical_error",
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
