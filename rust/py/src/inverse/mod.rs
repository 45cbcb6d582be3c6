//! The engines of `inverse` and `inverse_solutions`; their docstrings are in Python.

pub(crate) mod batch;
pub(crate) mod cartesian_path;
pub(crate) mod targets;

use std::sync::Arc;

use nalgebra::Vector3;
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use tdcr::forward::{Forward, Load, ModelSettings, Plan};
use tdcr::inverse::{
    Answer, ConstantCurvatureInverse, Inversion, Inverter, Method, RodInverse, invert, solve_start,
};
use tdcr::model::rod_only;
use tdcr::rod::contact::Scene;
use tdcr::{InvalidInput, constant_curvature, rod};

use crate::convert::arrays::{float_array, frozen, invalid, status, values, wrong_shape};
use crate::convert::interruptible;
use crate::forward::model_choice::model_settings;
use crate::forward::run;
use crate::forward::shape::Shape;
use crate::inverse::targets::one_target;
use crate::robot::Robot;
use crate::scene::{Surroundings, raise_fault};
use crate::settings::bounds::Bounds;
use crate::settings::inverse::InverseSettings;

/// Time of a step or an evaluation of arcs \[µs\].
const MICROSECONDS_PER_ARC_STEP: f64 = 0.25;

/// Time of a step or an evaluation of a rod \[µs\].
const MICROSECONDS_PER_ROD_STEP: f64 = 25.0;

/// Estimated time of a single inverse that uses all its starts and steps \[µs\].
fn estimated_microseconds(search: &tdcr::inverse::InverseSettings, per_step: f64) -> f64 {
    let starts = if search.method == Method::Swarm { search.starts } else { 1 };
    let swarms = search.swarm.particles as f64 * search.swarm.max_iterations as f64;
    let steps = search.starts as f64 * search.max_iterations as f64;
    (steps + swarms * starts as f64) * per_step
}

/// The model's knowledge of a robot, which an inverse refers to.
pub(crate) enum Plans {
    Arcs(Arc<constant_curvature::Plan>),
    Rod(Arc<rod::Plan>, Option<Scene>),
}

/// An inverse of one of the models.
pub(crate) enum Engine<'a> {
    Arcs(Box<ConstantCurvatureInverse<'a>>),
    Rod(Box<RodInverse<'a>>),
}

impl Plans {
    pub(crate) fn new(
        robot: &Bound<'_, Robot>,
        model: &str,
        settings: Option<&Bound<'_, PyAny>>,
        around: &Surroundings,
    ) -> PyResult<Self> {
        let settings = model_settings(model, settings)?;
        around.check(&settings)?;
        let core: &tdcr::robot::Robot = &robot.get().0;
        match settings {
            ModelSettings::ConstantCurvature(settings) => {
                Plan::constant_curvature(core, settings).map(Self::Arcs)
            }
            ModelSettings::Rod(settings) => Plan::rod(core, settings).and_then(|plan| {
                let scene = around.scene(core, &plan)?;
                Ok(Self::Rod(plan, scene))
            }),
            ModelSettings::Linkage(_) => {
                let expected = "a model with an inverse (\"rod\" or \"constant_curvature\")";
                Err(InvalidInput::new("model", expected, format!("\"{model}\"")))
            }
        }
        .map_err(|e| invalid(&e))
    }

    pub(crate) fn engine<'a>(
        &'a self,
        robot: &'a Bound<'_, Robot>,
        bounds: Option<&Bound<'_, PyAny>>,
        search: Option<&Bound<'_, InverseSettings>>,
        method: &str,
    ) -> PyResult<Engine<'a>> {
        let bounds = Bounds::extract(bounds)?;
        let mut search = search.map_or_else(Default::default, |search| search.get().0);
        let Some(method) = Method::ALL.into_iter().find(|known| known.as_str() == method) else {
            let got = format!("\"{method}\"");
            return Err(invalid(&InvalidInput::new("method", "\"newton\" or \"pso\"", got)));
        };
        search.method = method;
        let robot: &tdcr::robot::Robot = &robot.get().0;
        match self {
            Self::Arcs(plan) => {
                let inverse = ConstantCurvatureInverse::new(robot, plan, &bounds, search);
                inverse.map(|inverse| Engine::Arcs(Box::new(inverse)))
            }
            Self::Rod(plan, scene) => {
                let inverse = RodInverse::new(robot, plan, &bounds, search);
                let among = |inverse: RodInverse<'a>| match scene {
                    Some(scene) => inverse.among(scene),
                    None => Ok(inverse),
                };
                inverse.and_then(among).map(|inverse| Engine::Rod(Box::new(inverse)))
            }
        }
        .map_err(|e| invalid(&e))
    }
}

