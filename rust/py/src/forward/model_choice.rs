//! Which model a call takes, with its settings.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::{IntoPyObjectExt, PyTypeInfo};

use tdcr::InvalidInput;
use tdcr::constant_curvature::ConstantCurvatureSettings;
use tdcr::linkage::LinkageSettings;
use tdcr::rod::RodSettings;

use crate::convert::arrays::{invalid, type_name};
use crate::scene::Surroundings;
use crate::settings::{constant_curvature, linkage, rod};

/// A model by name with its settings.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Choice {
    Rod(RodSettings),
    Linkage(LinkageSettings),
    ConstantCurvature(ConstantCurvatureSettings),
}

impl Choice {
    /// Name of the model.
    pub(crate) const fn model(&self) -> &'static str {
        match self {
            Self::Rod(_) => "rod",
            Self::Linkage(_) => "linkage",
            Self::ConstantCurvature(_) => "constant_curvature",
        }
    }

    /// The settings as Python knows them.
    pub(crate) fn settings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match self {
            Self::Rod(own) => rod::RodSettings(*own).into_bound_py_any(py),
            Self::Linkage(own) => linkage::LinkageSettings(*own).into_bound_py_any(py),
            Self::ConstantCurvature(own) => {
                constant_curvature::ConstantCurvatureSettings(*own).into_bound_py_any(py)
            }
        }
    }

    /// Checks the name, and that the settings are those of this model.
    pub(crate) fn new(model: &str, settings: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        match model {
            "rod" => {
                let given = own_settings::<rod::RodSettings>(model, settings)?;
                Ok(Self::Rod(given.map_or_else(Default::default, |s| s.get().0)))
            }
            "linkage" => {
                let given = own_settings::<linkage::LinkageSettings>(model, settings)?;
                Ok(Self::Linkage(given.map_or_else(Default::default, |s| s.get().0)))
            }
            "constant_curvature" => {
                let given =
                    own_settings::<constant_curvature::ConstantCurvatureSettings>(model, settings)?;
                Ok(Self::ConstantCurvature(given.map_or_else(Default::default, |s| s.get().0)))
            }
            _ => {
                let expected = "\"rod\", \"linkage\" or \"constant_curvature\"";
                let got = format!("\"{model}\"");
                Err(invalid(&InvalidInput::new("model", expected, got)))
            }
        }
    }
}

/// Settings of the right class, or none: those of another model are `InvalidInput`, anything else is a
/// `TypeError`.
fn own_settings<'a, 'py, T: PyTypeInfo>(
    model: &str,
    settings: Option<&'a Bound<'py, PyAny>>,
) -> PyResult<Option<&'a Bound<'py, T>>> {
    let Some(settings) = settings else { return Ok(None) };
    settings.cast::<T>().map(Some).map_err(|_| {
        let expected = T::type_object(settings.py()).name().map(|name| name.to_string());
        let (expected, got) = (expected.unwrap_or_default(), type_name(settings));
        let known = settings.is_instance_of::<rod::RodSettings>()
            || settings.is_instance_of::<linkage::LinkageSettings>()
            || settings.is_instance_of::<constant_curvature::ConstantCurvatureSettings>();
        if known {
            let expected = format!("{expected} for model \"{model}\"");
            return invalid(&InvalidInput::new("settings", expected, got));
        }
        let message = format!("settings: expected {expected} for model \"{model}\", got {got}");
        PyTypeError::new_err(message)
    })
}

/// An argument that models without forces or starts do not take.
pub(crate) fn rod_only(argument: &str, model: &str) -> PyErr {
    let got = format!("{argument} for model \"{model}\"");
    invalid(&InvalidInput::new(argument, "none, or model \"rod\"", got))
}

/// Obstacles or loads for a model that knows no forces.
pub(crate) fn not_around(around: &Surroundings, model: &str) -> PyErr {
    rod_only(around.any().unwrap_or("obstacles"), model)
}
