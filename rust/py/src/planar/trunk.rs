//! The functions behind `tdcr.planar`; its docstrings are in Python.

use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use tdcr::InvalidInput;
use tdcr::batch::pool;
use tdcr::planar::{AngleFunction, Cables, Trunk, TwoSections, solution_rows};

use crate::convert::arguments::{number, optional, text, whole};
use crate::convert::arrays::{float_array, frozen, invalid, values, wrong_shape};
use crate::convert::interruptible;

/// A one-dimensional array of numbers, or one number.
pub(crate) fn row(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let array = float_array(argument, value)?;
    if array.shape().len() > 1 {
        return Err(wrong_shape(argument, "a sequence of numbers", array.shape()));
    }
    Ok(values(&array)?.to_vec())
}

/// Rows of two numbers.
pub(crate) fn pairs(
    argument: &str,
    value: &Bound<'_, PyAny>,
    rows: &str,
) -> PyResult<Vec<[f64; 2]>> {
    let array = float_array(argument, value)?;
    if array.shape().len() != 2 || array.shape()[1] != 2 {
        let expected = format!("an array of shape ({rows}, 2)");
        return Err(wrong_shape(argument, &expected, array.shape()));
    }
    Ok(values(&array)?.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect())
}

fn flat<const N: usize>(rows: impl IntoIterator<Item = [f64; N]>) -> Vec<f64> {
    rows.into_iter().flatten().collect()
}

pub(crate) fn trunk(
    lengths: &Bound<'_, PyAny>,
    cable_distance: &Bound<'_, PyAny>,
) -> PyResult<Trunk> {
    let distance = number("cable_distance", cable_distance)?;
    Trunk::new(row("lengths", lengths)?, distance).map_err(|e| invalid(&e))
}

/// Turns that fit the trunk.
pub(crate) fn turns(trunk: &Trunk, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let turns = row("turns", value)?;
    trunk.check_turns(&turns).map_err(|e| invalid(&e))?;
    Ok(turns)
}

fn cable_kind(value: &Bound<'_, PyAny>) -> PyResult<Cables> {
    let name = text("cables", value)?;
    Cables::ALL.into_iter().find(|known| known.as_str() == name).ok_or_else(|| {
        let got = format!("\"{name}\"");
        invalid(&InvalidInput::new("cables", "\"chords\" or \"arcs\"", got))
    })
}

fn two_sections(
    l1: &Bound<'_, PyAny>,
    l2: &Bound<'_, PyAny>,
    limit: &Bound<'_, PyAny>,
) -> PyResult<TwoSections> {
    let (l1, l2, limit) = (number("l1", l1)?, number("l2", l2)?, number("limit", limit)?);
    TwoSections::new(l1, l2, limit).map_err(|e| invalid(&e))
}

/// A coordinate of a target.
pub(crate) fn coordinate(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    let number = number(argument, value)?;
    if number.is_finite() {
        return Ok(number);
    }
    Err(invalid(&InvalidInput::new(argument, "a finite number [m]", format!("{number:?}"))))
}

type Two = (Py<PyAny>, Py<PyAny>);

/// The checked lengths (m,) and cable distance.
#[pyfunction]
pub(crate) fn _planar_trunk(
    lengths: &Bound<'_, PyAny>,
    cable_distance: &Bound<'_, PyAny>,
) -> PyResult<(Vec<f64>, f64)> {
    let trunk = trunk(lengths, cable_distance)?;
    Ok((trunk.lengths().to_vec(), number("cable_distance", cable_distance)?))
}

