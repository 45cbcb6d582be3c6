//! `forward` and the engine of `forward_batch`.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use pyo3::{IntoPyObjectExt, PyTypeInfo};
use rayon::ThreadPool;

use tdcr::batch::{Field, Key, Solved, chain_rows, pool, solve_rows};
use tdcr::constant_curvature::{ConstantCurvature, ConstantCurvatureSettings};
use tdcr::linkage::{Linkage, LinkageSettings};
use tdcr::model::Model;
use tdcr::rod::contact::LoadedRod;
use tdcr::rod::{Rod, RodSettings};
use tdcr::{InvalidInput, Status};

use crate::arguments::{optional, whole};
use crate::contact;
use crate::convert::{float_array, frozen, invalid, status, type_name, values, wrong_shape};
use crate::long_call;
use crate::robot::Robot;
use crate::rod::{self, Load};
use crate::settings;
use crate::shape::Shape;
use crate::surroundings::{self, Surroundings, Watched};

/// From tendon displacements, or tensions, to the shape.
///
/// Parameters
/// ----------
/// robot : Robot
/// displacements : array_like, shape (K,), optional
///     Change of each tendon's length inside the robot, in the order of `robot.tendons` [m].
///     Negative pulls, positive releases, 0 holds the tendon at its rest length, `inf` frees it. A
///     tendon can only pull: its length is at most rest length plus displacement.
/// tensions : array_like, shape (K,), optional
///     Tension of each tendon instead, finite and not negative [N, or 1/m^2 in units of EI where
///     the backbone's Young's modulus is not given]. Model "rod" only. The displacements of the shape are
///     then those that lead to it: length minus length at rest, without what an elastic tendon stretches.
/// model : {"rod", "linkage", "constant_curvature"}, optional
///     "rod": the least strain energy under frictionless tendons, for any routing, rest shape and number of
///     tendons (Mahapatra & Ghosal 2024). The one with tensions.
///     "linkage": a chain of four-bar (one tendon) or seven-bar linkages (two), the constrained
///     minimum of the coupler angles (Ashwin & Ghosal, "Forward kinematics of cable-driven
///     continuum robot using optimization method"). The two most-pulled tendons on different lines
///     through the centre drive and are kept at their lengths (a message names one that would have
///     to push); the bounds of the others are checked. Straight backbones only.
///     "constant_curvature": every segment an arc, by least squares over all its tendons
///     (opencontinuumrobotics.com). Bilateral: displacements count as given, but for free tendons and
///     the only, released one of a segment. Straight backbones and straight routing only.
/// obstacles : Obstacle or sequence of Obstacle, optional
///     What the robot stays out of, or inside of: its disks' centres, holes and the places opposite to the
///     holes, and a body around the backbone by `RodSettings.body_radius`. Frictionless. Model "rod" with
///     sliding tendons only.
/// loads : Loads, optional
///     Weight, forces and moments on the robot. As obstacles, and only with Young's modulus and diameter.
/// settings : RodSettings, LinkageSettings or ConstantCurvatureSettings, optional
///     Those of the model.
/// start : Shape, optional
///     A shape of this robot and model "rod" with as many elements, under displacements near by: the
///     solve starts there, not at rest. A start that does not help is dropped. It may have had other obstacles
///     and loads.
///
/// Returns
/// -------
/// Shape
///     Not converging is an outcome: see its `status`, `message` and `require`.
///
/// Raises
/// ------
/// InvalidInput
///     Both or neither of displacements and tensions, NaN, -inf, another number of values than
///     tendons, a (B, K) array, a negative or infinite tension, tensions, obstacles, loads or a start for
///     another model than the rod, proportional tendons with tensions, obstacles or loads, loads without
///     Young's modulus or with another number of `disk_forces` than disks, a start of another robot, model or number of elements, an unknown model, settings of
///     another model, axial strain or elastic tendons without Young's modulus; in the models that take
///     no others a pre-bent backbone, a routing, two linkage tendons on one azimuth.
/// TypeError
///     A value of another type.
/// Exception
///     Whatever the function of a `SignedDistance` raises, with a note that names the obstacle where there are
///     several; a value of it that is no finite number is InvalidInput.
#[pyfunction]
#[pyo3(signature = (robot, displacements=None, *, tensions=None, model="rod", obstacles=None, loads=None,
    settings=None, start=None),
    text_signature = "(robot, displacements=None, *, tensions=None, model='rod', obstacles=(), loads=None, \
    settings=None, start=None)")]
