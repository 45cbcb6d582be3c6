//! Arguments that are numbers, counts and names: a wrong type is a `TypeError` that names the argument,
//! a number that cannot be used is `InvalidInput`.

use numpy::{PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyOverflowError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyByteArray, PyBytes, PyDict, PyFloat, PyFrozenSet, PySet, PyString};

use tdcr::InvalidInput;

use crate::convert::arrays::{invalid, type_name, wrong_shape};

pub(crate) fn wrong_type(argument: &str, expected: &str, value: &Bound<'_, PyAny>) -> PyErr {
    PyTypeError::new_err(format!("{argument}: expected {expected}, got {}", type_name(value)))
}

/// True and False are integers to Python, but no lengths or counts to anybody.
fn is_bool(value: &Bound<'_, PyAny>) -> bool {
    value.is_instance_of::<PyBool>() || type_name(value).starts_with("bool")
}

/// A number.
pub(crate) fn number(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    let wrong = || wrong_type(argument, "a number", value);
    if is_bool(value) {
        return Err(wrong());
    }
    value.extract().map_err(|error: PyErr| {
        if error.is_instance_of::<PyOverflowError>(value.py()) {
            return invalid(&InvalidInput::new(argument, "a number of float64", "a larger one"));
        }
        wrong()
    })
}

/// Number that a function returned for one point.
pub(crate) fn number_of_point(
    argument: &str,
    expected: &str,
    value: &Bound<'_, PyAny>,
) -> PyResult<f64> {
    if let Ok(value) = value.cast::<PyFloat>() {
        return Ok(value.value());
    }
    if let Ok(array) = value.cast::<PyUntypedArray>()
        && array.ndim() != 0
    {
        return Err(wrong_shape(argument, expected, array.shape()));
    }
    number(argument, value)
}

/// A whole number of 0 or more.
pub(crate) fn whole(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<usize> {
    let wrong = || wrong_type(argument, "an int", value);
    if is_bool(value) {
        return Err(wrong());
    }
    let refuse = || invalid(&InvalidInput::new(argument, "a whole number in range", value));
    let integer: i64 = value.extract().map_err(|error: PyErr| {
        if error.is_instance_of::<PyOverflowError>(value.py()) { refuse() } else { wrong() }
    })?;
    usize::try_from(integer).map_err(|_| refuse())
}

/// A name.
pub(crate) fn text(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<String> {
    let Ok(text) = value.cast::<PyString>() else {
        return Err(wrong_type(argument, "a str", value));
    };
    text.to_cow().map(std::borrow::Cow::into_owned).map_err(|_| {
        invalid(&InvalidInput::new(argument, "text of whole characters", "a lone surrogate"))
    })
}

/// An optional argument.
pub(crate) fn optional<T>(
    argument: &str,
    value: Option<&Bound<'_, PyAny>>,
    extract: fn(&str, &Bound<'_, PyAny>) -> PyResult<T>,
) -> PyResult<Option<T>> {
    value.map(|value| extract(argument, value)).transpose()
}

/// One of something or a sequence of them.
pub(crate) enum OneOrMany<T> {
    /// A single one.
    One(T),
    /// One per stretch, disk or subsegment.
    Many(Vec<T>),
}

impl<T> OneOrMany<T> {
    /// A sequence if it is one, else a single value.
    pub(crate) fn extract(
        argument: &str,
        value: &Bound<'_, PyAny>,
        extract: fn(&str, &Bound<'_, PyAny>) -> PyResult<T>,
    ) -> PyResult<Self> {
        // Iterable, but not in the order of anything.
        let loose = value.is_instance_of::<PyDict>()
            || value.is_instance_of::<PySet>()
            || value.is_instance_of::<PyFrozenSet>();
        let characters = value.is_instance_of::<PyString>()
            || value.is_instance_of::<PyBytes>()
            || value.is_instance_of::<PyByteArray>();
        if loose || characters {
            return Err(wrong_type(argument, "a number or a sequence of numbers", value));
        }
        match value.try_iter() {
            Ok(items) => {
                items.map(|item| extract(argument, &item?)).collect::<PyResult<_>>().map(Self::Many)
            }
            Err(_) => extract(argument, value).map(Self::One),
        }
    }

    pub(crate) fn into_vec(self) -> Vec<T> {
        match self {
            Self::One(value) => vec![value],
            Self::Many(values) => values,
        }
    }
}
