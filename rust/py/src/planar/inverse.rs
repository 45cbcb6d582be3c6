//! The engines of `PlanarTrunk.inverse` and `inverse_batch`; their docstrings are in Python.

use std::time::Instant;

use nalgebra::Vector2;
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use tdcr::batch::pool;
use tdcr::planar::{
    Circle, Goal, Inverse, InverseSettings, Row, SwarmInverse, SwarmSettings, SwarmSolver,
    Unknowns, WatchDecision, inverse_rows, inverse_until, solve_rows,
};
use tdcr::{InvalidInput, Status};

use crate::convert::arguments::{OneOrMany, number, optional, text, whole};
use crate::convert::arrays::{
    float_array, frozen, frozen_statuses, invalid, status, values, wrong_shape,
};
use crate::convert::interruptible::{self, POLL};
use crate::planar::trunk::{coordinate, pairs, row, trunk};
use crate::settings::pso::PsoSettings;

/// Estimated time of a section in a Newton step \[µs\].
const MICROSECONDS_PER_SECTION: f64 = 2.5;

fn newton_settings(
    tolerance: &Bound<'_, PyAny>,
    max_iterations: &Bound<'_, PyAny>,
    starts: Option<&Bound<'_, PyAny>>,
) -> PyResult<InverseSettings> {
    let default = InverseSettings::default();
    Ok(InverseSettings {
        tolerance: number("tolerance", tolerance)?,
        max_iterations: whole("max_iterations", max_iterations)?,
        starts: optional("starts", starts, whole)?.unwrap_or(default.starts),
    })
}

/// The keywords of method "pso", but for the callback.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct SwarmKeywords<'py> {
    obstacles: Bound<'py, PyAny>,
    objective: Bound<'py, PyAny>,
    settings: Bound<'py, PsoSettings>,
    polish: bool,
    tolerance: Bound<'py, PyAny>,
    max_iterations: Bound<'py, PyAny>,
    restarts: Bound<'py, PyAny>,
}

impl SwarmKeywords<'_> {
    fn settings(&self) -> PyResult<SwarmSettings> {
        let name = text("objective", &self.objective)?;
        let known = Unknowns::ALL.into_iter().find(|known| known.as_str() == name);
        let unknowns = known.ok_or_else(|| {
            let got = format!("\"{name}\"");
            invalid(&InvalidInput::new("objective", "\"bends\" or \"points\"", got))
        })?;
        Ok(SwarmSettings {
            swarm: self.settings.get().0,
            unknowns,
            polish: self.polish,
            tolerance: number("tolerance", &self.tolerance)?,
            max_iterations: whole("max_iterations", &self.max_iterations)?,
            restarts: whole("restarts", &self.restarts)?,
        })
    }
}

/// Circles from rows (x, y, radius).
fn circles(value: &Bound<'_, PyAny>) -> PyResult<Vec<Circle>> {
    let array = float_array("obstacles", value)?;
    let rows = match array.shape() {
        [0] | [0, 3] => return Ok(Vec::new()),
        [_, 3] => values(&array)?.chunks_exact(3).enumerate(),
        shape => {
            return Err(wrong_shape("obstacles", "rows (x, y, radius), shape (k, 3)", shape));
        }
    };
    rows.map(|(i, row)| {
        Circle::new(row[0], row[1], row[2])
            .map_err(|error| invalid(&error.within(&format!("obstacles[{i}]"))))
    })
    .collect()
}

/// Smallest distance of a trunk from circles.
#[pyfunction]
pub(crate) fn _planar_clearance(
    lengths: &Bound<'_, PyAny>,
    cable_distance: &Bound<'_, PyAny>,
    given: &Bound<'_, PyAny>,
    obstacles: &Bound<'_, PyAny>,
) -> PyResult<f64> {
    let trunk = trunk(lengths, cable_distance)?;
    let turns = crate::planar::trunk::turns(&trunk, given)?;
    Ok(trunk.clearance(&turns, &circles(obstacles)?))
}

