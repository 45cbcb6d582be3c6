//! Obstacles in closed form.

use std::fmt::Write as _;

use nalgebra::{Matrix3, Vector3};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use tdcr::obstacle as core;

use crate::convert::arguments::number;
use crate::convert::arrays::{frozen, frozen_vector, invalid, matrix3, vector};
use crate::scene::mesh::Mesh;
use crate::scene::obstacle::Obstacle;

/// Adds the classes of obstacles that are data: a new one is a class and a line here.
pub(crate) fn add_shapes(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Sphere>()?;
    module.add_class::<Cylinder>()?;
    module.add_class::<HalfSpace>()?;
    module.add_class::<Capsule>()?;
    module.add_class::<Cuboid>()?;
    module.add_class::<Mesh>()
}

type NewArgs<'py> = (Bound<'py, PyTuple>, Bound<'py, PyDict>);

fn text(v: Vector3<f64>) -> String {
    format!("({:?}, {:?}, {:?})", v.x, v.y, v.z)
}

/// A ball.
///
/// Parameters
/// ----------
/// center : array_like, shape (3,)
///     In the world frame [m].
/// radius : float
///     [m].
/// inside : bool, optional
///     The robot stays in the ball instead of out of it.
///
/// Raises
/// ------
/// InvalidInput
///     A value that is not finite, a radius that is not positive; names the argument.
/// TypeError
///     A value of another type.
#[pyclass(frozen, extends = Obstacle, module = "tdcr")]
pub(crate) struct Sphere(core::Sphere);

#[pymethods]
impl Sphere {
    #[new]
    #[pyo3(signature = (center, radius, *, inside=false))]
    fn new(
        center: &Bound<'_, PyAny>,
        radius: &Bound<'_, PyAny>,
        inside: bool,
    ) -> PyResult<PyClassInitializer<Self>> {
        let sphere = core::Sphere::new(&vector("center", center)?, number("radius", radius)?);
        let sphere = sphere.map_err(|e| invalid(&e))?;
        Ok(Obstacle::new(sphere, inside).initializer().add_subclass(Self(sphere)))
    }

    /// Centre, shape (3,) [m].
    #[getter]
    fn center(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_vector(py, self.0.center())
    }

    /// Radius [m].
    #[getter]
    fn radius(&self) -> f64 {
        self.0.radius()
    }

    fn __repr__(slf: PyRef<'_, Self>) -> String {
        let arguments = format!("{}, {:?}", text(slf.0.center()), slf.0.radius());
        slf.as_super().text("Sphere", &arguments)
    }

    fn __getnewargs_ex__<'py>(slf: PyRef<'py, Self>, py: Python<'py>) -> PyResult<NewArgs<'py>> {
        slf.as_super().new_args((slf.center(py)?, slf.radius()).into_pyobject(py)?)
    }
}

/// An infinite round bar.
///
/// Parameters
/// ----------
/// point : array_like, shape (3,)
///     Any point on its axis, in the world frame [m].
/// axis : array_like, shape (3,)
///     Direction of its axis, of any length.
/// radius : float
///     [m].
/// inside : bool, optional
///     The robot stays in the bar, a straight tube, instead of out of it.
///
/// Raises
/// ------
/// InvalidInput
///     A value that is not finite, an axis of zero length, a radius that is not positive; names the
///     argument.
/// TypeError
///     A value of another type.
#[pyclass(frozen, extends = Obstacle, module = "tdcr")]
pub(crate) struct Cylinder(core::Cylinder);

#[pymethods]
impl Cylinder {
    #[new]
    #[pyo3(signature = (point, axis, radius, *, inside=false))]
    fn new(
        point: &Bound<'_, PyAny>,
        axis: &Bound<'_, PyAny>,
        radius: &Bound<'_, PyAny>,
        inside: bool,
    ) -> PyResult<PyClassInitializer<Self>> {
        let (point, axis) = (vector("point", point)?, vector("axis", axis)?);
        let cylinder = core::Cylinder::new(&point, &axis, number("radius", radius)?);
        let cylinder = cylinder.map_err(|e| invalid(&e))?;
        Ok(Obstacle::new(cylinder, inside).initializer().add_subclass(Self(cylinder)))
    }

