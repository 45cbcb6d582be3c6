//! Every name of the Python side that Rust calls back. Where a module moves there, it moves here, and nowhere else.

use pyo3::prelude::*;
use pyo3::types::PyModule;

/// A function or class by its module and name.
pub(crate) struct PythonName {
    pub(crate) module: &'static str,
    pub(crate) name: &'static str,
}

impl PythonName {
    const fn new(module: &'static str, name: &'static str) -> Self {
        Self { module, name }
    }

    /// The object of this name.
    pub(crate) fn get<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import(self.module)?.getattr(self.name)
    }
}

// Errors and statuses.
pub(crate) const INVALID_INPUT: PythonName = PythonName::new("tdcr.errors", "InvalidInput");
pub(crate) const NOT_CONVERGED: PythonName = PythonName::new("tdcr.errors", "NotConverged");
pub(crate) const STATUS: PythonName = PythonName::new("tdcr._base.status", "Status");

// Files and pictures behind methods of the classes.
pub(crate) const LOAD_ROBOT: PythonName = PythonName::new("tdcr._io.robot_file", "load_robot");
pub(crate) const SAVE_ROBOT: PythonName = PythonName::new("tdcr._io.robot_file", "save_robot");
pub(crate) const LOAD_MESH: PythonName = PythonName::new("tdcr._io.mesh_file", "load_mesh");
pub(crate) const LOAD: PythonName = PythonName::new("tdcr._io.save_load", "load");
pub(crate) const SAVE: PythonName = PythonName::new("tdcr._io.save_load", "save");
pub(crate) const PLOT_SHAPE: PythonName = PythonName::new("tdcr._plot.shape", "plot_shape");

// Results whose classes are Python's.
pub(crate) const VARIATION: PythonName = PythonName::new("tdcr._forward.sensitivity", "Variation");
pub(crate) const GRADIENT: PythonName = PythonName::new("tdcr._forward.sensitivity", "Gradient");

// Functions of this module that pickles call.
pub(crate) const REBUILD_TENDON: PythonName = PythonName::new("tdcr._core", "_tendon");
pub(crate) const REBUILD_SHAPE: PythonName = PythonName::new("tdcr._core", "_shape");
pub(crate) const REBUILD_SENSITIVITY: PythonName = PythonName::new("tdcr._core", "sensitivity");

/// The module numpy.
pub(crate) fn numpy(py: Python<'_>) -> PyResult<Bound<'_, PyModule>> {
    py.import("numpy")
}
