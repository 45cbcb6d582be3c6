//! `Tendon`.

use std::fmt::Write as _;

use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use tdcr::robot::{self as core, PerDisk, Routing};

use crate::convert::arguments::{OneOrMany, number, optional, text, whole};
use crate::convert::arrays::{invalid, list_text};
use crate::convert::python_side;

/// A cable that runs from the base through one hole in every disk up to the disk where it ends.
///
/// Parameters
/// ----------
/// azimuth : float or sequence of float
///     Azimuth of the hole, counter-clockwise about +z from +x, for all disks or for each of the
///     disks 0..end [rad].
/// radius : float or sequence of float
///     Distance of the hole from the disk centre, for all disks or for each [m].
/// end : int, optional
///     Disk where the tendon terminates. Default: the tip.
/// stiffness : float, optional
///     Axial stiffness EA of the cable [N]. Default: rigid.
/// name : str, optional
///     Default: "t0", "t1", ... by its place in the robot.
///
/// Raises
/// ------
/// InvalidInput
///     A value out of range, or sequences whose lengths do not fit; names the argument.
/// TypeError
///     A value of another type.
///
/// See Also
/// --------
/// Tendon.helical : azimuth linear in arc length.
/// Tendon.from_holes : holes by number.
#[pyclass(frozen, eq, hash, module = "tdcr")]
#[derive(Clone, PartialEq, Eq, Hash)]
pub(crate) struct Tendon(pub(crate) core::Tendon);

fn per_disk(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<PerDisk> {
    Ok(match OneOrMany::extract(argument, value, number)? {
        OneOrMany::One(value) => PerDisk::Same(value),
        OneOrMany::Many(values) => PerDisk::Each(values),
    })
}

fn per_disk_value<'py>(py: Python<'py>, value: &PerDisk) -> PyResult<Bound<'py, PyAny>> {
    match value {
        PerDisk::Same(value) => value.into_bound_py_any(py),
        PerDisk::Each(values) => Ok(PyTuple::new(py, values)?.into_any()),
    }
}

fn per_disk_text(value: &PerDisk) -> String {
    match value {
        PerDisk::Same(value) => format!("{value:?}"),
        PerDisk::Each(values) => list_text(values),
    }
}

impl Tendon {
    fn build(
        routing: Routing,
        end: Option<&Bound<'_, PyAny>>,
        stiffness: Option<f64>,
        name: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let end = optional("end", end, whole)?;
        let name = optional("name", name, text)?;
        core::Tendon::new(routing, end, stiffness, name).map(Self).map_err(|e| invalid(&e))
    }
}

#[pymethods]
impl Tendon {
    #[new]
    #[pyo3(signature = (azimuth, radius, *, end=None, stiffness=None, name=None))]
    fn new(
        azimuth: &Bound<'_, PyAny>,
        radius: &Bound<'_, PyAny>,
        end: Option<&Bound<'_, PyAny>>,
        stiffness: Option<f64>,
        name: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let routing = Routing::Angles {
            azimuth: per_disk("azimuth", azimuth)?,
            radius: per_disk("radius", radius)?,
        };
        Self::build(routing, end, stiffness, name)
    }

    /// A tendon whose azimuth grows linearly with arc length from base to end.
    ///
    /// Parameters
    /// ----------
    /// azimuth : float
    ///     Azimuth of the hole in disk 0 [rad].
    /// radius : float
    ///     Distance of the holes from the disk centre [m].
    /// turns : float, optional
    ///     Turns from base to end, positive counter-clockwise about +z.
    /// end, stiffness, name
    ///     As for `Tendon`.
    #[staticmethod]
    #[pyo3(signature = (azimuth, radius, *, turns=1.0, end=None, stiffness=None, name=None))]
    fn helical(
        azimuth: f64,
        radius: f64,
        turns: f64,
        end: Option<&Bound<'_, PyAny>>,
        stiffness: Option<f64>,
        name: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        Self::build(Routing::Helical { azimuth, radius, turns }, end, stiffness, name)
    }

