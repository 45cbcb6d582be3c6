//! The engine of `forward_batch`.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use rayon::ThreadPool;

use tdcr::batch::{Field, Key, Solved, chain_rows, pool, solve_rows};
use tdcr::constant_curvature::ConstantCurvature;
use tdcr::linkage::Linkage;
use tdcr::model::Model;
use tdcr::obstacle::FirstFault;
use tdcr::rod::Rod;
use tdcr::rod::contact::LoadedRod;
use tdcr::{InvalidInput, Status};

use crate::convert::arguments::{optional, whole};
use crate::convert::arrays::{float_array, frozen, invalid, status, values, wrong_shape};
use crate::convert::interruptible;
use crate::forward::model_choice::{Choice, not_around};
use crate::robot::Robot;
use crate::scene::contact;
use crate::scene::{self, Surroundings};

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
    let choice = Choice::new(model, settings)?;
    if warm && !matches!(choice, Choice::Rod(_)) {
        let got = format!("True for model \"{model}\"");
        return Err(invalid(&InvalidInput::new("warm", "False, or model \"rod\"", got)));
    }
    let around = Surroundings::new(py, Some(obstacles), loads)?;
    if around.any().is_some() && !matches!(choice, Choice::Rod(_)) {
        return Err(not_around(&around, model));
    }
    let core = &robot.get().0;
    let tendons = core.tendons().len();
    let array = float_array("displacements", displacements)?;
    let &[rows, columns] = array.shape() else {
        let expected = format!("shape (B, {tendons}); forward takes ({tendons},)");
        return Err(wrong_shape("displacements", &expected, array.shape()));
    };
    if columns != tendons {
        let expected = format!("shape (B, {tendons}), one column per tendon");
        return Err(wrong_shape("displacements", &expected, array.shape()));
    }
    let fields = fields.iter().map(|name| Field::named(name)).collect::<Result<Vec<_>, _>>();
    let fields = fields.map_err(|e| invalid(&e))?;
    let threads = optional("threads", threads, whole)?;
    let pool = pool(threads).map_err(|e| invalid(&e))?;
    let flat = values(&array)?;
    let batch = Batch { displacements: flat, rows, tendons, fields: &fields, pool: &pool, warm };
    let kept = robot.get();
    let solved = match choice {
        Choice::Rod(settings) => {
            let plan = kept.rod_plan(settings).map_err(|e| invalid(&e))?;
            if around.any().is_some() {
                let scene = around.scene(core, &plan, &settings).map_err(|e| invalid(&e))?;
                let rod = LoadedRod::new(core, &plan, &scene).map_err(|e| invalid(&e))?;
                let mut first_fault = FirstFault::default();
                let rod = |stop| {
                    around.stopped_by(&stop);
                    first_fault = FirstFault::raising(stop);
                    rod.reporting_to(&first_fault)
                };
                // After Ctrl-C, which is raised here, functions fail because of it.
                let solved = batch.solve(py, rod, progress)?;
                scene::checked(py, first_fault.take())?;
                return export(py, &batch, solved);
            }
            let rod = |stop| Rod::new(core, &plan).stopped_by(stop);
            batch.solve(py, rod, progress)
        }
        Choice::Linkage(settings) => {
            let plan = kept.linkage_plan().map_err(|e| invalid(&e))?;
            let model = Linkage::new(core, plan, settings).map_err(|e| invalid(&e))?;
            batch.solve(py, |_| model, progress)
        }
        Choice::ConstantCurvature(settings) => {
            let plan = kept.constant_curvature_plan(settings).map_err(|e| invalid(&e))?;
            batch.solve(py, |_| ConstantCurvature::new(core, plan), progress)
        }
    }?;
    export(py, &batch, solved)
}

/// What all models' batches have.
struct Batch<'a> {
    displacements: &'a [f64],
    rows: usize,
    tendons: usize,
    fields: &'a [Field],
    pool: &'a ThreadPool,
    warm: bool,
}

impl Batch<'_> {
    /// Solves all rows with a model that may listen to a stop flag.
    fn solve<M: Model>(
        &self,
        py: Python<'_>,
        model: impl FnOnce(Arc<AtomicBool>) -> M + Send,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Solved> {
        let &Self { displacements, rows, fields, pool, warm, .. } = self;
        let solve = if warm { chain_rows } else { solve_rows };
        let solved = interruptible::run(py, progress, |control| {
            solve(&model(Arc::clone(&control.stop)), displacements, rows, fields, pool, control)
        })?;
        // Stopped only by an interrupt, which run has raised; an empty answer then is never seen.
        Ok(solved.map_err(|e| invalid(&e))?.unwrap_or_default())
    }
}

fn export<'py>(py: Python<'py>, batch: &Batch<'_>, solved: Solved) -> PyResult<Bound<'py, PyDict>> {
    let &Batch { displacements, rows, tendons, fields, .. } = batch;
    let answer = PyDict::new(py);
    answer.set_item("displacements", frozen(py, displacements.to_vec(), &[rows, tendons])?)?;
    if fields.contains(&Field::Contacts) {
        answer.set_item(Field::Contacts.as_str(), contact::table(py, &solved.contacts)?)?;
    }
    if fields.contains(&Field::TendonPoints) {
        answer.set_item(Field::TendonPoints.as_str(), PyList::empty(py))?;
    }
    for column in solved.columns {
        let shape: Vec<usize> = std::iter::once(rows).chain(column.shape).collect();
        let array = frozen(py, column.values, &shape)?;
        let name = column.key.field().as_str();
        match column.key {
            Key::TendonPoints(_) => {
                if let Some(list) = answer.get_item(name)? {
                    list.cast::<PyList>()?.append(array)?;
                }
            }
            _ => answer.set_item(name, array)?,
        }
    }
    let mut statuses = Vec::with_capacity(rows);
    for report in &solved.reports {
        statuses.push(status(py, report.status)?.unbind());
    }
    answer.set_item("status", frozen(py, statuses, &[rows])?)?;
    let ok = solved.reports.iter().map(|r| r.status == Status::Converged).collect();
    answer.set_item("ok", frozen::<bool>(py, ok, &[rows])?)?;
    let residual = solved.reports.iter().map(|r| r.residual).collect();
    answer.set_item("residual", frozen::<f64>(py, residual, &[rows])?)?;
    let iterations = solved.reports.iter().map(|r| r.iterations as u64).collect();
    answer.set_item("iterations", frozen::<u64>(py, iterations, &[rows])?)?;
    Ok(answer)
}
