//! The engine of `inverse_batch` and `track`; their docstrings are in Python.

use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::ThreadPool;

use tdcr::batch::pool;
use tdcr::inverse::{Answer, InverseRows, Inverter, Target, invert_path, invert_rows};
use tdcr::{InvalidInput, Status};

use crate::convert::arguments::{optional, whole};
use crate::convert::arrays::{float_array, frozen, frozen_statuses, invalid, values, wrong_shape};
use crate::convert::interruptible;
use crate::inverse::targets::many_targets;
use crate::inverse::{Engine, Plans, one_start};
use crate::robot::Robot;
use crate::scene::{Surroundings, raise_fault};
use crate::settings::inverse::InverseSettings;

/// Columns of many inverses, each alone (`chain` false) or from the answer of the one before.
#[pyfunction]
#[pyo3(signature = (robot, targets, *, model, start, bounds, settings, search, method, threads, progress, chain,
    obstacles, loads))]
#[allow(clippy::too_many_arguments)] // The keywords of inverse_batch and track.
pub(crate) fn _inverse_batch<'py>(
    py: Python<'py>,
    robot: &Bound<'py, Robot>,
    targets: &Bound<'py, PyAny>,
    model: &str,
    start: Option<&Bound<'py, PyAny>>,
    bounds: Option<&Bound<'py, PyAny>>,
    settings: Option<&Bound<'py, PyAny>>,
    search: Option<&Bound<'py, InverseSettings>>,
    method: &str,
    threads: Option<&Bound<'py, PyAny>>,
    progress: Option<&Bound<'py, PyAny>>,
    chain: bool,
    obstacles: &Bound<'py, PyAny>,
    loads: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let around = Surroundings::new(py, Some(obstacles), loads)?;
    let plans = Plans::new(robot, model, settings, &around)?;
    let engine = plans.engine(robot, bounds, search, method)?;
    let targets = many_targets("targets", targets)?;
    let pool = if chain {
        None
    } else {
        let threads = optional("threads", threads, whole)?;
        Some(pool(threads).map_err(|e| invalid(&e))?)
    };
    let pool = pool.as_deref();
    match &engine {
        Engine::Arcs(inverse) => {
            invert_many(py, &**inverse, &targets, start, pool, progress, &around)
        }
        Engine::Rod(inverse) => {
            let rows = invert_many(py, &**inverse, &targets, start, pool, progress, &around)?;
            raise_fault(py, inverse.take_fault())?;
            Ok(rows)
        }
    }
}

/// On a pool each alone, without one as a path.
fn invert_many<'py, I: Inverter>(
    py: Python<'py>,
    inverse: &I,
    targets: &[Target],
    start: Option<&Bound<'py, PyAny>>,
    pool: Option<&ThreadPool>,
    progress: Option<&Bound<'py, PyAny>>,
    around: &Surroundings,
) -> PyResult<Bound<'py, PyDict>> {
    check_targets(inverse, targets)?;
    let answers = if let Some(pool) = pool {
        let starts = many_starts(inverse.robot(), targets.len(), start)?;
        interruptible::run(py, progress, |control| {
            around.stopped_by(&control.stop);
            invert_rows(inverse, targets, &starts, pool, control)
        })?
    } else {
        let start = one_start(inverse.robot(), start)?;
        interruptible::run(py, progress, |control| {
            around.stopped_by(&control.stop);
            invert_path(inverse, targets, start.as_deref(), control)
        })?
    };
    let answers = answers.map_err(|e| invalid(&e))?;
    // Stopped only by an interrupt, which run has raised; an empty answer then is never seen.
    export(py, answers.unwrap_or_default(), inverse.robot().tendons().len())
}

fn export(py: Python<'_>, rows: InverseRows, tendons: usize) -> PyResult<Bound<'_, PyDict>> {
    let InverseRows { displacements, tensions, answers } = rows;
    let count = [answers.len()];
    let columns = PyDict::new(py);
    columns.set_item("displacements", frozen(py, displacements, &[answers.len(), tendons])?)?;
    columns.set_item("tensions", frozen(py, tensions, &[answers.len(), tendons])?)?;
    columns.set_item("status", frozen_statuses(py, answers.iter().map(|a| a.status))?)?;
    let floats = |column: fn(&Answer) -> f64| answers.iter().map(column).collect::<Vec<f64>>();
    columns.set_item("error", frozen(py, floats(|a| a.distance), &count)?)?;
    columns.set_item("rotation_error", frozen(py, floats(|a| a.angle), &count)?)?;
    let counts = |column: fn(&Answer) -> usize| {
        answers.iter().map(|a| column(a) as u64).collect::<Vec<u64>>()
    };
    columns.set_item("iterations", frozen(py, counts(|a| a.iterations), &count)?)?;
    columns.set_item("starts", frozen(py, counts(|a| a.starts), &count)?)?;
    let ok = answers.iter().map(|a| a.status == Status::Converged).collect();
    columns.set_item("ok", frozen::<bool>(py, ok, &count)?)?;
    Ok(columns)
}

/// Refuses targets that are too far away.
fn check_targets<I: Inverter>(inverse: &I, targets: &[Target]) -> PyResult<()> {
    for (row, target) in targets.iter().enumerate() {
        inverse.check_target(target).map_err(|error| {
            let got = format!("{} in row {row}", error.got);
            invalid(&InvalidInput { argument: "targets".to_owned(), got, ..error })
        })?;
    }
    Ok(())
}

/// Displacements of a start of all rows, or of one for each.
fn many_starts(
    robot: &tdcr::robot::Robot,
    rows: usize,
    value: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<f64>> {
    let Some(value) = value else { return Ok(Vec::new()) };
    let array = float_array("start", value)?;
    let tendons = robot.tendons().len();
    if array.shape() != [tendons] && array.shape() != [rows, tendons] {
        let expected = format!("displacements of shape ({tendons},) or ({rows}, {tendons})");
        return Err(wrong_shape("start", &expected, array.shape()));
    }
    Ok(values(&array)?.to_vec())
}
