//! Arrays of a `Shape`, built on first access.

use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};

use tdcr::lie::Pose;
use tdcr::model::State;
use tdcr::robot::Robot;

use crate::convert::arrays::{Lazy, frozen, frozen_frames, frozen_points};

/// Arrays of a shape; all of one shape come from its one state.
#[derive(Default)]
pub(crate) struct ShapeArrays {
    frames: Lazy,
    positions: Lazy,
    tip: Lazy,
    strains: Lazy,
    tendon_points: Lazy,
    tendon_lengths: Lazy,
    tensions: Lazy,
    displacements: Lazy,
}

impl ShapeArrays {
    pub(crate) fn displacements(&self, py: Python<'_>, values: &[f64]) -> PyResult<Py<PyAny>> {
        self.displacements.get(py, || frozen(py, values.to_vec(), &[values.len()]))
    }

    pub(crate) fn frames(&self, py: Python<'_>, state: &State) -> PyResult<Py<PyAny>> {
        self.frames.get(py, || frozen_frames(py, &state.frames))
    }

    pub(crate) fn positions(&self, py: Python<'_>, state: &State) -> PyResult<Py<PyAny>> {
        let centres = state.frames.iter().map(|frame| frame.translation);
        self.positions.get(py, || frozen_points(py, centres))
    }

    pub(crate) fn tip(&self, py: Python<'_>, state: &State) -> PyResult<Py<PyAny>> {
        self.tip.get(py, || {
            let tip = state.frames.last().copied().unwrap_or_else(Pose::identity);
            frozen(py, tip.to_row_major().to_vec(), &[4, 4])
        })
    }

    pub(crate) fn strains(&self, py: Python<'_>, state: &State) -> PyResult<Py<PyAny>> {
        self.strains.get(py, || {
            let width = if state.elongations.is_empty() { 3 } else { 4 };
            let mut flat = vec![0.0; width * state.strains.len()];
            state.write_strains(&mut flat);
            frozen(py, flat, &[state.strains.len(), width])
        })
    }

    pub(crate) fn tendon_points<'py>(
        &self,
        py: Python<'py>,
        robot: &Robot,
        state: &State,
    ) -> PyResult<Bound<'py, PyList>> {
        let arrays = self.tendon_points.get(py, || {
            let points =
                robot.paths().iter().map(|path| frozen_points(py, path.points(&state.frames)));
            let points = points.collect::<PyResult<Vec<_>>>()?;
            Ok(PyTuple::new(py, points)?.into_any().unbind())
        })?;
        // A list of its own for every caller; the arrays are shared and read-only.
        arrays.bind(py).cast::<PyTuple>()?.as_sequence().to_list()
    }

    pub(crate) fn tendon_lengths(&self, py: Python<'_>, state: &State) -> PyResult<Py<PyAny>> {
        let lengths = &state.tendon_lengths;
        self.tendon_lengths.get(py, || frozen(py, lengths.clone(), &[lengths.len()]))
    }

    pub(crate) fn tensions(&self, py: Python<'_>, state: &State) -> PyResult<Py<PyAny>> {
        let tensions = &state.tensions;
        self.tensions.get(py, || frozen(py, tensions.clone(), &[tensions.len()]))
    }
}
