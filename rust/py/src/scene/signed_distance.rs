//! `SignedDistance`.

use std::sync::Arc;

use nalgebra::Vector3;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use tdcr::obstacle::{self as core, Fault, by_differences};

use crate::convert::arguments::{number_of_point, wrong_type};
use crate::convert::arrays::vector;
use crate::scene::obstacle::Obstacle;

/// A volume that a Python function describes.
///
/// Parameters
/// ----------
/// f : callable
///     Takes a point, an array of shape (3,) in the world frame [m], and returns its signed distance
///     [m]: negative inside, positive outside. It need not be a distance far from the surface, but
///     its gradient there should be of order one.
/// gradient : callable, optional
///     Takes a point and returns the gradient of `f`, shape (3,). Default: central differences of
///     `f`, six calls a point.
/// inside : bool, optional
///     The robot stays in the volume instead of out of it.
///
/// Raises
/// ------
/// TypeError
///     A value that is not callable.
#[pyclass(frozen, extends = Obstacle, module = "tdcr")]
pub(crate) struct SignedDistance {
    f: Py<PyAny>,
    gradient: Option<Py<PyAny>>,
}

fn call<'py>(
    py: Python<'py>,
    function: &Py<PyAny>,
    x: &Vector3<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    // A new array every time: the function may keep it.
    function.bind(py).call1((PyArray1::from_slice(py, x.as_slice()),))
}

fn value(f: &Py<PyAny>, x: &Vector3<f64>) -> Result<f64, Fault> {
    let call = |py: Python<'_>| number_of_point("f", "one number for a point", &call(py, f, x)?);
    Ok(Python::attach(call)?)
}

fn function(f: &Py<PyAny>, gradient: Option<&Py<PyAny>>, py: Python<'_>) -> core::DistanceFunction {
    let f = f.clone_ref(py);
    let Some(gradient) = gradient else {
        return by_differences(move |x| value(&f, x));
    };
    let gradient = gradient.clone_ref(py);
    Arc::new(move |x| {
        let slope = |py: Python<'_>| vector("gradient", &call(py, &gradient, x)?);
        Ok((value(&f, x)?, Python::attach(slope)?))
    })
}

fn callable(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
    if value.is_callable() {
        return Ok(value.clone().unbind());
    }
    Err(wrong_type(argument, "a callable", value))
}

#[pymethods]
impl SignedDistance {
    #[new]
    #[pyo3(signature = (f, gradient=None, *, inside=false))]
    fn new(
        f: &Bound<'_, PyAny>,
        gradient: Option<&Bound<'_, PyAny>>,
        inside: bool,
    ) -> PyResult<PyClassInitializer<Self>> {
        let py = f.py();
        let f = callable("f", f)?;
        let gradient = gradient.map(|g| callable("gradient", g)).transpose()?;
        let volume = core::SignedDistance::new(function(&f, gradient.as_ref(), py));
        Ok(Obstacle::new(volume, inside).initializer().add_subclass(Self { f, gradient }))
    }

    /// The function of the distance.
    #[getter]
    fn f(&self, py: Python<'_>) -> Py<PyAny> {
        self.f.clone_ref(py)
    }

    /// The function of the gradient, or None. (`gradient` is the method that all obstacles have.)
    #[getter]
    fn gradient_function(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        self.gradient.as_ref().map(|gradient| gradient.clone_ref(py))
    }

    /// Equal by their functions.
    fn __eq__(slf: PyRef<'_, Self>, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        let py = other.py();
        let Ok(other) = other.cast::<Self>() else { return Ok(false) };
        let key = |one: &PyRef<'_, Self>| {
            (one.f(py), one.gradient_function(py), one.as_super().0.inside()).into_pyobject(py)
        };
        key(&slf)?.eq(key(&other.borrow())?)
    }

    fn __hash__(slf: PyRef<'_, Self>, py: Python<'_>) -> PyResult<isize> {
        let inside = slf.as_super().0.inside();
        (slf.f(py), slf.gradient_function(py), inside).into_pyobject(py)?.hash()
    }

    fn __repr__(slf: PyRef<'_, Self>, py: Python<'_>) -> PyResult<String> {
        let f = slf.f.bind(py).repr()?;
        let arguments = match &slf.gradient {
            Some(gradient) => format!("{f}, {}", gradient.bind(py).repr()?),
            None => f.to_string(),
        };
        Ok(slf.as_super().text("SignedDistance", &arguments))
    }

    fn __getnewargs_ex__<'py>(
        slf: PyRef<'py, Self>,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        slf.as_super().new_args((slf.f(py), slf.gradient_function(py)).into_pyobject(py)?)
    }
}
