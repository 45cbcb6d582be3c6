//! Settings of the inverse.

use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;

use tdcr::InvalidInput;
use tdcr::inverse;
use tdcr::solve::pso;

use crate::convert::arguments::{OneOrMany, number};
use crate::convert::arrays::{invalid, one_or_tuple};
use crate::settings::fields::{Count, Flag, Float, Kind, Seed, settings_class};
use crate::settings::pso::PsoSettings;

settings_class! {
    /// How precisely, how long and with which weights an inverse is sought.
    InverseSettings: inverse::InverseSettings, checked by inverse::InverseSettings::validate; {
        /// position_tolerance : float, optional
        ///     Distance to the target that counts as reached [m].
        position_tolerance: Float = 1e-10, "Distance that counts as reached [m].";

        /// rotation_tolerance : float, optional
        ///     Angle to the target that counts as reached [rad].
        rotation_tolerance: Float = 1e-10, "Angle that counts as reached [rad].";

        /// position_weight : float or (float, float, float), optional
        ///     Weight of the distance, or of its parts along the world axes; 0 leaves an axis out.
        position_weight: PerAxis = 1.0, "Weight of the distance, one number or one per world axis.";

        /// rotation_weight : float or (float, float, float), optional
        ///     What one radian counts, or one about each tool axis [m]; 0 leaves an axis free: (1, 1, 0) points
        ///     the tool and lets it roll. Default: 0.3 of the robot's length. Weights decide what is nearest to
        ///     a target out of reach.
        rotation_weight: OptionalPerAxis = None,
            "What one radian counts, one number or one per tool axis [m]; None: 0.3 of the robot's length.";

        /// starts : int, optional
        ///     Starts at most before a target counts as out of reach.
        starts: Count = 200, "Starts at most.";

        /// max_iterations : int, optional
        ///     Steps per start at most.
        max_iterations: Count = 50, "Steps per start at most.";

        /// seed : int, optional
        ///     Of the random starts. The same seed gives the same answer on any number of threads.
        seed: Seed = 0, "Seed of the random starts.";

        /// least_energy : bool, optional
        ///     Whether freedom that the target leaves goes to the least bending energy. False keeps the answer
        ///     near its start: a path then has no jumps where a least energy ends at a bound.
        least_energy: Flag = True, "Whether freedom goes to the least bending energy.";

        /// swarm : PsoSettings, optional
        ///     The swarms of method "pso" and of the last resort, their seeds counted from its own. They
        ///     minimise the squared weighted miss over the robot's length. Default: 30 particles that hand
        ///     over to descents at 1 % of the robot's length, or when they stagnate.
        swarm: Swarm = None, "The swarms, or None for the default.";
    }

    /// Raises
    /// ------
    /// InvalidInput
    ///     Tolerances that are not positive, weights that are negative, NaN or zero everywhere, no starts.
    methods {}
}

/// Weights of three axes: one number where they are equal.
struct PerAxis;

impl Kind for PerAxis {
    type Value = [f64; 3];

    fn read(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
        let given = OneOrMany::extract(argument, value, number)?.into_vec();
        match given.as_slice() {
            [one] => Ok([*one; 3]),
            &[x, y, z] => Ok([x, y, z]),
            other => {
                let got = format!("{} numbers", other.len());
                Err(invalid(&InvalidInput::new(argument, "one number or three", got)))
            }
        }
    }

    fn show<'py>(py: Python<'py>, values: &[f64; 3]) -> PyResult<Bound<'py, PyAny>> {
        let equal = values.iter().all(|value| *value == values[0]);
        one_or_tuple(py, if equal { &values[..1] } else { values })
    }
}

/// Weights of three axes, or None for the default ones.
struct OptionalPerAxis;

impl Kind for OptionalPerAxis {
    type Value = [Option<f64>; 3];

    fn read(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Self::Value> {
        if value.is_none() { Ok([None; 3]) } else { Ok(PerAxis::read(argument, value)?.map(Some)) }
    }

    fn show<'py>(py: Python<'py>, values: &Self::Value) -> PyResult<Bound<'py, PyAny>> {
        match *values {
            [Some(x), Some(y), Some(z)] => PerAxis::show(py, &[x, y, z]),
            _ => Ok(py.None().into_bound(py)),
        }
    }
}

/// Settings of swarms, or None for those of the inverse.
struct Swarm;

impl Kind for Swarm {
    type Value = pso::PsoSettings;

    fn read(_: &str, value: &Bound<'_, PyAny>) -> PyResult<pso::PsoSettings> {
        if value.is_none() {
            return Ok(inverse::InverseSettings::default().swarm);
        }
        Ok(value.cast::<PsoSettings>()?.get().0)
    }

    fn show<'py>(py: Python<'py>, value: &pso::PsoSettings) -> PyResult<Bound<'py, PyAny>> {
        let default = inverse::InverseSettings::default().swarm;
        (*value != default).then_some(PsoSettings(*value)).into_bound_py_any(py)
    }
}
