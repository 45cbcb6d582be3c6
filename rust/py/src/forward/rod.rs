//! The rod model from Python: its settings, and what `forward` does for it alone.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use tdcr::InvalidInput;
use tdcr::batch::chained_shape;
use tdcr::model::{Model, State};
use tdcr::robot::Robot;
use tdcr::rod::{self, Plan, Rod, Scratch, Subsegment, TendonLaw};

use crate::convert::arguments::whole;
use crate::convert::arrays::{called, float_array, invalid, type_name, values, wrong_shape};
use crate::convert::interruptible;
use crate::forward::model_choice::Choice;
use crate::forward::shape::Shape;
use crate::robot::Robot as PyRobot;
use crate::scene::{self, Surroundings};

/// Choices of the rod model.
///
/// Parameters
/// ----------
/// subsegment : {"arc", "link"}, optional
///     Kinematics of an element. "arc": of constant strain, a piece of a helix. "link": a rigid link
///     that bisects the bend, as in the papers. Both converge with order 2 in the number of elements.
/// tendons : {"sliding", "proportional"}, optional
///     How a displacement is imposed. "sliding": the total length of a tendon is bounded and it slides
///     without friction. "proportional": every piece between two disks shrinks by the same ratio, as in
///     the papers.
/// elements : int, optional
///     Elements between two disks, 1 to 100.
/// axial : bool, optional
///     Whether elements stretch. Needs Young's modulus and diameter of the backbone.
/// tolerance : float, optional
///     Relative residual of forces and lengths that counts as solved, 1e-13 to 1e-3; among obstacles and
///     under loads 5e-11 if it is smaller.
/// max_iterations : int, optional
///     Evaluations of the whole rod at most, each of which ends in a Newton step.
/// body_radius : float, optional
///     Radius of a body around the backbone, which keeps clear of obstacles at the disks' centres [m]. 0:
///     only the centres themselves, the tendons' holes and the places opposite to these do.
///
/// Raises
/// ------
/// InvalidInput
///     A value out of range, an unknown name.
#[pyclass(frozen, eq, module = "tdcr")]
#[derive(Clone, PartialEq)]
pub(crate) struct RodSettings(pub(crate) rod::RodSettings);

fn elements(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    whole("elements", value)
}

fn max_iterations(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    whole("max_iterations", value)
}

/// The choice of a name.
pub(crate) fn named<T: Copy>(
    argument: &str,
    all: [T; 2],
    name: fn(T) -> &'static str,
    given: &str,
) -> PyResult<T> {
    all.into_iter().find(|known| name(*known) == given).ok_or_else(|| {
        let expected = format!("\"{}\" or \"{}\"", name(all[0]), name(all[1]));
        invalid(&InvalidInput::new(argument, expected, format!("\"{given}\"")))
    })
}

#[pymethods]
impl RodSettings {
    #[new]
    #[pyo3(signature = (*, subsegment="arc", tendons="sliding", elements=1, axial=false, tolerance=1e-11,
        max_iterations=600, body_radius=0.0))]
    fn new(
        subsegment: &str,
        tendons: &str,
        #[pyo3(from_py_with = elements)] elements: usize,
        axial: bool,
        tolerance: f64,
        #[pyo3(from_py_with = max_iterations)] max_iterations: usize,
        body_radius: f64,
    ) -> PyResult<Self> {
        let subsegment = named("subsegment", Subsegment::ALL, Subsegment::as_str, subsegment)?;
        let tendons = named("tendons", TendonLaw::ALL, TendonLaw::as_str, tendons)?;
        // Adding 0.0 turns -0.0, which is equal to it, into 0.0.
        let body_radius = body_radius + 0.0;
        let settings = rod::RodSettings {
            subsegment,
            tendons,
            axial,
            elements,
            tolerance,
            max_iterations,
            body_radius,
        };
        settings.validate().map_err(|e| invalid(&e))?;
        Ok(Self(settings))
    }

    /// Kinematics of an element: "arc" or "link".
    #[getter]
    fn subsegment(&self) -> &'static str {
        self.0.subsegment.as_str()
    }

    /// How displacements are imposed: "sliding" or "proportional".
    #[getter]
    fn tendons(&self) -> &'static str {
        self.0.tendons.as_str()
    }

    /// Elements between two disks.
    #[getter]
    fn elements(&self) -> usize {
        self.0.elements
    }

    /// Whether elements stretch.
    #[getter]
    fn axial(&self) -> bool {
        self.0.axial
    }

    /// Relative residual of forces and lengths that counts as solved.
    #[getter]
    fn tolerance(&self) -> f64 {
        self.0.tolerance
    }

    /// Evaluations of the whole rod at most, each of which ends in a Newton step.
    #[getter]
    fn max_iterations(&self) -> usize {
        self.0.max_iterations
    }

    /// Radius of a body around the backbone that keeps clear of obstacles [m].
    #[getter]
    fn body_radius(&self) -> f64 {
        self.0.body_radius
    }

    fn __hash__(&self) -> u64 {
        let settings = &self.0;
        let mut hasher = DefaultHasher::new();
        (settings.subsegment, settings.tendons, settings.axial).hash(&mut hasher);
        (settings.elements, settings.max_iterations).hash(&mut hasher);
        settings.tolerance.to_bits().hash(&mut hasher);
        settings.body_radius.to_bits().hash(&mut hasher);
        hasher.finish()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        called("RodSettings", &keywords(py, &self.0)?)
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        Ok((PyTuple::empty(py), keywords(py, &self.0)?))
    }
}

