//! `sensitivity`: derivatives by everything that a rod is made of.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

use nalgebra::Vector3;
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};

use tdcr::InvalidInput;
use tdcr::forward::{Forward, ModelSettings, Plan};
use tdcr::rod::{self as core, Linearized, Rod};

use crate::convert::arguments::number;
use crate::convert::arrays::{
    float_array, frozen, frozen_points, invalid, shape_text, type_name, values, wrong_shape,
};
use crate::convert::python_side;
use crate::forward::jacobian::frozen_columns;
use crate::forward::run;
use crate::forward::shape::Shape;
use crate::scene::Surroundings;

/// Exact derivatives at a shape of the rod.
///
/// By implicit differentiation of the conditions that the shape meets, with the factors of the last Newton
/// step: no solve, and no step length to choose.
///
/// Parameters
/// ----------
/// shape : Shape
///     Of model "rod" and converged, under displacements or tensions.
///
/// Returns
/// -------
/// Sensitivity
///
/// Raises
/// ------
/// InvalidInput
///     A shape of another model, or one among obstacles or under loads.
/// NotConverged
///     A shape that did not converge.
/// TypeError
///     No shape.
///
/// Examples
/// --------
/// >>> import numpy as np, tdcr
/// >>> robot = tdcr.Robot(tdcr.Backbone(0.2, 10), [tdcr.Tendon(0.0, 0.01)])
/// >>> at = tdcr.sensitivity(tdcr.forward(robot, [-0.005]))
/// >>> weights = np.zeros((11, 3))
/// >>> weights[-1, 0] = 1.0  # the tip's x
/// >>> at.adjoint(weights).displacements.round(2)
/// array([-9.31])
#[pyfunction]
pub(crate) fn sensitivity(py: Python<'_>, shape: &Bound<'_, PyAny>) -> PyResult<Sensitivity> {
    let Ok(shape) = shape.cast::<Shape>() else {
        let message = format!("shape: expected a Shape, got {}", type_name(shape));
        return Err(PyTypeError::new_err(message));
    };
    let own = shape.get();
    let ModelSettings::Rod(settings) = own.model_settings() else {
        let got = format!("one of model \"{}\"", own.model());
        return Err(invalid(&InvalidInput::new("shape", "a shape of model \"rod\"", got)));
    };
    if let Some(what) = own.around().and_then(Surroundings::any) {
        let expected = "a shape without obstacles and loads";
        return Err(invalid(&InvalidInput::new("shape", expected, format!("one with {what}"))));
    }
    if !own.ok() {
        return Err(Shape::not_converged(shape));
    }
    let plan = Plan::rod(own.core_robot(), settings).map_err(|e| invalid(&e))?;
    let forward = Forward::new(own.core_robot(), own.model_settings()).map_err(|e| invalid(&e))?;
    let at = run(py, forward, |forward| forward.linearize(own.state(), own.displacement_values()))?;
    Ok(Sensitivity { shape: shape.clone().unbind(), plan, at })
}

/// Exact derivatives at a shape of the rod; made by `sensitivity`.
///
/// Tendons under tension count, and those that are just as long as they may be: the latter are followed on
/// their pulled side, at rest for instance, for changes that let none of them go slack. Free and slack ones
/// do not. Where tendons that count depend on each other (`dependent`), displacements cannot change one by
/// one: derivatives are then those of the nearest change that the rod can follow. With proportional tendons,
/// tensions are those of the base pieces.
#[pyclass(frozen, eq, module = "tdcr")]
pub(crate) struct Sensitivity {
    shape: Py<Shape>,
    plan: Arc<core::Plan>,
    at: Arc<Linearized>,
}

impl PartialEq for Sensitivity {
    fn eq(&self, other: &Self) -> bool {
        self.shape.get().same(other.shape.get())
    }
}

impl Sensitivity {
    fn core(&self) -> core::Sensitivity<'_> {
        let rod = Rod::new(self.shape.get().core_robot(), &self.plan);
        rod.sensitivity_at(Arc::clone(&self.at))
    }

    fn robot(&self) -> &tdcr::robot::Robot {
        self.shape.get().core_robot()
    }
}

