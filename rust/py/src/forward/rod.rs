//! The rod model from Python: what `forward` does for it alone.

use std::sync::Arc;

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use tdcr::InvalidInput;
use tdcr::batch::chained_shape;
use tdcr::model::{Model, State};
use tdcr::robot::Robot;
use tdcr::rod::{self, Plan, Rod, Scratch};

use crate::convert::arrays::{float_array, invalid, type_name, values, wrong_shape};
use crate::convert::interruptible;
use crate::forward::model_choice::Choice;
use crate::forward::shape::Shape;
use crate::robot::Robot as PyRobot;
use crate::scene::{self, Surroundings};
use crate::settings::rod::RodSettings;

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
