//! Tendon loads, and solves under them.

use crate::error::InvalidInput;
use crate::model::{Model, Shape, State};

/// Load of the tendons.
///
/// ```
/// use tdcr::forward::{Forward, Load, ModelSettings};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let forward = Forward::new(&robot, ModelSettings::default())?;
/// let found = forward.solve(Load::Tensions(vec![0.0; 3]), None)?;
/// // Without tension the robot is at rest.
/// assert!(found.displacements.iter().all(|displacement| displacement.abs() < 1e-12));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum Load {
    /// Displacements, one per tendon \[m\].
    Displacements(Vec<f64>),
    /// Tensions, one per tendon, in the unit of the results.
    Tensions(Vec<f64>),
}

/// Shape with the displacements that it has.
///
/// ```
/// use tdcr::forward::{Forward, Load, ModelSettings, Solution};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let forward = Forward::new(&robot, ModelSettings::default())?;
/// let load = Load::Displacements(vec![-0.005, f64::INFINITY, f64::INFINITY]);
/// let Solution { displacements, shape } = forward.solve(load, None)?;
/// assert_eq!(displacements[0], -0.005);
/// assert_eq!(shape.report.status, tdcr::Status::Converged);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Solution {
    /// Displacements, as given or, under tensions, those that lead to the shape \[m\].
    pub displacements: Vec<f64>,
    /// Solved quantities and the outcome.
    pub shape: Shape,
}

/// Solves a prepared model under a load, from rest or from an earlier shape.
///
/// # Errors
/// As [`Model::solve`], [`Model::solve_from`] and [`Model::solve_tensions`]; `InvalidInput` for a start beside
/// tensions, which are reached from rest, and for displacements that do not fit the robot.
pub fn solve_load<M: Model>(
    model: &M,
    load: Load,
    start: Option<&State>,
) -> Result<Solution, InvalidInput> {
    let mut work = M::Scratch::default();
    match load {
        Load::Displacements(displacements) => {
            model.robot().check_displacements(&displacements)?;
            let report = match start {
                Some(start) => model.solve_from(start, &displacements, &mut work)?,
                None => model.solve(&displacements, &mut work)?,
            };
            let shape = model.result(&displacements, report, work);
            Ok(Solution { displacements, shape })
        }
        Load::Tensions(_) if start.is_some() => {
            let expected = "none beside tensions, which are reached from rest";
            Err(InvalidInput::new("start", expected, "one"))
        }
        Load::Tensions(tensions) => {
            let report = model.solve_tensions(&tensions, &mut work)?;
            let shape = model.result(&[], report, work);
            Ok(Solution { displacements: model.displacements(&shape.state), shape })
        }
    }
}