fn one_goal(
    x: &Bound<'_, PyAny>,
    y: &Bound<'_, PyAny>,
    heading: Option<&Bound<'_, PyAny>>,
    limit: &Bound<'_, PyAny>,
) -> PyResult<Goal> {
    Ok(Goal {
        point: Vector2::new(coordinate("x", x)?, coordinate("y", y)?),
        heading: optional("heading", heading, number)?,
        limits: row("limit", limit)?,
    })
}

fn fields(py: Python<'_>, found: Inverse) -> PyResult<Bound<'_, PyDict>> {
    let answer = PyDict::new(py);
    let m = found.turns.len();
    answer.set_item("turns", frozen(py, found.turns, &[m])?)?;
    answer.set_item("error", found.error)?;
    answer.set_item("heading_error", found.heading_error)?;
    answer.set_item("energy", found.energy)?;
    answer.set_item("status", status(py, found.status)?)?;
    answer.set_item("iterations", found.iterations)?;
    answer.set_item("starts", found.starts)?;
    Ok(answer)
}

/// The Newton inverse as a dict of the fields of `tdcr.planar.PlanarInverse`.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // The keywords of PlanarTrunk.inverse.
pub(crate) fn _planar_newton<'py>(
    py: Python<'py>,
    lengths: &Bound<'py, PyAny>,
    cable_distance: &Bound<'py, PyAny>,
    x: &Bound<'py, PyAny>,
    y: &Bound<'py, PyAny>,
    heading: Option<&Bound<'py, PyAny>>,
    limit: &Bound<'py, PyAny>,
    tolerance: &Bound<'py, PyAny>,
    max_iterations: &Bound<'py, PyAny>,
    starts: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let trunk = trunk(lengths, cable_distance)?;
    let goal = one_goal(x, y, heading, limit)?;
    let settings = newton_settings(tolerance, max_iterations, starts)?;
    let steps = settings.starts as f64 * settings.max_iterations as f64;
    let microseconds = steps * trunk.lengths().len() as f64 * MICROSECONDS_PER_SECTION;
    let found = interruptible::run_if_long(py, microseconds, |control| {
        inverse_until(&trunk, &goal, &settings, &control.stop)
    })?;
    // Stopped only by an exception, which is raised already.
    found.map_err(|e| invalid(&e))?.map_or_else(|| Ok(PyDict::new(py)), |found| fields(py, found))
}

/// The inverse by swarm as a dict of the fields of `tdcr.planar.PlanarInverse`.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // The keywords of PlanarTrunk.inverse.
pub(crate) fn _planar_swarm<'py>(
    py: Python<'py>,
    lengths: &Bound<'py, PyAny>,
    cable_distance: &Bound<'py, PyAny>,
    x: &Bound<'py, PyAny>,
    y: &Bound<'py, PyAny>,
    heading: Option<&Bound<'py, PyAny>>,
    limit: &Bound<'py, PyAny>,
    keywords: SwarmKeywords<'py>,
    callback: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let trunk = trunk(lengths, cable_distance)?;
    let goal = one_goal(x, y, heading, limit)?;
    let circles = circles(&keywords.obstacles)?;
    let settings = keywords.settings()?;
    // Solve without the GIL: a callback hears of every move, signals get a look every 50 ms.
    let mut solver = SwarmSolver::new(&trunk, &circles, &settings).map_err(|e| invalid(&e))?;
    let mut listener = Listener { callback: callback.map(|c| c.clone().unbind()), fault: None };
    let seed = settings.swarm.seed;
    let found = py.detach(|| {
        let mut last_poll = Instant::now();
        solver.solve(&goal, seed, &mut |progress| {
            if listener.callback.is_none() && last_poll.elapsed() < POLL {
                return WatchDecision::GoOn;
            }
            last_poll = Instant::now();
            listener.ask(progress.iteration, progress.value)
        })
    });
    // An exception of the callback or a signal ends the search.
    if let Some(fault) = listener.fault {
        return Err(fault);
    }
    // Abandoned only with a fault.
    let Some(found) = found.map_err(|e| invalid(&e))? else { return Ok(PyDict::new(py)) };
    // The inverse, and what the swarms did.
    let SwarmInverse { inverse, clearance, value, history, moves, evaluations, swarms, seed } =
        found;
    let answer = fields(py, inverse)?;
    let count = history.len();
    answer.set_item("clearance", clearance)?;
    answer.set_item("value", value)?;
    answer.set_item("history", frozen(py, history, &[count])?)?;
    answer.set_item("moves", moves)?;
    answer.set_item("evaluations", evaluations)?;
    answer.set_item("swarms", swarms)?;
    answer.set_item("seed", seed)?;
    Ok(answer)
}

