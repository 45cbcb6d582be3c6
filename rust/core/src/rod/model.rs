//! The rod as a forward model: from displacements or tensions to results.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use nalgebra::{Matrix6xX, Vector3};

use super::degenerate_rest;
use super::dual_newton::{DualNewton, Ending};
use super::load_stepping::{Limits, LoadStepping};
use super::message::{Failure, message};
use super::newton_system::{NewtonSystem, Residual};
use super::plan::Plan;
use super::tendon_law::Equations;
use crate::error::InvalidInput;
use crate::lie::Pose;
use crate::model::{Model, Report, State};
use crate::robot::Robot;
use crate::status::Status;

/// Buffers of a solve.
///
/// ```
/// use tdcr::model::Model;
/// use tdcr::rod::{Plan, Rod, RodSettings, Scratch};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, RodSettings::default())?;
/// let rod = Rod::new(&robot, &plan);
/// // The same buffers for many solves.
/// let mut scratch = Scratch::default();
/// for pull in [0.001, 0.002, 0.003] {
///     let report = rod.solve(&[-pull, f64::INFINITY, f64::INFINITY], &mut scratch)?;
///     assert_eq!(report.status, tdcr::Status::Converged);
/// }
/// assert!(rod.state(&scratch).tensions[0] > 0.0);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    pub(super) state: State,
    pub(super) system: NewtonSystem,
    /// One subsegment, where displacements are proportional.
    pub(super) part: NewtonSystem,
    /// Tension of every piece, and the tendons that drive, where displacements are proportional.
    pub(super) piece_tensions: Vec<f64>,
    pub(super) drives: Vec<bool>,
    pub(super) dual_newton: DualNewton,
    pub(super) residual: Residual,
    pub(super) ending: Ending,
    load_stepping: LoadStepping,
}

/// The rod model of a robot, ready to solve.
///
/// ```
/// use tdcr::model::Model;
/// use tdcr::rod::{Plan, Rod, RodSettings};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, RodSettings::default())?;
/// // One tendon is pulled, the others are free.
/// let shape = Rod::new(&robot, &plan).shape(&[-0.005, f64::INFINITY, f64::INFINITY])?;
/// assert_eq!(shape.report.status, tdcr::Status::Converged);
/// assert!(shape.state.tensions.iter().all(|tension| *tension >= 0.0));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Rod<'r> {
    pub(super) robot: &'r Robot,
    pub(super) plan: &'r Plan,
    pub(super) stop: Option<Arc<AtomicBool>>,
}

/// Newton steps per load step, where tensions are given, and the shortest load step.
const NEWTON_STEPS: usize = 20;
const SHORTEST: f64 = 1e-4;

impl<'r> Rod<'r> {
    /// Solves with a plan that was made of this robot.
    #[must_use]
    pub fn new(robot: &'r Robot, plan: &'r Plan) -> Self {
        Self { robot, plan, stop: None }
    }

    /// Rod whose solves end soon after the flag is set, with the status of an iteration limit. It is
    /// looked at once per subsegment.
    #[must_use]
    pub fn stopped_by(self, stop: Arc<AtomicBool>) -> Self {
        Self { stop: Some(stop), ..self }
    }

    /// Hands the flag to the solve that begins.
    fn share_stop(&self, work: &mut Scratch) {
        work.system.stop.clone_from(&self.stop);
        work.part.stop.clone_from(&self.stop);
    }

    /// Length of every tendon at rest through this model's elements, which displacements count from \[m\].
    #[must_use]
    pub fn rest_lengths(&self) -> &[f64] {
        &self.plan.rest_lengths
    }

    /// Solves from the strains and tensions at hand to the displacements; returns the number of evaluations.
    fn solve_displacements(&self, displacements: &[f64], work: &mut Scratch) -> usize {
        let plan = self.plan;
        work.system.set_bounds(plan, displacements);
        self.share_stop(work);
        match plan.settings.tendons.equations() {
            Equations::PerTendon => {
                let mut budget = plan.settings.max_iterations;
                let Scratch { dual_newton, system, .. } = work;
                (work.ending, work.residual) =
                    degenerate_rest::solve(dual_newton, plan, system, &mut budget);
                plan.settings.max_iterations - budget
            }
            Equations::PerPiece => self.solve_pieces(displacements, work),
        }
    }

