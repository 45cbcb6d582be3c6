//! The engine of `tdcr.design.routing`; its docstrings are in Python, but for the settings'.

use std::hash::{DefaultHasher, Hash, Hasher};

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use tdcr::batch::pool;
use tdcr::design::{self, Routed, routing_rows, routing_stopped_by};

use crate::convert::arguments::{number, optional, whole};
use crate::convert::arrays::{called, frozen, invalid, status, type_name, vectors};
use crate::convert::interruptible;
use crate::forward::model_choice::Choice;
use crate::forward::rod::RodSettings;
use crate::forward::shape::Shape;
use crate::robot::Robot;
use crate::settings::bounds::range;

/// Choices of a routing design.
///
/// Parameters
/// ----------
/// rod : RodSettings, optional
///     Of the rod model that the design is for; sliding tendons.
/// holes : int or None, optional
///     Evenly spaced holes per disk, 1 to 360; None: any azimuth.
/// azimuth : float, optional
///     Azimuth of hole 0 [rad].
/// max_jump : int, optional
///     How many holes a tendon moves on from one disk to the next at most; None: any number. With
///     holes only.
/// radius : (float, float), optional
///     Smallest and largest radius of holes [m], with `holes=None` only; None: the radii of the
///     robot's tendons.
/// beam_width : int, optional
///     Beginnings of routings that the search follows from disk to disk. Where it is no smaller than
///     the number of all routings of one tendon, all are tried.
/// tolerance : float, optional
///     Distance of every disk from its wanted place that counts as reached, in shares of the robot's
///     length. In (0, 1e-2].
/// max_iterations : int, optional
///     Steps of a descent, and rounds of the search around a routing of several tendons, at most.
///
/// Raises
/// ------
/// InvalidInput
///     A value out of range; proportional tendons; radii where holes are given.
/// TypeError
///     A value of another type.
#[pyclass(frozen, eq, module = "tdcr")]
#[derive(Clone, PartialEq)]
pub(crate) struct RoutingSettings(pub(crate) design::RoutingSettings);

fn holes(value: &Bound<'_, PyAny>) -> PyResult<Option<usize>> {
    if value.is_none() { Ok(None) } else { whole("holes", value).map(Some) }
}

fn azimuth(value: &Bound<'_, PyAny>) -> PyResult<f64> {
    // -0.0 made 0.0, so that equal settings have equal bits.
    Ok(number("azimuth", value)? + 0.0)
}

fn beam_width(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    whole("beam_width", value)
}

fn tolerance(value: &Bound<'_, PyAny>) -> PyResult<f64> {
    number("tolerance", value)
}

fn max_iterations(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    whole("max_iterations", value)
}

/// Both ends of a range of radii.
fn pair(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<(f64, f64)> {
    let wrong = || {
        let got = type_name(value);
        PyTypeError::new_err(format!("{argument}: expected a pair (smallest, largest), got {got}"))
    };
    let items: Vec<Bound<'_, PyAny>> =
        value.try_iter().map_err(|_| wrong())?.collect::<PyResult<_>>()?;
    let [low, high] = items.as_slice() else { return Err(wrong()) };
    Ok((number(argument, low)?, number(argument, high)?))
}

/// The settings as the keywords of their constructor.
pub(crate) fn keywords<'py>(
    py: Python<'py>,
    settings: &design::RoutingSettings,
) -> PyResult<Bound<'py, PyDict>> {
    let keywords = PyDict::new(py);
    keywords.set_item("rod", RodSettings(settings.rod))?;
    keywords.set_item("holes", settings.holes)?;
    keywords.set_item("azimuth", settings.azimuth)?;
    keywords.set_item("max_jump", settings.max_jump)?;
    keywords.set_item("radius", settings.radius)?;
    keywords.set_item("beam_width", settings.beam_width)?;
    keywords.set_item("tolerance", settings.tolerance)?;
    keywords.set_item("max_iterations", settings.max_iterations)?;
    Ok(keywords)
}

#[pymethods]
impl RoutingSettings {
    #[new]
    #[pyo3(
        signature = (*, rod=None, holes=Some(12), azimuth=0.0, max_jump=None, radius=None, beam_width=256,
                     tolerance=1e-8, max_iterations=100),
        text_signature = "(*, rod=None, holes=12, azimuth=0.0, max_jump=None, radius=None, \
                          beam_width=256, tolerance=1e-08, max_iterations=100)"
    )]
    // One argument per setting, all by keyword.
    #[allow(clippy::too_many_arguments)]
    fn new(
        rod: Option<&Bound<'_, RodSettings>>,
        #[pyo3(from_py_with = holes)] holes: Option<usize>,
        #[pyo3(from_py_with = azimuth)] azimuth: f64,
        max_jump: Option<&Bound<'_, PyAny>>,
        radius: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = beam_width)] beam_width: usize,
        #[pyo3(from_py_with = tolerance)] tolerance: f64,
        #[pyo3(from_py_with = max_iterations)] max_iterations: usize,
    ) -> PyResult<Self> {
        let settings = design::RoutingSettings {
            rod: rod.map_or_else(Default::default, |rod| rod.get().0),
            holes,
            azimuth,
            max_jump: optional("max_jump", max_jump, whole)?,
            radius: optional("radius", radius, pair)?,
            beam_width,
            tolerance,
            max_iterations,
        };
        settings.validate().map_err(|e| invalid(&e))?;
        Ok(Self(settings))
    }

    /// Settings of the rod model that the design is for.
    #[getter]
    fn rod(&self) -> RodSettings {
        RodSettings(self.0.rod)
    }

    /// Evenly spaced holes per disk, or None for any azimuth.
    #[getter]
    fn holes(&self) -> Option<usize> {
        self.0.holes
    }

    /// Azimuth of hole 0 [rad].
    #[getter]
    fn azimuth(&self) -> f64 {
        self.0.azimuth
    }

    /// Holes that a tendon moves on by from disk to disk at most, or None.
    #[getter]
    fn max_jump(&self) -> Option<usize> {
        self.0.max_jump
    }

    /// Smallest and largest radius of holes [m], or None.
    #[getter]
    fn radius(&self) -> Option<(f64, f64)> {
        self.0.radius
    }

    /// Beginnings of routings that the search follows.
    #[getter]
    fn beam_width(&self) -> usize {
        self.0.beam_width
    }

    /// Distance that counts as reached, in shares of the robot's length.
    #[getter]
    fn tolerance(&self) -> f64 {
        self.0.tolerance
    }

    /// Steps of a descent, and rounds of a search, at most.
    #[getter]
    fn max_iterations(&self) -> usize {
        self.0.max_iterations
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<u64> {
        let mut hasher = DefaultHasher::new();
        self.__repr__(py)?.hash(&mut hasher);
        Ok(hasher.finish())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        called("RoutingSettings", &keywords(py, &self.0)?)
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        Ok((PyTuple::empty(py), keywords(py, &self.0)?))
    }
}

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
    let shape = Shape::new(robot.clone(), Choice::Rod(settings.rod), pulls, answer.shape);
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
