//! `Contact`: where a shape touches an obstacle.

use std::hash::{DefaultHasher, Hash, Hasher};

use numpy::Element;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use tdcr::{Contact as Core, InvalidInput, PointKind};

use crate::convert::arguments::{number, optional, whole};
use crate::convert::arrays::{frozen, frozen_points, frozen_vector, invalid, vector};

/// A place where a robot touches an obstacle, in the world frame.
///
/// Parameters
/// ----------
/// disk : int
///     The disk that touches.
/// kind : {"center", "hole", "mirror"}
///     Which of its points: its centre (or the body around it), a tendon's hole, or the place opposite to a hole.
/// tendon : int or None
///     The tendon whose hole it is, or opposite to it.
/// obstacle : int
///     Index in `Shape.obstacles`.
/// point : array_like, shape (3,)
///     Place of the robot's point [m].
/// normal : array_like, shape (3,)
///     Gradient of the obstacle's distance there: a unit vector towards the robot.
/// gap : float
///     Distance left, the body's radius taken off [m]; 0 up to what the solve leaves.
/// force : array_like, shape (3,)
///     Force on the robot [N, or 1/m^2 when the shape's `units` is "EI"]. The obstacle feels the opposite.
///
/// Raises
/// ------
/// InvalidInput
///     An unknown kind, a vector of another shape.
/// TypeError
///     A value of another type.
#[pyclass(frozen, eq, module = "tdcr")]
#[derive(Clone, PartialEq)]
pub(crate) struct Contact(pub(crate) Core);

#[pymethods]
impl Contact {
    #[new]
    #[allow(clippy::too_many_arguments)] // The fields of a result.
    fn new(
        disk: &Bound<'_, PyAny>,
        kind: &str,
        tendon: Option<&Bound<'_, PyAny>>,
        obstacle: &Bound<'_, PyAny>,
        point: &Bound<'_, PyAny>,
        normal: &Bound<'_, PyAny>,
        gap: &Bound<'_, PyAny>,
        force: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let known = PointKind::ALL.into_iter().find(|known| known.as_str() == kind);
        let kind = known.ok_or_else(|| {
            let expected = "\"center\", \"hole\" or \"mirror\"";
            invalid(&InvalidInput::new("kind", expected, format!("\"{kind}\"")))
        })?;
        Ok(Self(Core {
            disk: whole("disk", disk)?,
            kind,
            tendon: optional("tendon", tendon, whole)?,
            obstacle: whole("obstacle", obstacle)?,
            point: vector("point", point)?,
            normal: vector("normal", normal)?,
            gap: number("gap", gap)?,
            force: vector("force", force)?,
        }))
    }

    /// The disk that touches.
    #[getter]
    fn disk(&self) -> usize {
        self.0.disk
    }

    /// Which of its points: "center", "hole" or "mirror".
    #[getter]
    fn kind(&self) -> &'static str {
        self.0.kind.as_str()
    }

    /// The tendon whose hole it is, or opposite to it; None for a centre.
    #[getter]
    fn tendon(&self) -> Option<usize> {
        self.0.tendon
    }

    /// Index in `Shape.obstacles`.
    #[getter]
    fn obstacle(&self) -> usize {
        self.0.obstacle
    }

    /// Place of the robot's point, shape (3,) [m].
    #[getter]
    fn point(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_vector(py, self.0.point)
    }

    /// Unit vector from the obstacle towards the robot, shape (3,).
    #[getter]
    fn normal(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_vector(py, self.0.normal)
    }

    /// Distance left [m].
    #[getter]
    fn gap(&self) -> f64 {
        self.0.gap
    }

    /// Force on the robot, shape (3,) [N, or 1/m^2 when the shape's `units` is "EI"].
    #[getter]
    fn force(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_vector(py, self.0.force)
    }

    fn __hash__(&self) -> u64 {
        let Core { disk, kind, tendon, obstacle, point, force, .. } = &self.0;
        let mut hasher = DefaultHasher::new();
        (disk, kind, tendon, obstacle).hash(&mut hasher);
        for value in point.iter().chain(force) {
            // Adding 0.0 turns -0.0, which is equal to it, into 0.0.
            (value + 0.0).to_bits().hash(&mut hasher);
        }
        hasher.finish()
    }

    fn __repr__(&self) -> String {
        let Core { disk, tendon, obstacle, point, force, .. } = &self.0;
        let kind = self.kind();
        let which = tendon.map_or_else(|| kind.to_owned(), |k| format!("{kind} of tendon {k}"));
        let [x, y, z] = (*point).into();
        format!(
            "<Contact of disk {disk}, {which}, with obstacle {obstacle} at ({x:.6}, {y:.6}, {z:.6}) m: \
             force {:.6}>",
            force.norm()
        )
    }

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let (point, normal, force) = (self.point(py)?, self.normal(py)?, self.force(py)?);
        let Core { disk, tendon, obstacle, gap, .. } = self.0;
        (disk, self.kind(), tendon, obstacle, point, normal, gap, force).into_pyobject(py)
    }
}

/// Contacts of many rows as columns by name; what has no tendon has -1.
pub(crate) fn table<'py>(
    py: Python<'py>,
    contacts: &[(usize, Core)],
) -> PyResult<Bound<'py, PyDict>> {
    fn column<T: Element>(
        py: Python<'_>,
        contacts: &[(usize, Core)],
        value: impl FnMut(&(usize, Core)) -> T,
    ) -> PyResult<Py<PyAny>> {
        frozen(py, contacts.iter().map(value).collect(), &[contacts.len()])
    }
    let index = |k: usize| i64::try_from(k).unwrap_or(i64::MAX);
    let columns = PyDict::new(py);
    columns.set_item("row", column(py, contacts, |(row, _)| index(*row))?)?;
    columns.set_item("disk", column(py, contacts, |(_, c)| index(c.disk))?)?;
    let kinds: Vec<_> = contacts.iter().map(|(_, c)| c.kind.as_str()).collect();
    columns.set_item("kind", kinds)?;
    columns.set_item("tendon", column(py, contacts, |(_, c)| c.tendon.map_or(-1, index))?)?;
    columns.set_item("obstacle", column(py, contacts, |(_, c)| index(c.obstacle))?)?;
    columns.set_item("point", frozen_points(py, contacts.iter().map(|(_, c)| c.point))?)?;
    columns.set_item("normal", frozen_points(py, contacts.iter().map(|(_, c)| c.normal))?)?;
    columns.set_item("gap", column(py, contacts, |(_, c)| c.gap)?)?;
    columns.set_item("force", frozen_points(py, contacts.iter().map(|(_, c)| c.force))?)?;
    Ok(columns)
}