    /// The solved quantities, and how the solve ended.
    fn report(&self, work: &mut Scratch, evaluations: usize) -> Report {
        if work.ending != Ending::Converged && work.system.stops() {
            work.ending = Ending::Stopped;
        }
        let Scratch { state, system, .. } = work;
        write_state(state, self, &system.strains, &system.ends, &system.tensions);
        report(work.ending, work.residual.worst(), evaluations)
    }
}

/// Puts the strains and tensions of a state, in the plan's unit, in place of those at rest.
pub(super) fn read_state(
    start: &State,
    plan: &Plan,
    strains: &mut [f64],
    tensions: &mut [f64],
) -> Result<(), InvalidInput> {
    let elements = plan.data.len() * plan.settings.elements;
    if start.strains.len() != elements {
        let expected = format!("{elements} strains, one per element");
        return Err(InvalidInput::new("start", expected, start.strains.len()));
    }
    let width = plan.unknowns();
    for (e, (own, strain)) in strains.chunks_exact_mut(width).zip(&start.strains).enumerate() {
        own[..3].copy_from_slice(strain.as_slice());
        if let (4, Some(elongation)) = (width, start.elongations.get(e)) {
            own[3] = *elongation;
        }
    }
    for (own, tension) in tensions.iter_mut().zip(&start.tensions) {
        *own = if tension.is_finite() { tension.max(0.0) / plan.unit } else { 0.0 };
    }
    Ok(())
}

/// Disk frames and everything else that follows from strains, the frames of the subsegments' ends in their base
/// disks' and tensions.
pub(super) fn write_state(
    state: &mut State,
    rod: &Rod<'_>,
    strains: &[f64],
    ends: &[Pose],
    tensions: &[f64],
) {
    let plan = rod.plan;
    state.clear();
    let mut frame = *rod.robot.base();
    state.frames.push(frame);
    state.tendon_lengths.resize(plan.rest_lengths.len(), 0.0);
    let rows = strains.chunks_exact(plan.width());
    for (i, ((data, strains), end)) in plan.data.iter().zip(rows).zip(ends).enumerate() {
        frame = frame.compose(end);
        state.frames.push(frame);
        for strain in strains.chunks_exact(plan.unknowns()) {
            state.strains.push(Vector3::new(strain[0], strain[1], strain[2]));
            state.elongations.extend(strain.get(3));
            data.elasticity.add_energy(strain, &mut state.energy);
        }
        for piece in &plan.pieces[plan.starts[i]..plan.starts[i + 1]] {
            let length = (end.transform(&piece.to) - piece.from).norm();
            state.tendon_lengths[piece.tendon] += length;
        }
    }
    state.energy *= plan.unit;
    state.tensions.extend(tensions.iter().map(|t| t * plan.unit));
}

/// Report of so many evaluations, the last of which finds that there is no step to take.
pub(super) fn report(ending: Ending, residual: f64, evaluations: usize) -> Report {
    let status = match ending {
        Ending::Converged => Status::Converged,
        Ending::Lost => Status::Infeasible,
        Ending::Spent | Ending::Stopped => Status::IterationLimit,
        Ending::Broken => Status::NumericalError,
    };
    Report { status, residual, iterations: evaluations.saturating_sub(1) }
}