/// Settings as the keywords of `RodSettings`.
pub(crate) fn keywords<'py>(
    py: Python<'py>,
    settings: &rod::RodSettings,
) -> PyResult<Bound<'py, PyDict>> {
    let keywords = PyDict::new(py);
    keywords.set_item("subsegment", settings.subsegment.as_str())?;
    keywords.set_item("tendons", settings.tendons.as_str())?;
    keywords.set_item("elements", settings.elements)?;
    keywords.set_item("axial", settings.axial)?;
    keywords.set_item("tolerance", settings.tolerance)?;
    keywords.set_item("max_iterations", settings.max_iterations)?;
    keywords.set_item("body_radius", settings.body_radius)?;
    Ok(keywords)
}

/// What a robot is solved for.
pub(crate) enum Load {
    /// Displacements \[m\].
    Displacements(Vec<f64>),
    /// Tensions, in the unit of the results.
    Tensions(Vec<f64>),
}

/// Rods with more second derivatives than this may take longer than a second.
const LONG: usize = 20_000;

/// Runs what solves a rod without the GIL: where Ctrl-C can stop it, if that may take long.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    robot: &Robot,
    plan: &Plan,
    job: impl FnOnce(&Rod<'_>) -> T + Send,
) -> PyResult<T> {
    let rod = Rod::new(robot, plan);
    if plan.second_derivatives() < LONG {
        return Ok(py.detach(|| job(&rod)));
    }
    interruptible::run(py, None, |control| job(&rod.stopped_by(Arc::clone(&control.stop))))
}

/// Displacements and the shape, found from rest or from an earlier shape.
pub(crate) fn solve(
    rod: &Rod<'_>,
    load: Load,
    start: Option<State>,
) -> Result<(Vec<f64>, tdcr::Shape), InvalidInput> {
    match (load, start) {
        (Load::Tensions(tensions), _) => under_tensions(rod, &tensions),
        (Load::Displacements(displacements), None) => {
            let shape = rod.shape(&displacements)?;
            Ok((displacements, shape))
        }
        (Load::Displacements(displacements), Some(start)) => {
            rod.robot().check_displacements(&displacements)?;
            let mut work = Scratch::default();
            let report = rod.solve_from(&start, &displacements, &mut work)?;
            let shape = rod.result(&displacements, report, work);
            Ok((displacements, shape))
        }
    }
}

/// The shape under tensions, with the displacements that it has.
fn under_tensions(
    rod: &Rod<'_>,
    tensions: &[f64],
) -> Result<(Vec<f64>, tdcr::Shape), InvalidInput> {
    let mut work = Scratch::default();
    let report = rod.solve_tensions(tensions, &mut work)?;
    let message = rod.message(&[], &work);
    let state = rod.take_state(work);
    Ok((rod.displacements(&state), tdcr::Shape { state, report, message }))
}

/// The solved quantities of a shape that a solve may start from.
pub(crate) fn start(
    robot: &Robot,
    settings: &rod::RodSettings,
    value: &Bound<'_, PyAny>,
) -> PyResult<State> {
    let Ok(shape) = value.cast::<Shape>() else {
        let message = format!("start: expected a Shape, got {}", type_name(value));
        return Err(PyTypeError::new_err(message));
    };
    let shape = shape.get();
    let refuse =
        |expected: String, got: String| Err(invalid(&InvalidInput::new("start", expected, got)));
    if shape.model() != "rod" {
        let got = format!("one of model \"{}\"", shape.model());
        return refuse("a shape of model \"rod\"".to_owned(), got);
    }
    if shape.core_robot() != robot {
        return refuse("a shape of this robot".to_owned(), "one of another robot".to_owned());
    }
    let state = shape.state();
    let (subsegments, rows) = (robot.backbone().subsegments(), state.strains.len());
    if rows != subsegments * settings.elements {
        let expected = format!("a shape with elements={}", settings.elements);
        return refuse(expected, format!("one with elements={}", rows / subsegments));
    }
    Ok(state.clone())
}

/// One row of a warm batch, its chain solved up to there.
#[pyfunction]
pub(crate) fn _chained_shape(
    py: Python<'_>,
    robot: &Bound<'_, PyRobot>,
    displacements: &Bound<'_, PyAny>,
    row: usize,
    settings: Option<&Bound<'_, RodSettings>>,
    obstacles: &Bound<'_, PyAny>,
    loads: Option<&Bound<'_, PyAny>>,
) -> PyResult<Shape> {
    let settings = settings.map_or_else(Default::default, |settings| settings.get().0);
    let array = float_array("displacements", displacements)?;
    let flat = values(&array)?;
    let core = &robot.get().0;
    let tendons = core.tendons().len();
    if !matches!(array.shape(), [rows, columns] if row < *rows && *columns == tendons) {
        let expected = format!("shape (B, {tendons}) with a row {row}");
        return Err(wrong_shape("displacements", &expected, array.shape()));
    }
    let plan = robot.get().rod_plan(settings).map_err(|e| invalid(&e))?;
    let around = Surroundings::new(py, Some(obstacles), loads)?;
    let shape = if around.any().is_some() {
        let scene = around.scene(core, &plan, &settings).map_err(|e| invalid(&e))?;
        scene::solve(py, core, &plan, &scene, |rod| chained_shape(rod, flat, row))?
    } else {
        let shape = run(py, core, &plan, |rod| chained_shape(rod, flat, row))?;
        shape.map_err(|e| invalid(&e))?
    };
    let own = flat[row * tendons..(row + 1) * tendons].to_vec();
    Ok(Shape::new(robot.get().clone(), Choice::Rod(settings), own, shape).among(around))
}
