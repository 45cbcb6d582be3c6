//! The engine of `forward_batch`.

use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};

use tdcr::Status;
use tdcr::batch::{Field, Key, Solved, pool};
use tdcr::forward::{Forward, Rows, Solution};

use crate::convert::arguments::{optional, whole};
use crate::convert::arrays::{float_array, frozen, frozen_statuses, invalid, values, wrong_shape};
use crate::convert::interruptible;
use crate::forward::model_choice::model_settings;
use crate::forward::run;
use crate::forward::shape::Shape;
use crate::robot::Robot;
use crate::scene::{Surroundings, contact, raise_fault};

/// Names of the fields a batch can have.
#[pyfunction]
pub(crate) fn _fields(py: Python<'_>) -> PyResult<Bound<'_, PyTuple>> {
    PyTuple::new(py, Field::ALL.map(Field::as_str))
}

/// Columns of a batch by field name; `tdcr.forward_batch` is the face of it.
#[pyfunction]
#[pyo3(signature = (robot, displacements, *, model, obstacles, loads, settings, fields, threads, progress,
    warm))]
#[allow(clippy::too_many_arguments)] // The keywords of forward_batch.
pub(crate) fn _forward_batch<'py>(
    py: Python<'py>,
    robot: &Bound<'py, Robot>,
    displacements: &Bound<'py, PyAny>,
    model: &str,
    obstacles: &Bound<'py, PyAny>,
    loads: Option<&Bound<'py, PyAny>>,
    settings: Option<&Bound<'py, PyAny>>,
    fields: Vec<String>,
    threads: Option<&Bound<'py, PyAny>>,
    progress: Option<&Bound<'py, PyAny>>,
    warm: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let settings = model_settings(model, settings)?;
    settings.check_warm(warm).map_err(|e| invalid(&e))?;
    let around = Surroundings::new(py, Some(obstacles), loads)?;
    let core = &robot.get().0;
    let tendons = core.tendons().len();
    // A row of displacements per solve.
    let array = float_array("displacements", displacements)?;
    let &[rows, columns] = array.shape() else {
        let expected = format!("shape (B, {tendons}); forward takes ({tendons},)");
        return Err(wrong_shape("displacements", &expected, array.shape()));
    };
    if columns != tendons {
        let expected = format!("shape (B, {tendons}), one column per tendon");
        return Err(wrong_shape("displacements", &expected, array.shape()));
    }
    // Fields and threads.
    let fields = fields.iter().map(|name| Field::named(name)).collect::<Result<Vec<_>, _>>();
    let fields = fields.map_err(|e| invalid(&e))?;
    let threads = optional("threads", threads, whole)?;
    let pool = pool(threads).map_err(|e| invalid(&e))?;
    let flat = values(&array)?;
    let wanted = Rows { displacements: flat, count: rows, fields: &fields, warm };
    // All rows on the pool.
    let forward = around.prepare(core, settings)?;
    let (solved, fault) = interruptible::run(py, progress, |control| {
        around.stopped_by(&control.stop);
        let forward = forward.stopped_by(&control.stop);
        (forward.solve_rows(&wanted, &pool, control), forward.take_fault())
    })?;
    // After Ctrl-C, which run has raised, functions fail because of it; an empty answer then is never seen.
    raise_fault(py, fault)?;
    let solved = solved.map_err(|e| invalid(&e))?.unwrap_or_default();
    export(py, &wanted, tendons, solved)
}

/// One row of a warm batch, its chain solved up to there.
#[pyfunction]
pub(crate) fn _chained_shape(
    py: Python<'_>,
    robot: &Bound<'_, Robot>,
    displacements: &Bound<'_, PyAny>,
    row: usize,
    settings: Option<&Bound<'_, PyAny>>,
    obstacles: &Bound<'_, PyAny>,
    loads: Option<&Bound<'_, PyAny>>,
) -> PyResult<Shape> {
    let settings = model_settings("rod", settings)?;
    let array = float_array("displacements", displacements)?;
    let flat = values(&array)?;
    let core = &robot.get().0;
    let tendons = core.tendons().len();
    if !matches!(array.shape(), [rows, columns] if row < *rows && *columns == tendons) {
        let expected = format!("shape (B, {tendons}) with a row {row}");
        return Err(wrong_shape("displacements", &expected, array.shape()));
    }
    let around = Surroundings::new(py, Some(obstacles), loads)?;
    let chained = |forward: &Forward<'_>| forward.chained_shape(flat, row);
    let shape = run(py, around.prepare(core, settings)?, chained)?;
    let displacements = flat[row * tendons..(row + 1) * tendons].to_vec();
    Ok(Shape::new(robot.get().clone(), settings, Solution { displacements, shape }).among(around))
}

fn export<'py>(
    py: Python<'py>,
    wanted: &Rows<'_>,
    tendons: usize,
    solved: Solved,
) -> PyResult<Bound<'py, PyDict>> {
    let &Rows { displacements, count: rows, fields, .. } = wanted;
    // Fields that are there even without rows.
    let answer = PyDict::new(py);
    answer.set_item("displacements", frozen(py, displacements.to_vec(), &[rows, tendons])?)?;
    if fields.contains(&Field::Contacts) {
        answer.set_item(Field::Contacts.as_str(), contact::table(py, &solved.contacts)?)?;
    }
    if fields.contains(&Field::TendonPoints) {
        answer.set_item(Field::TendonPoints.as_str(), PyList::empty(py))?;
    }
    // Columns of the models, tendon points by tendon.
    for column in solved.columns {
        let shape: Vec<usize> = std::iter::once(rows).chain(column.shape).collect();
        let array = frozen(py, column.values, &shape)?;
        let name = column.key.field().as_str();
        match column.key {
            // The list made above has an array per tendon.
            Key::TendonPoints(_) => {
                if let Some(list) = answer.get_item(name)? {
                    list.cast::<PyList>()?.append(array)?;
                }
            }
            _ => answer.set_item(name, array)?,
        }
    }
    // Report of every row.
    let reports = &solved.reports;
    answer.set_item("status", frozen_statuses(py, reports.iter().map(|r| r.status))?)?;
    let ok = reports.iter().map(|r| r.status == Status::Converged).collect();
    answer.set_item("ok", frozen::<bool>(py, ok, &[rows])?)?;
    let residual = reports.iter().map(|r| r.residual).collect();
    answer.set_item("residual", frozen::<f64>(py, residual, &[rows])?)?;
    let iterations = reports.iter().map(|r| r.iterations as u64).collect();
    answer.set_item("iterations", frozen::<u64>(py, iterations, &[rows])?)?;
    Ok(answer)
}
