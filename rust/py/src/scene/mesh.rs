//! `Mesh`.

use numpy::PyReadonlyArrayDyn;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};

use tdcr::InvalidInput;
use tdcr::obstacle as core;

use crate::convert::arrays::{
    Lazy, align, frozen, frozen_points, invalid, type_name, vectors, wrong_shape,
};
use crate::convert::python_side;
use crate::scene::obstacle::Obstacle;

/// The inside of a closed surface of triangles.
///
/// Whether the surface cuts through itself is not checked.
///
/// Parameters
/// ----------
/// vertices : array_like, shape (V, 3)
///     In the world frame [m].
/// faces : array_like of int, shape (F, 3)
///     Vertex numbers, counter-clockwise seen from outside. A surface that is inside out as a whole is
///     turned.
/// inside : bool, optional
///     The robot stays in the volume, a vessel, instead of out of it.
///
/// Raises
/// ------
/// InvalidInput
///     An empty mesh, a vertex that is not finite or does not exist, a triangle without area, a
///     surface that is not closed (names the first edge that has not two faces), faces that turn
///     different ways, parts that touch in a single vertex, no volume; names the argument.
/// TypeError
///     A value of another type.
///
/// See Also
/// --------
/// Mesh.load : from a file.
#[pyclass(frozen, extends = Obstacle, module = "tdcr")]
pub(crate) struct Mesh {
    core: core::Mesh,
    vertices: Lazy,
    faces: Lazy,
}

/// Rows of three whole numbers of 0 or more.
fn triangles(value: &Bound<'_, PyAny>) -> PyResult<Vec<[usize; 3]>> {
    let numpy = python_side::numpy(value.py())?;
    let array = numpy.call_method1("asarray", (value,)).map_err(|error| {
        let got = error.value(value.py()).to_string();
        invalid(&InvalidInput::new("faces", "a rectangular array of vertex numbers", got))
    })?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    if shape.len() != 2 || shape[1] != 3 {
        return Err(wrong_shape("faces", "an array of shape (F, 3)", &shape));
    }
    let dtype = array.getattr("dtype")?;
    let kind: String = dtype.getattr("kind")?.extract()?;
    if !matches!(kind.as_str(), "i" | "u") {
        let got = type_name(value);
        let message = format!("faces: expected whole numbers, got {got} of dtype {dtype}");
        return Err(PyTypeError::new_err(message));
    }
    let array = numpy.call_method1("ascontiguousarray", (array, "int64"))?;
    let array: PyReadonlyArrayDyn<'_, i64> = align(array)?.extract()?;
    let number = |index: &i64| {
        let refuse = || InvalidInput::new("faces", "vertex numbers of 0 or more", index);
        usize::try_from(*index).map_err(|_| invalid(&refuse()))
    };
    let numbers = array.as_slice()?.iter().map(number).collect::<PyResult<Vec<_>>>()?;
    Ok(numbers.chunks_exact(3).map(|face| [face[0], face[1], face[2]]).collect())
}

#[pymethods]
impl Mesh {
    #[new]
    #[pyo3(signature = (vertices, faces, *, inside=false))]
    fn new(
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        faces: &Bound<'_, PyAny>,
        inside: bool,
    ) -> PyResult<PyClassInitializer<Self>> {
        let (vertices, faces) = (vectors("vertices", vertices)?, triangles(faces)?);
        let mesh = py.detach(|| core::Mesh::new(&vertices, &faces)).map_err(|e| invalid(&e))?;
        let base = Obstacle::new(mesh.clone(), inside).initializer();
        let (vertices, faces) = (Lazy::default(), Lazy::default());
        Ok(base.add_subclass(Self { core: mesh, vertices, faces }))
    }

    /// Reads a mesh file.
    ///
    /// Any format that trimesh reads (STL, OBJ, PLY, ...); `pip install tdcr[mesh]`. Vertices that are
    /// equal are merged, as STL files repeat them for every triangle.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    /// unit : {"m", "cm", "mm", "um", "in"}
    ///     Unit of the file's coordinates, which mesh files do not state.
    /// inside : bool, optional
    ///     As for `Mesh`.
    ///
    /// Raises
    /// ------
    /// InvalidInput
    ///     Another unit, a file that trimesh cannot read, or whose surface is not closed; names the
    ///     argument.
    /// OSError
    ///     The file cannot be read.
    /// ImportError
    ///     trimesh is not installed.
    #[classmethod]
    #[pyo3(signature = (path, *, unit, inside=false))]
    fn load<'py>(
        class: &Bound<'py, PyType>,
        path: &Bound<'py, PyAny>,
        unit: &Bound<'py, PyAny>,
        inside: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        python_side::LOAD_MESH.get(class.py())?.call1((path, unit, inside))
    }

    /// Vertices, shape (V, 3) [m].
    #[getter]
    fn vertices(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.vertices.get(py, || frozen_points(py, self.core.vertices().into_iter()))
    }

    /// Vertex numbers of the faces, counter-clockwise seen from outside, shape (F, 3).
    #[getter]
    fn faces(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.faces.get(py, || {
            let faces = self.core.faces();
            // Meshes are checked to have fewer vertices than i64 counts.
            let number = |index: &usize| i64::try_from(*index).unwrap_or(i64::MAX);
            frozen(py, faces.iter().flatten().map(number).collect(), &[faces.len(), 3])
        })
    }

    fn __repr__(slf: PyRef<'_, Self>) -> String {
        let (vertices, faces) = (slf.core.vertices().len(), slf.core.faces().len());
        let arguments = format!("<({vertices}, 3) array>, <({faces}, 3) array>");
        slf.as_super().text("Mesh", &arguments)
    }

    fn __getnewargs_ex__<'py>(
        slf: PyRef<'py, Self>,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        slf.as_super().new_args((slf.vertices(py)?, slf.faces(py)?).into_pyobject(py)?)
    }
}