#[allow(clippy::too_many_arguments)] // Keywords.
pub(crate) fn forward(
    py: Python<'_>,
    robot: &Bound<'_, Robot>,
    displacements: Option<&Bound<'_, PyAny>>,
    tensions: Option<&Bound<'_, PyAny>>,
    model: &str,
    obstacles: Option<&Bound<'_, PyAny>>,
    loads: Option<&Bound<'_, PyAny>>,
    settings: Option<&Bound<'_, PyAny>>,
    start: Option<&Bound<'_, PyAny>>,
) -> PyResult<Shape> {
    let choice = Choice::new(model, settings)?;
    let around = Surroundings::new(py, obstacles, loads)?;
    let load = load(robot, displacements, tensions)?;
    let solved = robot.get();
    let core = &solved.0;
    let (displacements, shape) = match (choice, load) {
        (Choice::Rod(settings), load) => {
            if let (Load::Tensions(_), Some(_)) = (&load, start) {
                let expected = "none beside tensions, which are reached from rest";
                return Err(invalid(&InvalidInput::new("start", expected, "one")));
            }
            let start = start.map(|start| rod::start(core, &settings, start)).transpose()?;
            let plan = solved.rod_plan(settings).map_err(|e| invalid(&e))?;
            match (around.any(), load) {
                (None, load) => rod::run(py, core, &plan, |rod| rod::solve(rod, load, start))?,
                (Some(_), load) => {
                    let scene = around.scene(core, &plan, &settings).map_err(|e| invalid(&e))?;
                    let solve = |rod: &surroundings::Watched<'_>| rod.solve_load(load, start);
                    Ok(surroundings::solve(py, core, &plan, &scene, solve)?)
                }
            }
        }
        _ if around.any().is_some() => return Err(not_around(&around, model)),
        (_, Load::Tensions(_)) => return Err(rod_only("tensions", model)),
        _ if start.is_some() => return Err(rod_only("start", model)),
        (Choice::Linkage(settings), Load::Displacements(displacements)) => py.detach(|| {
            let linkage = Linkage::new(core, solved.linkage_plan()?, settings)?;
            let shape = linkage.shape(&displacements)?;
            Ok((displacements, shape))
        }),
        (Choice::ConstantCurvature(settings), Load::Displacements(displacements)) => {
            py.detach(|| {
                let plan = solved.constant_curvature_plan(settings)?;
                let shape = ConstantCurvature::new(core, plan).shape(&displacements)?;
                Ok((displacements, shape))
            })
        }
    }
    .map_err(|e| invalid(&e))?;
    Ok(Shape::new(solved.clone(), choice, displacements, shape).among(around))
}

/// Obstacles or loads for a model that knows no forces.
fn not_around(around: &Surroundings, model: &str) -> PyErr {
    rod_only(around.any().unwrap_or("obstacles"), model)
}

/// What is given: displacements or tensions, not both.
fn load(
    robot: &Bound<'_, Robot>,
    displacements: Option<&Bound<'_, PyAny>>,
    tensions: Option<&Bound<'_, PyAny>>,
) -> PyResult<Load> {
    let refuse = |argument: &str, got: &str| {
        let expected = "displacements or tensions";
        Err(invalid(&InvalidInput::new(argument, expected, got)))
    };
    match (displacements, tensions) {
        (Some(given), None) => one_row(robot, given).map(Load::Displacements),
        (None, Some(given)) => one_tension_each(robot, given).map(Load::Tensions),
        (None, None) => refuse("displacements", "neither"),
        (Some(_), Some(_)) => refuse("tensions", "both"),
    }
}

/// An argument that models without forces or starts do not take.
pub(crate) fn rod_only(argument: &str, model: &str) -> PyErr {
    let got = format!("{argument} for model \"{model}\"");
    invalid(&InvalidInput::new(argument, "none, or model \"rod\"", got))
}

