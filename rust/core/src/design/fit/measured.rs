//! Measured rows of a fit.

use nalgebra::Vector3;

use crate::batch::in_row;
use crate::error::InvalidInput;
use crate::lie::Pose;
use crate::robot::Robot;

/// Measured rows without gaps; see [`fit`](super::fit).
#[derive(Clone, Debug)]
pub struct Measured {
    /// Displacements of each row, one after the other \[m\]; `inf` is free.
    pub displacements: Vec<f64>,
    /// Points of each row in the world, one after the other: the tool point alone, or every disk, the base first \[m\].
    pub points: Vec<Vector3<f64>>,
    /// Rows that are not fitted to, one entry per row.
    pub held_out: Vec<bool>,
}

impl Measured {
    /// Displacements and points of a row.
    pub(super) fn row(&self, row: usize) -> (&[f64], &[Vector3<f64>]) {
        let rows = self.held_out.len();
        let (tendons, points) = (self.displacements.len() / rows, self.points.len() / rows);
        let displacements = &self.displacements[row * tendons..(row + 1) * tendons];
        (displacements, &self.points[row * points..(row + 1) * points])
    }

    /// Disks whose points were measured, each with the point in its frame.
    pub(super) fn marks(&self, robot: &Robot) -> Vec<(usize, Pose)> {
        let n = robot.backbone().subsegments();
        if self.points.len() == self.held_out.len() {
            return vec![(n, *robot.tool())];
        }
        (0..=n).map(|disk| (disk, Pose::identity())).collect()
    }

    pub(super) fn check(&self, robot: &Robot, unknowns: usize) -> Result<(), InvalidInput> {
        let (rows, disks) = (self.held_out.len(), robot.backbone().subsegments() + 1);
        if self.displacements.len() != rows * robot.tendons().len() {
            let expected = format!("{rows} rows, one value per tendon");
            return Err(InvalidInput::new("displacements", expected, self.displacements.len()));
        }
        if self.points.len() != rows && self.points.len() != rows * disks {
            let expected = format!("{rows} points, or {}, one per row and disk", rows * disks);
            return Err(InvalidInput::new("measurements", expected, self.points.len()));
        }
        for row in 0..rows {
            robot.check_displacements(self.row(row).0).map_err(|error| in_row(error, row))?;
        }
        let fitted = self.held_out.iter().filter(|held| !**held).count();
        let numbers = fitted * 3 * self.points.len().checked_div(rows).unwrap_or(0);
        if numbers <= unknowns {
            let expected = format!("more numbers to fit to than unknowns ({unknowns})");
            return Err(InvalidInput::new("measurements", expected, numbers));
        }
        Ok(())
    }
}
