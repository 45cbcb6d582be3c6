//! The tool at a target, as what is wanted of a rod.

use nalgebra::Vector6;

use super::pose_residual::Aim;
use super::tension_problem::Goal;
use crate::rod::equilibrium::Motion;

/// A target of the tool.
#[derive(Clone, Debug)]
pub(super) struct ToolGoal<'a> {
    pub(super) aim: Aim<'a>,
    moved: Vec<f64>,
    turned: Vec<f64>,
}

impl<'a> ToolGoal<'a> {
    pub(super) fn new(aim: Aim<'a>) -> Self {
        Self { aim, moved: Vec::new(), turned: Vec::new() }
    }
}

impl Goal<6> for ToolGoal<'_> {
    fn place(&mut self, motion: &Motion) {
        self.aim.place(motion.tool.translation, || motion.tool.rotation);
    }

    fn write(
        &mut self,
        motion: &Motion,
        residual: &mut Vector6<f64>,
        jacobian: &mut [Vector6<f64>],
    ) {
        *residual = self.aim.residual();
        self.aim.write_columns(&motion.columns, jacobian);
    }

    fn squared(&self) -> f64 {
        self.aim.residual().norm_squared()
    }

    fn met(&self, residual: &Vector6<f64>) -> bool {
        self.aim.met(residual)
    }

    fn curve(&mut self, motion: &mut Motion, weights: &Vector6<f64>, matrix: &mut [f64]) {
        let Self { aim, moved, turned } = self;
        let rotates = aim.rotates();
        let push = aim.curvature(weights);
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