/// Displacements of a start.
pub(crate) fn one_start(
    robot: &tdcr::robot::Robot,
    value: Option<&Bound<'_, PyAny>>,
) -> PyResult<Option<Vec<f64>>> {
    let Some(value) = value else { return Ok(None) };
    let array = float_array("start", value)?;
    let tendons = robot.tendons().len();
    if array.shape() != [tendons] {
        let expected = format!("displacements of shape ({tendons},)");
        return Err(wrong_shape("start", &expected, array.shape()));
    }
    Ok(Some(values(&array)?.to_vec()))
}

/// (displacements, tensions, status, message, error, `rotation_error`, iterations, starts)
type Row = (Py<PyAny>, Py<PyAny>, Py<PyAny>, String, f64, f64, usize, usize);

fn row(
    py: Python<'_>,
    displacements: Vec<f64>,
    tensions: Vec<f64>,
    answer: &Answer,
    message: String,
) -> PyResult<Row> {
    let tendons = displacements.len();
    Ok((
        frozen(py, displacements, &[tendons])?,
        frozen(py, tensions, &[tendons])?,
        status(py, answer.status)?.unbind(),
        message,
        answer.distance,
        answer.angle,
        answer.iterations,
        answer.starts,
    ))
}

/// One inverse, for a target or for positions of the disks.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // The keywords of inverse.
pub(crate) fn _inverse(
    py: Python<'_>,
    robot: &Bound<'_, Robot>,
    target: Option<&Bound<'_, PyAny>>,
    positions: Option<&Bound<'_, PyAny>>,
    model: &str,
    start: Option<&Bound<'_, PyAny>>,
    bounds: Option<&Bound<'_, PyAny>>,
    settings: Option<&Bound<'_, PyAny>>,
    search: Option<&Bound<'_, InverseSettings>>,
    method: &str,
    obstacles: &Bound<'_, PyAny>,
    loads: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Row, Option<Shape>)> {
    let around = Surroundings::new(py, Some(obstacles), loads)?;
    let plans = Plans::new(robot, model, settings, &around)?;
    let engine = plans.engine(robot, bounds, search, method)?;
    // Solve where Ctrl-C can stop it, unless all its steps end soon.
    let found = match (&engine, positions) {
        (Engine::Arcs(_), Some(_)) => return Err(invalid(&rod_only("positions", model))),
        (Engine::Arcs(inverse), None) => {
            let time = estimated_microseconds(inverse.settings(), MICROSECONDS_PER_ARC_STEP);
            invert_one(py, &**inverse, target, start, &around, time)?
        }
        (Engine::Rod(inverse), positions) => {
            // Among obstacles there is no bound.
            let time = match around.any() {
                None => estimated_microseconds(inverse.settings(), MICROSECONDS_PER_ROD_STEP),
                Some(_) => f64::INFINITY,
            };
            // First: an interrupt stops the functions of obstacles too.
            let found = match positions {
                Some(positions) => invert_positions(py, inverse, positions, start, &around)?,
                None => invert_one(py, &**inverse, target, start, &around, time)?,
            };
            raise_fault(py, inverse.take_fault())?;
            found
        }
    };
    // A shape of its own where several have these displacements.
    let found = found.map_err(|e| invalid(&e))?;
    with_shape(py, robot, found, model_settings(model, settings)?, around)
}

/// A row, and the shape found where displacements do not say which it is: solved again from there.
fn with_shape(
    py: Python<'_>,
    robot: &Bound<'_, Robot>,
    found: Inversion,
    settings: ModelSettings,
    around: Surroundings,
) -> PyResult<(Row, Option<Shape>)> {
    let Inversion { answer, displacements, tensions, message, state } = found;
    let shape = match state {
        Some(state) => {
            let load = Load::Displacements(displacements.clone());
            let solve = |forward: &Forward<'_>| forward.solve(load, Some(&state));
            let core = &robot.get().0;
            let solution = run(py, around.prepare(core, settings)?, solve)?;
            Some(Shape::new(robot.get().clone(), settings, solution).among(around))
        }
        None => None,
    };
    Ok((row(py, displacements, tensions, &answer, message)?, shape))
}

