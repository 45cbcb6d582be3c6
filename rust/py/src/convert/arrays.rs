//! Between Python values and the core's.

use nalgebra::{Matrix3, Matrix4, Vector3};
use numpy::{Element, PyArray, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyTuple, PyType};

use tdcr::lie::Pose;
use tdcr::{InvalidInput, Status};

use crate::convert::python_side::{INVALID_INPUT, STATUS, numpy};

/// A core error as `tdcr.errors.InvalidInput`.
pub(crate) fn invalid(error: &InvalidInput) -> PyErr {
    Python::attach(|py| match invalid_class(py) {
        Ok(class) => PyErr::from_type(class, (error.to_string(), error.argument.clone())),
        Err(import_error) => import_error,
    })
}

fn invalid_class(py: Python<'_>) -> PyResult<Bound<'_, PyType>> {
    static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    Ok(CLASS.import(py, INVALID_INPUT.module, INVALID_INPUT.name)?.clone())
}

/// A status as `tdcr.Status`.
pub(crate) fn status(py: Python<'_>, status: Status) -> PyResult<Bound<'_, PyAny>> {
    static MEMBERS: PyOnceLock<[Py<PyAny>; Status::ALL.len()]> = PyOnceLock::new();
    let members = MEMBERS.get_or_try_init(py, || {
        let class = STATUS.get(py)?;
        let mut members = Vec::with_capacity(Status::ALL.len());
        for status in Status::ALL {
            members.push(class.call1((status.as_str(),))?.unbind());
        }
        members.try_into().map_err(|_| PyTypeError::new_err("Status has other members"))
    })?;
    Ok(members[status as usize].bind(py).clone())
}

/// A Python value that is built on first access.
pub(crate) struct Lazy(PyOnceLock<Py<PyAny>>);

impl Default for Lazy {
    fn default() -> Self {
        Self(PyOnceLock::new())
    }
}

impl Lazy {
    pub(crate) fn get(
        &self,
        py: Python<'_>,
        build: impl FnOnce() -> PyResult<Py<PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        Ok(self.0.get_or_try_init(py, build)?.clone_ref(py))
    }
}

/// The name of a value's type, for messages.
pub(crate) fn type_name(value: &Bound<'_, PyAny>) -> String {
    // Not by str(), which looks at signals and would lose a Ctrl-C on the way.
    let name = value.get_type().name();
    let name = name.and_then(|name| name.to_cow().map(std::borrow::Cow::into_owned));
    name.unwrap_or_else(|_| "another type".to_owned())
}

/// An array of numbers of any shape as C-order, aligned float64: itself, or a copy of one that is not.
///
/// Text and objects are a `TypeError`; what has no rectangular shape is `InvalidInput`.
pub(crate) fn float_array<'py>(
    argument: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    if let Ok(array) = value.extract::<PyReadonlyArrayDyn<'py, f64>>()
        && array.as_slice().is_ok()
        && array.is_c_contiguous()
    {
        return Ok(array);
    }
    let py = value.py();
    let numpy = numpy(py)?;
    let array = numpy.call_method1("asarray", (value,)).map_err(|error| {
        let expected = "a rectangular array of numbers";
        let got = error.value(py).to_string();
        invalid(&InvalidInput::new(argument, expected, got))
    })?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if !matches!(kind.as_str(), "f" | "i" | "u") {
        let message = format!(
            "{argument}: expected numbers, got {} of dtype {}",
            type_name(value),
            array.getattr("dtype")?
        );
        return Err(PyTypeError::new_err(message));
    }
    let float = numpy.call_method1("ascontiguousarray", (&array, "float64"))?;
    // ascontiguousarray makes a 0-d array 1-d; shapes are checked on the original.
    let shape = array.getattr("shape")?;
    align(float.call_method1("reshape", (shape,))?)?.extract()
}

/// Array whose numbers are aligned in memory: itself, or a copy of one from a packed record.
pub(crate) fn align(array: Bound<'_, PyAny>) -> PyResult<Bound<'_, PyAny>> {
    let sound = array.getattr("flags")?.getattr("aligned")?.extract()?;
    if sound { Ok(array) } else { array.call_method0("copy") }
}

/// The values of a C-order array.
pub(crate) fn values<'a>(array: &'a PyReadonlyArrayDyn<'_, f64>) -> PyResult<&'a [f64]> {
    Ok(array.as_slice()?)
}

/// A shape as Python prints it.
pub(crate) fn shape_text(shape: &[usize]) -> String {
    let sizes: Vec<String> = shape.iter().map(ToString::to_string).collect();
    match sizes.as_slice() {
        [one] => format!("({one},)"),
        many => format!("({})", many.join(", ")),
    }
}

/// Refuses an array of another shape than expected.
pub(crate) fn wrong_shape(argument: &str, expected: &str, shape: &[usize]) -> PyErr {
    let got = format!("shape {}", shape_text(shape));
    invalid(&InvalidInput::new(argument, expected, got))
}

/// A 4x4 homogeneous matrix.
pub(crate) fn matrix4(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Matrix4<f64>> {
    let array = float_array(argument, value)?;
    if array.shape() != [4, 4] {
        return Err(wrong_shape(argument, "a homogeneous matrix of shape (4, 4)", array.shape()));
    }
    Ok(Matrix4::from_row_slice(values(&array)?))
}

/// A matrix of three rows and columns.
pub(crate) fn matrix3(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Matrix3<f64>> {
    let array = float_array(argument, value)?;
    if array.shape() != [3, 3] {
        return Err(wrong_shape(argument, "a matrix of shape (3, 3)", array.shape()));
    }
    Ok(Matrix3::from_row_slice(values(&array)?))
}

/// Three numbers.
pub(crate) fn vector(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Vector3<f64>> {
    let array = float_array(argument, value)?;
    if array.shape() != [3] {
        return Err(wrong_shape(argument, "three numbers, shape (3,)", array.shape()));
    }
    Ok(Vector3::from_column_slice(values(&array)?))
}

/// Rows of three numbers.
pub(crate) fn vectors(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<Vector3<f64>>> {
    let array = float_array(argument, value)?;
    if array.shape().len() != 2 || array.shape()[1] != 3 {
        return Err(wrong_shape(argument, "an array of shape (n, 3)", array.shape()));
    }
    Ok(values(&array)?.chunks_exact(3).map(Vector3::from_column_slice).collect())
}

/// A read-only numpy array of any shape from its values in C order.
pub(crate) fn frozen<T: Element>(
    py: Python<'_>,
    values: Vec<T>,
    shape: &[usize],
) -> PyResult<Py<PyAny>> {
    let array = PyArray::from_vec(py, values).reshape(shape.to_vec())?;
    array.call_method1("setflags", (false,))?;
    Ok(array.into_any().unbind())
}

/// Statuses as a read-only array of `tdcr.Status`.
pub(crate) fn frozen_statuses(
    py: Python<'_>,
    statuses: impl Iterator<Item = Status>,
) -> PyResult<Py<PyAny>> {
    let members = statuses.map(|one| Ok(status(py, one)?.unbind()));
    let members = members.collect::<PyResult<Vec<_>>>()?;
    let rows = members.len();
    frozen(py, members, &[rows])
}

/// Three numbers as a read-only array.
pub(crate) fn frozen_vector(py: Python<'_>, vector: Vector3<f64>) -> PyResult<Py<PyAny>> {
    frozen(py, vector.as_slice().to_vec(), &[3])
}

/// Points as a read-only (m, 3) array.
pub(crate) fn frozen_points(
    py: Python<'_>,
    points: impl Iterator<Item = Vector3<f64>>,
) -> PyResult<Py<PyAny>> {
    let flat: Vec<f64> = points.flat_map(|p| [p.x, p.y, p.z]).collect();
    let rows = flat.len() / 3;
    frozen(py, flat, &[rows, 3])
}

/// Frames as a read-only (m, 4, 4) array.
pub(crate) fn frozen_frames(py: Python<'_>, frames: &[Pose]) -> PyResult<Py<PyAny>> {
    let flat: Vec<f64> = frames.iter().flat_map(Pose::to_row_major).collect();
    frozen(py, flat, &[frames.len(), 4, 4])
}

/// One number as itself, several as a tuple.
pub(crate) fn one_or_tuple<'py, T>(py: Python<'py>, values: &[T]) -> PyResult<Bound<'py, PyAny>>
where
    T: Copy + IntoPyObject<'py>,
{
    if let [one] = values {
        return one.into_bound_py_any(py);
    }
    Ok(PyTuple::new(py, values.iter().copied())?.into_any())
}

/// A list for a repr: whole when short, else its ends.
pub(crate) fn list_text<T: std::fmt::Debug>(values: &[T]) -> String {
    match values {
        [one] => format!("{one:?}"),
        many if many.len() <= 6 => format!("{many:?}"),
        many => {
            let last = &many[many.len() - 1];
            format!("[{:?}, {:?}, ..., {last:?}]", many[0], many[1])
        }
    }
}