impl Model for Rod<'_> {
    const NAME: &'static str = "rod";

    type Scratch = Scratch;

    fn robot(&self) -> &Robot {
        self.robot
    }

    fn strain_width(&self) -> usize {
        self.plan.unknowns()
    }

    fn elements(&self) -> usize {
        self.plan.settings.elements
    }

    fn solve(&self, displacements: &[f64], work: &mut Scratch) -> Result<Report, InvalidInput> {
        work.system.reset(self.plan);
        let evaluations = self.solve_displacements(displacements, work);
        Ok(self.report(work, evaluations))
    }

    fn resume(&self, displacements: &[f64], work: &mut Scratch) -> Result<Report, InvalidInput> {
        let starts = work.system.tensions.len() == displacements.len();
        if starts && work.ending == Ending::Converged {
            let evaluations = self.solve_displacements(displacements, work);
            if work.ending == Ending::Converged {
                return Ok(self.report(work, evaluations));
            }
        }
        self.solve(displacements, work)
    }

    /// Solves for displacements from the strains and tensions of an earlier shape of this robot with as many
    /// elements; a start that does not help is dropped.
    ///
    /// # Errors
    /// `InvalidInput` for a start with another number of strains.
    fn solve_from(
        &self,
        start: &State,
        displacements: &[f64],
        work: &mut Scratch,
    ) -> Result<Report, InvalidInput> {
        work.system.reset(self.plan);
        let NewtonSystem { strains, tensions, .. } = &mut work.system;
        read_state(start, self.plan, strains, tensions)?;
        work.ending = Ending::Converged;
        self.resume(displacements, work)
    }

    /// Shape under given tensions, in the unit of the results: displacements follow from it. It is a minimum
    /// reachable from rest as the tensions grow together; infeasible beyond where that path ends.
    ///
    /// # Errors
    /// `InvalidInput` for another number of tensions, or one that is negative or not finite.
    fn solve_tensions(&self, tensions: &[f64], work: &mut Scratch) -> Result<Report, InvalidInput> {
        let expected = "sliding tendons where tensions are given";
        self.plan.settings.tendons.require_tensions("tendons", expected)?;
        self.plan.check_tensions(tensions)?;
        let mut budget = self.plan.settings.max_iterations;
        self.share_stop(work);
        let Scratch { system, load_stepping, .. } = work;
        system.reset(self.plan);
        system.clear_bounds(self.plan);
        system.active.clear();
        system.active.extend(tensions.iter().map(|tension| *tension > 0.0));
        let (target, unit) = (tensions.iter().copied(), self.plan.unit);
        let limits = Limits {
            newton_steps: NEWTON_STEPS,
            tolerance: self.plan.settings.tolerance,
            shortest_load_step: SHORTEST,
        };
        (work.ending, work.residual) =
            load_stepping.solve(self.plan, system, target, unit, &limits, &mut budget);
        Ok(self.report(work, self.plan.settings.max_iterations - budget))
    }

    /// Displacements under which a shape has the lengths and tensions that it has, `L − c T − L_rest` \[m\].
    fn displacements(&self, state: &State) -> Vec<f64> {
        let plan = self.plan;
        let rows = state.tendon_lengths.iter().zip(&state.tensions);
        let plans = plan.rest_lengths.iter().zip(&plan.compliance);
        let change = |((own, tension), (rest, compliance)): ((&f64, &f64), (&f64, &f64))| {
            own - compliance * tension / plan.unit - rest
        };
        rows.zip(plans).map(change).collect()
    }

    fn jacobian(
        &self,
        displacements: &[f64],
        start: Option<&State>,
        work: &mut Scratch,
    ) -> Result<Result<Matrix6xX<f64>, Report>, InvalidInput> {
        let report = match start {
            Some(start) => self.solve_from(start, displacements, work)?,
            None => self.solve(displacements, work)?,
        };
        if report.status != Status::Converged {
            return Ok(Err(report));
        }
        Ok(Ok(self.sensitivity(displacements, work).jacobian(self.robot.tool())))
    }

    fn state<'w>(&self, work: &'w Scratch) -> &'w State {
        &work.state
    }

    fn take_state(&self, work: Scratch) -> State {
        work.state
    }

    fn message(&self, displacements: &[f64], work: &Scratch) -> String {
        let tendon_names = self.robot.tendon_names();
        let Scratch { ending, state, .. } = work;
        message(&Failure { plan: self.plan, tendon_names, ending: *ending, state }, displacements)
    }
}
