//! Settings of the rod model.

use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;

use tdcr::rod::{self, Subsegment, TendonLaw};

use crate::settings::fields::{Count, Flag, Float, Kind, OneOf, Unsigned, choices, settings_class};

choices!(["", " or "]; Subsegment, TendonLaw);

settings_class! {
    /// Choices of the rod model.
    RodSettings: rod::RodSettings, checked by rod::RodSettings::validate; {
        /// subsegment : {"arc", "link"}, optional
        ///     Kinematics of an element. "arc": of constant strain, a piece of a helix. "link": a rigid link
        ///     that bisects the bend, as in the papers. Both converge with order 2 in the number of elements.
        subsegment: OneOf<Subsegment> = "arc", "Kinematics of an element: \"arc\" or \"link\".";

        /// tendons : {"sliding", "proportional"}, optional
        ///     How a displacement is imposed. "sliding": the total length of a tendon is bounded and it slides
        ///     without friction. "proportional": every piece between two disks shrinks by the same ratio, as in
        ///     the papers.
        tendons: OneOf<TendonLaw> = "sliding",
            "How displacements are imposed: \"sliding\" or \"proportional\".";

        /// elements : int, optional
        ///     Elements between two disks, 1 to 100.
        elements: Count = 1, "Elements between two disks.";

        /// axial : bool, optional
        ///     Whether elements stretch. Needs Young's modulus and diameter of the backbone.
        axial: Flag = False, "Whether elements stretch.";

        /// tolerance : float, optional
        ///     Relative residual of forces and lengths that counts as solved, 1e-13 to 1e-3; among obstacles and
        ///     under loads 5e-11 if it is smaller.
        tolerance: Float = 1e-11, "Relative residual of forces and lengths that counts as solved.";

        /// max_iterations : int, optional
        ///     Evaluations of the whole rod at most, each of which ends in a Newton step.
        max_iterations: Count = 600,
            "Evaluations of the whole rod at most, each of which ends in a Newton step.";

        /// body_radius : float, optional
        ///     Radius of a body around the backbone, which keeps clear of obstacles at the disks' centres [m]. 0:
        ///     only the centres themselves, the tendons' holes and the places opposite to these do.
        body_radius: Unsigned<Float> = 0.0,
            "Radius of a body around the backbone that keeps clear of obstacles [m].";
    }

    /// Raises
    /// ------
    /// InvalidInput
    ///     A value out of range, an unknown name.
    methods {}
}

/// Settings of the rod as a setting of a design, None for the default ones.
impl Kind for RodSettings {
    type Value = rod::RodSettings;

    fn read(_: &str, value: &Bound<'_, PyAny>) -> PyResult<rod::RodSettings> {
        if value.is_none() {
            return Ok(rod::RodSettings::default());
        }
        Ok(value.cast::<Self>()?.get().0)
    }

    fn show<'py>(py: Python<'py>, value: &rod::RodSettings) -> PyResult<Bound<'py, PyAny>> {
        Self(*value).into_bound_py_any(py)
    }
}
