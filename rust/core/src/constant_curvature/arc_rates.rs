//! Rates of the arcs by displacements and holes, and of the disks by the arcs.
//!
//! The unknowns of the arcs are `u = M⁺ d`. While the rank of M stays, a change ∂M of the holes changes the
//! pseudo-inverse by the formula of G. H. Golub and V. Pereyra, SIAM J. Numer. Anal. 10 (1973), doi:10.1137/0710036.

use nalgebra::{DMatrix, DVector, Matrix6xX, Vector2};

use super::arc::Arc;
use super::kinematics::tip_derivative;
use super::model::{ConstantCurvature, Scratch};
use crate::lie::Pose;

/// Derivatives of the arcs of one solve. Arcs are three numbers each: the bending vector and the length.
#[derive(Debug)]
pub struct ArcRates<'a> {
    model: &'a ConstantCurvature<'a>,
    work: &'a Scratch,
    /// `M`, without the rows of tendons that are not active, and `M⁺`.
    matrix: DMatrix<f64>,
    inverse: &'a DMatrix<f64>,
    /// `u` and `z = d - M u`.
    unknowns: DVector<f64>,
    misfit: DVector<f64>,
}

impl ConstantCurvature<'_> {
    /// Derivatives at the arcs that the last solve for `displacements` left in `work`.
    #[must_use]
    pub fn arc_rates<'a>(&'a self, displacements: &[f64], work: &'a Scratch) -> ArcRates<'a> {
        let plan = self.plan;
        let mut matrix = plan.matrix.clone();
        let mut given = DVector::zeros(displacements.len());
        for (k, active) in work.active.iter().enumerate() {
            if *active {
                given[k] = displacements[k];
            } else {
                matrix.row_mut(k).fill(0.0);
            }
        }
        let inverse = plan.inverse_for(&work.active, work.masked.as_ref());
        let unknowns = inverse * &given;
        let misfit = given - &matrix * &unknowns;
        ArcRates { model: self, work, matrix, inverse, unknowns, misfit }
    }
}

impl ArcRates<'_> {
    /// Rates of the arcs by the displacement of a tendon; 0 for one that is not active.
    #[must_use]
    pub fn by_displacement(&self, tendon: usize) -> DVector<f64> {
        self.by_unknowns(&self.inverse.column(tendon).into(), 0.0)
    }

    /// Rates of the arcs by a shift of all holes of a straight tendon.
    #[must_use]
    pub fn by_holes(&self, tendon: usize, shift: Vector2<f64>) -> DVector<f64> {
        let plan = self.model.plan;
        let path = &self.model.robot.paths()[tendon];
        let (hole, width) = (path.holes[0].xy(), plan.width());
        // The scale is the mean radius, and changes with the holes too.
        let scaled = hole.dot(&shift) / (hole.norm() * self.matrix.nrows() as f64) / plan.scale;
        let mut change = self.matrix.clone();
        for (column, mut entries) in change.column_iter_mut().enumerate() {
            entries *= if column % width < 2 { -scaled } else { 0.0 };
        }
        for (i, segment) in plan.segments.iter().enumerate() {
            if self.work.active[tendon] && plan.settings.coupling.joins(path.end(), segment) {
                change[(tendon, width * i)] -= shift.x / plan.scale;
                change[(tendon, width * i + 1)] -= shift.y / plan.scale;
            }
        }
        let (matrix, inverse) = (&self.matrix, self.inverse);
        let across = change.tr_mul(&inverse.tr_mul(&self.unknowns));
        let within = inverse.tr_mul(&change.tr_mul(&self.misfit))
            - &change * &self.unknowns
            - matrix * &across;
        self.by_unknowns(&(inverse * within + across), scaled)
    }

    /// Rates of the arcs from those of the unknowns, and of the scale over itself.
    fn by_unknowns(&self, rates: &DVector<f64>, scaled: f64) -> DVector<f64> {
        let plan = self.model.plan;
        let width = plan.width();
        DVector::from_fn(3 * plan.segments.len(), |row, _| {
            match (row / 3 * width + row % 3, row % 3) {
                (at, 0 | 1) => (rates[at] - scaled * self.unknowns[at]) / plan.scale,
                (at, _) if width == 3 => rates[at],
                _ => 0.0,
            }
        })
    }

    /// Velocity of a tool on a disk (translation, then rotation, world axes) by the arcs, (6, 3m).
    #[must_use]
    pub fn of_disk(&self, disk: usize, tool: &Pose) -> Matrix6xX<f64> {
        let (robot, plan) = (self.model.robot, self.model.plan);
        let mut out = Matrix6xX::zeros(3 * plan.segments.len());
        let Some(last) = plan.segments.iter().position(|s| disk > s.first && disk <= s.last) else {
            return out;
        };
        let (segment, places) = (&plan.segments[last], robot.backbone().arc_lengths());
        let share = (places[disk] - places[segment.first]) / segment.rest_length;
        let mut arcs = self.work.arcs[..=last].to_vec();
        arcs[last] = Arc { bend: arcs[last].bend * share, length: arcs[last].length * share };
        let mut rates = tip_derivative(robot.base(), tool, &arcs);
        rates.columns_mut(3 * last, 3).scale_mut(share);
        out.columns_mut(0, 3 * last + 3).copy_from(&rates);
        out
    }
}