    /// A tendon by the numbers of the holes it passes.
    ///
    /// Parameters
    /// ----------
    /// indices : sequence of int
    ///     Hole number on each disk 0..end, 0-based, counter-clockwise.
    /// count : int
    ///     Evenly spaced holes per disk.
    /// radius : float or sequence of float
    ///     Distance of the holes from the disk centre, for all disks or for each [m].
    /// azimuth : float, optional
    ///     Azimuth of hole 0 [rad].
    /// end, stiffness, name
    ///     As for `Tendon`.
    #[staticmethod]
    #[pyo3(signature = (indices, count, radius, *, azimuth=0.0, end=None, stiffness=None,
                        name=None))]
    fn from_holes(
        indices: &Bound<'_, PyAny>,
        count: &Bound<'_, PyAny>,
        radius: &Bound<'_, PyAny>,
        azimuth: f64,
        end: Option<&Bound<'_, PyAny>>,
        stiffness: Option<f64>,
        name: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let routing = Routing::Holes {
            indices: OneOrMany::extract("indices", indices, whole)?.into_vec(),
            count: whole("count", count)?,
            radius: per_disk("radius", radius)?,
            azimuth,
        };
        Self::build(routing, end, stiffness, name)
    }

    /// Description of the holes: "angles", "helical" or "holes".
    #[getter]
    fn routing(&self) -> &'static str {
        match self.0.routing() {
            Routing::Angles { .. } => "angles",
            Routing::Helical { .. } => "helical",
            Routing::Holes { .. } => "holes",
        }
    }

    /// Azimuth as it was given [rad]: float or tuple of float.
    #[getter]
    fn azimuth<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match self.0.routing() {
            Routing::Angles { azimuth, .. } => per_disk_value(py, azimuth),
            Routing::Helical { azimuth, .. } | Routing::Holes { azimuth, .. } => {
                azimuth.into_bound_py_any(py)
            }
        }
    }

    /// Distance of the holes from the disk centre [m]: float or tuple of float.
    #[getter]
    fn radius<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match self.0.routing() {
            Routing::Angles { radius, .. } | Routing::Holes { radius, .. } => {
                per_disk_value(py, radius)
            }
            Routing::Helical { radius, .. } => radius.into_bound_py_any(py),
        }
    }

    /// Turns from base to end of a helical tendon, else None.
    #[getter]
    fn turns(&self) -> Option<f64> {
        match self.0.routing() {
            Routing::Helical { turns, .. } => Some(*turns),
            _ => None,
        }
    }

    /// Hole numbers of a tendon given by them, else None.
    #[getter]
    fn indices<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyTuple>>> {
        match self.0.routing() {
            Routing::Holes { indices, .. } => PyTuple::new(py, indices).map(Some),
            _ => Ok(None),
        }
    }

    /// Holes per disk of a tendon given by hole numbers, else None.
    #[getter]
    fn count(&self) -> Option<usize> {
        match self.0.routing() {
            Routing::Holes { count, .. } => Some(*count),
            _ => None,
        }
    }

    /// Disk where it terminates, or None for the tip.
    #[getter]
    fn end(&self) -> Option<usize> {
        self.0.end()
    }

    /// Axial stiffness EA [N], or None when rigid.
    #[getter]
    fn stiffness(&self) -> Option<f64> {
        self.0.stiffness()
    }

    /// Its name, or None for the default by its place.
    #[getter]
    fn name(&self) -> Option<&str> {
        self.0.name()
    }

    fn __repr__(&self) -> String {
        let mut text = match self.0.routing() {
            Routing::Angles { azimuth, radius } => {
                format!("Tendon({}, {}", per_disk_text(azimuth), per_disk_text(radius))
            }
            Routing::Helical { azimuth, radius, turns } => {
                format!("Tendon.helical({azimuth:?}, {radius:?}, turns={turns:?}")
            }
            Routing::Holes { indices, count, radius, azimuth } => {
                let (holes, radius) = (list_text(indices), per_disk_text(radius));
                format!("Tendon.from_holes({holes}, {count}, {radius}, azimuth={azimuth:?}")
            }
        };
        if let Some(end) = self.0.end() {
            let _ = write!(text, ", end={end}");
        }
        if let Some(stiffness) = self.0.stiffness() {
            let _ = write!(text, ", stiffness={stiffness:?}");
        }
        if let Some(name) = self.0.name() {
            let _ = write!(text, ", name={name:?}");
        }
        text + ")"
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let rebuild = python_side::REBUILD_TENDON.get(py)?;
        let (end, stiffness) = (self.end(), self.stiffness());
        let recipe = (
            self.azimuth(py)?,
            self.radius(py)?,
            self.turns(),
            self.indices(py)?,
            self.count(),
            end,
            stiffness,
            self.name(),
        );
        Ok((rebuild, recipe.into_pyobject(py)?))
    }
}

/// Rebuilds a pickled tendon from its recipe.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // The recipe, flat.
pub(crate) fn _tendon(
    azimuth: &Bound<'_, PyAny>,
    radius: &Bound<'_, PyAny>,
    turns: Option<f64>,
    indices: Option<&Bound<'_, PyAny>>,
    count: Option<&Bound<'_, PyAny>>,
    end: Option<&Bound<'_, PyAny>>,
    stiffness: Option<f64>,
    name: Option<&Bound<'_, PyAny>>,
) -> PyResult<Tendon> {
    match (turns, indices, count) {
        (Some(turns), _, _) => {
            let (azimuth, radius) = (azimuth.extract()?, radius.extract()?);
            Tendon::helical(azimuth, radius, turns, end, stiffness, name)
        }
        (None, Some(indices), Some(count)) => {
            let azimuth = azimuth.extract()?;
            Tendon::from_holes(indices, count, radius, azimuth, end, stiffness, name)
        }
        _ => Tendon::new(azimuth, radius, end, stiffness, name),
    }
}
