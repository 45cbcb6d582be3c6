//! One inverse, with everything found for its target.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::batch::Inverter;
use super::bounds::Bounds;
use super::outcome::Answer;
use super::rod::RodInverse;
use super::{InverseSettings, Target};
use crate::error::InvalidInput;
use crate::forward::Plan;
use crate::model::State;
use crate::robot::Robot;
use crate::rod::RodSettings;

/// Answer of one inverse, with everything found.
///
/// ```
/// use tdcr::inverse::{Bounds, InverseSettings, RodInverse};
/// use tdcr::rod::{Plan, RodSettings};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, RodSettings::default())?;
/// let inverse = RodInverse::new(&robot, &plan, &Bounds::default(), InverseSettings::default())?;
/// // The disks as they are at rest.
/// let positions: Vec<_> =
///     robot.rest_frames().iter().skip(1).map(|frame| Some(frame.translation)).collect();
/// let found = inverse.solve_positions(&positions, None, None)?;
/// assert!(found.message.is_empty() && found.displacements.iter().all(|d| d.abs() < 1e-8));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Inversion {
    /// Outcome; among wanted positions of disks its distance is the largest of a disk.
    pub answer: Answer,
    /// Tendon displacements \[m\].
    pub displacements: Vec<f64>,
    /// Tensions, in the unit of the results; NaN where the model knows no forces.
    pub tensions: Vec<f64>,
    /// Obstacle to an answer, in a sentence; empty when the target is met.
    pub message: String,
    /// Solved quantities, where displacements do not say which shape it is.
    pub state: Option<State>,
}

/// Seeks the displacements that bring the tool to a target, first from displacements, if given \[m\]; ends soon after
/// the flag is set, if there is one.
///
/// # Errors
/// `InvalidInput` for a start that does not fit the robot and a target too far away.
pub fn invert<I: Inverter>(
    inverse: &I,
    target: &Target,
    start: Option<&[f64]>,
    stop: Option<&Arc<AtomicBool>>,
) -> Result<Inversion, InvalidInput> {
    inverse.check_target(target)?;
    let start = solve_start(inverse, start, stop)?;
    let mut work = inverse.buffers(stop.map(AsRef::as_ref));
    let answer = inverse.solve(target, start.as_ref(), &mut work);
    let mut displacements = vec![f64::NAN; inverse.robot().tendons().len()];
    let mut tensions = displacements.clone();
    inverse.write_displacements(&work, &mut displacements);
    inverse.write_tensions(&work, &mut tensions);
    let message = inverse.message(&answer, &work);
    let state = inverse.state(&mut work);
    Ok(Inversion { answer, displacements, tensions, message, state })
}

/// Solved start of an inverse from displacements, if given \[m\].
///
/// # Errors
/// As [`Inverter::start`], naming the start.
pub fn solve_start<I: Inverter>(
    inverse: &I,
    displacements: Option<&[f64]>,
    stop: Option<&Arc<AtomicBool>>,
) -> Result<Option<I::Start>, InvalidInput> {
    let start = displacements.map(|own| inverse.start(own, stop)).transpose();
    start.map_err(|error| InvalidInput { argument: "start".to_owned(), ..error })
}

impl Robot {
    /// Displacements that bring the tool to a target, by the strain-energy rod with default settings and without
    /// bounds.
    ///
    /// # Errors
    /// As [`invert`].
    pub fn inverse(&self, target: &Target) -> Result<Inversion, InvalidInput> {
        let plan = Plan::rod(self, RodSettings::default())?;
        let settings = InverseSettings::default();
        invert(&RodInverse::new(self, &plan, &Bounds::default(), settings)?, target, None, None)
    }
}
