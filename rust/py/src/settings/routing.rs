//! Settings of routing designs.

use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use tdcr::design;

use crate::convert::arguments::number;
use crate::convert::arrays::type_name;
use crate::settings::fields::{Count, Kind, Number, Optional, Unsigned, settings_class};
use crate::settings::rod::RodSettings;

settings_class! {
    /// Choices of a routing design.
    RoutingSettings: design::RoutingSettings, checked by design::RoutingSettings::validate; {
        /// rod : RodSettings, optional
        ///     Of the rod model that the design is for; sliding tendons.
        rod: RodSettings = None, "Settings of the rod model that the design is for.";

        /// holes : int or None, optional
        ///     Evenly spaced holes per disk, 1 to 360; None: any azimuth.
        holes: Optional<Count> = 12, "Evenly spaced holes per disk, or None for any azimuth.";

        /// azimuth : float, optional
        ///     Azimuth of hole 0 [rad].
        azimuth: Unsigned<Number> = 0.0, "Azimuth of hole 0 [rad].";

        /// max_jump : int, optional
        ///     How many holes a tendon moves on from one disk to the next at most; None: any number. With
        ///     holes only.
        max_jump: Optional<Count> = None,
            "How many holes a tendon moves on from disk to disk at most, or None.";

        /// radius : (float, float), optional
        ///     Smallest and largest radius of holes [m], with `holes=None` only; None: the radii of the
        ///     robot's tendons.
        radius: Optional<Pair> = None, "Smallest and largest radius of holes [m], or None.";

        /// beam_width : int, optional
        ///     Beginnings of routings that the search follows from disk to disk. Where it is no smaller than
        ///     the number of all routings of one tendon, all are tried.
        beam_width: Count = 256, "Beginnings of routings that the search follows.";

        /// tolerance : float, optional
        ///     Distance of every disk from its wanted place that counts as reached, in shares of the robot's
        ///     length. In (0, 1e-2].
        tolerance: Number = 1e-08, "Distance that counts as reached, in shares of the robot's length.";

        /// max_iterations : int, optional
        ///     Steps of a descent, and rounds of the search around a routing of several tendons, at most.
        max_iterations: Count = 100, "Steps of a descent, and rounds of a search, at most.";
    }

    /// Raises
    /// ------
    /// InvalidInput
    ///     A value out of range; proportional tendons; radii where holes are given.
    /// TypeError
    ///     A value of another type.
    methods {}
}

/// Both ends of a range of radii.
struct Pair;

impl Kind for Pair {
    type Value = (f64, f64);

    fn read(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<(f64, f64)> {
        let wrong = || {
            let got = type_name(value);
            PyTypeError::new_err(format!(
                "{argument}: expected a pair (smallest, largest), got {got}"
            ))
        };
        let items: Vec<Bound<'_, PyAny>> =
            value.try_iter().map_err(|_| wrong())?.collect::<PyResult<_>>()?;
        let [low, high] = items.as_slice() else { return Err(wrong()) };
        Ok((number(argument, low)?, number(argument, high)?))
    }

    fn show<'py>(py: Python<'py>, value: &(f64, f64)) -> PyResult<Bound<'py, PyAny>> {
        value.into_bound_py_any(py)
    }
}
