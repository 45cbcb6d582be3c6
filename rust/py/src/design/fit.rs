//! The engine of `tdcr.design.fit`; its docstrings are in Python.

use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use nalgebra::Vector3;

use tdcr::batch::pool;
use tdcr::design::{FitSettings, Measured, Parameter, fit};

use crate::convert::arrays::{float_array, frozen, invalid, values};
use crate::convert::interruptible;
use crate::forward::model_choice::model_settings;
use crate::robot::Robot;

/// Robot, values and standard errors by name, residuals after and before, rows that failed, names at their bounds,
/// steps, and whether they converged.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // What a fit is made of.
pub(crate) fn _fit<'py>(
    py: Python<'py>,
    robot: &Bound<'py, Robot>,
    displacements: &Bound<'py, PyAny>,
    points: &Bound<'py, PyAny>,
    held_out: Vec<bool>,
    parameters: Vec<String>,
    model: &str,
    settings: Option<&Bound<'py, PyAny>>,
    robust: bool,
    max_iterations: usize,
) -> PyResult<Bound<'py, PyTuple>> {
    let model = model_settings(model, settings)?;
    // Parameters by name; Python has checked them.
    let kinds: Vec<Parameter> = (parameters.iter())
        .filter_map(|name| Parameter::ALL.into_iter().find(|kind| kind.as_str() == name))
        .collect();
    // Rows as the core has them.
    let points = float_array("measurements", points)?;
    let shape = points.shape().to_vec();
    let points = values(&points)?.chunks_exact(3).map(Vector3::from_column_slice).collect();
    let displacements = values(&float_array("displacements", displacements)?)?.to_vec();
    let measured = Measured { displacements, points, held_out };
    let settings = FitSettings { model, robust, max_iterations };
    // On all cores, listening for Ctrl-C.
    let (core, pool) = (&robot.get().0, pool(None).map_err(|e| invalid(&e))?);
    let found = interruptible::run(py, None, |control| {
        fit(core, &measured, &kinds, &settings, &pool, control)
    })?;
    // Stopped only by an interrupt, which run has raised.
    let Some(found) = found.map_err(|e| invalid(&e))? else { return Ok(PyTuple::empty(py)) };
    // Values by name, and the rest as Python has it.
    let (estimates, errors) = (PyDict::new(py), PyDict::new(py));
    for ((kind, own), error) in found.parameters.into_iter().zip(found.standard_errors) {
        let count = [own.len()];
        estimates.set_item(kind.as_str(), frozen(py, own, &count)?)?;
        errors.set_item(kind.as_str(), frozen(py, error, &count)?)?;
    }
    let array = |points: Vec<Vector3<f64>>| {
        frozen(py, points.iter().flat_map(|p| [p.x, p.y, p.z]).collect::<Vec<f64>>(), &shape)
    };
    let fields = [
        Bound::new(py, Robot::from(found.robot))?.into_any(),
        estimates.into_any(),
        errors.into_any(),
        array(found.residuals)?.into_bound(py),
        array(found.residuals_before)?.into_bound(py),
        found.failed.into_pyobject(py)?.into_any(),
        PyTuple::new(py, found.at_bounds.iter().map(|kind| kind.as_str()))?.into_any(),
        found.iterations.into_pyobject(py)?.into_any(),
        found.converged.into_pyobject(py)?.to_owned().into_any(),
    ];
    PyTuple::new(py, fields)
}
