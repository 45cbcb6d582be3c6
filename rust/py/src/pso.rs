//! The engine of `tdcr.pso.minimize`: a swarm over a Python function.

use std::time::Instant;

use numpy::{PyArray1, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use tdcr::solve::pso::{Objective, Progress, Swarm};

use crate::convert::arguments::number_of_point;
use crate::convert::arrays::{float_array, frozen, invalid, status, values, wrong_shape};
use crate::convert::interruptible::POLL;
use crate::settings::pso::PsoSettings;

/// A Python function with those who follow the run.
struct Function<'a, 'py> {
    f: &'a Bound<'py, PyAny>,
    vectorized: bool,
    callback: Option<&'a Bound<'py, PyAny>>,
    progress: Option<&'a Bound<'py, PyAny>>,
    last_report: Instant,
}

impl Function<'_, '_> {
    fn one(&self, point: &[f64]) -> PyResult<f64> {
        let py = self.f.py();
        // A new array every time: the function may keep it.
        let value = self.f.call1((PyArray1::from_slice(py, point),))?;
        let expected = "one number for a point (vectorized=True takes all points at once)";
        number_of_point("f", expected, &value)
    }

    fn all(&self, points: &[f64], dimensions: usize, values_out: &mut [f64]) -> PyResult<()> {
        let py = self.f.py();
        let count = values_out.len();
        let rows = PyArray1::from_slice(py, points).reshape([count, dimensions])?;
        let array = float_array("f", &self.f.call1((rows,))?)?;
        if array.shape() != [count] {
            let expected = format!("a number for every point, shape ({count},)");
            return Err(wrong_shape("f", &expected, array.shape()));
        }
        values_out.copy_from_slice(values(&array)?);
        Ok(())
    }
}

impl Objective for Function<'_, '_> {
    type Error = PyErr;

    fn values(&mut self, points: &[f64], n: usize, values: &mut [f64]) -> PyResult<()> {
        if self.vectorized {
            return self.all(points, n, values);
        }
        for (value, point) in values.iter_mut().zip(points.chunks_exact(n)) {
            *value = self.one(point)?;
            // Functions written in C never look.
            self.f.py().check_signals()?;
        }
        Ok(())
    }

    fn watch(&mut self, progress: &Progress) -> PyResult<bool> {
        let py = self.f.py();
        // Functions written in C let no other thread run either.
        py.detach(|| ());
        py.check_signals()?;
        if let Some(tell) = self.progress
            && self.last_report.elapsed() >= POLL
        {
            tell.call1((progress.iteration,))?;
            self.last_report = Instant::now();
        }
        match self.callback {
            Some(callback) => callback.call1((progress.iteration, progress.value))?.is_truthy(),
            None => Ok(false),
        }
    }
}

/// The fields of a result, in the order of `tdcr.pso.PsoResult`.
#[pyfunction]
#[pyo3(signature = (f, lower, upper, *, settings, start, vectorized, callback, progress))]
#[allow(clippy::too_many_arguments)] // The keywords of minimize.
pub(crate) fn _pso_minimize<'py>(
    py: Python<'py>,
    f: &Bound<'py, PyAny>,
    lower: &Bound<'py, PyAny>,
    upper: &Bound<'py, PyAny>,
    settings: &Bound<'py, PsoSettings>,
    start: Option<&Bound<'py, PyAny>>,
    vectorized: bool,
    callback: Option<&Bound<'py, PyAny>>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let settings = settings.get().0;
    let (lower, upper) = (bound("lower", lower)?, bound("upper", upper)?);
    let mut swarm = Swarm::new(settings, &lower, &upper).map_err(|e| invalid(&e))?;
    if let Some(points) = start {
        let points = rows("start", points, lower.len())?;
        swarm.start_from(&points).map_err(|e| invalid(&e))?;
    }
    let mut function = Function { f, vectorized, callback, progress, last_report: Instant::now() };
    let report = swarm.run(&mut function)?;
    if let Some(tell) = progress {
        tell.call1((report.iterations,))?;
    }
    let history = swarm.history().to_vec();
    let moves = history.len();
    (
        frozen(py, swarm.best().to_vec(), &[lower.len()])?,
        report.value,
        status(py, report.status)?,
        report.stop.as_str(),
        report.message(settings.target),
        report.iterations,
        report.evaluations,
        report.nan_count,
        frozen(py, history, &[moves])?,
    )
        .into_pyobject(py)
}

/// One bound of the box.
fn bound(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let array = float_array(argument, value)?;
    if array.shape().len() != 1 {
        return Err(wrong_shape(argument, "one number per dimension, shape (n,)", array.shape()));
    }
    Ok(values(&array)?.to_vec())
}

/// One point, or several in rows.
fn rows(argument: &str, value: &Bound<'_, PyAny>, dimensions: usize) -> PyResult<Vec<f64>> {
    let array = float_array(argument, value)?;
    let shape = array.shape();
    if !matches!(shape.len(), 1 | 2) || shape.last() != Some(&dimensions) {
        let expected = format!("shape ({dimensions},) or (m, {dimensions})");
        return Err(wrong_shape(argument, &expected, shape));
    }
    Ok(values(&array)?.to_vec())
}
