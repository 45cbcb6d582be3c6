//! Disks at given positions, as the goal of a rod's inverse.
//!
//! Of the residuals of many disks only their sum of squares and its derivatives count: with `[J r] = Q U`, those of
//! the triangular U, one row more than there are tendons.

use nalgebra::{DMatrix, SVector, Vector3};

use super::goal::Goal;
use crate::rod::equilibrium::Motion;

/// Target positions of some of the disks.
#[derive(Clone, Debug)]
pub(super) struct PositionGoal {
    /// Disk, from 0 for the first beyond the base, and its target position in the base's frame \[m\].
    targets: Vec<(usize, Vector3<f64>)>,
    /// Residual of a metre.
    scale: f64,
    /// Residuals whose squares sum up to its square are met.
    tolerance: f64,
    /// Offsets from the disks to their targets at the last update \[m\].
    offsets: Vec<Vector3<f64>>,
    velocities: Vec<Vector3<f64>>,
    forces: Vec<Vector3<f64>>,
    second: Vec<f64>,
}

impl PositionGoal {
    /// Goal of a rod of a length, met when every disk is within a tolerance \[m\].
    pub(super) fn new(targets: Vec<(usize, Vector3<f64>)>, length: f64, tolerance: f64) -> Self {
        let scale = 1.0 / (length * (targets.len().max(1) as f64).sqrt());
        Self {
            targets,
            scale,
            tolerance: tolerance * scale,
            offsets: Vec::new(),
            velocities: Vec::new(),
            forces: Vec::new(),
            second: Vec::new(),
        }
    }

    /// Largest and root mean square of the distances, and the disk of the largest, from 0 for the first beyond the
    /// base.
    pub(super) fn errors(&self) -> (f64, f64, usize) {
        let (mut most, mut sum, mut disk) = (0.0, 0.0, 0);
        for ((own, _), offsets) in self.targets.iter().zip(&self.offsets) {
            let distance = offsets.norm();
            sum += distance * distance;
            if distance > most {
                (most, disk) = (distance, *own);
            }
        }
        (most, (sum / self.targets.len().max(1) as f64).sqrt(), disk)
    }
}

impl<const R: usize> Goal<R> for PositionGoal {
    fn update(&mut self, motion: &Motion) {
        self.offsets.clear();
        self.offsets.extend(self.targets.iter().map(|(disk, place)| place - motion.disks[*disk]));
    }

    fn write_residual(
        &mut self,
        motion: &Motion,
        residual: &mut SVector<f64, R>,
        jacobian: &mut [SVector<f64, R>],
    ) {
        motion.write_velocities(&mut self.velocities);
        let count = jacobian.len();
        let all = DMatrix::from_fn(3 * self.targets.len(), count + 1, |row, column| {
            let i = row / 3;
            let value = if column < count {
                -self.velocities[self.targets[i].0 * count + column]
            } else {
                self.offsets[i]
            };
            self.scale * value[row % 3]
        });
        let upper = all.qr().unpack_r();
        for (column, own) in jacobian.iter_mut().chain([residual]).enumerate() {
            own.fill(0.0);
            for row in 0..upper.nrows().min(R) {
                own[row] = upper[(row, column)];
            }
        }
    }

    fn squared_norm(&self) -> f64 {
        self.offsets.iter().map(|offsets| (self.scale * offsets).norm_squared()).sum()
    }

    fn is_met(&self, residual: &SVector<f64, R>) -> bool {
        residual.norm() <= self.tolerance
    }

    /// Second derivatives with the residuals of the last update as weights, as a sum of squares needs them.
    fn add_hessian(&mut self, motion: &mut Motion, _: &SVector<f64, R>, matrix: &mut [f64]) {
        let count = motion.columns.len();
        self.forces.clear();
        self.forces.resize(motion.disks.len(), Vector3::zeros());
        for ((disk, _), offsets) in self.targets.iter().zip(&self.offsets) {
            self.forces[*disk] = offsets * -self.scale * self.scale;
        }
        motion.curve_places(&self.forces, &mut self.second);
        for a in 0..count {
            for b in 0..=a {
                matrix[a * count + b] += self.second[a * count + b] + self.second[b * count + a];
            }
        }
    }
}
