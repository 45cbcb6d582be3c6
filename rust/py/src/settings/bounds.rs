//! `Bounds`: what an inverse may use.

use std::hash::{Hash, Hasher};

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use tdcr::InvalidInput;
use tdcr::inverse::{self as core, Range};

use crate::convert::arguments::{OneOrMany, number};
use crate::convert::arrays::{invalid, list_text, one_or_tuple, type_name};

/// Bounds of an inverse. What is left out has no bound but the model's own.
///
/// Parameters
/// ----------
/// displacement : (lower, upper), optional
///     Of tendon displacements [m]: numbers, or sequences with one value per tendon. Negative pulls;
///     infinite is no bound. Constant curvature never releases the only tendon of a segment: shapes
///     that leave its segment straight are not sought.
/// tension : (lower, upper), optional
///     Of tensions, for the rod, in the units of `Shape.tensions`: numbers, or sequences with one value
///     per tendon. A lower bound above 0 keeps tendons taut.
/// curvature : float or sequence of float, optional
///     Largest curvature, one value or one per segment [1/m], for constant curvature. No segment turns
///     by more than a full turn.
/// length : (lower, upper), optional
///     Of the lengths of extensible segments [m]: numbers, or sequences with one value per segment.
///     Default: half to twice the rest length.
///
/// Raises
/// ------
/// InvalidInput
///     NaN, a lower bound above the upper one, a negative curvature, sequences of different lengths.
#[pyclass(frozen, eq, hash, module = "tdcr")]
#[derive(Clone, PartialEq)]
pub(crate) struct Bounds(pub(crate) core::Bounds);

impl Hash for Bounds {
    fn hash<H: Hasher>(&self, state: &mut H) {
        for range in [&self.0.displacement, &self.0.tension, &self.0.curvature, &self.0.length] {
            let values = range.as_ref().map(Range::values);
            for value in values.into_iter().flat_map(|(lower, upper)| lower.iter().chain(upper)) {
                (value + 0.0).to_bits().hash(state);
            }
        }
    }
}

fn numbers(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    OneOrMany::extract(argument, value, number).map(OneOrMany::into_vec)
}

/// A pair of bounds.
pub(crate) fn range(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Range> {
    let wrong = || {
        let got = type_name(value);
        PyTypeError::new_err(format!("{argument}: expected a pair (lower, upper), got {got}"))
    };
    let items: Vec<Bound<'_, PyAny>> =
        value.try_iter().map_err(|_| wrong())?.collect::<PyResult<_>>()?;
    let [lower, upper] = items.as_slice() else {
        let got = format!("{} values", items.len());
        return Err(invalid(&InvalidInput::new(argument, "a pair (lower, upper)", got)));
    };
    Range::new(argument, numbers(argument, lower)?, numbers(argument, upper)?)
        .map_err(|e| invalid(&e))
}

impl Bounds {
    /// `Bounds`, a pair of bounds on displacements, or none.
    pub(crate) fn extract(value: Option<&Bound<'_, PyAny>>) -> PyResult<core::Bounds> {
        let Some(value) = value else { return Ok(core::Bounds::default()) };
        if let Ok(bounds) = value.cast::<Self>() {
            return Ok(bounds.get().0.clone());
        }
        Ok(core::Bounds { displacement: Some(range("bounds", value)?), ..Default::default() })
    }
}

#[pymethods]
impl Bounds {
    #[new]
    #[pyo3(signature = (*, displacement=None, tension=None, curvature=None, length=None))]
    fn new(
        displacement: Option<&Bound<'_, PyAny>>,
        tension: Option<&Bound<'_, PyAny>>,
        curvature: Option<&Bound<'_, PyAny>>,
        length: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let pair = |argument, value: Option<&Bound<'_, PyAny>>| {
            value.map(|value| range(argument, value)).transpose()
        };
        let largest = |value: &Bound<'_, PyAny>| {
            let upper = numbers("curvature", value)?;
            if let Some(negative) = upper.iter().find(|kappa| **kappa < 0.0) {
                let expected = "curvatures of 0 or more [1/m]";
                return Err(invalid(&InvalidInput::new("curvature", expected, negative)));
            }
            Range::new("curvature", vec![0.0], upper).map_err(|e| invalid(&e))
        };
        Ok(Self(core::Bounds {
            displacement: pair("displacement", displacement)?,
            tension: pair("tension", tension)?,
            curvature: curvature.map(largest).transpose()?,
            length: pair("length", length)?,
        }))
    }

    /// Lowest and highest displacements [m], or None.
    #[getter]
    fn displacement<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyTuple>>> {
        pair(py, self.0.displacement.as_ref())
    }

    /// Lowest and highest tensions, or None.
    #[getter]
    fn tension<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyTuple>>> {
        pair(py, self.0.tension.as_ref())
    }

    /// Largest curvatures [1/m], or None.
    #[getter]
    fn curvature<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let range = self.0.curvature.as_ref();
        range.map(|range| one_or_tuple(py, range.values().1)).transpose()
    }

    /// Lowest and highest lengths of segments [m], or None.
    #[getter]
    fn length<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyTuple>>> {
        pair(py, self.0.length.as_ref())
    }

    fn __repr__(&self) -> String {
        let text = |values: &[f64]| match values {
            [one] => format!("{one:?}"),
            many => list_text(many),
        };
        let both = |range: &Range| {
            let (lower, upper) = range.values();
            format!("({}, {})", text(lower), text(upper))
        };
        let displacement =
            self.0.displacement.as_ref().map(|range| format!("displacement={}", both(range)));
        let tension = self.0.tension.as_ref().map(|range| format!("tension={}", both(range)));
        let curvature =
            self.0.curvature.as_ref().map(|range| format!("curvature={}", text(range.values().1)));
        let length = self.0.length.as_ref().map(|range| format!("length={}", both(range)));
        let given: Vec<String> =
            [displacement, tension, curvature, length].into_iter().flatten().collect();
        format!("Bounds({})", given.join(", "))
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("displacement", self.displacement(py)?)?;
        keywords.set_item("tension", self.tension(py)?)?;
        keywords.set_item("curvature", self.curvature(py)?)?;
        keywords.set_item("length", self.length(py)?)?;
        Ok((PyTuple::empty(py), keywords))
    }
}

fn pair<'py>(py: Python<'py>, range: Option<&Range>) -> PyResult<Option<Bound<'py, PyTuple>>> {
    let Some(range) = range else { return Ok(None) };
    let (lower, upper) = range.values();
    PyTuple::new(py, [one_or_tuple(py, lower)?, one_or_tuple(py, upper)?]).map(Some)
}
