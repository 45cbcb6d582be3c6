//! The engine of `tdcr.design.routing`; its docstrings are in Python.

use pyo3::prelude::*;
use pyo3::types::PyTuple;

use tdcr::batch::pool;
use tdcr::design::{self, Routed, routing_rows, routing_stopped_by};
use tdcr::forward::{ModelSettings, Solution};

use crate::convert::arguments::{optional, whole};
use crate::convert::arrays::{frozen, invalid, status, vectors};
use crate::convert::interruptible;
use crate::forward::shape::Shape;
use crate::robot::Robot;
use crate::settings::bounds::range;
use crate::settings::routing::RoutingSettings;

/// Robot, shape, displacements, holes, errors, root mean squares, optimality, iterations, evaluations, status and
/// message.
fn fields<'py>(
    py: Python<'py>,
    answer: Routed,
    settings: &design::RoutingSettings,
) -> PyResult<Bound<'py, PyTuple>> {
    let (disks, tendons) = (answer.errors.len(), answer.displacements.len());
    let robot = Robot::from(answer.robot);
    let pulls = answer.displacements.clone();
    let solution = Solution { displacements: pulls, shape: answer.shape };
    let shape = Shape::new(robot.clone(), ModelSettings::Rod(settings.rod), solution);
    let holes = match answer.holes {
        Some(holes) => {
            let rows = holes.into_iter().map(|row| PyTuple::new(py, row));
            PyTuple::new(py, rows.collect::<PyResult<Vec<_>>>()?)?.into_any()
        }
        None => py.None().into_bound(py),
    };
    let fields = [
        Bound::new(py, robot)?.into_any(),
        Bound::new(py, shape)?.into_any(),
        frozen(py, answer.displacements, &[tendons])?.into_bound(py),
        holes,
        frozen(py, answer.errors, &[disks])?.into_bound(py),
        answer.rms.into_pyobject(py)?.into_any(),
        answer.relaxed_rms.into_pyobject(py)?.into_any(),
        answer.optimality.as_str().into_pyobject(py)?.into_any(),
        answer.iterations.into_pyobject(py)?.into_any(),
        answer.evaluations.into_pyobject(py)?.into_any(),
        status(py, answer.status)?,
        answer.message.into_pyobject(py)?.into_any(),
    ];
    PyTuple::new(py, fields)
}

/// The routing nearest to wanted places; `start` is a routed robot and its tensions.
#[pyfunction]
pub(crate) fn _routing<'py>(
    py: Python<'py>,
    robot: &Bound<'py, Robot>,
    targets: &Bound<'py, PyAny>,
    bounds: Option<&Bound<'py, PyAny>>,
    start: Option<(Bound<'py, Robot>, Vec<f64>)>,
    settings: &Bound<'py, RoutingSettings>,
) -> PyResult<Bound<'py, PyTuple>> {
    let targets = vectors("target_positions", targets)?;
    let bounds = bounds.map(|value| range("bounds", value)).transpose()?;
    let (core, settings) = (&robot.get().0, settings.get().0);
    let from = start.as_ref().map(|(robot, tensions)| (&*robot.get().0, tensions.as_slice()));
    let answer = interruptible::run(py, None, |control| {
        routing_stopped_by(core, &targets, bounds.as_ref(), from, &settings, &control.stop)
    })?;
    fields(py, answer.map_err(|e| invalid(&e))?, &settings)
}

/// Nearest routings of all rows, on `threads`.
#[pyfunction]
pub(crate) fn _routing_batch<'py>(
    py: Python<'py>,
    robot: &Bound<'py, Robot>,
    rows: Vec<Bound<'py, PyAny>>,
    bounds: Option<&Bound<'py, PyAny>>,
    settings: &Bound<'py, RoutingSettings>,
    threads: Option<&Bound<'py, PyAny>>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Vec<Bound<'py, PyTuple>>> {
    let rows = rows.iter().map(|row| vectors("target_positions", row));
    let rows = rows.collect::<PyResult<Vec<_>>>()?;
    let bounds = bounds.map(|value| range("bounds", value)).transpose()?;
    let pool = pool(optional("threads", threads, whole)?).map_err(|e| invalid(&e))?;
    let (core, settings) = (&robot.get().0, settings.get().0);
    let answers = interruptible::run(py, progress, |control| {
        routing_rows(core, &rows, bounds.as_ref(), &settings, &pool, control)
    })?;
    let answers = answers.map_err(|e| invalid(&e))?.unwrap_or_default();
    answers.into_iter().map(|answer| fields(py, answer, &settings)).collect()
}