/// Who is asked during a search, and what came of it.
struct Listener {
    callback: Option<Py<PyAny>>,
    fault: Option<PyErr>,
}

impl Listener {
    fn ask(&mut self, iteration: usize, value: f64) -> WatchDecision {
        let answer = Python::attach(|py| {
            py.check_signals()?;
            match &self.callback {
                Some(callback) => callback.bind(py).call1((iteration, value))?.is_truthy(),
                None => Ok(false),
            }
        });
        match answer {
            Ok(false) => WatchDecision::GoOn,
            Ok(true) => WatchDecision::Finish,
            Err(fault) => {
                self.fault = Some(fault);
                WatchDecision::Abandon
            }
        }
    }
}

/// Goals of a batch: headings and limits are for all rows, or a heading for each.
fn goals(
    points: &Bound<'_, PyAny>,
    heading: Option<&Bound<'_, PyAny>>,
    limit: &Bound<'_, PyAny>,
) -> PyResult<Vec<Goal>> {
    let points = pairs("points", points, "B")?;
    let bad = |point: &[f64; 2]| !(point[0].is_finite() && point[1].is_finite());
    if let Some(row) = points.iter().position(bad) {
        let got = format!("{:?} in row {row}", points[row]);
        return Err(invalid(&InvalidInput::new("points", "finite numbers [m]", got)));
    }
    let headings = heading.map(|value| row("heading", value)).transpose()?;
    let each = spread("heading", headings.unwrap_or_default(), points.len())?;
    let limits = row("limit", limit)?;
    let goal = |(i, [x, y]): (usize, [f64; 2])| {
        let heading = each.get(i).copied();
        Goal { point: Vector2::new(x, y), heading, limits: limits.clone() }
    };
    Ok(points.into_iter().enumerate().map(goal).collect())
}

/// One value for all rows, or one each; none at all for none.
fn spread<T: Clone>(argument: &str, given: Vec<T>, rows: usize) -> PyResult<Vec<T>> {
    match &given[..] {
        [one] => Ok(vec![one.clone(); rows]),
        [] => Ok(given),
        _ if given.len() == rows => Ok(given),
        _ => {
            let expected = format!("one value, or {rows}, one per row");
            Err(invalid(&InvalidInput::new(argument, expected, given.len())))
        }
    }
}

/// Columns of many inverses by Newton's method.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // The keywords of PlanarTrunk.inverse_batch.
pub(crate) fn _planar_newton_batch<'py>(
    py: Python<'py>,
    lengths: &Bound<'py, PyAny>,
    cable_distance: &Bound<'py, PyAny>,
    points: &Bound<'py, PyAny>,
    heading: Option<&Bound<'py, PyAny>>,
    limit: &Bound<'py, PyAny>,
    tolerance: &Bound<'py, PyAny>,
    max_iterations: &Bound<'py, PyAny>,
    starts: Option<&Bound<'py, PyAny>>,
    threads: Option<&Bound<'py, PyAny>>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let trunk = trunk(lengths, cable_distance)?;
    let goals = goals(points, heading, limit)?;
    let settings = newton_settings(tolerance, max_iterations, starts)?;
    let pool = pool(optional("threads", threads, whole)?).map_err(|e| invalid(&e))?;
    // A batch of none would refuse nothing.
    settings.validate().map_err(|e| invalid(&e))?;
    let found = interruptible::run(py, progress, |control| {
        inverse_rows(&trunk, &goals, &settings, &pool, control)
    })?;
    let found = found.map_err(|e| invalid(&e))?.unwrap_or_default();
    columns(py, &found.iter().collect::<Vec<_>>(), trunk.lengths().len())
}

