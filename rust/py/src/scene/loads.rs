//! `Loads`.

use std::hash::{DefaultHasher, Hash, Hasher};

use nalgebra::Vector3;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use tdcr::rod::contact as core;

use crate::convert::arguments::number;
use crate::convert::arrays::{frozen_points, frozen_vector, invalid, vector, vectors};

/// Weight and dead loads on a robot, in the world's axes: all keep their direction as it bends.
///
/// They are in newtons, so the backbone needs Young's modulus and diameter.
///
/// Parameters
/// ----------
/// gravity : array_like, shape (3,), optional
///     Acceleration [m/s^2]. Without masses it does nothing.
/// backbone_density : float, optional
///     [kg/m^3]. The weight of a subsegment goes to its two disks in halves.
/// disk_mass : float, optional
///     Of every disk but the base [kg].
/// tip_force : array_like, shape (3,), optional
///     On the centre of the tip disk [N].
/// tip_moment : array_like, shape (3,), optional
///     On the tip disk [N m].
/// disk_forces : array_like, shape (n + 1, 3), optional
///     On the centres of all disks, base first [N]; added to the others.
///
/// Raises
/// ------
/// InvalidInput
///     Numbers that are not finite, a negative density or mass, another shape; names the argument.
/// TypeError
///     A value of another type.
#[pyclass(frozen, eq, module = "tdcr")]
#[derive(Clone, PartialEq)]
pub(crate) struct Loads(pub(crate) core::Loads);

fn or_zero(argument: &str, value: Option<&Bound<'_, PyAny>>) -> PyResult<Vector3<f64>> {
    value.map_or_else(|| Ok(Vector3::zeros()), |value| vector(argument, value))
}

fn gravity(value: &Bound<'_, PyAny>) -> PyResult<Vector3<f64>> {
    vector("gravity", value)
}

fn backbone_density(value: &Bound<'_, PyAny>) -> PyResult<f64> {
    number("backbone_density", value)
}

fn disk_mass(value: &Bound<'_, PyAny>) -> PyResult<f64> {
    number("disk_mass", value)
}

#[pymethods]
impl Loads {
    #[new]
    #[pyo3(
        signature = (*, gravity=core::Loads::default().gravity, backbone_density=0.0, disk_mass=0.0,
            tip_force=None, tip_moment=None, disk_forces=None),
        text_signature = "(*, gravity=(0.0, 0.0, -9.81), backbone_density=0.0, disk_mass=0.0, \
            tip_force=None, tip_moment=None, disk_forces=None)"
    )]
    fn new(
        #[pyo3(from_py_with = gravity)] gravity: Vector3<f64>,
        #[pyo3(from_py_with = backbone_density)] backbone_density: f64,
        #[pyo3(from_py_with = disk_mass)] disk_mass: f64,
        tip_force: Option<&Bound<'_, PyAny>>,
        tip_moment: Option<&Bound<'_, PyAny>>,
        disk_forces: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let forces = disk_forces.map(|forces| vectors("disk_forces", forces)).transpose()?;
        let loads = core::Loads {
            gravity,
            backbone_density,
            disk_mass,
            tip_force: or_zero("tip_force", tip_force)?,
            tip_moment: or_zero("tip_moment", tip_moment)?,
            disk_forces: forces.unwrap_or_default(),
        };
        loads.validate().map_err(|e| invalid(&e))?;
        Ok(Self(loads))
    }

    /// Acceleration of gravity, shape (3,) [m/s^2].
    #[getter]
    fn gravity(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_vector(py, self.0.gravity)
    }

    /// Density of the backbone [kg/m^3].
    #[getter]
    fn backbone_density(&self) -> f64 {
        self.0.backbone_density
    }

    /// Mass of every disk but the base [kg].
    #[getter]
    fn disk_mass(&self) -> f64 {
        self.0.disk_mass
    }

    /// Force on the tip disk's centre, shape (3,) [N].
    #[getter]
    fn tip_force(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_vector(py, self.0.tip_force)
    }

    /// Moment on the tip disk, shape (3,) [N m].
    #[getter]
    fn tip_moment(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_vector(py, self.0.tip_moment)
    }

    /// Forces on the centres of all disks, shape (n + 1, 3) [N], or None.
    #[getter]
    fn disk_forces(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        let forces = &self.0.disk_forces;
        let given = (!forces.is_empty()).then(|| frozen_points(py, forces.iter().copied()));
        given.transpose()
    }

    fn __hash__(&self) -> u64 {
        let loads = &self.0;
        let vectors = [loads.gravity, loads.tip_force, loads.tip_moment];
        let vectors = vectors.iter().chain(&loads.disk_forces).flatten();
        let mut hasher = DefaultHasher::new();
        for value in vectors.chain(&[loads.backbone_density, loads.disk_mass]) {
            // Adding 0.0 turns -0.0, which is equal to it, into 0.0.
            (value + 0.0).to_bits().hash(&mut hasher);
        }
        hasher.finish()
    }

    fn __repr__(&self) -> String {
        let loads = &self.0;
        let text = |v: &Vector3<f64>| format!("({:?}, {:?}, {:?})", v.x, v.y, v.z);
        let forces: Vec<String> = loads.disk_forces.iter().map(text).collect();
        let forces =
            if forces.is_empty() { "None".to_owned() } else { format!("[{}]", forces.join(", ")) };
        format!(
            "Loads(gravity={}, backbone_density={:?}, disk_mass={:?}, tip_force={}, tip_moment={}, \
             disk_forces={forces})",
            text(&loads.gravity),
            loads.backbone_density,
            loads.disk_mass,
            text(&loads.tip_force),
            text(&loads.tip_moment),
        )
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("gravity", self.gravity(py)?)?;
        keywords.set_item("backbone_density", self.backbone_density())?;
        keywords.set_item("disk_mass", self.disk_mass())?;
        keywords.set_item("tip_force", self.tip_force(py)?)?;
        keywords.set_item("tip_moment", self.tip_moment(py)?)?;
        keywords.set_item("disk_forces", self.disk_forces(py)?)?;
        Ok((PyTuple::empty(py), keywords))
    }
}
