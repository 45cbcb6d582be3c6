//! `forward` and the engine of `forward_batch`.

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use tdcr::batch::{Columns, Fields, pool, solve_rows};
use tdcr::linkage::{self, Linkage};
use tdcr::model::Model;
use tdcr::{InvalidInput, Status};

use crate::convert::{float_array, frozen, invalid, status, type_name, values, wrong_shape};
use crate::long_call;
use crate::robot::Robot;
use crate::settings::LinkageSettings;
use crate::shape::Shape;

/// From tendon displacements to the shape.
///
/// Parameters
/// ----------
/// robot : Robot
/// displacements : array_like, shape (K,)
///     Change of each tendon's length inside the robot, in the order of `robot.tendons` [m].
///     Negative pulls, positive releases, 0 holds the tendon at its rest length, `inf` frees it. A
///     tendon can only pull: its length is at most rest length plus displacement.
/// model : {"linkage"}
///     "linkage": a chain of four-bar (one tendon) or seven-bar linkages (two), the constrained
///     minimum of the coupler angles (Ashwin & Ghosal, "Forward kinematics of cable-driven
///     continuum robot using optimization method"). The two most-pulled tendons on different lines
///     through the centre drive; the bounds of the others are checked. Straight backbones only.
/// settings : LinkageSettings, optional
///
/// Returns
/// -------
/// Shape
///     Not converging is an outcome: see its `status`, `message` and `require`.
///
/// Raises
/// ------
/// InvalidInput
///     NaN, -inf, another number of displacements than tendons, a (B, K) array, an unknown model, a
///     pre-bent backbone, two linkage tendons on one azimuth.
/// TypeError
///     A value of another type.
#[pyfunction]
#[pyo3(signature = (robot, displacements, *, model, settings=None))]
pub(crate) fn forward(
    py: Python<'_>,
    robot: &Bound<'_, Robot>,
    displacements: &Bound<'_, PyAny>,
    model: &str,
    settings: Option<&Bound<'_, PyAny>>,
) -> PyResult<Shape> {
    let settings = linkage_settings(model, settings)?;
    let array = float_array("displacements", displacements)?;
    let tendons = robot.get().0.tendons().len();
    match array.shape() {
        [_] => {}
        [_, _] => {
            let expected = format!("shape ({tendons},); forward_batch takes (B, {tendons})");
            return Err(wrong_shape("displacements", &expected, array.shape()));
        }
        shape => {
            let expected = format!("shape ({tendons},)");
            return Err(wrong_shape("displacements", &expected, shape));
        }
    }
    let displacements = values(&array)?.to_vec();
    let core = &robot.get().0;
    let shape = py
        .detach(|| Linkage::new(core, settings)?.shape(&displacements))
        .map_err(|e| invalid(&e))?;
    Ok(Shape::new(robot.get().clone(), model, displacements, shape))
}

/// The settings of a model, after checking its name and their type.
fn linkage_settings(
    model: &str,
    settings: Option<&Bound<'_, PyAny>>,
) -> PyResult<linkage::LinkageSettings> {
    if model != "linkage" {
        let got = format!("\"{model}\"");
        return Err(invalid(&InvalidInput::new("model", "\"linkage\"", got)));
    }
    let Some(settings) = settings else { return Ok(linkage::LinkageSettings::default()) };
    let settings = settings.cast::<LinkageSettings>().map_err(|_| {
        let got = type_name(settings);
        PyTypeError::new_err(format!(
            "settings: expected LinkageSettings for \"{model}\", got {got}"
        ))
    })?;
    Ok(settings.get().0)
}

/// Columns of a batch by field name; `tdcr.forward_batch` is the face of it.
#[pyfunction]
#[pyo3(signature = (robot, displacements, *, model, settings, fields, threads, progress))]
#[allow(clippy::too_many_arguments)] // The keywords of forward_batch.
pub(crate) fn _forward_batch<'py>(
    py: Python<'py>,
    robot: &Bound<'py, Robot>,
    displacements: &Bound<'py, PyAny>,
    model: &str,
    settings: Option<&Bound<'py, PyAny>>,
    fields: Vec<String>,
    threads: Option<i64>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let settings = linkage_settings(model, settings)?;
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
    let wanted = Fields {
        tip: fields.iter().any(|f| f == "tip"),
        frames: fields.iter().any(|f| f == "frames"),
        positions: fields.iter().any(|f| f == "positions"),
        strains: fields.iter().any(|f| f == "strains"),
        tendon_points: fields.iter().any(|f| f == "tendon_points"),
        tendon_lengths: fields.iter().any(|f| f == "tendon_lengths"),
        tensions: fields.iter().any(|f| f == "tensions"),
        energy: fields.iter().any(|f| f == "energy"),
    };
    let pool = pool(threads.map(crate::convert::count)).map_err(|e| invalid(&e))?;
    let model = Linkage::new(core, settings).map_err(|e| invalid(&e))?;
    let flat = values(&array)?;
    let solved = long_call::run(py, progress, |control| {
        solve_rows(&model, flat, rows, wanted, &pool, control)
    })?;
    // Stopped only by an interrupt, which run has raised; an empty answer then is never seen.
    let solved = solved.map_err(|e| invalid(&e))?.unwrap_or_default();
    export(py, robot, wanted, solved)
}

fn export<'py>(
    py: Python<'py>,
    robot: &Bound<'py, Robot>,
    wanted: Fields,
    solved: Columns,
) -> PyResult<Bound<'py, PyDict>> {
    let core = &robot.get().0;
    let rows = solved.reports.len();
    let (n, tendons) = (core.backbone().subsegments(), core.tendons().len());
    let answer = PyDict::new(py);
    let put = |wanted: bool, name: &str, values: Vec<f64>, shape: &[usize]| -> PyResult<()> {
        if wanted {
            answer.set_item(name, frozen(py, values, shape)?)?;
        }
        Ok(())
    };
    put(wanted.tip, "tip", solved.tip, &[rows, 4, 4])?;
    put(wanted.frames, "frames", solved.frames, &[rows, n + 1, 4, 4])?;
    put(wanted.positions, "positions", solved.positions, &[rows, n + 1, 3])?;
    put(wanted.strains, "strains", solved.strains, &[rows, n, 3])?;
    put(wanted.tendon_lengths, "tendon_lengths", solved.tendon_lengths, &[rows, tendons])?;
    put(wanted.tensions, "tensions", solved.tensions, &[rows, tendons])?;
    put(wanted.energy, "energy", solved.energy, &[rows])?;
    if wanted.tendon_points {
        let list = PyList::empty(py);
        for (path, points) in core.paths().iter().zip(solved.tendon_points) {
            list.append(frozen(py, points, &[rows, path.end() + 1, 3])?)?;
        }
        answer.set_item("tendon_points", list)?;
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
