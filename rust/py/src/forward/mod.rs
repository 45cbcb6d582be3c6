//! `forward`: one solve.

pub(crate) mod batch;
pub(crate) mod jacobian;
pub(crate) mod model_choice;
pub(crate) mod sensitivity;
pub(crate) mod shape;
pub(crate) mod shape_arrays;
pub(crate) mod shape_parts;

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use tdcr::InvalidInput;
use tdcr::forward::{Forward, Load, ModelSettings};
use tdcr::model::{State, rod_only};
use tdcr::robot as core;
use tdcr::rod::contact::Scene;

use crate::convert::arrays::{float_array, invalid, type_name, values, wrong_shape};
use crate::convert::interruptible;
use crate::forward::model_choice::model_settings;
use crate::forward::shape::Shape;
use crate::robot::Robot;
use crate::scene::{Surroundings, raise_fault};

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
///     Young's modulus or with another number of `disk_forces` than disks, a start of another robot,
///     model or number of elements, an unknown model, settings of
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
    let settings = model_settings(model, settings)?;
    let around = Surroundings::new(py, obstacles, loads)?;
    let load = load(robot, displacements, tensions)?;
    let core = &robot.get().0;
    let start = start.map(|start| start_state(core, &settings, start)).transpose()?;
    let solve = |forward: &Forward<'_>| forward.solve(load, start.as_ref());
    let solution = run(py, around.prepare(core, settings)?, solve)?;
    Ok(Shape::new(robot.get().clone(), settings, solution).among(around))
}

/// Runs solves without the GIL, where Ctrl-C can stop them if they may take long. Functions of obstacles take the
/// GIL and see Ctrl-C themselves; what one of them raises is raised here.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    forward: Forward<'_>,
    job: impl FnOnce(&Forward<'_>) -> Result<T, InvalidInput> + Send,
) -> PyResult<T> {
    let listens = forward.scene().is_some_and(Scene::calls_functions);
    let microseconds = if listens { 0.0 } else { forward.estimated_microseconds() };
    let (answer, fault) = interruptible::run_if_long(py, microseconds, |control| {
        let forward = forward.stopped_by(&control.stop);
        (job(&forward), forward.take_fault())
    })?;
    raise_fault(py, fault)?;
    answer.map_err(|e| invalid(&e))
}

/// Displacements or tensions, whichever is given.
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

/// Solved quantities of a shape that a solve may start from.
pub(crate) fn start_state(
    robot: &core::Robot,
    settings: &ModelSettings,
    value: &Bound<'_, PyAny>,
) -> PyResult<State> {
    let ModelSettings::Rod(settings) = settings else {
        return Err(invalid(&rod_only("start", settings.model())));
    };
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
