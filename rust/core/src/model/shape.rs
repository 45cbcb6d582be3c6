//! The result of a forward solve, the same for every model.

use nalgebra::Vector3;

use super::{Report, State};
use crate::robot::Robot;

/// A solved (or not solved: see the report's status) robot.
///
/// ```
/// use tdcr::linkage::{Linkage, LinkageSettings, Plan};
/// use tdcr::model::Model;
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot)?;
/// let linkage = Linkage::new(&robot, &plan, LinkageSettings::default())?;
/// let shape = linkage.shape(&[-0.005, f64::INFINITY, f64::INFINITY])?;
/// assert!(shape.message.is_empty());
/// assert_eq!(shape.tendon_points(&robot, 0).len(), 11);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Shape {
    /// Frames, strains, lengths, tensions, energy.
    pub state: State,
    /// Outcome of the solve.
    pub report: Report,
    /// Reason why the solve did not converge, or empty.
    pub message: String,
}

impl Shape {
    /// Places of a tendon's holes in the world, disk 0 first \[m\].
    #[must_use]
    pub fn tendon_points(&self, robot: &Robot, tendon: usize) -> Vec<Vector3<f64>> {
        robot.paths()[tendon].points(&self.state.frames).collect()
    }
}
