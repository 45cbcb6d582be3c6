//! The rod model from Python: its settings, and what `forward` does for it alone.

use std::hash::{DefaultHasher, Hash, Hasher};

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use tdcr::InvalidInput;
use tdcr::rod::{self, Subsegment, TendonRule};

use crate::convert::arguments::whole;
use crate::convert::arrays::{called, invalid};

/// Choices of the rod model.
///
/// Parameters
/// ----------
/// subsegment : {"arc", "link"}, optional
///     Kinematics of an element. "arc": of constant strain, a piece of a helix. "link": a rigid link
///     that bisects the bend, as in the papers. Both converge with order 2 in the number of elements.
/// tendons : {"sliding", "proportional"}, optional
///     How a displacement is imposed. "sliding": the total length of a tendon is bounded and it slides
///     without friction. "proportional": every piece between two disks shrinks by the same ratio, as in
///     the papers.
/// elements : int, optional
///     Elements between two disks, 1 to 100.
/// axial : bool, optional
///     Whether elements stretch. Needs Young's modulus and diameter of the backbone.
/// tolerance : float, optional
///     Relative residual of forces and lengths that counts as solved, 1e-13 to 1e-3; among obstacles and
///     under loads 5e-11 if it is smaller.
/// max_iterations : int, optional
///     Evaluations of the whole rod at most, each of which ends in a Newton step.
/// body_radius : float, optional
///     Radius of a body around the backbone, which keeps clear of obstacles at the disks' centres [m]. 0:
///     only the centres themselves, the tendons' holes and the places opposite to these do.
///
/// Raises
/// ------
/// InvalidInput
///     A value out of range, an unknown name.
#[pyclass(frozen, eq, module = "tdcr")]
#[derive(Clone, PartialEq)]
pub(crate) struct RodSettings(pub(crate) rod::RodSettings);

fn elements(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    whole("elements", value)
}

fn max_iterations(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    whole("max_iterations", value)
}

/// The choice of a name.
pub(crate) fn named<T: Copy>(
    argument: &str,
    all: [T; 2],
    name: fn(T) -> &'static str,
    given: &str,
) -> PyResult<T> {
    all.into_iter().find(|known| name(*known) == given).ok_or_else(|| {
        let expected = format!("\"{}\" or \"{}\"", name(all[0]), name(all[1]));
        invalid(&InvalidInput::new(argument, expected, format!("\"{given}\"")))
    })
}

#[pymethods]
impl RodSettings {
    #[new]
    #[pyo3(signature = (*, subsegment="arc", tendons="sliding", elements=1, axial=false, tolerance=1e-11,
        max_iterations=600, body_radius=0.0))]
    fn new(
        subsegment: &str,
        tendons: &str,
        #[pyo3(from_py_with = elements)] elements: usize,
        axial: bool,
        tolerance: f64,
        #[pyo3(from_py_with = max_iterations)] max_iterations: usize,
        body_radius: f64,
    ) -> PyResult<Self> {
        let subsegment = named("subsegment", Subsegment::ALL, Subsegment::as_str, subsegment)?;
        let tendons = named("tendons", TendonRule::ALL, TendonRule::as_str, tendons)?;
        // Adding 0.0 turns -0.0, which is equal to it, into 0.0.
        let body_radius = body_radius + 0.0;
        let settings = rod::RodSettings {
            subsegment,
            tendons,
            axial,
            elements,
            tolerance,
            max_iterations,
            body_radius,
        };
        settings.validate().map_err(|e| invalid(&e))?;
        Ok(Self(settings))
    }

    /// Kinematics of an element: "arc" or "link".
    #[getter]
    fn subsegment(&self) -> &'static str {
        self.0.subsegment.as_str()
    }

    /// How displacements are imposed: "sliding" or "proportional".
    #[getter]
    fn tendons(&self) -> &'static str {
        self.0.tendons.as_str()
    }

    /// Elements between two disks.
    #[getter]
    fn elements(&self) -> usize {
        self.0.elements
    }

    /// Whether elements stretch.
    #[getter]
    fn axial(&self) -> bool {
        self.0.axial
    }

    /// Relative residual of forces and lengths that counts as solved.
    #[getter]
    fn tolerance(&self) -> f64 {
        self.0.tolerance
    }

    /// Evaluations of the whole rod at most, each of which ends in a Newton step.
    #[getter]
    fn max_iterations(&self) -> usize {
        self.0.max_iterations
    }

    /// Radius of a body around the backbone that keeps clear of obstacles [m].
    #[getter]
    fn body_radius(&self) -> f64 {
        self.0.body_radius
    }

    fn __hash__(&self) -> u64 {
        let settings = &self.0;
        let mut hasher = DefaultHasher::new();
        (settings.subsegment, settings.tendons, settings.axial).hash(&mut hasher);
        (settings.elements, settings.max_iterations).hash(&mut hasher);
        settings.tolerance.to_bits().hash(&mut hasher);
        settings.body_radius.to_bits().hash(&mut hasher);
        hasher.finish()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        called("RodSettings", &keywords(py, &self.0)?)
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        Ok((PyTuple::empty(py), keywords(py, &self.0)?))
    }
}

/// Settings as the keywords of `RodSettings`.
pub(crate) fn keywords<'py>(
    py: Python<'py>,
    settings: &rod::RodSettings,
) -> PyResult<Bound<'py, PyDict>> {
    let keywords = PyDict::new(py);
    keywords.set_item("subsegment", settings.subsegment.as_str())?;
    keywords.set_item("tendons", settings.tendons.as_str())?;
    keywords.set_item("elements", settings.elements)?;
    keywords.set_item("axial", settings.axial)?;
    keywords.set_item("tolerance", settings.tolerance)?;
    keywords.set_item("max_iterations", settings.max_iterations)?;
    keywords.set_item("body_radius", settings.body_radius)?;
    Ok(keywords)
}
