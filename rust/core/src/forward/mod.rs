//! Forward solves: one entry for every model, load, start and scene.
//!
//! [`Forward`] is a robot prepared for a model among obstacles and under loads; [`Robot::forward`] is its short form.

mod load;
mod plans;
mod task;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use nalgebra::Matrix6xX;
use rayon::ThreadPool;

use crate::batch::{Control, Solved};
use crate::constant_curvature::{ConstantCurvature, ConstantCurvatureSettings};
use crate::error::InvalidInput;
use crate::linkage::{Linkage, LinkageSettings};
use crate::model::{Model, Shape, State, no_derivatives, rod_only};
use crate::obstacle::{Fault, FirstFault, Obstacle};
use crate::robot::Robot;
use crate::rod::contact::{LoadedRod, Loads, Scene};
use crate::rod::{self, Linearized, Rod, RodSettings};

pub use load::{Load, Solution, solve_load};
pub use plans::Plan;
pub use task::Rows;
use task::{ChainedShape, SolveLoad, SolveRows, Task, ToolJacobian};

/// Forward model with its settings.
///
/// ```
/// use tdcr::forward::ModelSettings;
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// assert_eq!(ModelSettings::default().model(), "rod");
/// assert!(ModelSettings::of_model("linkage")?.check_derivatives().is_err());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ModelSettings {
    /// Strain-energy rod.
    Rod(RodSettings),
    /// Chain of four-bar and seven-bar linkages.
    Linkage(LinkageSettings),
    /// Segments of constant curvature.
    ConstantCurvature(ConstantCurvatureSettings),
}

impl Default for ModelSettings {
    fn default() -> Self {
        Self::Rod(RodSettings::default())
    }
}

impl ModelSettings {
    /// Name of the model, as in Python.
    #[must_use]
    pub const fn model(&self) -> &'static str {
        match self {
            Self::Rod(_) => Rod::NAME,
            Self::Linkage(_) => Linkage::NAME,
            Self::ConstantCurvature(_) => ConstantCurvature::NAME,
        }
    }

    /// Default settings of a model by name.
    ///
    /// # Errors
    /// `InvalidInput` for another name.
    pub fn of_model(name: &str) -> Result<Self, InvalidInput> {
        let all = [
            Self::Rod(RodSettings::default()),
            Self::Linkage(LinkageSettings::default()),
            Self::ConstantCurvature(ConstantCurvatureSettings::default()),
        ];
        all.into_iter().find(|settings| settings.model() == name).ok_or_else(|| {
            let expected = "\"rod\", \"linkage\" or \"constant_curvature\"";
            InvalidInput::new("model", expected, format!("\"{name}\""))
        })
    }

    /// Refusal of rows that start from each other by models without states to start from.
    ///
    /// # Errors
    /// `InvalidInput` for warm rows of a model other than the rod.
    pub fn check_warm(&self, warm: bool) -> Result<(), InvalidInput> {
        if warm && !matches!(self, Self::Rod(_)) {
            let got = format!("True for model \"{}\"", self.model());
            return Err(InvalidInput::new("warm", "False, or model \"rod\"", got));
        }
        Ok(())
    }

    /// Refusal of Jacobians by the model without derivatives.
    ///
    /// # Errors
    /// `InvalidInput` for the linkage.
    pub fn check_derivatives(&self) -> Result<(), InvalidInput> {
        match self {
            Self::Rod(_) | Self::ConstantCurvature(_) => Ok(()),
            Self::Linkage(_) => Err(no_derivatives(self.model())),
        }
    }

    /// Refusal of obstacles and loads by models that know no forces.
    ///
    /// # Errors
    /// `InvalidInput` that names the argument, for every model but the rod.
    pub fn check_surroundings(
        &self,
        obstacles: &[Obstacle],
        loads: Option<&Loads>,
    ) -> Result<(), InvalidInput> {
        match (self, obstacles, loads) {
            (Self::Rod(_), ..) | (_, [], None) => Ok(()),
            (_, [], Some(_)) => Err(rod_only("loads", self.model())),
            _ => Err(rod_only("obstacles", self.model())),
        }
    }
}

/// Time of a hard solve of a rod per second derivative \[µs\]. A usual one takes 1 µs per subsegment, which has nine.
const HARD_ROD: f64 = 2.5;
/// Time of a hard solve among obstacles per second derivative \[µs\]. A usual one takes 10 µs per subsegment among a
/// few bodies, 180 µs among meshes.
const HARD_CONTACT: f64 = 125.0;

/// Robot prepared for forward solves: its plan, what surrounds it and a flag that ends solves early.
///
/// ```
/// use tdcr::forward::{Forward, Load, ModelSettings};
/// use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// let robot = Robot::new(backbone, vec![Tendon::straight(0.0, 0.01)?], None, None, None)?;
/// let forward = Forward::new(&robot, ModelSettings::default())?;
/// let bent = forward.solve(Load::Displacements(vec![-0.005]), None)?;
/// // The tension that bends it so far leads to the same displacement.
/// let again = forward.solve(Load::Tensions(bent.shape.state.tensions), None)?;
/// assert!((again.displacements[0] + 0.005).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Forward<'r> {
    robot: &'r Robot,
    plan: Plan,
    scene: Option<Scene>,
    first_fault: FirstFault,
}