/// Displacements of one solve.
pub(crate) fn one_row(
    robot: &Bound<'_, Robot>,
    displacements: &Bound<'_, PyAny>,
) -> PyResult<Vec<f64>> {
    let array = float_array("displacements", displacements)?;
    let tendons = robot.get().0.tendons().len();
    match array.shape() {
        [_] => Ok(values(&array)?.to_vec()),
        [_, _] => {
            let expected = format!("shape ({tendons},); forward_batch takes (B, {tendons})");
            Err(wrong_shape("displacements", &expected, array.shape()))
        }
        shape => Err(wrong_shape("displacements", &format!("shape ({tendons},)"), shape)),
    }
}

/// Tensions of one solve.
fn one_tension_each(robot: &Bound<'_, Robot>, tensions: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let array = float_array("tensions", tensions)?;
    let tendons = robot.get().0.tendons().len();
    if array.shape() != [tendons] {
        let expected = format!("shape ({tendons},), one value per tendon");
        return Err(wrong_shape("tensions", &expected, array.shape()));
    }
    // Adding 0.0 turns -0.0 into 0.0.
    Ok(values(&array)?.iter().map(|tension| tension + 0.0).collect())
}

/// A model by name with its settings.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Choice {
    Rod(RodSettings),
    Linkage(LinkageSettings),
    ConstantCurvature(ConstantCurvatureSettings),
}

impl Choice {
    /// Name of the model.
    pub(crate) const fn model(&self) -> &'static str {
        match self {
            Self::Rod(_) => "rod",
            Self::Linkage(_) => "linkage",
            Self::ConstantCurvature(_) => "constant_curvature",
        }
    }

    /// The settings as Python knows them.
    pub(crate) fn settings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match self {
            Self::Rod(own) => rod::RodSettings(*own).into_bound_py_any(py),
            Self::Linkage(own) => settings::LinkageSettings(*own).into_bound_py_any(py),
            Self::ConstantCurvature(own) => {
                settings::ConstantCurvatureSettings(*own).into_bound_py_any(py)
            }
        }
    }

    /// Checks the name, and that the settings are those of this model.
    pub(crate) fn new(model: &str, settings: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        match model {
            "rod" => {
                let given = own_settings::<rod::RodSettings>(model, settings)?;
                Ok(Self::Rod(given.map_or_else(Default::default, |s| s.get().0)))
            }
            "linkage" => {
                let given = own_settings::<settings::LinkageSettings>(model, settings)?;
                Ok(Self::Linkage(given.map_or_else(Default::default, |s| s.get().0)))
            }
            "constant_curvature" => {
                let given = own_settings::<settings::ConstantCurvatureSettings>(model, settings)?;
                Ok(Self::ConstantCurvature(given.map_or_else(Default::default, |s| s.get().0)))
            }
            _ => {
                let expected = "\"rod\", \"linkage\" or \"constant_curvature\"";
                let got = format!("\"{model}\"");
                Err(invalid(&InvalidInput::new("model", expected, got)))
            }
        }
    }
}

/// Settings of the right class, or none: those of another model are `InvalidInput`, anything else is a
/// `TypeError`.
fn own_settings<'a, 'py, T: PyTypeInfo>(
    model: &str,
    settings: Option<&'a Bound<'py, PyAny>>,
) -> PyResult<Option<&'a Bound<'py, T>>> {
    let Some(settings) = settings else { return Ok(None) };
    settings.cast::<T>().map(Some).map_err(|_| {
        let expected = T::type_object(settings.py()).name().map(|name| name.to_string());
        let (expected, got) = (expected.unwrap_or_default(), type_name(settings));
        let known = settings.is_instance_of::<rod::RodSettings>()
            || settings.is_instance_of::<settings::LinkageSettings>()
            || settings.is_instance_of::<settings::ConstantCurvatureSettings>();
        if known {
            let expected = format!("{expected} for model \"{model}\"");
            return invalid(&InvalidInput::new("settings", expected, got));
        }
        let message = format!("settings: expected {expected} for model \"{model}\", got {got}");
        PyTypeError::new_err(message)
    })
}

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
                let fault = Mutex::new(None);
                let watched = |stop| {
                    around.stopped_by(&stop);
                    Watched::new(rod, stop, &fault)
                };
                // After Ctrl-C, which is raised here, functions fail because of it.
                let solved = batch.solve(py, watched, progress)?;
                surroundings::checked(py, fault)?;
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
        let solved = long_call::run(py, progress, |control| {
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