/// Turns (m,) and misfit (m,) of cable lengths (m, 2).
#[pyfunction]
pub(crate) fn _planar_turns(
    py: Python<'_>,
    lengths: &Bound<'_, PyAny>,
    cable_distance: &Bound<'_, PyAny>,
    cable_lengths: &Bound<'_, PyAny>,
    cables: &Bound<'_, PyAny>,
) -> PyResult<Two> {
    let trunk = trunk(lengths, cable_distance)?;
    let m = trunk.lengths().len();
    let pairs = pairs("cable_lengths", cable_lengths, &m.to_string())?;
    let bent = trunk.turns(&pairs, cable_kind(cables)?).map_err(|e| invalid(&e))?;
    Ok((frozen(py, bent.turns, &[m])?, frozen(py, bent.misfit, &[m])?))
}

/// Cable lengths (m, 2) of turns (m,).
#[pyfunction]
pub(crate) fn _planar_cable_lengths(
    py: Python<'_>,
    lengths: &Bound<'_, PyAny>,
    cable_distance: &Bound<'_, PyAny>,
    given: &Bound<'_, PyAny>,
    cables: &Bound<'_, PyAny>,
) -> PyResult<Py<PyAny>> {
    let trunk = trunk(lengths, cable_distance)?;
    let turns = turns(&trunk, given)?;
    let pairs = trunk.cable_lengths(&turns, cable_kind(cables)?).map_err(|e| invalid(&e))?;
    frozen(py, flat(pairs), &[turns.len(), 2])
}

/// Positions (m, 2) and absolute headings (m,) of the platforms.
#[pyfunction]
pub(crate) fn _planar_platforms(
    py: Python<'_>,
    lengths: &Bound<'_, PyAny>,
    cable_distance: &Bound<'_, PyAny>,
    given: &Bound<'_, PyAny>,
) -> PyResult<Two> {
    let trunk = trunk(lengths, cable_distance)?;
    let ends = trunk.platforms(&turns(&trunk, given)?);
    let headings = ends.iter().map(|end| end.1).collect();
    let m = ends.len();
    let positions = frozen(py, flat(ends.iter().map(|end| [end.0.x, end.0.y])), &[m, 2])?;
    Ok((positions, frozen(py, headings, &[m])?))
}

/// Rows (s, x, y, heading) along the exact curve, (m * points, 4).
#[pyfunction]
pub(crate) fn _planar_curve(
    py: Python<'_>,
    lengths: &Bound<'_, PyAny>,
    cable_distance: &Bound<'_, PyAny>,
    given: &Bound<'_, PyAny>,
    points: &Bound<'_, PyAny>,
) -> PyResult<Py<PyAny>> {
    let trunk = trunk(lengths, cable_distance)?;
    let turns = turns(&trunk, given)?;
    let points = whole("points", points)?;
    if !(2..=10_000_000).contains(&points) {
        let expected = "2 to 10000000 points per section (its ends)";
        return Err(invalid(&InvalidInput::new("points", expected, points)));
    }
    let curve = trunk.curve(&turns, points);
    let rows = curve.len();
    frozen(py, flat(curve), &[rows, 4])
}

fn angle(s: &Bound<'_, PyAny>, angles: &Bound<'_, PyAny>) -> PyResult<AngleFunction> {
    AngleFunction::new(row("s", s)?, &row("angles", angles)?).map_err(|e| invalid(&e))
}

/// Coefficients (n, 4) of the natural spline through n + 1 nodes.
#[pyfunction]
pub(crate) fn _angle_coefficients(
    py: Python<'_>,
    s: &Bound<'_, PyAny>,
    angles: &Bound<'_, PyAny>,
) -> PyResult<Py<PyAny>> {
    let angle = angle(s, angles)?;
    let pieces = angle.coefficients();
    frozen(py, flat(pieces.iter().copied()), &[pieces.len(), 4])
}

/// Angles of the spline at arc lengths, in their shape.
#[pyfunction]
pub(crate) fn _angle_at(
    py: Python<'_>,
    s: &Bound<'_, PyAny>,
    angles: &Bound<'_, PyAny>,
    at: &Bound<'_, PyAny>,
) -> PyResult<Py<PyAny>> {
    let angle = angle(s, angles)?;
    let at = float_array("s", at)?;
    let angles = values(&at)?.iter().map(|s| angle.at(*s)).collect();
    frozen(py, angles, at.shape())
}

