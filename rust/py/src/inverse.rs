//! The engines of `inverse`, `inverse_batch`, `track` and `inverse_solutions`; their docstrings are in
//! Python.

use nalgebra::{Matrix4, Vector3};
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use tdcr::batch::pool;
use tdcr::constant_curvature::{Arc, ConstantCurvature, Plan, Workspace};
use tdcr::inverse::{
    Answer, ConstantCurvatureInverse, InverseRows, Method, Target, invert_path, invert_rows,
};
use tdcr::model::Model;
use tdcr::robot::rigid_motion;
use tdcr::{InvalidInput, Status};

use crate::arguments::{optional, whole};
use crate::bounds::Bounds;
use crate::convert::{float_array, frozen, invalid, status, values, wrong_shape};
use crate::forward::Choice;
use crate::long_call;
use crate::robot::Robot;
use crate::settings::InverseSettings;

/// Starts up to which a single inverse ends soon enough to go without listening for Ctrl-C.
const SOON: usize = 1000;

/// One target from its numbers: 3 of a position or 16 of a frame.
fn target(argument: &str, numbers: &[f64]) -> Result<Target, InvalidInput> {
    let made = if numbers.len() == 3 {
        Target::point(Vector3::from_column_slice(numbers))
    } else {
        rigid_motion("target", &Matrix4::from_row_slice(numbers)).map(|pose| Target::frame(&pose))
    };
    made.map_err(|error| InvalidInput { argument: argument.to_owned(), ..error })
}

/// A single target.
fn one_target(value: &Bound<'_, PyAny>) -> PyResult<Target> {
    let array = float_array("target", value)?;
    match array.shape() {
        [3] | [4, 4] => target("target", values(&array)?).map_err(|e| invalid(&e)),
        shape => {
            let expected = "a position of shape (3,) or a frame of shape (4, 4)";
            Err(wrong_shape("target", expected, shape))
        }
    }
}

/// Rows of targets.
fn many_targets(value: &Bound<'_, PyAny>) -> PyResult<Vec<Target>> {
    let array = float_array("targets", value)?;
    let width = match array.shape() {
        [_, 3] => 3,
        [_, 4, 4] => 16,
        shape => {
            let expected = "positions of shape (B, 3) or frames of shape (B, 4, 4)";
            return Err(wrong_shape("targets", expected, shape));
        }
    };
    let rows = values(&array)?.chunks_exact(width).enumerate();
    rows.map(|(row, numbers)| {
        target("targets", numbers).map_err(|error| {
            invalid(&InvalidInput { got: format!("{} in row {row}", error.got), ..error })
        })
    })
    .collect()
}

/// What all calls share.
struct Problem<'a> {
    inverse: ConstantCurvatureInverse<'a>,
    robot: &'a tdcr::robot::Robot,
    plan: &'a Plan,
}

impl<'a> Problem<'a> {
    fn new(
        robot: &'a Bound<'_, Robot>,
        model: &str,
        settings: Option<&Bound<'_, PyAny>>,
        bounds: Option<&Bound<'_, PyAny>>,
        search: Option<&Bound<'_, InverseSettings>>,
        method: &str,
    ) -> PyResult<Self> {
        let Choice::ConstantCurvature(settings) = Choice::new(model, settings)? else {
            let expected = "a model with an inverse (\"constant_curvature\")";
            return Err(invalid(&InvalidInput::new("model", expected, format!("\"{model}\""))));
        };
        let bounds = Bounds::extract(bounds)?;
        let mut search = search.map_or_else(Default::default, |search| search.get().0);
        let Some(method) = Method::ALL.into_iter().find(|known| known.as_str() == method) else {
            let got = format!("\"{method}\"");
            return Err(invalid(&InvalidInput::new("method", "\"newton\" or \"pso\"", got)));
        };
        search.method = method;
        let plan = robot.get().constant_curvature_plan(settings).map_err(|e| invalid(&e))?;
        let robot: &tdcr::robot::Robot = &robot.get().0;
        let inverse = ConstantCurvatureInverse::new(robot, plan, &bounds, search);
        Ok(Self { inverse: inverse.map_err(|e| invalid(&e))?, robot, plan })
    }

    /// The arcs of a start given as displacements.
    fn arcs(&self, argument: &str, displacements: &[f64]) -> PyResult<Vec<Arc>> {
        let mut work = Workspace::default();
        let model = ConstantCurvature::new(self.robot, self.plan);
        self.robot
            .check_displacements(displacements)
            .and_then(|()| model.solve(displacements, &mut work))
            .map_err(|error| invalid(&InvalidInput { argument: argument.to_owned(), ..error }))?;
        Ok(work.arcs().to_vec())
    }

    fn one_start(&self, value: Option<&Bound<'_, PyAny>>) -> PyResult<Option<Vec<Arc>>> {
        let Some(value) = value else { return Ok(None) };
        let array = float_array("start", value)?;
        let tendons = self.robot.tendons().len();
        if array.shape() != [tendons] {
            let expected = format!("displacements of shape ({tendons},)");
            return Err(wrong_shape("start", &expected, array.shape()));
        }
        self.arcs("start", values(&array)?).map(Some)
    }

