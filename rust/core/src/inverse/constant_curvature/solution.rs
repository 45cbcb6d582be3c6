//! One of several answers of an inverse.

use crate::constant_curvature::Arc;
use crate::inverse::outcome::Answer;

/// One of several answers.
///
/// ```
/// # use nalgebra::Vector3;
/// # use tdcr::constant_curvature::{ConstantCurvatureSettings, Plan};
/// # use tdcr::inverse::{Bounds, ConstantCurvatureInverse, InverseSettings, Target};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// # let plan = Plan::new(&robot, ConstantCurvatureSettings::default())?;
/// # let (bounds, settings) = (Bounds::default(), InverseSettings::default());
/// # let inverse = ConstantCurvatureInverse::new(&robot, &plan, &bounds, settings)?;
/// let tip = tdcr::constant_curvature::Arc::new(5.0, 1.0, 0.2).frame(1.0).translation;
/// let solutions = inverse.solutions(&Target::Position(tip));
/// assert!(solutions.iter().any(|solution| (solution.arcs[0].kappa() - 5.0).abs() < 1e-6));
/// assert!(solutions.is_sorted_by(|a, b| a.energy <= b.energy));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Its arcs, base first.
    pub arcs: Vec<Arc>,
    /// Its displacements \[m\].
    pub displacements: Vec<f64>,
    /// Its bending energy, in a unit common to the answers.
    pub energy: f64,
    /// Number of starts that led to it.
    pub hits: usize,
    /// Outcome of its search.
    pub answer: Answer,
}
