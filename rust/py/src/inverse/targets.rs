//! Targets of the tool, from Python.

use nalgebra::{Matrix4, Vector3};
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use tdcr::InvalidInput;
use tdcr::inverse::Target;
use tdcr::robot::rigid_motion;

use crate::convert::arrays::{float_array, invalid, values, wrong_shape};

/// One target from its numbers: 3 of a position or 16 of a frame.
fn target(argument: &str, numbers: &[f64]) -> Result<Target, InvalidInput> {
    let made = if numbers.len() == 3 {
        Target::point(Vector3::from_column_slice(numbers))
    } else {
        rigid_motion("target", &Matrix4::from_row_slice(numbers)).map(|pose| Target::frame(&pose))
    };
    made.map_err(|error| InvalidInput { argument: argument.to_owned(), ..error })
}

/// A single target.
pub(crate) fn one_target(value: &Bound<'_, PyAny>) -> PyResult<Target> {
    let array = float_array("target", value)?;
    match array.shape() {
        [3] | [4, 4] => target("target", values(&array)?).map_err(|e| invalid(&e)),
        shape => {
            let expected = "a position of shape (3,) or a frame of shape (4, 4)";
            Err(wrong_shape("target", expected, shape))
        }
    }
}

/// Rows of targets.
pub(crate) fn many_targets(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<Target>> {
    let array = float_array(argument, value)?;
    let width = match array.shape() {
        [_, 3] => 3,
        [_, 4, 4] => 16,
        shape => {
            let expected = "positions of shape (B, 3) or frames of shape (B, 4, 4)";
            return Err(wrong_shape(argument, expected, shape));
        }
    };
    let rows = values(&array)?.chunks_exact(width).enumerate();
    rows.map(|(row, numbers)| {
        target(argument, numbers).map_err(|error| {
            invalid(&InvalidInput { got: format!("{} in row {row}", error.got), ..error })
        })
    })
    .collect()
}
