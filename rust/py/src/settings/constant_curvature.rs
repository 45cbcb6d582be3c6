//! Settings of the constant-curvature model.

use pyo3::prelude::*;

use tdcr::constant_curvature::{self, Coupling};

use crate::settings::fields::{Flag, Kind, OneOf, choices, settings_class};

choices!(["", " or "]; Coupling);

settings_class! {
    /// Choices of the constant-curvature model.
    ConstantCurvatureSettings: constant_curvature::ConstantCurvatureSettings, checked by |_| Ok(()); {
        /// coupling : {"coupled", "per_segment"}, optional
        ///     "coupled": displacements are measured at the base, and a tendon is shortened in every segment
        ///     it runs through. "per_segment": each displacement is the part inside the segment where the
        ///     tendon ends.
        coupling: QuotedCoupling = "coupled",
            "How displacements reach the segments: \"coupled\" or \"per_segment\".";

        /// extensible : bool, optional
        ///     Whether the length of every segment is an unknown too. At least three tendons must end at
        ///     each segment that has any.
        extensible: Flag = False, "Whether the length of every segment is an unknown too.";
    }

    /// Raises
    /// ------
    /// InvalidInput
    ///     Another coupling.
    methods {}
}

/// A coupling whose repr has double quotes.
struct QuotedCoupling;

impl Kind for QuotedCoupling {
    type Value = Coupling;

    fn read(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Coupling> {
        OneOf::read(argument, value)
    }

    fn show<'py>(py: Python<'py>, value: &Coupling) -> PyResult<Bound<'py, PyAny>> {
        OneOf::show(py, value)
    }

    fn text(_: Python<'_>, value: &Coupling) -> PyResult<String> {
        Ok(format!("{:?}", value.as_str()))
    }
}
