//! `Backbone`.

use std::fmt::Write as _;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use tdcr::robot::{self as core, BackboneSpec};

use crate::convert::arguments::{OneOrMany, number, whole};
use crate::convert::arrays::{frozen, frozen_points, invalid, list_text, one_or_tuple, vectors};

/// The flexible spine of a robot.
///
/// Parameters
/// ----------
/// length : float or sequence of float
///     Length of the backbone, or of each of its stretches, base first [m].
/// subsegments : int or sequence of int
///     Number of equal subsegments of the backbone, or of each stretch. With n in all there are
///     n + 1 disks, numbered 0 (base) to n (tip).
/// poisson_ratio : float, optional
///     Poisson's ratio of the material, in (-1, 0.5]; torsion is softer than bending by
///     GJ/EI = 1/(1 + nu).
/// rest : array_like, shape (n, 3), optional
///     Rest rotation vector of each subsegment, in the frame of its own base disk [rad]. Default:
///     straight.
/// youngs_modulus : float, optional
///     Young's modulus [Pa]. With it (and `diameter`) forces come out in newtons; without, in units
///     of the bending stiffness EI.
/// diameter : float or sequence of float, optional
///     Diameter of the round backbone, or of each subsegment [m].
/// disk_radius : float, optional
///     Outer radius of the disks [m]; holes outside it are refused.
///
/// Raises
/// ------
/// InvalidInput
///     A value out of range, or sequences whose lengths do not fit; names the argument.
/// TypeError
///     A value of another type.
#[pyclass(frozen, eq, hash, module = "tdcr")]
#[derive(Clone, PartialEq, Eq, Hash)]
pub(crate) struct Backbone(pub(crate) core::Backbone);

fn diameters(diameter: Option<&Bound<'_, PyAny>>) -> PyResult<Option<Vec<f64>>> {
    let extract = |d| OneOrMany::extract("diameter", d, number);
    Ok(diameter.map(extract).transpose()?.map(OneOrMany::into_vec))
}