    /// The point on its axis that was given, shape (3,) [m].
    #[getter]
    fn point(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_vector(py, self.0.point())
    }

    /// Direction of its axis, a unit vector, shape (3,).
    #[getter]
    fn axis(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_vector(py, self.0.axis())
    }

    /// Radius [m].
    #[getter]
    fn radius(&self) -> f64 {
        self.0.radius()
    }

    fn __repr__(slf: PyRef<'_, Self>) -> String {
        let (point, axis) = (text(slf.0.point()), text(slf.0.axis()));
        let arguments = format!("{point}, {axis}, {:?}", slf.0.radius());
        slf.as_super().text("Cylinder", &arguments)
    }

    fn __getnewargs_ex__<'py>(slf: PyRef<'py, Self>, py: Python<'py>) -> PyResult<NewArgs<'py>> {
        let positional = (slf.point(py)?, slf.axis(py)?, slf.radius()).into_pyobject(py)?;
        slf.as_super().new_args(positional)
    }
}

/// All that lies behind a plane: a floor, a wall.
///
/// Parameters
/// ----------
/// point : array_like, shape (3,)
///     Any point of the plane, in the world frame [m].
/// normal : array_like, shape (3,)
///     Out of the solid, of any length.
/// inside : bool, optional
///     The robot stays behind the plane instead of before it.
///
/// Raises
/// ------
/// InvalidInput
///     A value that is not finite, a normal of zero length; names the argument.
/// TypeError
///     A value of another type.
#[pyclass(frozen, extends = Obstacle, module = "tdcr")]
pub(crate) struct HalfSpace(core::HalfSpace);

#[pymethods]
impl HalfSpace {
    #[new]
    #[pyo3(signature = (point, normal, *, inside=false))]
    fn new(
        point: &Bound<'_, PyAny>,
        normal: &Bound<'_, PyAny>,
        inside: bool,
    ) -> PyResult<PyClassInitializer<Self>> {
        let half_space = core::HalfSpace::new(&vector("point", point)?, &vector("normal", normal)?);
        let half_space = half_space.map_err(|e| invalid(&e))?;
        Ok(Obstacle::new(half_space, inside).initializer().add_subclass(Self(half_space)))
    }

    /// The point of its plane that was given, shape (3,) [m].
    #[getter]
    fn point(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_vector(py, self.0.point())
    }

    /// Direction out of the solid, a unit vector, shape (3,).
    #[getter]
    fn normal(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_vector(py, self.0.normal())
    }

    fn __repr__(slf: PyRef<'_, Self>) -> String {
        let arguments = format!("{}, {}", text(slf.0.point()), text(slf.0.normal()));
        slf.as_super().text("HalfSpace", &arguments)
    }

    fn __getnewargs_ex__<'py>(slf: PyRef<'py, Self>, py: Python<'py>) -> PyResult<NewArgs<'py>> {
        slf.as_super().new_args((slf.point(py)?, slf.normal(py)?).into_pyobject(py)?)
    }
}

/// A bar with round ends: all points within the radius of a segment.
///
/// Parameters
/// ----------
/// a, b : array_like, shape (3,)
///     Ends of the segment, in the world frame [m]. One and the same point makes a ball.
/// radius : float
///     [m].
/// inside : bool, optional
///     The robot stays in the capsule instead of out of it.
///
/// Raises
/// ------
/// InvalidInput
///     A value that is not finite, a radius that is not positive; names the argument.
/// TypeError
///     A value of another type.
#[pyclass(frozen, extends = Obstacle, module = "tdcr")]
pub(crate) struct Capsule(core::Capsule);

#[pymethods]
impl Capsule {
    #[new]
    #[pyo3(signature = (a, b, radius, *, inside=false))]
    fn new(
        a: &Bound<'_, PyAny>,
        b: &Bound<'_, PyAny>,
        radius: &Bound<'_, PyAny>,
        inside: bool,
    ) -> PyResult<PyClassInitializer<Self>> {
        let (a, b) = (vector("a", a)?, vector("b", b)?);
        let capsule = core::Capsule::new(&a, &b, number("radius", radius)?);
        let capsule = capsule.map_err(|e| invalid(&e))?;
        Ok(Obstacle::new(capsule, inside).initializer().add_subclass(Self(capsule)))
    }

