//! Interface of every forward model: a solve into reusable buffers, and the whole result from it.

mod contact;
mod shape;
mod state;

use crate::error::InvalidInput;
use crate::robot::Robot;

pub use contact::{Contact, PointKind};
pub use shape::Shape;
pub use state::{Report, State};

/// A robot prepared for one forward model.
pub trait Model: Sync {
    /// Buffers of a solve.
    type Scratch: Default + Send;

    /// The robot it was prepared from.
    fn robot(&self) -> &Robot;

    /// Numbers per element in a row of strains: 3, or 4 with the elongation.
    fn strain_width(&self) -> usize {
        3
    }

    /// Elements between two disks, each with a row of strains.
    fn elements(&self) -> usize {
        1
    }

    /// Solves for checked displacements \[m\]; see [`Robot::check_displacements`]. A solve that does
    /// not converge is a report, with the last iterate in the state.
    ///
    /// # Errors
    /// `InvalidInput` for displacements that the model does not take.
    fn solve(
        &self,
        displacements: &[f64],
        work: &mut Self::Scratch,
    ) -> Result<Report, InvalidInput>;

    /// As [`Model::solve`], from what the last solve of this model left in `work`, where the model can
    /// start from that.
    ///
    /// # Errors
    /// As [`Model::solve`].
    fn resume(
        &self,
        displacements: &[f64],
        work: &mut Self::Scratch,
    ) -> Result<Report, InvalidInput> {
        self.solve(displacements, work)
    }

    /// The solved quantities of the last solve in `work`.
    fn state<'w>(&self, work: &'w Self::Scratch) -> &'w State;

    /// The buffers' quantities, taken out of them.
    fn take_state(&self, work: Self::Scratch) -> State;

    /// What stood in the way of the last solve, in a sentence; empty when it converged.
    fn message(&self, displacements: &[f64], work: &Self::Scratch) -> String;

    /// Solves once and builds the whole result.
    ///
    /// # Errors
    /// As [`Model::solve`], and for displacements that do not fit the robot.
    fn shape(&self, displacements: &[f64]) -> Result<Shape, InvalidInput> {
        self.robot().check_displacements(displacements)?;
        let mut work = Self::Scratch::default();
        let report = self.solve(displacements, &mut work)?;
        Ok(self.result(displacements, report, work))
    }

    /// The whole result of the last solve in `work`.
    fn result(&self, displacements: &[f64], report: Report, work: Self::Scratch) -> Shape {
        let message = self.message(displacements, &work);
        Shape { state: self.take_state(work), report, message }
    }
}