    fn many_starts(
        &self,
        rows: usize,
        value: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Vec<Vec<Arc>>> {
        let Some(value) = value else { return Ok(Vec::new()) };
        let array = float_array("start", value)?;
        let tendons = self.robot.tendons().len();
        if array.shape() == [tendons] {
            return Ok(vec![self.arcs("start", values(&array)?)?; rows]);
        }
        if array.shape() != [rows, tendons] {
            let expected = format!("displacements of shape ({tendons},) or ({rows}, {tendons})");
            return Err(wrong_shape("start", &expected, array.shape()));
        }
        let given = values(&array)?.chunks_exact(tendons.max(1));
        given.map(|displacements| self.arcs("start", displacements)).collect()
    }
}

/// (displacements, status, message, error, `rotation_error`, iterations, starts)
type Row = (Py<PyAny>, Py<PyAny>, String, f64, f64, usize, usize);

fn row(py: Python<'_>, displacements: Vec<f64>, answer: &Answer, message: String) -> PyResult<Row> {
    let tendons = displacements.len();
    Ok((
        frozen(py, displacements, &[tendons])?,
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
) -> PyResult<Row> {
    let problem = Problem::new(robot, model, settings, bounds, search, method)?;
    let target = one_target(target)?;
    let start = problem.one_start(start)?;
    let inverse = &problem.inverse;
    let solve = |mut work: tdcr::inverse::Workspace<'_>| {
        let answer = inverse.solve(&target, start.as_deref(), &mut work);
        let mut displacements = vec![0.0; problem.robot.tendons().len()];
        inverse.write_displacements(&work, &mut displacements);
        (displacements, answer, inverse.message(&answer, &work))
    };
    let (displacements, answer, message) = if inverse.settings().starts <= SOON {
        py.detach(|| solve(inverse.workspace()))
    } else {
        long_call::run(py, None, |control| solve(inverse.workspace().stopped_by(&control.stop)))?
    };
    row(py, displacements, &answer, message)
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
    let problem = Problem::new(robot, model, settings, bounds, search, method)?;
    let target = one_target(target)?;
    let inverse = &problem.inverse;
    let solutions = long_call::run(py, None, |control| {
        inverse.solutions_in(&target, &mut inverse.workspace().stopped_by(&control.stop))
    })?;
    let rows = solutions.iter().map(|solution| {
        let displacements = solution.displacements(problem.plan);
        Ok((row(py, displacements, &solution.answer, String::new())?, solution.hits))
    });
    rows.collect()
}

/// Columns of many inverses, each alone (`chain` false) or from the answer of the one before.
#[pyfunction]
#[pyo3(signature = (robot, targets, *, model, start, bounds, settings, search, method, threads, progress, chain))]
#[allow(clippy::too_many_arguments)] // The keywords of inverse_batch and track.
pub(crate) fn _inverse_batch<'py>(
    py: Python<'py>,
    robot: &Bound<'py, Robot>,
    targets: &Bound<'py, PyAny>,
    model: &str,
    start: Option<&Bound<'py, PyAny>>,
    bounds: Option<&Bound<'py, PyAny>>,
    settings: Option<&Bound<'py, PyAny>>,
    search: Option<&Bound<'py, InverseSettings>>,
    method: &str,
    threads: Option<&Bound<'py, PyAny>>,
    progress: Option<&Bound<'py, PyAny>>,
    chain: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let problem = Problem::new(robot, model, settings, bounds, search, method)?;
    let targets = many_targets(targets)?;
    let inverse = &problem.inverse;
    let answers = if chain {
        let start = problem.one_start(start)?;
        long_call::run(py, progress, |control| {
            invert_path(inverse, &targets, start.as_deref(), control)
        })?
    } else {
        let threads = optional("threads", threads, whole)?;
        let pool = pool(threads).map_err(|e| invalid(&e))?;
        let starts = problem.many_starts(targets.len(), start)?;
        long_call::run(py, progress, |control| {
            invert_rows(inverse, &targets, &starts, &pool, control)
        })?
    };
    // Stopped only by an interrupt, which run has raised; an empty answer then is never seen.
    export(py, answers.unwrap_or_default(), problem.robot.tendons().len())
}

fn export(py: Python<'_>, rows: InverseRows, tendons: usize) -> PyResult<Bound<'_, PyDict>> {
    let InverseRows { displacements, answers } = rows;
    let count = [answers.len()];
    let columns = PyDict::new(py);
    columns.set_item("displacements", frozen(py, displacements, &[answers.len(), tendons])?)?;
    let mut statuses = Vec::with_capacity(answers.len());
    for answer in &answers {
        statuses.push(status(py, answer.status)?.unbind());
    }
    columns.set_item("status", frozen(py, statuses, &count)?)?;
    let floats = |column: fn(&Answer) -> f64| answers.iter().map(column).collect::<Vec<f64>>();
    columns.set_item("error", frozen(py, floats(|a| a.distance), &count)?)?;
    columns.set_item("rotation_error", frozen(py, floats(|a| a.angle), &count)?)?;
    let counts = |column: fn(&Answer) -> usize| {
        answers.iter().map(|a| column(a) as u64).collect::<Vec<u64>>()
    };
    columns.set_item("iterations", frozen(py, counts(|a| a.iterations), &count)?)?;
    columns.set_item("starts", frozen(py, counts(|a| a.starts), &count)?)?;
    let ok = answers.iter().map(|a| a.status == Status::Converged).collect();
    columns.set_item("ok", frozen::<bool>(py, ok, &count)?)?;
    Ok(columns)
}
