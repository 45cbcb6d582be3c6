//! Settings: a class for every struct of the core's, written by one macro.

pub(crate) mod bounds;
pub(crate) mod constant_curvature;
pub(crate) mod fields;
pub(crate) mod inverse;
pub(crate) mod linkage;
pub(crate) mod prebend;
pub(crate) mod pso;
pub(crate) mod rod;
pub(crate) mod routing;

use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

use crate::settings::constant_curvature::ConstantCurvatureSettings;
use crate::settings::inverse::InverseSettings;
use crate::settings::linkage::LinkageSettings;
use crate::settings::prebend::PrebendSettings;
use crate::settings::pso::PsoSettings;
use crate::settings::rod::RodSettings;
use crate::settings::routing::RoutingSettings;

/// Defaults of the core's settings by class name, for the test that compares them with Python's.
#[pyfunction]
pub(crate) fn _rust_defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    [
        ("LinkageSettings", LinkageSettings::default().keywords(py)?),
        ("ConstantCurvatureSettings", ConstantCurvatureSettings::default().keywords(py)?),
        ("InverseSettings", InverseSettings::default().keywords(py)?),
        ("RodSettings", RodSettings::default().keywords(py)?),
        ("PrebendSettings", PrebendSettings::default().keywords(py)?),
        ("RoutingSettings", RoutingSettings::default().keywords(py)?),
        ("PsoSettings", PsoSettings::default().keywords(py)?),
    ]
    .into_py_dict(py)
}