#[pymethods]
impl Backbone {
    #[new]
    #[pyo3(signature = (length, subsegments, *, poisson_ratio=0.35, rest=None, youngs_modulus=None,
                        diameter=None, disk_radius=None))]
    fn new(
        length: &Bound<'_, PyAny>,
        subsegments: &Bound<'_, PyAny>,
        poisson_ratio: f64,
        rest: Option<&Bound<'_, PyAny>>,
        youngs_modulus: Option<f64>,
        diameter: Option<&Bound<'_, PyAny>>,
        disk_radius: Option<f64>,
    ) -> PyResult<Self> {
        let spec = BackboneSpec {
            length: OneOrMany::extract("length", length, number)?.into_vec(),
            subsegments: OneOrMany::extract("subsegments", subsegments, whole)?.into_vec(),
            poisson_ratio,
            rest: rest.map(|rest| vectors("rest", rest)).transpose()?,
            youngs_modulus,
            diameter: diameters(diameter)?,
            disk_radius,
        };
        core::Backbone::new(spec).map(Self).map_err(|e| invalid(&e))
    }

    /// A pre-bent backbone along a curve in space.
    ///
    /// A cubic spline goes through the points; the rest rotation vectors are those of frames that do
    /// not twist about it. The rest shape starts at the robot's base frame: it lies on the curve where
    /// the curve starts along the base's z axis, and is the curve moved there otherwise. The arcs of
    /// the subsegments meet the curve's tangents exactly and its points to order 2 in their number.
    ///
    /// Parameters
    /// ----------
    /// points : array_like, shape (m, 3)
    ///     At least two points along the curve, base first [m]. The backbone's length is the spline's.
    /// subsegments : int
    ///     Number of equal subsegments.
    /// poisson_ratio, youngs_modulus, diameter, disk_radius
    ///     As for `Backbone`.
    ///
    /// Raises
    /// ------
    /// InvalidInput
    ///     Points that repeat or are not finite, a curve that bends by more than pi per subsegment.
    #[staticmethod]
    #[pyo3(signature = (points, subsegments, *, poisson_ratio=0.35, youngs_modulus=None,
                        diameter=None, disk_radius=None))]
    fn from_curve(
        points: &Bound<'_, PyAny>,
        subsegments: &Bound<'_, PyAny>,
        poisson_ratio: f64,
        youngs_modulus: Option<f64>,
        diameter: Option<&Bound<'_, PyAny>>,
        disk_radius: Option<f64>,
    ) -> PyResult<Self> {
        let spec = BackboneSpec {
            poisson_ratio,
            youngs_modulus,
            diameter: diameters(diameter)?,
            disk_radius,
            ..BackboneSpec::straight(1.0, whole("subsegments", subsegments)?)
        };
        core::Backbone::from_curve(&vectors("points", points)?, spec)
            .map(Self)
            .map_err(|e| invalid(&e))
    }

    /// Length of the backbone, or of each stretch [m]: float or tuple of float.
    #[getter]
    fn length<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        one_or_tuple(py, &self.0.spec().length)
    }

    /// Number of subsegments, or of each stretch: int or tuple of int.
    #[getter]
    fn subsegments<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        one_or_tuple(py, &self.0.spec().subsegments)
    }

    /// Poisson's ratio.
    #[getter]
    fn poisson_ratio(&self) -> f64 {
        self.0.spec().poisson_ratio
    }

    /// Rest rotation vectors, shape (n, 3) [rad], or None when straight.
    #[getter]
    fn rest(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        let rest = self.0.spec().rest.as_ref();
        rest.map(|rest| frozen_points(py, rest.iter().copied())).transpose()
    }

    /// Young's modulus [Pa], or None.
    #[getter]
    fn youngs_modulus(&self) -> Option<f64> {
        self.0.spec().youngs_modulus
    }

    /// Diameter, or of each subsegment [m]: float, tuple of float or None.
    #[getter]
    fn diameter<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.0.spec().diameter.as_ref().map(|d| one_or_tuple(py, d)).transpose()
    }

    /// Outer radius of the disks [m], or None.
    #[getter]
    fn disk_radius(&self) -> Option<f64> {
        self.0.spec().disk_radius
    }

    /// Number of subsegments n.
    #[getter]
    fn count(&self) -> usize {
        self.0.subsegments()
    }

    /// Rest length of each subsegment, shape (n,) [m].
    #[getter]
    fn lengths(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen(py, self.0.lengths().to_vec(), &[self.0.subsegments()])
    }

    /// Arc length from the base to each disk, shape (n + 1,) [m].
    #[getter]
    fn arc_lengths(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen(py, self.0.arc_lengths().to_vec(), &[self.0.subsegments() + 1])
    }

    /// Rest length from base to tip [m].
    #[getter]
    fn total_length(&self) -> f64 {
        self.0.total_length()
    }

    fn __repr__(&self) -> String {
        let spec = self.0.spec();
        let mut text = format!(
            "Backbone({}, {}, poisson_ratio={:?}",
            list_text(&spec.length),
            list_text(&spec.subsegments),
            spec.poisson_ratio
        );
        if let Some(rest) = &spec.rest {
            let _ = write!(text, ", rest=<({}, 3) array>", rest.len());
        }
        if let Some(modulus) = spec.youngs_modulus {
            let _ = write!(text, ", youngs_modulus={modulus:?}");
        }
        if let Some(diameter) = &spec.diameter {
            let _ = write!(text, ", diameter={}", list_text(diameter));
        }
        if let Some(radius) = spec.disk_radius {
            let _ = write!(text, ", disk_radius={radius:?}");
        }
        text + ")"
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let positional = PyTuple::new(py, [self.length(py)?, self.subsegments(py)?])?;
        let keywords = PyDict::new(py);
        keywords.set_item("poisson_ratio", self.poisson_ratio())?;
        keywords.set_item("rest", self.rest(py)?)?;
        keywords.set_item("youngs_modulus", self.youngs_modulus())?;
        keywords.set_item("diameter", self.diameter(py)?)?;
        keywords.set_item("disk_radius", self.disk_radius())?;
        Ok((positional, keywords))
    }
}