#[pymethods]
impl Sensitivity {
    /// The shape at which it was taken.
    #[getter]
    fn shape(&self, py: Python<'_>) -> Py<Shape> {
        self.shape.clone_ref(py)
    }

    /// True if tendons that count depend on each other: three on one inextensible segment, tendons that
    /// share all holes.
    #[getter]
    fn dependent(&self) -> bool {
        self.core().dependent()
    }

    /// Velocity of the tool point by displacements.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6, K)
    ///     Velocity [m/m], then angular velocity [rad/m], world axes, as `tdcr.jacobian`.
    fn jacobian(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        frozen_columns(py, &py.detach(|| self.core().jacobian(self.robot().tool())))
    }

    /// First-order effect of a change of everything at once on the shape.
    ///
    /// Parameters
    /// ----------
    /// displacements : array_like, shape (K,), optional
    ///     Change of each displacement [m]. What it says of tendons that do not count has no effect.
    /// rest : array_like, shape (n, 3), optional
    ///     Change of each subsegment's rest rotation vector, as in `Backbone.rest` [rad].
    /// holes : sequence of K arrays, shape (end + 1, 3), optional
    ///     Change of each tendon's holes, disk 0 to its end, in the frames of the disks [m].
    /// lengths : array_like, shape (n,), optional
    ///     Change of each subsegment's length; bending stiffness EI stays [m].
    /// poisson_ratio : float, optional
    ///     Change of Poisson's ratio; EI stays.
    ///
    /// Returns
    /// -------
    /// Variation
    ///     Per unit of the change.
    ///
    /// Raises
    /// ------
    /// InvalidInput
    ///     Another shape, numbers that are not finite.
    /// TypeError
    ///     A value of another type.
    #[pyo3(signature = (*, displacements=None, rest=None, holes=None, lengths=None, poisson_ratio=0.0))]
    fn forward<'py>(
        &self,
        py: Python<'py>,
        displacements: Option<&Bound<'py, PyAny>>,
        rest: Option<&Bound<'py, PyAny>>,
        holes: Option<&Bound<'py, PyAny>>,
        lengths: Option<&Bound<'py, PyAny>>,
        #[pyo3(from_py_with = poisson_ratio)] poisson_ratio: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let sensitivity = self.core();
        let mut change = sensitivity.no_change();
        if let Some(given) = displacements {
            change.displacements = numbers("displacements", given, change.displacements.len())?;
        }
        if let Some(given) = rest {
            change.rest = rows("rest", given, change.rest.len())?;
        }
        if let Some(given) = lengths {
            change.lengths = numbers("lengths", given, change.lengths.len())?;
        }
        if let Some(given) = holes {
            self.read_holes(given, &mut change.holes)?;
        }
        change.poisson_ratio = poisson_ratio;
        let variation = py.detach(|| sensitivity.forward(&change));
        let state = self.shape.get().state();
        let (count, tendons) = (state.strains.len(), variation.tensions.len());
        let width = variation.strains.len() / count;
        let fields = (
            frozen(py, variation.strains, &[count, width])?,
            frozen(py, variation.tensions, &[tendons])?,
            frozen_points(py, variation.velocities.into_iter())?,
            frozen_points(py, variation.spins.into_iter())?,
        );
        python_side::VARIATION.get(py)?.call1(fields)
    }

    /// Gradient of weighted positions and rotations of the disks by everything at once: of
    /// `sum(positions * velocities) + sum(moments * spins)` in the words of `forward`, at the cost of one.
    ///
    /// Parameters
    /// ----------
    /// positions : array_like, shape (n + 1, 3), optional
    ///     Weight of each disk's centre, world axes: the gradient of a function of `Shape.positions`.
    /// moments : array_like, shape (n + 1, 3), optional
    ///     Weight of each disk's rotation, about world axes.
    ///
    /// Returns
    /// -------
    /// Gradient
    ///     In units of the weights times metres (radians) over those of what it is by.
    ///
    /// Raises
    /// ------
    /// InvalidInput
    ///     Another shape, numbers that are not finite.
    /// TypeError
    ///     A value of another type.
    #[pyo3(signature = (positions=None, moments=None))]
    fn adjoint<'py>(
        &self,
        py: Python<'py>,
        positions: Option<&Bound<'py, PyAny>>,
        moments: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let disks = self.robot().backbone().subsegments() + 1;
        let weights = |argument: &str, given: Option<&Bound<'py, PyAny>>| match given {
            Some(given) => rows(argument, given, disks),
            None => Ok(vec![Vector3::zeros(); disks]),
        };
        let (positions, moments) = (weights("positions", positions)?, weights("moments", moments)?);
        let by = py.detach(|| self.core().adjoint(&positions, &moments));
        let holes = by.holes.into_iter().map(|holes| frozen_points(py, holes.into_iter()));
        let holes = holes.collect::<PyResult<Vec<_>>>()?;
        let (tendons, count) = (by.displacements.len(), by.lengths.len());
        let fields = (
            frozen(py, by.displacements, &[tendons])?,
            frozen_points(py, by.rest.into_iter())?,
            PyList::new(py, holes)?,
            frozen(py, by.lengths, &[count])?,
            by.poisson_ratio,
        );
        python_side::GRADIENT.get(py)?.call1(fields)
    }

    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        ("sensitivity", self.shape.get().__hash__()).hash(&mut hasher);
        hasher.finish()
    }

    fn __repr__(&self) -> String {
        let counts = (self.robot().tendons().len(), self.robot().backbone().subsegments());
        let dependent = if self.dependent() { ", dependent" } else { "" };
        format!("<Sensitivity of {} tendons and {} subsegments{dependent}>", counts.0, counts.1)
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let rebuild = python_side::REBUILD_SENSITIVITY.get(py)?;
        Ok((rebuild, PyTuple::new(py, [self.shape(py)])?))
    }
}

