//! `cartesian_path`: targets between waypoints.

use numpy::{PyArray, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;

use tdcr::inverse::{Target, cartesian_path as core_path};

use crate::convert::arguments::number;
use crate::convert::arrays::{float_array, invalid};
use crate::inverse::targets::many_targets;

/// A path of the tool through waypoints, for `track` or `inverse_batch`.
///
/// Between two waypoints the position moves evenly along the straight line and the axes turn evenly about
/// one axis, the shorter way round; every waypoint is a row of the path.
///
/// Parameters
/// ----------
/// waypoints : array_like, shape (B, 3) or (B, 4, 4)
///     Positions, or frames [m], in the world.
/// step : float
///     Distance of neighbouring rows at most [m].
/// turn : float, optional
///     Angle between neighbouring frames at most [rad].
///
/// Returns
/// -------
/// ndarray, shape (m, 3) or (m, 4, 4)
///     The path, as many rows as it takes. Yours to change. Rotations are freed of rounding.
///
/// Raises
/// ------
/// InvalidInput
///     Waypoints that are no positions or frames, a step or turn that is not positive and finite, or
///     that makes more than ten million rows.
///
/// Examples
/// --------
/// >>> import tdcr
/// >>> tdcr.cartesian_path([[0.0, 0.0, 0.1], [0.03, 0.0, 0.1]], step=0.01)[:, 0].round(3)
/// array([0.  , 0.01, 0.02, 0.03])
#[pyfunction]
#[pyo3(signature = (waypoints, step, *, turn=None), text_signature = "(waypoints, step, *, turn=0.05)")]
pub(crate) fn cartesian_path<'py>(
    py: Python<'py>,
    waypoints: &Bound<'py, PyAny>,
    step: &Bound<'py, PyAny>,
    turn: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let targets = many_targets("waypoints", waypoints)?;
    // Of no waypoints the path is empty, and still of positions or of frames.
    let frames = float_array("waypoints", waypoints)?.ndim() == 3;
    let step = number("step", step)?;
    let turn = turn.map_or(Ok(0.05), |turn| number("turn", turn))?;
    let path = py.detach(|| core_path(&targets, step, turn)).map_err(|e| invalid(&e))?;
    let rows = path.len();
    let mut flat = Vec::with_capacity(rows * if frames { 16 } else { 3 });
    for target in &path {
        match target {
            Target::Position(point) => flat.extend_from_slice(point.as_slice()),
            Target::Pose(pose) => flat.extend_from_slice(&pose.to_row_major()),
        }
    }
    let array = PyArray::from_vec(py, flat);
    if frames {
        return Ok(array.reshape([rows, 4, 4])?.into_any());
    }
    Ok(array.reshape([rows, 3])?.into_any())
}
