//! The engines of `inverse` and `inverse_solutions`; their docstrings are in Python.

pub(crate) mod batch;
pub(crate) mod cartesian_path;
pub(crate) mod targets;

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

use nalgebra::Vector3;
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use tdcr::inverse::{
    Answer, ConstantCurvatureInverse, Inverter, Method, PositionsAnswer, RodInverse, Target,
};
use tdcr::model::State;
use tdcr::rod::contact::Scene;
use tdcr::{InvalidInput, constant_curvature, rod};

use crate::convert::arrays::{float_array, frozen, invalid, status, values, wrong_shape};
use crate::convert::interruptible;
use crate::forward::model_choice::{Choice, rod_only};
use crate::forward::rod::Load;
use crate::forward::shape::Shape;
use crate::inverse::targets::one_target;
use crate::robot::Robot;
use crate::scene::{self, Surroundings, Watched, checked};
use crate::settings::bounds::Bounds;
use crate::settings::inverse::InverseSettings;

/// Steps and evaluations, of a few tenths of a microsecond each, up to which a single inverse ends soon
/// enough to go without listening for Ctrl-C.
const SOON: usize = 200_000;

/// How many times as long those of the rod take.
const ROD: usize = 100;

/// Whether it does, by what a step takes.
fn soon(search: &tdcr::inverse::InverseSettings, each: usize) -> bool {
    let starts = if search.method == Method::Swarm { search.starts } else { 1 };
    let swarms = search.swarm.particles.saturating_mul(search.swarm.max_iterations);
    let steps = search.starts.saturating_mul(search.max_iterations);
    steps.saturating_add(swarms.saturating_mul(starts)).saturating_mul(each) <= SOON
}

/// The model's knowledge of a robot, which an inverse refers to.
pub(crate) enum Plans<'a> {
    Arcs(&'a constant_curvature::Plan),
    Rod(Arc<rod::Plan>, Option<Scene>),
}

