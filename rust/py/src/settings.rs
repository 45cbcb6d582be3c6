//! Settings of the models.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use tdcr::InvalidInput;
use tdcr::constant_curvature as cc;
use tdcr::linkage;
use tdcr::solve::pso::PsoSettings;

use crate::arguments::whole;
use crate::convert::invalid;
use crate::pso_settings;

/// How precisely and how long the linkage model solves each subsegment.
///
/// Parameters
/// ----------
/// step_tolerance : float, optional
///     A subsegment is solved when a full Newton step falls below this [rad]; the error left is
///     about its square. In (0, 1e-3].
/// max_iterations : int, optional
///     Newton steps per subsegment at most.
///
/// Raises
/// ------
/// InvalidInput
///     A value out of range.
#[pyclass(frozen, eq, module = "tdcr")]
#[derive(Clone, PartialEq)]
pub(crate) struct LinkageSettings(pub(crate) linkage::LinkageSettings);

fn max_iterations(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    whole("max_iterations", value)
}

#[pymethods]
impl LinkageSettings {
    #[new]
    #[pyo3(signature = (*, step_tolerance=1e-9, max_iterations=50))]
    fn new(
        step_tolerance: f64,
        #[pyo3(from_py_with = max_iterations)] max_iterations: usize,
    ) -> PyResult<Self> {
        let settings = linkage::LinkageSettings { step_tolerance, max_iterations };
        settings.validate().map_err(|e| invalid(&e))?;
        Ok(Self(settings))
    }

    /// Bound on the last Newton step [rad].
    #[getter]
    fn step_tolerance(&self) -> f64 {
        self.0.step_tolerance
    }

    /// Newton steps per subsegment at most.
    #[getter]
    fn max_iterations(&self) -> usize {
        self.0.max_iterations
    }

    fn __hash__(&self) -> u64 {
        self.0.step_tolerance.to_bits().rotate_left(17) ^ self.0.max_iterations as u64
    }

    fn __repr__(&self) -> String {
        let linkage::LinkageSettings { step_tolerance, max_iterations } = self.0;
        format!(
            "LinkageSettings(step_tolerance={step_tolerance:?}, max_iterations={max_iterations})"
        )
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("step_tolerance", self.step_tolerance())?;
        keywords.set_item("max_iterations", self.max_iterations())?;
        Ok((PyTuple::empty(py), keywords))
    }
}

/// Choices of the constant-curvature model.
///
/// Parameters
/// ----------
/// coupling : {"coupled", "per_segment"}, optional
///     "coupled": displacements are measured at the base, and a tendon is shortened in every segment
///     it runs through. "per_segment": each displacement is the part inside the segment where the
///     tendon ends.
/// extensible : bool, optional
///     Whether the length of every segment is an unknown too. At least three tendons must end at
///     each segment that has any.
///
/// Raises
/// ------
/// InvalidInput
///     Another coupling.
#[pyclass(frozen, eq, hash, module = "tdcr")]
#[derive(Clone, PartialEq, Eq, Hash)]
pub(crate) struct ConstantCurvatureSettings(pub(crate) cc::ConstantCurvatureSettings);

#[pymethods]
impl ConstantCurvatureSettings {
    #[new]
    #[pyo3(signature = (*, coupling="coupled", extensible=false))]
    fn new(coupling: &str, extensible: bool) -> PyResult<Self> {
        let known = cc::Coupling::ALL.into_iter().find(|known| known.as_str() == coupling);
        let Some(coupling) = known else {
            let expected = "\"coupled\" or \"per_segment\"";
            let got = format!("\"{coupling}\"");
            return Err(invalid(&InvalidInput::new("coupling", expected, got)));
        };
        Ok(Self(cc::ConstantCurvatureSettings { coupling, extensible }))
    }

    /// How displacements reach the segments: "coupled" or "per_segment".
    #[getter]
    fn coupling(&self) -> &'static str {
        self.0.coupling.as_str()
    }

    /// Whether the length of every segment is an unknown too.
    #[getter]
    fn extensible(&self) -> bool {
        self.0.extensible
    }

    fn __repr__(&self) -> String {
        let extensible = if self.0.extensible { "True" } else { "False" };
        format!(
            "ConstantCurvatureSettings(coupling={:?}, extensible={extensible})",
            self.coupling()
        )
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("coupling", self.coupling())?;
        keywords.set_item("extensible", self.extensible())?;
        Ok((PyTuple::empty(py), keywords))
    }
}

/// Defaults of the core's settings by class name, for the test that compares them with Python's.
#[pyfunction]
pub(crate) fn _rust_defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let linkage = linkage::LinkageSettings::default();
    let values = PyDict::new(py);
    values.set_item("step_tolerance", linkage.step_tolerance)?;
    values.set_item("max_iterations", linkage.max_iterations)?;
    let defaults = PyDict::new(py);
    defaults.set_item("LinkageSettings", values)?;
    let curvature = cc::ConstantCurvatureSettings::default();
    let values = PyDict::new(py);
    values.set_item("coupling", curvature.coupling.as_str())?;
    values.set_item("extensible", curvature.extensible)?;
    defaults.set_item("ConstantCurvatureSettings", values)?;
    defaults.set_item("PsoSettings", pso_settings::keywords(py, &PsoSettings::default())?)?;
    Ok(defaults)
}