impl Sensitivity {
    /// One array per tendon, into place.
    fn read_holes(
        &self,
        given: &Bound<'_, PyAny>,
        holes: &mut [Vec<Vector3<f64>>],
    ) -> PyResult<()> {
        let Ok(arrays) = given.try_iter() else {
            let message = format!("holes: expected one array per tendon, got {}", type_name(given));
            return Err(PyTypeError::new_err(message));
        };
        let arrays = arrays.collect::<PyResult<Vec<_>>>()?;
        if arrays.len() != holes.len() {
            let expected = format!("{} arrays, one per tendon", holes.len());
            return Err(invalid(&InvalidInput::new("holes", expected, arrays.len())));
        }
        for (k, (array, own)) in arrays.iter().zip(holes).enumerate() {
            *own = rows(&format!("holes[{k}]"), array, own.len())?;
        }
        Ok(())
    }
}

fn poisson_ratio(value: &Bound<'_, PyAny>) -> PyResult<f64> {
    let given = number("poisson_ratio", value)?;
    if given.is_finite() {
        return Ok(given);
    }
    Err(invalid(&InvalidInput::new("poisson_ratio", "a finite number", given)))
}

/// Finite numbers of a shape.
fn finite<'py>(
    argument: &str,
    given: &Bound<'py, PyAny>,
    shape: &[usize],
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let array = float_array(argument, given)?;
    if array.shape() != shape {
        let expected = format!("shape {}", shape_text(shape));
        return Err(wrong_shape(argument, &expected, array.shape()));
    }
    if let Some(bad) = values(&array)?.iter().find(|value| !value.is_finite()) {
        return Err(invalid(&InvalidInput::new(argument, "finite numbers", bad)));
    }
    Ok(array)
}

fn numbers(argument: &str, given: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<f64>> {
    Ok(values(&finite(argument, given, &[count])?)?.to_vec())
}

fn rows(argument: &str, given: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<Vector3<f64>>> {
    let array = finite(argument, given, &[count, 3])?;
    Ok(values(&array)?.chunks_exact(3).map(Vector3::from_column_slice).collect())
}