type Sampled = (Py<PyAny>, Py<PyAny>, Py<PyAny>, f64);

/// Arc lengths (k,), points (k, 2), headings (k,) and the error of Simpson's rule.
#[pyfunction]
pub(crate) fn _angle_curve(
    py: Python<'_>,
    s: &Bound<'_, PyAny>,
    angles: &Bound<'_, PyAny>,
    intervals: &Bound<'_, PyAny>,
) -> PyResult<Sampled> {
    let (angle, intervals) = (angle(s, angles)?, whole("intervals", intervals)?);
    let curve = py.detach(|| angle.curve(intervals)).map_err(|e| invalid(&e))?;
    let k = curve.s.len();
    let points = flat(curve.points.iter().map(|point| [point.x, point.y]));
    Ok((
        frozen(py, curve.s, &[k])?,
        frozen(py, points, &[k, 2])?,
        frozen(py, curve.headings, &[k])?,
        curve.error,
    ))
}

/// Every solution (S, 2) of one target.
#[pyfunction]
pub(crate) fn _two_section_solutions(
    py: Python<'_>,
    l1: &Bound<'_, PyAny>,
    l2: &Bound<'_, PyAny>,
    x: &Bound<'_, PyAny>,
    y: &Bound<'_, PyAny>,
    limit: &Bound<'_, PyAny>,
) -> PyResult<Py<PyAny>> {
    let two = two_sections(l1, l2, limit)?;
    let mut found = Vec::new();
    two.solutions(coordinate("x", x)?, coordinate("y", y)?, &mut found);
    let count = found.len();
    frozen(py, flat(found), &[count, 2])
}

/// Every solution of targets (B, 2): turns (T, 2) and counts (B,).
#[pyfunction]
pub(crate) fn _two_section_batch(
    py: Python<'_>,
    l1: &Bound<'_, PyAny>,
    l2: &Bound<'_, PyAny>,
    targets: &Bound<'_, PyAny>,
    limit: &Bound<'_, PyAny>,
    threads: Option<&Bound<'_, PyAny>>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Two> {
    let two = two_sections(l1, l2, limit)?;
    let targets = pairs("targets", targets, "B")?;
    let bad = |target: &[f64; 2]| !(target[0].is_finite() && target[1].is_finite());
    if let Some(row) = targets.iter().position(bad) {
        let got = format!("{:?} in row {row}", targets[row]);
        return Err(invalid(&InvalidInput::new("targets", "finite numbers [m]", got)));
    }
    let pool = pool(optional("threads", threads, whole)?).map_err(|e| invalid(&e))?;
    let many =
        interruptible::run(py, progress, |control| solution_rows(&two, &targets, &pool, control))?;
    // Stopped only by an interrupt, which run has raised.
    let many = many.unwrap_or_default();
    let counts: Vec<u64> = many.counts.iter().map(|count| *count as u64).collect();
    let (total, rows) = (many.turns.len(), counts.len());
    Ok((frozen(py, flat(many.turns), &[total, 2])?, frozen(py, counts, &[rows])?))
}

/// The turns (2,) whose tip is nearest, and the distance.
#[pyfunction]
pub(crate) fn _two_section_nearest(
    py: Python<'_>,
    l1: &Bound<'_, PyAny>,
    l2: &Bound<'_, PyAny>,
    x: &Bound<'_, PyAny>,
    y: &Bound<'_, PyAny>,
    limit: &Bound<'_, PyAny>,
) -> PyResult<(Py<PyAny>, f64)> {
    let two = two_sections(l1, l2, limit)?;
    let (turns, distance) = two.nearest(coordinate("x", x)?, coordinate("y", y)?);
    Ok((frozen(py, turns.to_vec(), &[2])?, distance))
}
