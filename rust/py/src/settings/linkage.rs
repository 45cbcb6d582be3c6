//! Settings of the linkage model.

use pyo3::prelude::*;

use tdcr::linkage;

use crate::settings::fields::{Count, Float, Kind, settings_class};

settings_class! {
    /// How precisely and how long the linkage model solves each subsegment.
    LinkageSettings: linkage::LinkageSettings, checked by linkage::LinkageSettings::validate; {
        /// step_tolerance : float, optional
        ///     A subsegment is solved when a full Newton step falls below this [rad]; the error left is
        ///     about its square. In (0, 1e-3].
        step_tolerance: ShortFloat = 1e-9, "Bound on the last Newton step [rad].";

        /// max_iterations : int, optional
        ///     Newton steps per subsegment at most.
        max_iterations: Count = 50, "Newton steps per subsegment at most.";
    }

    /// Raises
    /// ------
    /// InvalidInput
    ///     A value out of range.
    methods {}
}

/// A float whose repr is Rust's: 1e-9, not 1e-09.
struct ShortFloat;

impl Kind for ShortFloat {
    type Value = f64;

    fn read(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
        Float::read(argument, value)
    }

    fn show<'py>(py: Python<'py>, value: &f64) -> PyResult<Bound<'py, PyAny>> {
        Float::show(py, value)
    }

    fn text(_: Python<'_>, value: &f64) -> PyResult<String> {
        Ok(format!("{value:?}"))
    }
}
