//! `Shape`: the result of a forward solve.

use std::hash::{DefaultHasher, Hash, Hasher};

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple, PyType};

use tdcr::Status;
use tdcr::forward::{ModelSettings, Solution};
use tdcr::lie::Pose;
use tdcr::model::State;

use crate::convert::arrays::{frozen, status};
use crate::convert::python_side;
use crate::forward::model_choice::python_settings;
use crate::forward::shape_arrays::ShapeArrays;
use crate::robot::Robot;
use crate::scene::Surroundings;
use crate::scene::contact::Contact;
use crate::scene::loads::Loads;

/// The shape of a robot, as a forward model found it. A solve that did not converge carries its
/// last iterate, a status and a message. Arrays are in the world frame, read-only and built once,
/// on first access.
#[pyclass(frozen, module = "tdcr")]
pub(crate) struct Shape {
    robot: Robot,
    settings: ModelSettings,
    displacements: Vec<f64>,
    core: tdcr::Shape,
    /// None where there is nothing.
    around: Option<Surroundings>,
    arrays: ShapeArrays,
}

impl Shape {
    pub(crate) fn new(
        robot: Robot,
        settings: ModelSettings,
        Solution { displacements, shape: core }: Solution,
    ) -> Self {
        Self { robot, settings, displacements, core, around: None, arrays: ShapeArrays::default() }
    }

    /// This shape, solved among obstacles and under loads.
    pub(crate) fn among(self, around: Surroundings) -> Self {
        Self { around: around.any().is_some().then_some(around), ..self }
    }

    pub(crate) fn around(&self) -> Option<&Surroundings> {
        self.around.as_ref()
    }

    pub(crate) const fn model_settings(&self) -> ModelSettings {
        self.settings
    }

    pub(crate) fn displacement_values(&self) -> &[f64] {
        &self.displacements
    }

    /// The exception that has it as its result.
    pub(crate) fn not_converged(slf: &Bound<'_, Self>) -> PyErr {
        let report = || {
            let shape = slf.get();
            let message = format!("{}: {}", shape.core.report.status, shape.core.message);
            python_side::NOT_CONVERGED.get(slf.py())?.call1((message, slf))
        };
        report().map_or_else(|error| error, PyErr::from_value)
    }

    pub(crate) fn core_robot(&self) -> &tdcr::robot::Robot {
        &self.robot.0
    }

    pub(crate) fn state(&self) -> &State {
        &self.core.state
    }
}

