//! The engines of `tdcr.design`; its docstrings are in Python, but for the settings'.
// Python shows the default of `max_bend` as a number.
#![allow(clippy::approx_constant)]

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use tdcr::design::{self, angle_at_base, points_on_curve, prebend_stopped_by};
use tdcr::forward::{ModelSettings, Solution};
use tdcr::rod::Subsegment;

use crate::convert::arguments::{number, whole};
use crate::convert::arrays::{called, frozen, frozen_points, invalid, status, vectors};
use crate::convert::interruptible;
use crate::forward::one_row;
use crate::forward::rod::{RodSettings, named};
use crate::forward::shape::Shape;
use crate::robot::Robot;

/// Choices of a pre-bent design.
///
/// Parameters
/// ----------
/// rod : RodSettings, optional
///     Of the rod model that the design is for.
/// max_bend : float, optional
///     Largest bend of a subsegment at rest, in (0, pi] [rad].
/// smoothness : float, optional
///     Weight of the differences between neighbouring rest bends [rad], against distances over the robot's
///     length: 0 for none. With it the least sum of both is the answer, and "converged".
/// tolerance : float, optional
///     Distance of every disk from its wanted place that counts as reached, in shares of the robot's length.
///     In (0, 1e-2].
/// max_iterations : int, optional
///     Levenberg-Marquardt steps of a start at most.
///
/// Raises
/// ------
/// InvalidInput
///     A value out of range.
/// TypeError
///     A value of another type.
#[pyclass(frozen, eq, module = "tdcr")]
#[derive(Clone, PartialEq)]
pub(crate) struct PrebendSettings(pub(crate) design::PrebendSettings);

fn max_bend(value: &Bound<'_, PyAny>) -> PyResult<f64> {
    number("max_bend", value)
}

fn smoothness(value: &Bound<'_, PyAny>) -> PyResult<f64> {
    // -0.0 made 0.0, so that equal settings have equal bits.
    Ok(number("smoothness", value)? + 0.0)
}

fn tolerance(value: &Bound<'_, PyAny>) -> PyResult<f64> {
    number("tolerance", value)
}

fn max_iterations(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    whole("max_iterations", value)
}

/// The settings as the keywords of their constructor.
pub(crate) fn keywords<'py>(
    py: Python<'py>,
    settings: &design::PrebendSettings,
) -> PyResult<Bound<'py, PyDict>> {
    let keywords = PyDict::new(py);
    keywords.set_item("rod", RodSettings(settings.rod))?;
    keywords.set_item("max_bend", settings.max_bend)?;
    keywords.set_item("smoothness", settings.smoothness)?;
    keywords.set_item("tolerance", settings.tolerance)?;
    keywords.set_item("max_iterations", settings.max_iterations)?;
    Ok(keywords)
}

#[pymethods]
impl PrebendSettings {
    #[new]
    #[pyo3(signature = (*, rod=None, max_bend=3.141_592_653_589_793, smoothness=0.0,
                        tolerance=1e-10, max_iterations=100))]
    fn new(
        rod: Option<&Bound<'_, RodSettings>>,
        #[pyo3(from_py_with = max_bend)] max_bend: f64,
        #[pyo3(from_py_with = smoothness)] smoothness: f64,
        #[pyo3(from_py_with = tolerance)] tolerance: f64,
        #[pyo3(from_py_with = max_iterations)] max_iterations: usize,
    ) -> PyResult<Self> {
        let rod = rod.map_or_else(Default::default, |rod| rod.get().0);
        let settings =
            design::PrebendSettings { rod, max_bend, smoothness, tolerance, max_iterations };
        settings.validate().map_err(|e| invalid(&e))?;
        Ok(Self(settings))
    }

    /// Settings of the rod model that the design is for.
    #[getter]
    fn rod(&self) -> RodSettings {
        RodSettings(self.0.rod)
    }

    /// Largest bend of a subsegment at rest [rad].
    #[getter]
    fn max_bend(&self) -> f64 {
        self.0.max_bend
    }

    /// Weight of the differences between neighbouring rest bends.
    #[getter]
    fn smoothness(&self) -> f64 {
        self.0.smoothness
    }

    /// Distance that counts as reached, in shares of the robot's length.
    #[getter]
    fn tolerance(&self) -> f64 {
        self.0.tolerance
    }

    /// Levenberg-Marquardt steps of a start at most.
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
        called("PrebendSettings", &keywords(py, &self.0)?)
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        Ok((PyTuple::empty(py), keywords(py, &self.0)?))
    }
}

/// Products of small matrices in a descent, of about a microsecond each with all its starts, up to which a design
/// ends soon enough to go without listening for Ctrl-C.
const SOON: usize = 100_000;

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
    let solve =
        |stop: &Arc<AtomicBool>| prebend_stopped_by(core, &targets, &pulls, &settings, stop);
    let work = targets.len().pow(3) * settings.rod.elements;
    let answer = if work.saturating_mul(settings.max_iterations) <= SOON {
        py.detach(|| solve(&Arc::default()))
    } else {
        interruptible::run(py, None, |control| solve(&control.stop))?
    };
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
    let kind = named("subsegment", Subsegment::ALL, Subsegment::as_str, subsegment)?;
    let points = vectors("points", points)?;
    let core = &robot.get().0;
    let found = py.detach(|| {
        let places = points_on_curve(core, &points, kind)?;
        Ok((places, angle_at_base(core, &points)?))
    });
    let (places, angle) = found.map_err(|e| invalid(&e))?;
    Ok((frozen_points(py, places.into_iter())?, angle))
}
