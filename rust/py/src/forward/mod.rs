//! `forward`: one solve.

pub(crate) mod batch;
pub(crate) mod jacobian;
pub(crate) mod model_choice;
pub(crate) mod rod;
pub(crate) mod sensitivity;
pub(crate) mod shape;
pub(crate) mod shape_parts;

use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use tdcr::InvalidInput;
use tdcr::constant_curvature::ConstantCurvature;
use tdcr::linkage::Linkage;
use tdcr::model::Model;
use tdcr::rod::contact::LoadedRod;

use crate::convert::arrays::{float_array, invalid, values, wrong_shape};
use crate::forward::model_choice::{Choice, not_around, rod_only};
use crate::forward::rod::Load;
use crate::forward::shape::Shape;
use crate::robot::Robot;
use crate::scene::{self, Surroundings};

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
                    let solve = |rod: &LoadedRod<'_>| scene::solve_load(rod, load, start);
                    Ok(scene::solve(py, core, &plan, &scene, solve)?)
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
