//! `Backbone`, `Tendon` and `Robot`.

use std::fmt::Write as _;
use std::sync::Arc;

use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};

use tdcr::robot::{self as core, BackboneSpec, PerDisk, Routing};

use crate::convert::{
    Lazy, OneOrMany, count, frozen, frozen_frames, invalid, list_text, matrix4, one_or_tuple,
    vectors,
};

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
        let counts = OneOrMany::<i64>::extract("subsegments", "an int", subsegments)?.into_vec();
        let diameter = diameter
            .map(|d| OneOrMany::<f64>::extract("diameter", "a number", d))
            .transpose()?
            .map(OneOrMany::into_vec);
        let spec = BackboneSpec {
            length: OneOrMany::<f64>::extract("length", "a number", length)?.into_vec(),
            subsegments: counts.into_iter().map(count).collect(),
            poisson_ratio,
            rest: rest.map(|rest| vectors("rest", rest)).transpose()?,
            youngs_modulus,
            diameter,
            disk_radius,
        };
        core::Backbone::new(spec).map(Self).map_err(|e| invalid(&e))
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
        rest.map(|rest| crate::convert::frozen_points(py, rest.iter().copied())).transpose()
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
    Ok(match OneOrMany::<f64>::extract(argument, "a number", value)? {
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
        end: Option<i64>,
        stiffness: Option<f64>,
        name: Option<String>,
    ) -> PyResult<Self> {
        core::Tendon::new(routing, end.map(count), stiffness, name)
            .map(Self)
            .map_err(|e| invalid(&e))
    }
}

#[pymethods]
impl Tendon {
    #[new]
    #[pyo3(signature = (azimuth, radius, *, end=None, stiffness=None, name=None))]
    fn new(
        azimuth: &Bound<'_, PyAny>,
        radius: &Bound<'_, PyAny>,
        end: Option<i64>,
        stiffness: Option<f64>,
        name: Option<String>,
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
        end: Option<i64>,
        stiffness: Option<f64>,
        name: Option<String>,
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
        indices: Vec<i64>,
        count: i64,
        radius: &Bound<'_, PyAny>,
        azimuth: f64,
        end: Option<i64>,
        stiffness: Option<f64>,
        name: Option<String>,
    ) -> PyResult<Self> {
        if let Some(index) = indices.iter().find(|index| **index < 0) {
            let error = tdcr::InvalidInput::new("indices", "hole numbers from 0 on", index);
            return Err(invalid(&error));
        }
        let routing = Routing::Holes {
            indices: indices.into_iter().map(crate::convert::count).collect(),
            count: crate::convert::count(count),
            radius: per_disk("radius", radius)?,
            azimuth,
        };
        Self::build(routing, end, stiffness, name)
    }

    /// How the holes are described: "angles", "helical" or "holes".
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
        let rebuild = py.import("tdcr._core")?.getattr("_tendon")?;
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
    indices: Option<Vec<i64>>,
    count: Option<i64>,
    end: Option<i64>,
    stiffness: Option<f64>,
    name: Option<String>,
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
pub(crate) struct Robot(pub(crate) Arc<core::Robot>, Arc<Arrays>);

/// Arrays that are built on first access.
#[derive(Default)]
struct Arrays {
    base: Lazy,
    tool: Lazy,
    rest_lengths: Lazy,
    rest_frames: Lazy,
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

#[pymethods]
impl Robot {
    #[new]
    #[pyo3(signature = (backbone, tendons, *, base=None, tool=None, name=None))]
    fn new(
        backbone: &Bound<'_, Backbone>,
        tendons: Vec<Bound<'_, Tendon>>,
        base: Option<&Bound<'_, PyAny>>,
        tool: Option<&Bound<'_, PyAny>>,
        name: Option<String>,
    ) -> PyResult<Self> {
        let base = base.map(|base| matrix4("base", base)).transpose()?;
        let tool = tool.map(|tool| matrix4("tool", tool)).transpose()?;
        let tendons = tendons.iter().map(|tendon| tendon.get().0.clone()).collect();
        let backbone = backbone.get().0.clone();
        core::Robot::new(backbone, tendons, base.as_ref(), tool.as_ref(), name)
            .map(|robot| Self(Arc::new(robot), Arc::default()))
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
        class.py().import("tdcr._files")?.call_method1("load_robot", (path,))
    }

    /// Writes a robot file (TOML or JSON by its ending) that `load` reads back exactly.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     File ending in .toml or .json; replaced if it exists.
    #[pyo3(signature = (path))]
    fn save(slf: &Bound<'_, Self>, path: &Bound<'_, PyAny>) -> PyResult<()> {
        slf.py().import("tdcr._files")?.call_method1("save_robot", (slf, path))?;
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