/// An inverse of one of the models.
pub(crate) enum Engine<'a> {
    Arcs(Box<ConstantCurvatureInverse<'a>>),
    Rod(Box<RodInverse<'a>>),
}

impl<'a> Plans<'a> {
    pub(crate) fn new(
        robot: &'a Bound<'_, Robot>,
        model: &str,
        settings: Option<&Bound<'_, PyAny>>,
        around: &Surroundings,
    ) -> PyResult<Self> {
        let choice = Choice::new(model, settings)?;
        match choice {
            Choice::Rod(_) => {}
            _ => around.any().map_or(Ok(()), |what| Err(rod_only(what, model)))?,
        }
        match choice {
            Choice::ConstantCurvature(settings) => {
                robot.get().constant_curvature_plan(settings).map(Self::Arcs)
            }
            Choice::Rod(settings) => robot.get().rod_plan(settings).and_then(|plan| {
                let core = &robot.get().0;
                let scene = around.any().map(|_| around.scene(core, &plan, &settings));
                Ok(Self::Rod(plan, scene.transpose()?))
            }),
            Choice::Linkage(_) => {
                let expected = "a model with an inverse (\"rod\" or \"constant_curvature\")";
                Err(InvalidInput::new("model", expected, format!("\"{model}\"")))
            }
        }
        .map_err(|e| invalid(&e))
    }

    pub(crate) fn engine(
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

/// Errors of a start that is solved for name it.
fn of_start(error: InvalidInput) -> InvalidInput {
    InvalidInput { argument: "start".to_owned(), ..error }
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

/// One inverse.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // The keywords of inverse.
pub(crate) fn _inverse(
    py: Python<'_>,
    robot: &Bound<'_, Robot>,
    target: &Bound<'_, PyAny>,
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
    let target = one_target(target)?;
    let found = match &engine {
        Engine::Arcs(inverse) => {
            let soon = soon(inverse.settings(), 1);
            invert_one(py, &**inverse, &target, start, &around, soon)?
        }
        Engine::Rod(inverse) => {
            let soon = around.any().is_none() && soon(inverse.settings(), ROD);
            // First: an interrupt stops the functions of obstacles too.
            let found = invert_one(py, &**inverse, &target, start, &around, soon)?;
            checked(py, Mutex::new(inverse.take_fault()))?;
            found
        }
    };
    with_shape(py, robot, &plans, found, Choice::new(model, settings)?, around)
}

/// A row, and the shape found where displacements do not say which it is: solved again from there.
fn with_shape(
    py: Python<'_>,
    robot: &Bound<'_, Robot>,
    plans: &Plans<'_>,
    ((displacements, tensions, answer, message), state): Found,
    choice: Choice,
    around: Surroundings,
) -> PyResult<(Row, Option<Shape>)> {
    let shape = match (state, plans) {
        (Some(state), Plans::Rod(plan, Some(scene))) => {
            let load = Load::Displacements(displacements.clone());
            let solve = |rod: &Watched<'_>| rod.solve_load(load, Some(state));
            let (given, shape) = scene::solve(py, &robot.get().0, plan, scene, solve)?;
            Some(Shape::new(robot.get().clone(), choice, given, shape).among(around))
        }
        _ => None,
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

/// One inverse for places of the disks.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // The keywords of inverse.
pub(crate) fn _inverse_places(
    py: Python<'_>,
    robot: &Bound<'_, Robot>,
    positions: &Bound<'_, PyAny>,
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
    let Engine::Rod(inverse) = &engine else { return Err(rod_only("positions", model)) };
    let places = wanted_places(&robot.get().0, positions)?;
    let start = one_start(inverse.robot(), start)?;
    let found = interruptible::run(py, None, |control| {
        around.stopped_by(&control.stop);
        let begin = |own: Vec<f64>| inverse.start(&own, Some(&control.stop)).map_err(of_start);
        let start = start.map(begin).transpose()?;
        inverse.solve_positions(&places, start.as_ref(), Some(&control.stop))
    })?;
    checked(py, Mutex::new(inverse.take_fault()))?;
    let PositionsAnswer { answer, displacements, tensions, message, state } =
        found.map_err(|e| invalid(&e))?;
    let found = ((displacements, tensions, answer, message), state);
    with_shape(py, robot, &plans, found, Choice::new(model, settings)?, around)
}

/// Displacements, tensions, how it ended and the message, and the shape where displacements do not say which it is.
type Found = ((Vec<f64>, Vec<f64>, Answer, String), Option<State>);

fn invert_one<I: Inverter>(
    py: Python<'_>,
    inverse: &I,
    target: &Target,
    start: Option<&Bound<'_, PyAny>>,
    around: &Surroundings,
    soon: bool,
) -> PyResult<Found> {
    inverse.check_target(target).map_err(|e| invalid(&e))?;
    let start = one_start(inverse.robot(), start)?;
    let solve = |stop: Option<&Arc<AtomicBool>>| {
        let start = start.map(|own| inverse.start(&own, stop).map_err(of_start)).transpose()?;
        let mut work = inverse.buffers(stop.map(AsRef::as_ref));
        let answer = inverse.solve(target, start.as_ref(), &mut work);
        let mut displacements = vec![f64::NAN; inverse.robot().tendons().len()];
        let mut tensions = displacements.clone();
        inverse.write_displacements(&work, &mut displacements);
        inverse.write_tensions(&work, &mut tensions);
        let message = inverse.message(&answer, &work);
        Ok(((displacements, tensions, answer, message), inverse.state(&mut work)))
    };
    let found = if soon {
        py.detach(|| solve(None))
    } else {
        interruptible::run(py, None, |control| {
            around.stopped_by(&control.stop);
            solve(Some(&control.stop))
        })?
    };
    found.map_err(|e| invalid(&e))
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
