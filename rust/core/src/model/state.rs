//! Solved quantities of a robot, and the outcome of a solve.

use nalgebra::Vector3;

use super::Contact;
use crate::lie::Pose;
use crate::status::Status;

/// The solved quantities, in buffers that are reused from one solve to the next.
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
/// let state = Linkage::new(&robot, &plan, LinkageSettings::default())?
///     .shape(&[-0.005, f64::INFINITY, f64::INFINITY])?
///     .state;
/// assert_eq!((state.frames.len(), state.strains.len()), (11, 10));
/// assert!((state.tendon_lengths[0] - 0.195).abs() < 1e-9);
/// # Ok(())
/// # }
/// ```
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
    /// Contacts of the robot with obstacles.
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

/// Outcome of a solve, without any text.
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
/// let mut scratch = Default::default();
/// let report = linkage.solve(&[-0.005, f64::INFINITY, f64::INFINITY], &mut scratch)?;
/// assert_eq!(report.status, tdcr::Status::Converged);
/// assert!(report.residual < 1e-9);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// The outcome.
    pub status: Status,
    /// Largest violation of the model's conditions, relative.
    pub residual: f64,
    /// Newton steps taken, all subsegments together.
    pub iterations: usize,
}