    /// The first end of its segment, shape (3,) [m].
    #[getter]
    fn a(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_vector(py, self.0.a())
    }

    /// The other end of its segment, shape (3,) [m].
    #[getter]
    fn b(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_vector(py, self.0.b())
    }

    /// Radius [m].
    #[getter]
    fn radius(&self) -> f64 {
        self.0.radius()
    }

    fn __repr__(slf: PyRef<'_, Self>) -> String {
        let arguments = format!("{}, {}, {:?}", text(slf.0.a()), text(slf.0.b()), slf.0.radius());
        slf.as_super().text("Capsule", &arguments)
    }

    fn __getnewargs_ex__<'py>(slf: PyRef<'py, Self>, py: Python<'py>) -> PyResult<NewArgs<'py>> {
        slf.as_super().new_args((slf.a(py)?, slf.b(py)?, slf.radius()).into_pyobject(py)?)
    }
}

/// A box with any axes.
///
/// Parameters
/// ----------
/// center : array_like, shape (3,)
///     In the world frame [m].
/// half_extents : array_like, shape (3,)
///     Half its lengths along its own axes [m].
/// rotation : array_like, shape (3, 3), optional
///     Its axes as columns, in the world frame. Default: the world's.
/// inside : bool, optional
///     The robot stays in the box instead of out of it.
///
/// Raises
/// ------
/// InvalidInput
///     A value that is not finite, a length that is not positive, a matrix that is no rotation; names
///     the argument.
/// TypeError
///     A value of another type.
#[pyclass(frozen, extends = Obstacle, name = "Box", module = "tdcr")]
pub(crate) struct Cuboid(core::Cuboid);

#[pymethods]
impl Cuboid {
    #[new]
    #[pyo3(signature = (center, half_extents, rotation=None, *, inside=false))]
    fn new(
        center: &Bound<'_, PyAny>,
        half_extents: &Bound<'_, PyAny>,
        rotation: Option<&Bound<'_, PyAny>>,
        inside: bool,
    ) -> PyResult<PyClassInitializer<Self>> {
        let (center, half) = (vector("center", center)?, vector("half_extents", half_extents)?);
        let rotation =
            rotation.map_or_else(|| Ok(Matrix3::identity()), |r| matrix3("rotation", r))?;
        let cuboid = core::Cuboid::new(&center, &half, &rotation).map_err(|e| invalid(&e))?;
        Ok(Obstacle::new(cuboid, inside).initializer().add_subclass(Self(cuboid)))
    }

    /// Centre, shape (3,) [m].
    #[getter]
    fn center(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_vector(py, self.0.center())
    }

    /// Half its lengths along its own axes, shape (3,) [m].
    #[getter]
    fn half_extents(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_vector(py, self.0.half_extents())
    }

    /// Its axes as columns, shape (3, 3).
    #[getter]
    fn rotation(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen(py, self.0.rotation().transpose().as_slice().to_vec(), &[3, 3])
    }

    fn __repr__(slf: PyRef<'_, Self>) -> String {
        let mut arguments = format!("{}, {}", text(slf.0.center()), text(slf.0.half_extents()));
        if slf.0.rotation() != Matrix3::identity() {
            let rows = slf.0.rotation().transpose();
            let rows = rows.column_iter().map(|row| text(row.into())).collect::<Vec<_>>();
            let _ = write!(arguments, ", ({})", rows.join(", "));
        }
        slf.as_super().text("Box", &arguments)
    }

    fn __getnewargs_ex__<'py>(slf: PyRef<'py, Self>, py: Python<'py>) -> PyResult<NewArgs<'py>> {
        let (center, half) = (slf.center(py)?, slf.half_extents(py)?);
        slf.as_super().new_args((center, half, slf.rotation(py)?).into_pyobject(py)?)
    }
}