fn same_bits(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

impl Shape {
    /// Equal but for the surroundings.
    pub(crate) fn same(&self, other: &Self) -> bool {
        let (a, b) = (&self.core, &other.core);
        self.robot == other.robot
            && self.settings == other.settings
            && same_bits(&self.displacements, &other.displacements)
            && a.state.frames == b.state.frames
            && a.state.strains == b.state.strains
            && same_bits(&a.state.elongations, &b.state.elongations)
            && same_bits(&a.state.tensions, &b.state.tensions)
            && a.state.contacts == b.state.contacts
            && a.report.status == b.report.status
    }
}

#[pymethods]
impl Shape {
    /// The robot that was solved.
    #[getter]
    fn robot(&self) -> Robot {
        self.robot.clone()
    }

    /// Name of the model that solved it.
    #[getter]
    pub(crate) fn model(&self) -> &'static str {
        self.settings.model()
    }

    /// The settings it was solved with: RodSettings, LinkageSettings or ConstantCurvatureSettings.
    #[getter]
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        python_settings(py, self.settings)
    }

    /// Tendon displacements, shape (K,) [m]: negative pulls, `inf` is free. Of a shape under given
    /// tensions, those that lead to it.
    #[getter]
    fn displacements(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.arrays.displacements(py, &self.displacements)
    }

    /// Frame of every disk, shape (n + 1, 4, 4).
    #[getter]
    fn frames(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.arrays.frames(py, self.state())
    }

    /// Centre of every disk, shape (n + 1, 3) [m].
    #[getter]
    fn positions(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.arrays.positions(py, self.state())
    }

    /// Frame of the tip disk, shape (4, 4).
    #[getter]
    fn tip(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.arrays.tip(py, self.state())
    }

    /// Rotation vector of every element in the frame of its own base (bending about x and y,
    /// torsion), shape (n, 3) [rad]; with the relative elongation as a fourth column in extensible
    /// models. A rod of m elements per subsegment has n m rows, base first.
    #[getter]
    fn strains(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.arrays.strains(py, self.state())
    }

    /// Places of every tendon's holes: list of K arrays of shape (end + 1, 3) [m].
    #[getter]
    fn tendon_points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        self.arrays.tendon_points(py, &self.robot.0, self.state())
    }

    /// Length of every tendon from the base to its end, shape (K,) [m].
    #[getter]
    fn tendon_lengths(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.arrays.tendon_lengths(py, self.state())
    }

    /// Tension of every tendon, shape (K,) [N, or 1/m^2 when `units` is "EI"], 0 where it is slack or
    /// free. NaN in the linkage and the constant-curvature model, which know no forces.
    #[getter]
    fn tensions(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.arrays.tensions(py, self.state())
    }

    /// Contacts with obstacles: list of Contact, base first.
    #[getter]
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        PyList::new(py, self.core.state.contacts.iter().map(|contact| Contact(*contact)))
    }

    /// The obstacles it was solved among: tuple of Obstacle.
    #[getter]
    fn obstacles(&self, py: Python<'_>) -> Py<PyTuple> {
        let given = self.around.as_ref().map(|around| around.given.clone_ref(py));
        given.unwrap_or_else(|| PyTuple::empty(py).unbind())
    }

    /// The loads it was solved under: Loads, or None.
    #[getter]
    fn loads(&self) -> Option<Loads> {
        self.around.as_ref().and_then(|around| around.loads.clone())
    }

    /// Strain energy of the backbone [J, or 1/m when `units` is "EI"].
    #[getter]
    fn energy(&self) -> f64 {
        self.core.state.energy
    }

    /// Status of the solve: tdcr.Status.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        status(py, self.core.report.status)
    }

    /// True if the solve converged.
    #[getter]
    pub(crate) fn ok(&self) -> bool {
        self.core.report.status == Status::Converged
    }

    /// Reason of the status, or an empty string.
    #[getter]
    fn message(&self) -> &str {
        &self.core.message
    }

    /// Largest violation of the model's conditions at the answer, relative.
    #[getter]
    fn residual(&self) -> f64 {
        self.core.report.residual
    }

    /// Newton steps taken: of the whole rod, else all subsegments together.
    #[getter]
    fn iterations(&self) -> usize {
        self.core.report.iterations
    }

    /// "N" when the backbone's Young's modulus and diameter are known: tensions in N, energy in J; else
    /// "EI": tensions in 1/m^2 and energy in 1/m, both to be multiplied by the bending stiffness EI.
    #[getter]
    fn units(&self) -> &'static str {
        if self.robot.0.backbone().has_stiffness() { "N" } else { "EI" }
    }

    /// The shape itself if the solve converged.
    ///
    /// Raises
    /// ------
    /// NotConverged
    ///     With the shape as its `result`.
    fn require<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, Self>> {
        let shape = slf.get();
        if shape.ok() {
            return Ok(slf.clone());
        }
        Err(Self::not_converged(slf))
    }

    /// Writes the shape into a file.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     Ending in .npz or .json, which `load` reads back equal; or in .csv, for other programs: a
    ///     row per disk with its position [m]. Replaced if it exists.
    ///
    /// Raises
    /// ------
    /// InvalidInput
    ///     Another file ending; a `SignedDistance` among the obstacles, whose functions no file holds.
    /// OSError
    ///     The file cannot be written.
    #[pyo3(signature = (path))]
    fn save(slf: &Bound<'_, Self>, path: &Bound<'_, PyAny>) -> PyResult<()> {
        python_side::SAVE.get(slf.py())?.call1((slf, path))?;
        Ok(())
    }

    /// Reads a shape that `save` wrote. No code of a file is run.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     File ending in .npz or .json.
    ///
    /// Raises
    /// ------
    /// InvalidInput
    ///     Not the file of a shape: names the path, the field, what was expected and what was found.
    /// OSError
    ///     The file cannot be read.
    #[classmethod]
    fn load<'py>(
        class: &Bound<'py, PyType>,
        path: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        python_side::LOAD.get(class.py())?.call1((path, "Shape"))
    }

    /// Frames in the layout of CRVisToolkit, the plotting toolkit of opencontinuumrobotics.com: the
    /// argument `g` of its `draw_tdcr`, every frame flattened column by column. Its `seg_end` counts
    /// rows from 1: disk k is row k + 1.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n + 1, 16)
    ///     Lengths in m.
    fn plotting_layout(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let frames = &self.core.state.frames;
        let columns = |frame: &Pose| frame.to_matrix().as_slice().to_vec();
        frozen(py, frames.iter().flat_map(columns).collect(), &[frames.len(), 16])
    }

    /// Draws the shape with matplotlib (an optional extra: `pip install tdcr[plot]`).
    ///
    /// Parameters
    /// ----------
    /// ax : matplotlib.axes.Axes, optional
    ///     Axes to draw into, plain or 3-D. Default: those of a new figure.
    /// view : {"auto", "2d", "3d"}, optional
    ///     "auto" is the plane of the bend where the shape stays in one.
    /// disks, tendons, obstacles, contacts, legend : bool, optional
    ///     What is drawn.
    /// marks : array_like, shape (m, 3), optional
    ///     Places to mark, in their order: a target, a path [m].
    /// title : str, optional
    ///     Default: name of the robot, model and status.
    /// unit : {"auto", "m", "mm"}, optional
    ///     Unit of the axes.
    ///
    /// Returns
    /// -------
    /// matplotlib.axes.Axes
    ///     Not shown and not saved.
    ///
    /// Raises
    /// ------
    /// InvalidInput
    ///     An unknown view or unit.
    /// ImportError
    ///     matplotlib is not installed.
    #[pyo3(signature = (**options))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        python_side::PLOT_SHAPE.get(slf.py())?.call((slf,), options)
    }

    /// Equal by value: robot, model, settings, displacements, surroundings and answer.
    fn __eq__(&self, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        let Ok(other) = other.cast::<Self>() else { return Ok(false) };
        let other = other.get();
        let around = match (&self.around, &other.around) {
            (None, None) => true,
            (Some(one), Some(another)) => Python::attach(|py| one.same(another, py))?,
            _ => false,
        };
        Ok(around && self.same(other))
    }

    pub(crate) fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        self.robot.hash(&mut hasher);
        for value in &self.displacements {
            value.to_bits().hash(&mut hasher);
        }
        hasher.finish()
    }

    fn __repr__(&self) -> String {
        let tip = self.core.state.frames.last().map(|f| f.translation).unwrap_or_default();
        let status = self.core.report.status;
        let message = &self.core.message;
        let message = if message.is_empty() { String::new() } else { format!(" ({message})") };
        let contacts = match (&self.around, self.core.state.contacts.len()) {
            (None, _) => String::new(),
            (_, 1) => ", 1 contact".to_owned(),
            (_, count) => format!(", {count} contacts"),
        };
        format!(
            "<Shape {status}{message}: tip ({:.6}, {:.6}, {:.6}) m{contacts}, model {:?}>",
            tip.x,
            tip.y,
            tip.z,
            self.model()
        )
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let rebuild = python_side::REBUILD_SHAPE.get(py)?;
        let state = (
            self.robot.clone(),
            self.model(),
            self.settings(py)?,
            self.displacements(py)?,
            self.frames(py)?,
            self.strains(py)?,
            self.tendon_lengths(py)?,
            self.tensions(py)?,
            self.energy(),
            (self.core.report.status.as_str(), self.message(), self.residual(), self.iterations()),
            (self.obstacles(py), self.loads(), self.contacts(py)?),
        );
        Ok((rebuild, state.into_pyobject(py)?))
    }
}
