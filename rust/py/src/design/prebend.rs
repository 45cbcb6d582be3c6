//! The engines of `tdcr.design`; its docstrings are in Python.

use pyo3::prelude::*;
use pyo3::types::PyTuple;

use tdcr::design::{angle_at_base, points_on_curve, prebend_stopped_by};
use tdcr::forward::{ModelSettings, Solution};
use tdcr::rod::Subsegment;

use crate::convert::arrays::{frozen, frozen_points, invalid, status, vectors};
use crate::convert::interruptible;
use crate::forward::one_row;
use crate::forward::shape::Shape;
use crate::robot::Robot;
use crate::settings::fields::Choice as _;
use crate::settings::prebend::PrebendSettings;

/// Estimated time of a product of small matrices in a descent, with all its starts \[µs\].
const MICROSECONDS_PER_PRODUCT: f64 = 0.5;

/// Robot, shape, errors, iterations, status and message of a design.
#[pyfunction]
pub(crate) fn _prebend<'py>(
    py: Python<'py>,
    robot: &Bound<'py, Robot>,
    targets: &Bound<'py, PyAny>,
    displacements: &Bound<'py, PyAny>,
    settings: &Bound<'py, PrebendSettings>,
) -> PyResult<Bound<'py, PyTuple>> {
    let targets = vectors("target_positions", targets)?;
    let pulls = one_row(robot, displacements)?;
    let (core, settings) = (&robot.get().0, settings.get().0);
    let products = (targets.len().pow(3) * settings.rod.elements) as f64;
    let microseconds = products * settings.max_iterations as f64 * MICROSECONDS_PER_PRODUCT;
    let answer = interruptible::run_if_long(py, microseconds, |control| {
        prebend_stopped_by(core, &targets, &pulls, &settings, &control.stop)
    })?;
    let answer = answer.map_err(|e| invalid(&e))?;
    let disks = answer.errors.len();
    let robot = Robot::from(answer.robot);
    let solution = Solution { displacements: pulls, shape: answer.shape };
    let shape = Shape::new(robot.clone(), ModelSettings::Rod(settings.rod), solution);
    let fields = [
        Bound::new(py, robot)?.into_any(),
        Bound::new(py, shape)?.into_any(),
        frozen(py, answer.errors, &[disks])?.into_bound(py),
        answer.iterations.into_pyobject(py)?.into_any(),
        status(py, answer.status)?,
        answer.message.into_pyobject(py)?.into_any(),
    ];
    PyTuple::new(py, fields)
}

/// Places on a curve that disks 1 to n can have, and the angle at which it leaves the base's z axis [rad].
#[pyfunction]
pub(crate) fn _points_on_curve(
    py: Python<'_>,
    robot: &Bound<'_, Robot>,
    points: &Bound<'_, PyAny>,
    subsegment: &str,
) -> PyResult<(Py<PyAny>, f64)> {
    let kind = Subsegment::from_name("subsegment", subsegment)?;
    let points = vectors("points", points)?;
    let core = &robot.get().0;
    let found = py.detach(|| {
        let places = points_on_curve(core, &points, kind)?;
        Ok((places, angle_at_base(core, &points)?))
    });
    let (places, angle) = found.map_err(|e| invalid(&e))?;
    Ok((frozen_points(py, places.into_iter())?, angle))
}
