//! `jacobian`: the velocity of the tool point by displacements.

use nalgebra::Matrix6xX;
use pyo3::prelude::*;

use tdcr::forward::{Forward, Solution};

use crate::convert::arrays::{frozen, invalid};
use crate::forward::model_choice::model_settings;
use crate::forward::shape::Shape;
use crate::forward::{one_row, run, start_state};
use crate::robot::Robot;

/// Velocity of the tool point per metre of tendon displacement.
///
/// Parameters
/// ----------
/// robot : Robot
/// displacements : array_like, shape (K,)
///     As for `forward` [m].
/// model : {"rod", "constant_curvature"}, optional
/// settings : RodSettings or ConstantCurvatureSettings, optional
///     Those of the model.
/// start : Shape, optional
///     Where the rod's solve starts, as for `forward`. A shape under these displacements leaves nothing
///     to solve.
///
/// Returns
/// -------
/// ndarray, shape (6, K)
///     Velocity of the tool point [m/m], then angular velocity [rad/m], world axes. Exact; finite
///     where the robot is straight. Columns of tendons that do not count are zero: free and slack ones of
///     the rod; of constant curvature, free ones and the only, released one of a segment. A tendon of the
///     rod that is just as long as it may be, without tension, is followed on its pulled side, where it
///     moves the tip: so are all tendons at rest, held at 0. That holds for changes that leave all of
///     these under tension, not for one that lets some go slack: free (`inf`) those. Where taut
///     tendons depend on each other (three on one inextensible segment) no displacement can change
///     alone: the columns are then those of the nearest change that the rod can follow.
///
/// Raises
/// ------
/// InvalidInput
///     As `forward`, for a model without derivatives, and in constant curvature for displacements that
///     leave a segment no length or overflow.
/// NotConverged
///     The rod's solve did not converge; the shape is its `result`.
#[pyfunction]
#[pyo3(signature = (robot, displacements, *, model="rod", settings=None, start=None))]
pub(crate) fn jacobian(
    py: Python<'_>,
    robot: &Bound<'_, Robot>,
    displacements: &Bound<'_, PyAny>,
    model: &str,
    settings: Option<&Bound<'_, PyAny>>,
    start: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let settings = model_settings(model, settings)?;
    settings.check_derivatives().map_err(|e| invalid(&e))?;
    let displacements = one_row(robot, displacements)?;
    let core = &robot.get().0;
    let start = start.map(|start| start_state(core, &settings, start)).transpose()?;
    let forward = Forward::new(core, settings).map_err(|e| invalid(&e))?;
    let columns = run(py, forward, |forward| forward.jacobian(&displacements, start.as_ref()))?;
    match columns {
        Ok(matrix) => frozen_columns(py, &matrix),
        Err(shape) => {
            let shape =
                Shape::new(robot.get().clone(), settings, Solution { displacements, shape });
            Err(Shape::not_converged(&Bound::new(py, shape)?))
        }
    }
}

/// Six rows as a read-only (6, K) array.
pub(crate) fn frozen_columns(py: Python<'_>, matrix: &Matrix6xX<f64>) -> PyResult<Py<PyAny>> {
    // Columns of the transpose are the rows.
    frozen(py, matrix.transpose().as_slice().to_vec(), &[6, matrix.ncols()])
}
