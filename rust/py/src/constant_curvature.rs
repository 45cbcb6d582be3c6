//! The functions behind `tdcr.constant_curvature`; its docstrings are in Python.

use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use tdcr::InvalidInput;
use tdcr::constant_curvature::{Arc, Length, Mapping, frames, tip_derivative};
use tdcr::lie::Pose;
use tdcr::robot::rigid_motion;

use crate::convert::{float_array, frozen, frozen_frames, invalid, matrix4, values, wrong_shape};

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
    check("ell", "positive finite lengths [m]", &ell, |l| l.is_finite() && l > 0.0)?;
    Ok((kappa.iter().zip(&phi).zip(&ell)).map(|((k, p), l)| Arc::new(*k, *p, *l)).collect())
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
        (Some(ell), _) => Length::Known(ell),
        (None, true) => Length::Free,
        (None, false) => Length::Known(length),
    };
    let mut parameters = [(); 3].map(|()| Vec::with_capacity(rows));
    let mut residual = Vec::with_capacity(rows * columns);
    for given in values(&array)?.chunks_exact(columns) {
        let fit = mapping.fit(given, known).map_err(|e| invalid(&e))?;
        let arc = fit.arc;
        for (column, value) in parameters.iter_mut().zip([arc.kappa(), arc.phi(), arc.length]) {
            column.push(value);
        }
        residual.extend(fit.residual);
    }
    let [kappa, phi, ell] = parameters;
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
    let mut mapping_of = mapping(azimuth, radius, length.unwrap_or(1.0))?;
    let mut flat = Vec::with_capacity(arcs.len() * mapping_of.tendons());
    for arc in &arcs {
        if length.is_none() {
            mapping_of = mapping(azimuth, radius, arc.length)?;
        }
        flat.extend(mapping_of.displacements(arc));
    }
    frozen(py, flat, &[arcs.len(), mapping_of.tendons()])
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
    let points = crate::arguments::whole("points", points)?;
    if points < 2 {
        let expected = "at least 2 frames per segment (base and tip)";
        return Err(invalid(&InvalidInput::new("points", expected, points)));
    }
    let mut along = Vec::new();
    frames(&pose("base", base)?, &arcs, points, &mut along);
    frozen_frames(py, &along)
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
    frozen(py, matrix.transpose().as_slice().to_vec(), &[6, 3 * chain.len()])
}
