//! Base class of all obstacles, and obstacles as arguments.

use nalgebra::Vector3;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use tdcr::InvalidInput;
use tdcr::obstacle::{self as core, Fault, Near};

use crate::convert::arguments::wrong_type;
use crate::convert::arrays::{frozen, frozen_points, invalid, vectors};

/// Points between two looks at signals.
const CHUNK: usize = 4096;

/// Base of all obstacles: volumes that a robot stays out of, or inside of.
///
/// Made as one of its kinds: `Sphere`, `Mesh`, `SignedDistance` and the others that extend it.
/// Frozen; equal and hashed by value.
#[pyclass(frozen, eq, hash, subclass, module = "tdcr")]
#[derive(PartialEq, Eq, Hash)]
pub(crate) struct Obstacle(pub(crate) core::Obstacle);

impl Obstacle {
    pub(crate) fn new(volume: impl Into<core::Volume>, inside: bool) -> Self {
        Self(core::Obstacle::new(volume, inside))
    }

    /// The base of an obstacle of one kind.
    pub(crate) fn initializer(self) -> PyClassInitializer<Self> {
        self.into()
    }

    /// Arguments of an equal one.
    pub(crate) fn new_args<'py>(
        &self,
        positional: Bound<'py, PyTuple>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let keywords = PyDict::new(positional.py());
        keywords.set_item("inside", self.0.inside())?;
        Ok((positional, keywords))
    }

    /// `Name(arguments)`, with `inside` where it is so.
    pub(crate) fn text(&self, name: &str, arguments: &str) -> String {
        let inside = if self.0.inside() { ", inside=True" } else { "" };
        format!("{name}({arguments}{inside})")
    }
}

#[pymethods]
impl Obstacle {
    /// True for a lumen: the robot has to stay in it.
    #[getter]
    fn inside(&self) -> bool {
        self.0.inside()
    }

    /// Signed distance of points: positive where the robot may be.
    ///
    /// Parameters
    /// ----------
    /// points : array_like, shape (P, 3)
    ///     In the world frame [m].
    ///
    /// Returns
    /// -------
    /// ndarray, shape (P,)
    ///     [m]; of a `SignedDistance`, what its function says.
    ///
    /// Raises
    /// ------
    /// InvalidInput
    ///     Points of another shape or that are not finite; a function that does not return one finite
    ///     number.
    /// Exception
    ///     Whatever the function of a `SignedDistance` raises.
    fn distance(&self, py: Python<'_>, points: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let near = self.near(py, points)?;
        let rows = near.len();
        frozen(py, near.iter().map(|near| near.distance).collect(), &[rows])
    }

    /// Gradient of the signed distance: towards where the robot may be.
    ///
    /// Where the nearest place is not unique (centre, axis) it leads away from one of them, always the
    /// same.
    ///
    /// Parameters
    /// ----------
    /// points : array_like, shape (P, 3)
    ///     In the world frame [m].
    ///
    /// Returns
    /// -------
    /// ndarray, shape (P, 3)
    ///     Unit vectors; of a `SignedDistance`, the gradient of its function.
    ///
    /// Raises
    /// ------
    /// InvalidInput, Exception
    ///     As `distance`.
    fn gradient(&self, py: Python<'_>, points: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        frozen_points(py, self.near(py, points)?.iter().map(|near| near.gradient))
    }
}

impl Obstacle {
    fn near(&self, py: Python<'_>, points: &Bound<'_, PyAny>) -> PyResult<Vec<Near>> {
        let points = finite_points(points)?;
        let mut near = Vec::with_capacity(points.len());
        for chunk in points.chunks(CHUNK) {
            let found: Result<Vec<Near>, Fault> =
                py.detach(|| chunk.iter().map(|x| self.0.nearest(x)).collect());
            near.extend(found.map_err(|fault| fault_exception(py, fault, None))?);
            py.check_signals()?;
        }
        Ok(near)
    }
}

fn finite_points(points: &Bound<'_, PyAny>) -> PyResult<Vec<Vector3<f64>>> {
    let points = vectors("points", points)?;
    let bad = points.iter().position(|x| x.iter().any(|component| !component.is_finite()));
    bad.map_or(Ok(()), |row| {
        let [x, y, z] = points[row].into();
        let got = format!("({x:?}, {y:?}, {z:?}) in row {row}");
        Err(invalid(&InvalidInput::new("points", "finite numbers [m]", got)))
    })?;
    Ok(points)
}

/// Exception of a fault: the one that a function raised, with a note that names the obstacle where there are several.
pub(crate) fn fault_exception(py: Python<'_>, fault: Fault, obstacle: Option<&str>) -> PyErr {
    match fault.downcast::<PyErr>() {
        Ok(error) => {
            if let Some(name) = obstacle
                && let Err(other) =
                    error.value(py).call_method1("add_note", (format!("raised by {name}"),))
            {
                return other;
            }
            *error
        }
        // All other faults are the core's.
        Err(fault) => match fault.downcast::<InvalidInput>() {
            Ok(error) => invalid(&obstacle.map_or(*error.clone(), |name| error.within(name))),
            Err(fault) => pyo3::exceptions::PyRuntimeError::new_err(fault.to_string()),
        },
    }
}

/// One obstacle or a sequence of them.
pub(crate) fn obstacles(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<core::Obstacle>> {
    if let Ok(one) = value.cast::<Obstacle>() {
        return Ok(vec![one.get().0.clone()]);
    }
    let expected = "an obstacle or a sequence of obstacles";
    let items = value.try_iter().map_err(|_| wrong_type(argument, expected, value))?;
    let one = |(i, item): (usize, PyResult<Bound<'_, PyAny>>)| {
        let item = item?;
        let name = format!("{argument}[{i}]");
        let one = item.cast::<Obstacle>().map_err(|_| wrong_type(&name, "an obstacle", &item))?;
        Ok(one.get().0.clone())
    };
    items.enumerate().map(one).collect()
}

/// Smallest signed distance of points from any of several obstacles.
///
/// Parameters
/// ----------
/// obstacles : Obstacle or sequence of Obstacle
///     Their union is what a robot stays out of; none at all leaves every point free.
/// points : array_like, shape (P, 3)
///     In the world frame [m], for instance `shape.positions`.
///
/// Returns
/// -------
/// ndarray, shape (P,)
///     [m]: negative within an obstacle (or beyond the wall of a lumen), infinite without obstacles.
///
/// Raises
/// ------
/// InvalidInput
///     Points of another shape or that are not finite; a signed distance that does not return one
///     finite number (names the obstacle).
/// Exception
///     Whatever the function of a `SignedDistance` raises, with a note that names the obstacle.
/// TypeError
///     Something that is no obstacle.
#[pyfunction]
pub(crate) fn clearance(
    py: Python<'_>,
    obstacles: &Bound<'_, PyAny>,
    points: &Bound<'_, PyAny>,
) -> PyResult<Py<PyAny>> {
    let all = self::obstacles("obstacles", obstacles)?;
    let points = finite_points(points)?;
    let mut least = vec![f64::INFINITY; points.len()];
    for (i, obstacle) in all.iter().enumerate() {
        for (points, least) in points.chunks(CHUNK).zip(least.chunks_mut(CHUNK)) {
            let done: Result<(), Fault> = py.detach(|| {
                for (x, least) in points.iter().zip(least) {
                    *least = least.min(obstacle.nearest(x)?.distance);
                }
                Ok(())
            });
            done.map_err(|fault| fault_exception(py, fault, Some(&format!("obstacles[{i}]"))))?;
            py.check_signals()?;
        }
    }
    let rows = least.len();
    frozen(py, least, &[rows])
}