impl<'r> Forward<'r> {
    /// Prepares a robot for a model, with the plan that the robot keeps.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn new(robot: &'r Robot, settings: ModelSettings) -> Result<Self, InvalidInput> {
        let plan = Plan::new(robot, settings)?;
        Ok(Self { robot, plan, scene: None, first_fault: FirstFault::default() })
    }

    /// Puts it among obstacles and under loads, where there are any.
    ///
    /// # Errors
    /// As [`ModelSettings::check_surroundings`] and [`Scene::new`].
    pub fn among(
        self,
        obstacles: &[Obstacle],
        loads: Option<&Loads>,
    ) -> Result<Self, InvalidInput> {
        let settings = self.plan.settings();
        settings.check_surroundings(obstacles, loads)?;
        let scene = match &self.plan {
            Plan::Rod(plan) if !obstacles.is_empty() || loads.is_some() => {
                let radius = plan.settings.body_radius;
                Some(Scene::new(self.robot, plan, obstacles, loads, radius)?)
            }
            _ => None,
        };
        Ok(Self { scene, ..self })
    }

    /// The same, whose solves end soon after the flag is set, with the status of an iteration limit.
    #[must_use]
    pub fn stopped_by(self, stop: &Arc<AtomicBool>) -> Self {
        Self { first_fault: FirstFault::raising(Arc::clone(stop)), ..self }
    }

    /// Scene around it, if there is anything.
    #[must_use]
    pub fn scene(&self) -> Option<&Scene> {
        self.scene.as_ref()
    }

    /// First fault of an obstacle's function, which ended all work, if one failed.
    #[must_use]
    pub fn take_fault(&self) -> Option<Fault> {
        self.first_fault.take()
    }

    /// Solves under a load, from rest or from an earlier shape.
    ///
    /// # Errors
    /// As [`solve_load`], and for settings out of range.
    pub fn solve(&self, load: Load, start: Option<&State>) -> Result<Solution, InvalidInput> {
        self.run(SolveLoad { load, start })
    }

    /// Solves rows of displacements on a pool; see [`crate::batch::solve_rows`].
    ///
    /// # Errors
    /// As there, and for warm rows of a model other than the rod.
    pub fn solve_rows(
        &self,
        rows: &Rows<'_>,
        pool: &ThreadPool,
        control: &Control,
    ) -> Result<Option<Solved>, InvalidInput> {
        self.plan.settings().check_warm(rows.warm)?;
        self.run(SolveRows { rows, pool, control })
    }

    /// One row of a warm batch, its chain solved up to there; see [`crate::batch::chained_shape`].
    ///
    /// # Errors
    /// As there.
    pub fn chained_shape(&self, displacements: &[f64], row: usize) -> Result<Shape, InvalidInput> {
        self.run(ChainedShape { displacements, row })
    }

    /// Velocity of the tool by displacements; see [`Model::jacobian`].
    ///
    /// # Errors
    /// As [`Model::jacobian`], and for displacements that do not fit the robot.
    pub fn jacobian(
        &self,
        displacements: &[f64],
        start: Option<&State>,
    ) -> Result<Result<Matrix6xX<f64>, Shape>, InvalidInput> {
        self.run(ToolJacobian { displacements, start })
    }

    /// Derivatives of the rod at an earlier shape, which leaves nothing to solve but factors and equations.
    ///
    /// # Errors
    /// `InvalidInput` for another model, and as [`Model::solve_from`].
    pub fn linearize(
        &self,
        shape: &State,
        displacements: &[f64],
    ) -> Result<Arc<Linearized>, InvalidInput> {
        let Plan::Rod(plan) = &self.plan else {
            return Err(rod_only("shape", self.plan.settings().model()));
        };
        let rod = Rod::new(self.robot, plan).stopped_by(Arc::clone(self.first_fault.stop()));
        let mut work = rod::Scratch::default();
        rod.solve_from(shape, displacements, &mut work)?;
        Ok(rod.sensitivity(displacements, &work).linearization())
    }

    /// Time that a hard solve takes, by the size of the robot \[µs\]: what decides if a caller waits or listens.
    #[must_use]
    pub fn estimated_microseconds(&self) -> f64 {
        match (&self.plan, &self.scene) {
            (Plan::Rod(plan), None) => HARD_ROD * plan.second_derivatives() as f64,
            (Plan::Rod(plan), Some(_)) => HARD_CONTACT * plan.second_derivatives() as f64,
            (Plan::Linkage(..) | Plan::ConstantCurvature(_), _) => 0.0,
        }
    }

    /// Hands the model in its surroundings to a task.
    fn run<T: Task>(&self, task: T) -> Result<T::Output, InvalidInput> {
        let robot = self.robot;
        match (&self.plan, &self.scene) {
            (Plan::Rod(plan), None) => {
                let stop = Arc::clone(self.first_fault.stop());
                task.run(&Rod::new(robot, plan).stopped_by(stop))
            }
            (Plan::Rod(plan), Some(scene)) => {
                let rod = LoadedRod::new(robot, plan, scene)?;
                task.run(&rod.reporting_to(&self.first_fault))
            }
            (Plan::Linkage(plan, settings), _) => task.run(&Linkage::new(robot, plan, *settings)?),
            (Plan::ConstantCurvature(plan), _) => task.run(&ConstantCurvature::new(robot, plan)),
        }
    }
}

impl Robot {
    /// Shape under tendon displacements \[m\], by the strain-energy rod with its default settings.
    ///
    /// # Errors
    /// `InvalidInput` for displacements that do not fit the robot.
    pub fn forward(&self, displacements: &[f64]) -> Result<Shape, InvalidInput> {
        let load = Load::Displacements(displacements.to_vec());
        Ok(Forward::new(self, ModelSettings::default())?.solve(load, None)?.shape)
    }
}
