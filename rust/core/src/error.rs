//! Misuse is an error; a solve that does not converge is an outcome (see [`crate::Status`]).

use std::fmt::Display;

/// An argument that cannot be used, with what was expected and what came.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{argument}: expected {expected}, got {got}")]
pub struct InvalidInput {
    /// The argument as the caller named it, for instance `tendons[2].radius`.
    pub argument: String,
    /// What would have been accepted, with its unit.
    pub expected: String,
    /// What came.
    pub got: String,
}

impl InvalidInput {
    /// From the name of the argument, what was expected and what came.
    pub fn new(
        argument: impl Into<String>,
        expected: impl Into<String>,
        got: impl Display,
    ) -> Self {
        Self { argument: argument.into(), expected: expected.into(), got: got.to_string() }
    }

    /// The same error seen from outside: `radius` becomes `tendons[2].radius`.
    #[must_use]
    pub fn within(mut self, outer: &str) -> Self {
        self.argument = format!("{outer}.{}", self.argument);
        self
    }
}

/// A finite number, with -0.0 made 0.0 so that equal values have equal bits.
///
/// # Errors
/// `InvalidInput` when the value is NaN or infinite.
pub(crate) fn finite(argument: &str, unit: &str, value: f64) -> Result<f64, InvalidInput> {
    if value.is_finite() {
        Ok(value + 0.0)
    } else {
        Err(InvalidInput::new(argument, format!("a finite number [{unit}]"), format!("{value:?}")))
    }
}

/// A length that a robot can have: squares of lengths and their ratios neither overflow nor vanish.
///
/// # Errors
/// `InvalidInput` when it is not.
pub(crate) fn length(argument: &str, value: f64) -> Result<f64, InvalidInput> {
    positive(argument, "m", value)?;
    if (1e-15..=1e15).contains(&value) {
        Ok(value)
    } else {
        Err(InvalidInput::new(argument, "a length from 1e-15 to 1e15 m", format!("{value:?}")))
    }
}

/// A finite number above zero.
///
/// # Errors
/// `InvalidInput` when the value is not.
pub(crate) fn positive(argument: &str, unit: &str, value: f64) -> Result<f64, InvalidInput> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(InvalidInput::new(
            argument,
            format!("a positive finite number [{unit}]"),
            format!("{value:?}"),
        ))
    }
}
