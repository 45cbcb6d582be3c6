//! The functions behind `tdcr.constant_curvature`; its docstrings are in Python.

use std::sync::atomic::Ordering;

use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use tdcr::InvalidInput;
use tdcr::batch::Control;
use tdcr::constant_curvature::{Arc, Length, Mapping, Pattern, frames, tip_derivative};
use tdcr::lie::Pose;
use tdcr::robot::rigid_motion;

use crate::convert::arrays::{float_array, frozen, invalid, matrix4, values, wrong_shape};
use crate::convert::interruptible;

/// Estimated time of a row of many tendons \[µs\]: one of three takes 0.6.
const MICROSECONDS_PER_ROW: f64 = 5.0;

/// Rows from one look at the stop flag to the next.
const STRIDE: usize = 256;

/// Largest angle and length of an arc: their squares, and products with robots' lengths, are numbers.
const LARGEST: f64 = 1e150;

/// A one-dimensional array of finite numbers.
fn row(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let array = float_array(argument, value)?;
    if array.shape().len() != 1 {
        return Err(wrong_shape(argument, "a sequence of numbers", array.shape()));
    }
    Ok(values(&array)?.to_vec())
}

/// Arcs from their parameters, one value of each per arc.
fn arcs(
    kappa: &Bound<'_, PyAny>,
    phi: &Bound<'_, PyAny>,
    ell: &Bound<'_, PyAny>,
) -> PyResult<Vec<Arc>> {
    let (kappa, phi, ell) = (row("kappa", kappa)?, row("phi", phi)?, row("ell", ell)?);
    for (argument, column) in [("phi", &phi), ("ell", &ell)] {
        if column.len() != kappa.len() {
            let expected = format!("{} values, one per arc of kappa", kappa.len());
            return Err(invalid(&InvalidInput::new(argument, expected, column.len())));
        }
    }
    let check = |argument: &str, expected: &str, column: &[f64], good: fn(f64) -> bool| {
        let bad = column.iter().find(|value| !good(**value));
        bad.map_or(Ok(()), |bad| Err(invalid(&InvalidInput::new(argument, expected, bad))))
    };
    check("kappa", "finite curvatures of 0 or more [1/m]", &kappa, |k| k.is_finite() && k >= 0.0)?;
    check("phi", "finite angles [rad]", &phi, f64::is_finite)?;
    check("ell", "positive lengths up to 1e150 m", &ell, |l| l > 0.0 && l <= LARGEST)?;
    let angles: Vec<f64> = kappa.iter().zip(&ell).map(|(k, l)| k * l).collect();
    check("kappa", "curvatures with kappa * ell up to 1e150 rad", &angles, |a| a <= LARGEST)?;
    Ok((kappa.iter().zip(&phi).zip(&ell)).map(|((k, p), l)| Arc::new(*k, *p, *l)).collect())
}

/// Refuses what overflowed.
fn check_overflow(argument: &str, answer: &[f64]) -> PyResult<()> {
    if answer.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    let expected = "a value small enough to compute with";
    Err(invalid(&InvalidInput::new(argument, expected, "one that overflows")))
}

/// Runs a job over rows, where Ctrl-C can stop it if they are many.
fn run<T: Send>(
    py: Python<'_>,
    rows: usize,
    job: impl FnOnce(&Control) -> T + Send,
) -> PyResult<T> {
    interruptible::run_if_long(py, rows as f64 * MICROSECONDS_PER_ROW, job)
}

fn pose(argument: &str, value: Option<&Bound<'_, PyAny>>) -> PyResult<Pose> {
    let Some(value) = value else { return Ok(Pose::identity()) };
    rigid_motion(argument, &matrix4(argument, value)?).map_err(|e| invalid(&e))
}

fn mapping(
    azimuth: &Bound<'_, PyAny>,
    radius: &Bound<'_, PyAny>,
    length: f64,
) -> PyResult<Mapping> {
    Mapping::new(row("azimuth", azimuth)?, row("radius", radius)?, length).map_err(|e| invalid(&e))
}

type Columns = (Py<PyAny>, Py<PyAny>, Py<PyAny>, Py<PyAny>);

/// (kappa, phi, ell) and residuals of rows of displacements, until told to stop.
fn fit_rows(
    mapping: &Mapping,
    displacements: &[f64],
    length: Length,
    control: &Control,
) -> Result<([Vec<f64>; 3], Vec<f64>), InvalidInput> {
    let columns = mapping.tendons();
    let rows = displacements.len() / columns;
    let mut parameters = [(); 3].map(|()| Vec::with_capacity(rows));
    let mut residual = Vec::with_capacity(rows * columns);
    let mut pattern = Pattern::default();
    for (i, given) in displacements.chunks_exact(columns).enumerate() {
        if i % STRIDE == 0 && control.stop.load(Ordering::Relaxed) {
            break;
        }
        let arc = mapping.fit_row(given, length, &mut pattern, &mut residual).map_err(|error| {
            let place = if rows > 1 { format!(" in row {i}") } else { String::new() };
            InvalidInput { got: error.got + &place, ..error }
        })?;
        for (column, value) in parameters.iter_mut().zip([arc.kappa(), arc.phi(), arc.length]) {
            column.push(value);
        }
    }
    Ok((parameters, residual))
}

