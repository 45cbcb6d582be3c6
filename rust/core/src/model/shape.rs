//! The result of a forward solve, the same for every model.

use nalgebra::Vector3;

use super::{Report, State};
use crate::robot::Robot;

/// A solved (or not solved: see the report's status) robot.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Frames, strains, lengths, tensions, energy.
    pub state: State,
    /// How the solve ended.
    pub report: Report,
    /// What stood in the way, or empty.
    pub message: String,
}

impl Shape {
    /// Places of a tendon's holes in the world, disk 0 first \[m\].
    #[must_use]
    pub fn tendon_points(&self, robot: &Robot, tendon: usize) -> Vec<Vector3<f64>> {
        robot.paths()[tendon].points(&self.state.frames).collect()
    }
}
