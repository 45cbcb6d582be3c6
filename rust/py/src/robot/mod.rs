//! `Robot`.

pub(crate) mod backbone;
pub(crate) mod tendon;

use std::sync::Arc;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};

use tdcr::robot as core;

use crate::convert::arguments::{optional, text};
use crate::convert::arrays::{Lazy, frozen, frozen_frames, invalid, matrix4, type_name};
use crate::convert::python_side;
use crate::robot::backbone::Backbone;
use crate::robot::tendon::Tendon;

/// A backbone with tendons, placed in the world. Checked once, then immutable.
///
/// Parameters
/// ----------
/// backbone : Backbone
/// tendons : sequence of Tendon
///     Displacements and results follow their order.
/// base : array_like, shape (4, 4), optional
///     Frame of disk 0 in the world. Default: identity (z along the backbone towards the tip, x
///     towards azimuth 0).
/// tool : array_like, shape (4, 4), optional
///     Frame of the tool in the frame of the tip disk; inverses and Jacobians speak of it.
///     Default: identity.
/// name : str, optional
///
/// Raises
/// ------
/// InvalidInput
///     A tendon that does not fit the backbone (its end, its values per disk, a hole outside the
///     disk), two tendons of one name, a base or tool that is no rigid motion; names the argument.
/// TypeError
///     A value of another type.
#[pyclass(frozen, eq, hash, module = "tdcr")]
#[derive(Clone)]
pub(crate) struct Robot(pub(crate) Arc<core::Robot>, Arc<Kept>);

/// Parts that are built on first use and kept with the robot.
#[derive(Default)]
struct Kept {
    base: Lazy,
    tool: Lazy,
    rest_lengths: Lazy,
    rest_frames: Lazy,
}

impl From<core::Robot> for Robot {
    fn from(robot: core::Robot) -> Self {
        Self(Arc::new(robot), Arc::default())
    }
}

impl PartialEq for Robot {
    fn eq(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

impl Eq for Robot {}

impl std::hash::Hash for Robot {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.0.hash(state);
    }
}

/// The tendons of an iterable.
fn tendons_of(value: &Bound<'_, PyAny>) -> PyResult<Vec<core::Tendon>> {
    let wrong = |got: &Bound<'_, PyAny>| {
        let got = type_name(got);
        PyTypeError::new_err(format!("tendons: expected a sequence of Tendon, got {got}"))
    };
    let items = value.try_iter().map_err(|_| wrong(value))?;
    items
        .map(|item| {
            let item = item?;
            let tendon = item.cast::<Tendon>().map_err(|_| wrong(&item))?;
            Ok(tendon.get().0.clone())
        })
        .collect()
}

#[pymethods]
impl Robot {
    #[new]
    #[pyo3(signature = (backbone, tendons, *, base=None, tool=None, name=None))]
    fn new(
        backbone: &Bound<'_, Backbone>,
        tendons: &Bound<'_, PyAny>,
        base: Option<&Bound<'_, PyAny>>,
        tool: Option<&Bound<'_, PyAny>>,
        name: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let name = optional("name", name, text)?;
        let base = base.map(|base| matrix4("base", base)).transpose()?;
        let tool = tool.map(|tool| matrix4("tool", tool)).transpose()?;
        let tendons = tendons_of(tendons)?;
        let backbone = backbone.get().0.clone();
        core::Robot::new(backbone, tendons, base.as_ref(), tool.as_ref(), name)
            .map(Self::from)
            .map_err(|e| invalid(&e))
    }

    /// Reads a robot file (TOML or JSON).
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     File ending in .toml or .json.
    ///
    /// Raises
    /// ------
    /// InvalidInput
    ///     Not a robot file: names the field, what was expected and what was found.
    /// OSError
    ///     The file cannot be read.
    #[classmethod]
    fn load<'py>(
        class: &Bound<'py, PyType>,
        path: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        python_side::LOAD_ROBOT.get(class.py())?.call1((path,))
    }

    /// Writes a robot file (TOML or JSON by its ending) that `load` reads back exactly.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     File ending in .toml or .json; replaced if it exists.
    ///
    /// Raises
    /// ------
    /// InvalidInput
    ///     Another file ending.
    /// OSError
    ///     The file cannot be written.
    #[pyo3(signature = (path))]
    fn save(slf: &Bound<'_, Self>, path: &Bound<'_, PyAny>) -> PyResult<()> {
        python_side::SAVE_ROBOT.get(slf.py())?.call1((slf, path))?;
        Ok(())
    }

    /// Its backbone.
    #[getter]
    fn backbone(&self) -> Backbone {
        Backbone(self.0.backbone().clone())
    }

    /// Its tendons as they were described: tuple of Tendon.
    #[getter]
    fn tendons<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.0.tendons().iter().map(|tendon| Tendon(tendon.clone())))
    }

    /// Frame of disk 0 in the world, shape (4, 4).
    #[getter]
    fn base(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let build = || frozen(py, self.0.base().to_row_major().to_vec(), &[4, 4]);
        self.1.base.get(py, build)
    }

    /// Frame of the tool in the frame of the tip disk, shape (4, 4).
    #[getter]
    fn tool(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let build = || frozen(py, self.0.tool().to_row_major().to_vec(), &[4, 4]);
        self.1.tool.get(py, build)
    }

    /// Its name, or None.
    #[getter]
    fn name(&self) -> Option<&str> {
        self.0.name()
    }

    /// Names of the tendons, defaults filled in: tuple of str.
    #[getter]
    fn tendon_names<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.0.tendon_names())
    }

    /// Length of every tendon in the rest shape, shape (K,) [m].
    #[getter]
    fn rest_lengths(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let build = || {
            let lengths = self.0.paths().iter().map(|path| path.rest_length).collect();
            frozen(py, lengths, &[self.0.paths().len()])
        };
        self.1.rest_lengths.get(py, build)
    }

    /// Frame of every disk in the rest shape, in the world, shape (n + 1, 4, 4).
    #[getter]
    fn rest_frames(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let build = || frozen_frames(py, &self.0.rest_frames());
        self.1.rest_frames.get(py, build)
    }

    fn __repr__(&self) -> String {
        let name = self.0.name().map(|name| format!("{name:?}, ")).unwrap_or_default();
        let backbone = self.0.backbone();
        format!(
            "<Robot {name}{} subsegments over {} m, {} tendons: {}>",
            backbone.subsegments(),
            backbone.total_length(),
            self.0.tendons().len(),
            self.0.tendon_names().join(", "),
        )
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let backbone = Bound::new(py, self.backbone())?.into_any();
        let positional = PyTuple::new(py, [backbone, self.tendons(py)?.into_any()])?;
        let keywords = PyDict::new(py);
        keywords.set_item("base", self.base(py)?)?;
        keywords.set_item("tool", self.tool(py)?)?;
        keywords.set_item("name", self.name())?;
        Ok((positional, keywords))
    }
}
