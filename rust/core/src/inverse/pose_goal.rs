//! Tool at a target, as the goal of a rod's inverse.

use nalgebra::Vector6;

use super::goal::Goal;
use super::pose_residual::PoseResidual;
use crate::rod::equilibrium::Motion;

/// Target pose of the tool.
#[derive(Clone, Debug)]
pub(super) struct PoseGoal<'a> {
    pub(super) pose_residual: PoseResidual<'a>,
    moved: Vec<f64>,
    turned: Vec<f64>,
}

impl<'a> PoseGoal<'a> {
    pub(super) fn new(pose_residual: PoseResidual<'a>) -> Self {
        Self { pose_residual, moved: Vec::new(), turned: Vec::new() }
    }
}

impl Goal<6> for PoseGoal<'_> {
    fn update(&mut self, motion: &Motion) {
        self.pose_residual.update(motion.tool.translation, || motion.tool.rotation);
    }

    fn write_residual(
        &mut self,
        motion: &Motion,
        residual: &mut Vector6<f64>,
        jacobian: &mut [Vector6<f64>],
    ) {
        *residual = self.pose_residual.residual();
        self.pose_residual.write_jacobian(&motion.columns, jacobian);
    }

    fn squared_norm(&self) -> f64 {
        self.pose_residual.residual().norm_squared()
    }

    fn is_met(&self, residual: &Vector6<f64>) -> bool {
        self.pose_residual.is_met(residual)
    }

    fn add_hessian(&mut self, motion: &mut Motion, weights: &Vector6<f64>, matrix: &mut [f64]) {
        let Self { pose_residual, moved, turned } = self;
        let rotates = pose_residual.rotates();
        let push = pose_residual.curvature(weights);
        motion.curve(&push.force, &push.moment, moved, turned);
        let columns = &motion.columns;
        let size = columns.len();
        for a in 0..size {
            let spin = &columns[a].1;
            let row = push.row(spin);
            for b in 0..=a {
                let mut sum = moved[a * size + b] + moved[b * size + a];
                if rotates {
                    let other = &columns[b].1;
                    sum += push.rotation(&row, spin, other, turned[a * size + b]);
                }
                matrix[a * size + b] += sum;
            }
        }
    }
}