/// (kappa (B,), phi (B,), ell (B,), residual (B, N)) of displacements (B, N).
#[pyfunction]
pub(crate) fn _arc_from_displacements(
    py: Python<'_>,
    displacements: &Bound<'_, PyAny>,
    azimuth: &Bound<'_, PyAny>,
    radius: &Bound<'_, PyAny>,
    length: f64,
    ell: Option<f64>,
    extensible: bool,
) -> PyResult<Columns> {
    let mapping = mapping(azimuth, radius, length)?;
    let array = float_array("displacements", displacements)?;
    let &[rows, columns] = array.shape() else {
        return Err(wrong_shape("displacements", "shape (N,) or (B, N)", array.shape()));
    };
    if columns != mapping.tendons() {
        let expected = format!("{} values, one per tendon", mapping.tendons());
        return Err(invalid(&InvalidInput::new("displacements", expected, columns)));
    }
    let known = match (ell, extensible) {
        (Some(ell), true) => {
            let expected = "no length with extensible=True, which finds it: one of the two";
            return Err(invalid(&InvalidInput::new("ell", expected, ell)));
        }
        (Some(ell), false) => Length::Known(ell),
        (None, true) => Length::Free,
        (None, false) => Length::Known(length),
    };
    let given = values(&array)?;
    // Stopped only by an interrupt, which run has raised; what is missing then is never seen.
    let fitted = run(py, rows, |control| fit_rows(&mapping, given, known, control))?;
    let ([kappa, phi, ell], residual) = fitted.map_err(|e| invalid(&e))?;
    Ok((
        frozen(py, kappa, &[rows])?,
        frozen(py, phi, &[rows])?,
        frozen(py, ell, &[rows])?,
        frozen(py, residual, &[rows, columns])?,
    ))
}

/// Displacements (B, N) of arcs.
#[pyfunction]
pub(crate) fn _displacements_from_arc(
    py: Python<'_>,
    kappa: &Bound<'_, PyAny>,
    phi: &Bound<'_, PyAny>,
    ell: &Bound<'_, PyAny>,
    azimuth: &Bound<'_, PyAny>,
    radius: &Bound<'_, PyAny>,
    length: Option<f64>,
) -> PyResult<Py<PyAny>> {
    let arcs = arcs(kappa, phi, ell)?;
    let mapping = mapping(azimuth, radius, length.unwrap_or(1.0))?;
    let tendons = mapping.tendons();
    let flat = run(py, arcs.len(), |control| {
        let mut flat = Vec::with_capacity(arcs.len() * tendons);
        for (i, arc) in arcs.iter().enumerate() {
            if i % STRIDE == 0 && control.stop.load(Ordering::Relaxed) {
                break;
            }
            let rest_length = length.unwrap_or(arc.length);
            flat.extend((0..tendons).map(|k| mapping.displacement(k, arc, rest_length)));
        }
        flat
    })?;
    check_overflow("kappa", &flat)?;
    frozen(py, flat, &[arcs.len(), tendons])
}

/// Frames (m * points, 4, 4) along a chain of m arcs, base and tip of each included.
#[pyfunction]
pub(crate) fn _arc_frames(
    py: Python<'_>,
    kappa: &Bound<'_, PyAny>,
    phi: &Bound<'_, PyAny>,
    ell: &Bound<'_, PyAny>,
    points: &Bound<'_, PyAny>,
    base: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let arcs = arcs(kappa, phi, ell)?;
    let points = crate::convert::arguments::whole("points", points)?;
    if points < 2 {
        let expected = "at least 2 frames per segment (base and tip)";
        return Err(invalid(&InvalidInput::new("points", expected, points)));
    }
    let base = pose("base", base)?;
    let (mut along, mut flat) = (Vec::new(), Vec::<f64>::new());
    let count = points.checked_mul(arcs.len()).filter(|count| {
        let numbers = count.checked_mul(16);
        numbers.is_some_and(|numbers| flat.try_reserve_exact(numbers).is_ok())
            && along.try_reserve_exact(*count).is_ok()
    });
    let Some(count) = count else {
        let expected = "as many frames per segment as fit into memory";
        return Err(invalid(&InvalidInput::new("points", expected, points)));
    };
    py.detach(|| {
        frames(&base, &arcs, points, &mut along);
        flat.extend(along.iter().flat_map(Pose::to_row_major));
    });
    check_overflow("ell", &flat)?;
    frozen(py, flat, &[count, 4, 4])
}

/// Derivative (6, 3m) of the tool's velocity by kappa, phi and ell of every arc.
#[pyfunction]
pub(crate) fn _arc_jacobian(
    py: Python<'_>,
    kappa: &Bound<'_, PyAny>,
    phi: &Bound<'_, PyAny>,
    ell: &Bound<'_, PyAny>,
    base: Option<&Bound<'_, PyAny>>,
    tool: Option<&Bound<'_, PyAny>>,
) -> PyResult<Py<PyAny>> {
    let chain = arcs(kappa, phi, ell)?;
    let (kappa, phi, ell) = (row("kappa", kappa)?, row("phi", phi)?, row("ell", ell)?);
    let mut matrix = tip_derivative(&pose("base", base)?, &pose("tool", tool)?, &chain);
    for i in 0..chain.len() {
        let by = Arc::by_parameters(kappa[i], phi[i], ell[i]);
        let block = matrix.fixed_columns::<3>(3 * i) * by;
        matrix.fixed_columns_mut::<3>(3 * i).copy_from(&block);
    }
    check_overflow("kappa", matrix.as_slice())?;
    frozen(py, matrix.transpose().as_slice().to_vec(), &[6, 3 * chain.len()])
}
