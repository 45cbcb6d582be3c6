//! What every forward model offers: a solve into reusable buffers, and the whole result from it.

use nalgebra::Vector3;

use crate::error::InvalidInput;
use crate::lie::Pose;
use crate::robot::Robot;
use crate::shape::{Contact, Shape};
use crate::status::Status;

/// The solved quantities, in buffers that are reused from one solve to the next.
#[derive(Clone, Debug, Default)]
pub struct State {
    /// Frame of every disk in the world, disk 0 first.
    pub frames: Vec<Pose>,
    /// Rotation vector of every element in the frame of its own base \[rad\].
    pub strains: Vec<Vector3<f64>>,
    /// Relative elongation of every element; empty where the model has none.
    pub elongations: Vec<f64>,
    /// Length of every tendon from the base to its end \[m\].
    pub tendon_lengths: Vec<f64>,
    /// Tension of every tendon; NaN in models that know no forces.
    pub tensions: Vec<f64>,
    /// Where the robot touches obstacles.
    pub contacts: Vec<Contact>,
    /// Strain energy of the backbone \[J, or 1/m in units of EI\].
    pub energy: f64,
}

impl State {
    /// Rows of strains one after the other: rotation vector, and elongation where there is one.
    pub fn write_strains(&self, place: &mut [f64]) {
        let width = if self.elongations.is_empty() { 3 } else { 4 };
        for (i, (row, strain)) in place.chunks_exact_mut(width).zip(&self.strains).enumerate() {
            row[..3].copy_from_slice(strain.as_slice());
            if width == 4 {
                row[3] = self.elongations[i];
            }
        }
    }

    /// Empties the buffers, keeping their memory.
    pub fn clear(&mut self) {
        self.frames.clear();
        self.strains.clear();
        self.elongations.clear();
        self.tendon_lengths.clear();
        self.tensions.clear();
        self.contacts.clear();
        self.energy = 0.0;
    }
}

/// How a solve ended, without any text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// The outcome.
    pub status: Status,
    /// Largest violation of the model's conditions, relative.
    pub residual: f64,
    /// Newton steps taken, all subsegments together.
    pub iterations: usize,
}

/// A robot prepared for one forward model.
pub trait Model: Sync {
    /// Buffers of a solve.
    type Workspace: Default + Send;

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
        work: &mut Self::Workspace,
    ) -> Result<Report, InvalidInput>;

    /// As [`Model::solve`], from what the last solve of this model left in `work`, where the model can
    /// start from that.
    ///
    /// # Errors
    /// As [`Model::solve`].
    fn resume(
        &self,
        displacements: &[f64],
        work: &mut Self::Workspace,
    ) -> Result<Report, InvalidInput> {
        self.solve(displacements, work)
    }

    /// The solved quantities of the last solve in `work`.
    fn state<'w>(&self, work: &'w Self::Workspace) -> &'w State;

    /// The buffers' quantities, taken out of them.
    fn take_state(&self, work: Self::Workspace) -> State;

    /// What stood in the way of the last solve, in a sentence; empty when it converged.
    fn message(&self, displacements: &[f64], work: &Self::Workspace) -> String;

    /// Solves once and builds the whole result.
    ///
    /// # Errors
    /// As [`Model::solve`], and for displacements that do not fit the robot.
    fn shape(&self, displacements: &[f64]) -> Result<Shape, InvalidInput> {
        self.robot().check_displacements(displacements)?;
        let mut work = Self::Workspace::default();
        let report = self.solve(displacements, &mut work)?;
        Ok(self.result(displacements, report, work))
    }

    /// The whole result of the last solve in `work`.
    fn result(&self, displacements: &[f64], report: Report, work: Self::Workspace) -> Shape {
        let message = self.message(displacements, &work);
        Shape { state: self.take_state(work), report, message }
    }
}
