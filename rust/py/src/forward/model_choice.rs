//! Model of a call, by name, with its settings.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::{IntoPyObjectExt, PyTypeInfo};

use tdcr::InvalidInput;
use tdcr::forward::ModelSettings;

use crate::convert::arrays::{invalid, type_name};
use crate::settings::constant_curvature::ConstantCurvatureSettings;
use crate::settings::linkage::LinkageSettings;
use crate::settings::rod::RodSettings;

/// Settings as Python knows them.
pub(crate) fn python_settings(
    py: Python<'_>,
    settings: ModelSettings,
) -> PyResult<Bound<'_, PyAny>> {
    match settings {
        ModelSettings::Rod(own) => RodSettings(own).into_bound_py_any(py),
        ModelSettings::Linkage(own) => LinkageSettings(own).into_bound_py_any(py),
        ModelSettings::ConstantCurvature(own) => {
            ConstantCurvatureSettings(own).into_bound_py_any(py)
        }
    }
}

/// Settings of a model by name, its defaults where none are given: those of another model are `InvalidInput`,
/// anything else is a `TypeError`.
pub(crate) fn model_settings(
    model: &str,
    settings: Option<&Bound<'_, PyAny>>,
) -> PyResult<ModelSettings> {
    let mut choice = ModelSettings::of_model(model).map_err(|e| invalid(&e))?;
    let Some(settings) = settings else { return Ok(choice) };
    match &mut choice {
        ModelSettings::Rod(own) => *own = cast::<RodSettings>(model, settings)?.get().0,
        ModelSettings::Linkage(own) => *own = cast::<LinkageSettings>(model, settings)?.get().0,
        ModelSettings::ConstantCurvature(own) => {
            *own = cast::<ConstantCurvatureSettings>(model, settings)?.get().0;
        }
    }
    Ok(choice)
}

fn cast<'a, 'py, T: PyTypeInfo>(
    model: &str,
    settings: &'a Bound<'py, PyAny>,
) -> PyResult<&'a Bound<'py, T>> {
    settings.cast::<T>().map_err(|_| {
        let expected = T::type_object(settings.py()).name().map(|name| name.to_string());
        let (expected, got) = (expected.unwrap_or_default(), type_name(settings));
        let known = settings.is_instance_of::<RodSettings>()
            || settings.is_instance_of::<LinkageSettings>()
            || settings.is_instance_of::<ConstantCurvatureSettings>();
        if known {
            let expected = format!("{expected} for model \"{model}\"");
            return invalid(&InvalidInput::new("settings", expected, got));
        }
        let message = format!("settings: expected {expected} for model \"{model}\", got {got}");
        PyTypeError::new_err(message)
    })
}
