//! Predicted points of measured rows and their derivatives by the values, from one solve per row.

use std::sync::atomic::Ordering;

use nalgebra::{DMatrix, DVector};
use rayon::ThreadPool;
use rayon::prelude::*;

use super::measured::Measured;
use super::parameters::Parameters;
use crate::batch::Control;
use crate::constant_curvature::{self, ConstantCurvature};
use crate::error::InvalidInput;
use crate::forward::ModelSettings;
use crate::model::{Model, State, no_derivatives};
use crate::rod::{self, Rod};
use crate::status::Status;

/// Row of measurements beside its prediction.
pub(super) struct Row {
    /// Measured minus predicted, x, y, z of each point.
    pub(super) residual: DVector<f64>,
    /// Derivatives of the predicted points by the scaled values; empty where they were not asked for.
    pub(super) jacobian: DMatrix<f64>,
    /// Convergence of the forward solve: other rows have no weight.
    pub(super) solved: bool,
}

impl Row {
    /// Squared distance of each point.
    pub(super) fn squares(&self) -> impl Iterator<Item = f64> + '_ {
        self.residual.as_slice().chunks_exact(3).map(|r| r.iter().map(|x| x * x).sum())
    }
}

/// Everything that predictions are made of, but for the values.
pub(super) struct Predictor<'a> {
    pub(super) parameters: Parameters<'a>,
    pub(super) measured: &'a Measured,
    pub(super) model: ModelSettings,
    pub(super) pool: &'a ThreadPool,
    pub(super) control: &'a Control,
}

/// Row at its solution, as derivatives need it.
pub(super) struct Solution<'a> {
    /// Displacements as measured, and as the model has them.
    pub(super) given: &'a [f64],
    pub(super) displacements: &'a [f64],
    pub(super) state: &'a State,
}

/// Rows that a thread takes at least.
const ROWS_PER_JOB: usize = 8;

impl Predictor<'_> {
    /// Rows at some values, with derivatives or without: the same on any number of threads.
    pub(super) fn rows(
        &self,
        values: &DVector<f64>,
        chosen: &[usize],
        derivatives: bool,
    ) -> Result<Vec<Row>, InvalidInput> {
        let robot = self.parameters.robot(values)?;
        match self.model {
            ModelSettings::Rod(settings) => {
                let plan = rod::Plan::new(&robot, settings)?;
                let rod = Rod::new(&robot, &plan).stopped_by(self.control.stop.clone());
                self.solve(&rod, values, chosen, derivatives, |at, work, jacobian| {
                    self.fill_by_rod(&rod, at, work, jacobian);
                })
            }
            ModelSettings::Linkage(_) => Err(no_derivatives(self.model.model())),
            ModelSettings::ConstantCurvature(settings) => {
                let plan = constant_curvature::Plan::new(&robot, settings)?;
                let arcs = ConstantCurvature::new(&robot, &plan);
                self.solve(&arcs, values, chosen, derivatives, |at, work, jacobian| {
                    self.fill_by_arcs(&arcs, at, work, jacobian);
                })
            }
        }
    }

    fn solve<M: Model>(
        &self,
        model: &M,
        values: &DVector<f64>,
        chosen: &[usize],
        derivatives: bool,
        fill: impl Fn(&Solution<'_>, &M::Scratch, &mut DMatrix<f64>) + Sync,
    ) -> Result<Vec<Row>, InvalidInput> {
        let stopped = || self.control.stop.load(Ordering::Relaxed);
        let solve = |work: &mut M::Scratch, row: &usize| -> Result<Row, InvalidInput> {
            let (given, points) = self.measured.row(*row);
            if stopped() {
                // Nobody looks at it.
                return Ok(Row {
                    residual: DVector::zeros(0),
                    jacobian: DMatrix::zeros(0, 0),
                    solved: false,
                });
            }
            // Forward solve from rest.
            let displacements = self.parameters.displacements(values, given);
            let report = model.solve(&displacements, work)?;
            let at = Solution { given, displacements: &displacements, state: model.state(work) };
            // r = p̂ − p.
            let marks = self.measured.marks(model.robot());
            let residual = marks.iter().zip(points).flat_map(|((disk, tool), point)| {
                let off = point - at.state.frames[*disk].transform(&tool.translation);
                [off.x, off.y, off.z]
            });
            let residual = DVector::from_iterator(3 * points.len(), residual);
            let finite = residual.iter().all(|r| r.is_finite());
            let solved = report.status == Status::Converged && finite;
            // J = ∂p/∂x from the same solve, by the scaled values.
            let mut jacobian = DMatrix::zeros(0, 0);
            if derivatives && solved {
                jacobian = DMatrix::zeros(residual.len(), self.parameters.len());
                fill(&at, work, &mut jacobian);
                self.fill_by_base(model.robot(), values, at.state, &mut jacobian);
                let units = self.parameters.units.iter();
                jacobian.column_iter_mut().zip(units).for_each(|(mut own, unit)| own *= *unit);
            }
            self.control.done.fetch_add(1, Ordering::Relaxed);
            Ok(Row { residual, jacobian, solved })
        };
        // Rows on the pool; the first that fails in their order is the error.
        let rows: Vec<_> = self.pool.install(|| {
            let rows = chosen.par_iter().with_min_len(ROWS_PER_JOB);
            rows.map_init(M::Scratch::default, solve).collect()
        });
        rows.into_iter().collect()
    }
}
