//! Plans of the models, made on first use and kept with the robot.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::ModelSettings;
use crate::constant_curvature::{self, ConstantCurvatureSettings};
use crate::error::InvalidInput;
use crate::linkage::{self, LinkageSettings};
use crate::robot::Robot;
use crate::rod::{self, RodSettings};

/// Rod plans kept with a robot.
const MOST_PLANS: usize = 8;

/// Everything a model prepares from a robot once, with the model's settings.
///
/// ```
/// use tdcr::forward::{ModelSettings, Plan};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, ModelSettings::default())?;
/// assert_eq!(plan.settings(), ModelSettings::default());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub enum Plan {
    /// Strain-energy rod.
    Rod(Arc<rod::Plan>),
    /// Chain of linkages.
    Linkage(Arc<linkage::Plan>, LinkageSettings),
    /// Arcs of circles.
    ConstantCurvature(Arc<constant_curvature::Plan>),
}

impl Plan {
    /// Plan of a robot for a model, the robot's own where it has one.
    ///
    /// # Errors
    /// `InvalidInput` for settings out of range, and for a robot that the model does not take.
    pub fn new(robot: &Robot, settings: ModelSettings) -> Result<Self, InvalidInput> {
        match settings {
            ModelSettings::Rod(settings) => Self::rod(robot, settings).map(Self::Rod),
            ModelSettings::Linkage(settings) => {
                let plan = || linkage::Plan::new(robot).map(Arc::new);
                let plan = robot.derived::<Plans>().linkage.get_or_init(plan).clone();
                plan.map(|plan| Self::Linkage(plan, settings))
            }
            ModelSettings::ConstantCurvature(settings) => {
                Self::constant_curvature(robot, settings).map(Self::ConstantCurvature)
            }
        }
    }

    /// Settings that it was made with.
    #[must_use]
    pub fn settings(&self) -> ModelSettings {
        match self {
            Self::Rod(plan) => ModelSettings::Rod(plan.settings),
            Self::Linkage(_, settings) => ModelSettings::Linkage(*settings),
            Self::ConstantCurvature(plan) => ModelSettings::ConstantCurvature(plan.settings),
        }
    }

    /// Plan of the rod, kept for the settings used last.
    ///
    /// # Errors
    /// As [`rod::Plan::new`].
    pub fn rod(robot: &Robot, settings: RodSettings) -> Result<Arc<rod::Plan>, InvalidInput> {
        let plans = robot.derived::<Plans>();
        let lock = || plans.rod.lock().unwrap_or_else(PoisonError::into_inner);
        let mut known = lock();
        if let Some(place) = known.iter().position(|(own, _)| *own == settings) {
            known[place..].rotate_left(1);
            return Ok(Arc::clone(&known[known.len() - 1].1));
        }
        // Nobody waits while it is made; of two made at once both are right.
        drop(known);
        let plan = Arc::new(rod::Plan::new(robot, settings)?);
        let mut known = lock();
        if known.len() >= MOST_PLANS {
            known.remove(0);
        }
        known.push((settings, Arc::clone(&plan)));
        Ok(plan)
    }

    /// Plan of the constant-curvature model.
    ///
    /// # Errors
    /// As [`constant_curvature::Plan::new`].
    pub fn constant_curvature(
        robot: &Robot,
        settings: ConstantCurvatureSettings,
    ) -> Result<Arc<constant_curvature::Plan>, InvalidInput> {
        let place = 2 * settings.coupling as usize + usize::from(settings.extensible);
        let plan = || constant_curvature::Plan::new(robot, settings).map(Arc::new);
        robot.derived::<Plans>().constant_curvature[place].get_or_init(plan).clone()
    }
}

type Once<T> = OnceLock<Result<Arc<T>, InvalidInput>>;

/// Plans made so far.
#[derive(Default)]
struct Plans {
    linkage: Once<linkage::Plan>,
    /// One per settings: coupling, then extensible.
    constant_curvature: [Once<constant_curvature::Plan>; 4],
    /// Last few settings, latest last.
    rod: Mutex<Vec<(RodSettings, Arc<rod::Plan>)>>,
}