/// Wanted places of disks, from the first: rows of all disks or of those beyond the base, NaN where none is wanted.
fn wanted_places(
    robot: &tdcr::robot::Robot,
    value: &Bound<'_, PyAny>,
) -> PyResult<Vec<Option<Vector3<f64>>>> {
    let array = float_array("positions", value)?;
    let disks = robot.backbone().subsegments();
    let rows = match array.shape() {
        [rows, 3] if *rows == disks || *rows == disks + 1 => *rows,
        shape => {
            let expected = format!("shape ({disks}, 3) or, with the base, ({}, 3)", disks + 1);
            return Err(wrong_shape("positions", &expected, shape));
        }
    };
    let rows = values(&array)?.chunks_exact(3).enumerate().skip(rows - disks);
    rows.map(|(row, place)| {
        let missing = place.iter().filter(|x| x.is_nan()).count();
        if missing == 3 {
            return Ok(None);
        }
        if missing > 0 || place.iter().any(|x| x.is_infinite()) {
            let expected = "finite places [m], or rows of NaN where none is wanted";
            let got = format!("{place:?} in row {row}");
            return Err(invalid(&InvalidInput::new("positions", expected, got)));
        }
        Ok(Some(Vector3::from_column_slice(place)))
    })
    .collect()
}

fn invert_one<I: Inverter>(
    py: Python<'_>,
    inverse: &I,
    target: Option<&Bound<'_, PyAny>>,
    start: Option<&Bound<'_, PyAny>>,
    around: &Surroundings,
    microseconds: f64,
) -> PyResult<Result<Inversion, InvalidInput>> {
    let Some(target) = target else {
        return Ok(Err(InvalidInput::new("target", "a target or positions", "neither")));
    };
    let target = one_target(target)?;
    inverse.check_target(&target).map_err(|e| invalid(&e))?;
    let start = one_start(inverse.robot(), start)?;
    interruptible::run_if_long(py, microseconds, |control| {
        around.stopped_by(&control.stop);
        invert(inverse, &target, start.as_deref(), Some(&control.stop))
    })
}

fn invert_positions(
    py: Python<'_>,
    inverse: &RodInverse<'_>,
    positions: &Bound<'_, PyAny>,
    start: Option<&Bound<'_, PyAny>>,
    around: &Surroundings,
) -> PyResult<Result<Inversion, InvalidInput>> {
    let positions = wanted_places(inverse.robot(), positions)?;
    let start = one_start(inverse.robot(), start)?;
    interruptible::run(py, None, |control| {
        around.stopped_by(&control.stop);
        let start = solve_start(inverse, start.as_deref(), Some(&control.stop))?;
        inverse.solve_positions(&positions, start.as_ref(), Some(&control.stop))
    })
}

/// All answers of one target, least bending energy first, each with the number of starts that led there.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // The keywords of inverse_solutions.
pub(crate) fn _inverse_solutions(
    py: Python<'_>,
    robot: &Bound<'_, Robot>,
    target: &Bound<'_, PyAny>,
    model: &str,
    bounds: Option<&Bound<'_, PyAny>>,
    settings: Option<&Bound<'_, PyAny>>,
    search: Option<&Bound<'_, InverseSettings>>,
    method: &str,
) -> PyResult<Vec<(Row, usize)>> {
    let around = Surroundings::new(py, None, None)?;
    let plans = Plans::new(robot, model, settings, &around)?;
    let engine = plans.engine(robot, bounds, search, method)?;
    let Engine::Arcs(inverse) = &engine else {
        let expected = "\"constant_curvature\" for all answers (inverse has one of the rod)";
        return Err(invalid(&InvalidInput::new("model", expected, format!("\"{model}\""))));
    };
    let target = one_target(target)?;
    inverse.check_target(&target).map_err(|e| invalid(&e))?;
    let solutions = interruptible::run(py, None, |control| {
        inverse.solutions_in(&target, &mut inverse.scratch().stopped_by(&control.stop))
    })?;
    let rows = solutions.iter().map(|solution| {
        let unknown = vec![f64::NAN; solution.displacements.len()];
        Ok((
            row(py, solution.displacements.clone(), unknown, &solution.answer, String::new())?,
            solution.hits,
        ))
    });
    rows.collect()
}
