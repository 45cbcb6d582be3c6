//! Misuse is an error; a solve that does not converge is an outcome (see [`crate::Status`]).

use std::fmt::Display;

use nalgebra::{Matrix3, Vector3};

/// An argument that cannot be used, with what was expected and what came.
///
/// ```
/// use tdcr::robot::Tendon;
///
/// let error = Tendon::straight(0.0, -0.01).unwrap_err();
/// assert_eq!(error.argument, "radius");
/// assert_eq!(error.got, "-0.01");
/// ```
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{argument}: expected {expected}, got {got}")]
pub struct InvalidInput {
    /// The argument as the caller named it, for instance `tendons[2].radius`.
    pub argument: String,
    /// Values that would have been accepted, with their unit.
    pub expected: String,
    /// Value that came.
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

    /// Error seen from outside: `radius` becomes `tendons[2].radius`.
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

/// Three finite numbers, without negative zeros.
///
/// # Errors
/// `InvalidInput` when one of them is NaN or infinite.
pub(crate) fn finite_vector(
    argument: &str,
    unit: &str,
    value: &Vector3<f64>,
) -> Result<Vector3<f64>, InvalidInput> {
    if value.iter().all(|component| component.is_finite()) {
        Ok(value.map(|component| component + 0.0))
    } else {
        let got = format!("({:?}, {:?}, {:?})", value.x, value.y, value.z);
        Err(InvalidInput::new(argument, format!("three finite numbers [{unit}]"), got))
    }
}

/// A vector of any length as a unit vector; one that already is stays as it is to the bit.
///
/// # Errors
/// `InvalidInput` when it is zero or not finite.
pub(crate) fn direction(
    argument: &str,
    value: &Vector3<f64>,
) -> Result<Vector3<f64>, InvalidInput> {
    let value = finite_vector(argument, "1", value)?;
    let largest = value.amax();
    if largest == 0.0 {
        return Err(InvalidInput::new(argument, "a direction, not zero", "(0, 0, 0)"));
    }
    if (value.norm() - 1.0).abs() <= 4.0 * f64::EPSILON {
        return Ok(value);
    }
    // Scaled first: the squares of 1e-200 or 1e200 are not numbers one can work with.
    let scaled = value / largest;
    Ok(scaled / scaled.norm())
}

/// Largest error of orthonormality of a rotation matrix: the rounding of hand-typed 1e-10 digits.
const RIGID_TOLERANCE: f64 = 1e-9;

/// Checks that a matrix is a rotation; gives back how far it is from orthonormal.
///
/// # Errors
/// `InvalidInput`, which says that `what` was expected, when it is not.
pub(crate) fn rotation(
    argument: &str,
    what: &str,
    matrix: &Matrix3<f64>,
) -> Result<f64, InvalidInput> {
    let error = (matrix.transpose() * matrix - Matrix3::identity()).amax();
    let got = if error.is_nan() || error > RIGID_TOLERANCE {
        format!("R^T R off by {error:.1e}")
    } else if matrix.determinant() < 0.0 {
        "a reflection (determinant -1)".to_owned()
    } else {
        return Ok(error);
    };
    let expected = format!("{what} (R^T R = I to {RIGID_TOLERANCE:e})");
    Err(InvalidInput::new(argument, expected, got))
}