/// Columns of many inverses by swarm.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // The keywords of PlanarTrunk.inverse_batch.
pub(crate) fn _planar_swarm_batch<'py>(
    py: Python<'py>,
    lengths: &Bound<'py, PyAny>,
    cable_distance: &Bound<'py, PyAny>,
    points: &Bound<'py, PyAny>,
    heading: Option<&Bound<'py, PyAny>>,
    limit: &Bound<'py, PyAny>,
    keywords: SwarmKeywords<'py>,
    seed: &Bound<'py, PyAny>,
    threads: Option<&Bound<'py, PyAny>>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let trunk = trunk(lengths, cable_distance)?;
    let goals = goals(points, heading, limit)?;
    let circles = circles(&keywords.obstacles)?;
    let settings = keywords.settings()?;
    let seeds = OneOrMany::extract("seed", seed, whole)?.into_vec();
    let seeds = spread("seed", seeds, goals.len())?;
    let solver = SwarmSolver::new(&trunk, &circles, &settings).map_err(|e| invalid(&e))?;
    let rows: Vec<Row> = (goals.into_iter().zip(seeds))
        .map(|(goal, seed)| Row { goal, seed: seed as u64 })
        .collect();
    let pool = pool(optional("threads", threads, whole)?).map_err(|e| invalid(&e))?;
    let found =
        interruptible::run(py, progress, |control| solve_rows(&solver, &rows, &pool, control))?;
    let found = found.map_err(|e| invalid(&e))?.unwrap_or_default();
    let inverses: Vec<&Inverse> = found.iter().map(|answer| &answer.inverse).collect();
    let table = columns(py, &inverses, trunk.lengths().len())?;
    let count = [found.len()];
    let floats = |column: fn(&SwarmInverse) -> f64| found.iter().map(column).collect::<Vec<_>>();
    table.set_item("clearance", frozen(py, floats(|a| a.clearance), &count)?)?;
    table.set_item("value", frozen(py, floats(|a| a.value), &count)?)?;
    let counts = |column: fn(&SwarmInverse) -> u64| found.iter().map(column).collect::<Vec<_>>();
    table.set_item("moves", frozen(py, counts(|a| a.moves as u64), &count)?)?;
    table.set_item("evaluations", frozen(py, counts(|a| a.evaluations as u64), &count)?)?;
    table.set_item("swarms", frozen(py, counts(|a| a.swarms as u64), &count)?)?;
    table.set_item("seed", frozen(py, counts(|a| a.seed), &count)?)?;
    Ok(table)
}

fn columns<'py>(
    py: Python<'py>,
    answers: &[&Inverse],
    sections: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let count = [answers.len()];
    let table = PyDict::new(py);
    let turns = answers.iter().flat_map(|answer| answer.turns.iter().copied()).collect();
    table.set_item("turns", frozen::<f64>(py, turns, &[answers.len(), sections])?)?;
    let floats =
        |column: fn(&Inverse) -> f64| answers.iter().map(|a| column(a)).collect::<Vec<_>>();
    table.set_item("error", frozen(py, floats(|a| a.error), &count)?)?;
    table.set_item("heading_error", frozen(py, floats(|a| a.heading_error), &count)?)?;
    table.set_item("energy", frozen(py, floats(|a| a.energy), &count)?)?;
    table.set_item("status", frozen_statuses(py, answers.iter().map(|a| a.status))?)?;
    let counts = |column: fn(&Inverse) -> usize| {
        answers.iter().map(|a| column(a) as u64).collect::<Vec<_>>()
    };
    table.set_item("iterations", frozen(py, counts(|a| a.iterations), &count)?)?;
    table.set_item("starts", frozen(py, counts(|a| a.starts), &count)?)?;
    let ok = answers.iter().map(|a| a.status == Status::Converged).collect();
    table.set_item("ok", frozen::<bool>(py, ok, &count)?)?;
    Ok(table)
}

/// Defaults of both methods in the core, for the test that compares them with Python's.
#[pyfunction]
pub(crate) fn _planar_inverse_defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let (newton, swarm) = (InverseSettings::default(), SwarmSettings::default());
    let values = PyDict::new(py);
    values.set_item("tolerance", newton.tolerance)?;
    values.set_item("max_iterations", newton.max_iterations)?;
    values.set_item("polish", swarm.polish)?;
    values.set_item("restarts", swarm.restarts)?;
    values.set_item("objective", swarm.unknowns.as_str())?;
    Ok(values)
}
