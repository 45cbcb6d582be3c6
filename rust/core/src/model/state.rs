//! Solved quantities of a robot, and the outcome of a solve.

use nalgebra::Vector3;

use super::Contact;
use crate::lie::Pose;
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
