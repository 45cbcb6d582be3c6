//! The rod among obstacles and under loads as a forward model.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::augmented_lagrangian::{Minimizer, Residuals};
use super::load_state::{Checkpoint, TendonTarget};
use super::scene::Scene;
use crate::error::InvalidInput;
use crate::model::Contact;
use crate::model::{Model, Report, State};
use crate::obstacle::{Fault, FirstFault};
use crate::robot::Robot;
use crate::rod::dual_newton::Ending;
use crate::rod::model::{Rod, read_state, report, write_state};
use crate::rod::newton_system::NewtonSystem;
use crate::rod::plan::Plan;
use crate::status::Status;

/// Contacts are listed up to this gap, in shares of the robot's length.
pub(super) const TOUCHING: f64 = 1e-9;
/// Distance up to which parts of obstacles count, as a share of a subsegment.
const DETECTION: f64 = 0.5;

/// Buffers of a solve.
///
/// ```
/// use tdcr::rod::contact::Scratch;
/// # use nalgebra::Vector3;
/// # use tdcr::model::Model;
/// # use tdcr::obstacle::{HalfSpace, Obstacle};
/// # use tdcr::rod::contact::{LoadedRod, Scene};
/// # use tdcr::rod::{Plan, RodSettings};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, RodSettings::default())?;
/// // A wall 30 mm beside the robot.
/// let wall = HalfSpace::new(&Vector3::new(0.03, 0.0, 0.0), &-Vector3::x())?;
/// let scene = Scene::new(&robot, &plan, &[Obstacle::new(wall, false)], None, 0.0)?;
/// let rod = LoadedRod::new(&robot, &plan, &scene)?;
/// let mut scratch = Scratch::default();
/// rod.solve(&[-0.002, f64::INFINITY, f64::INFINITY], &mut scratch)?;
/// // No obstacle's function failed.
/// assert!(scratch.take_fault().is_none());
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Default)]
pub struct Scratch {
    state: State,
    pub(in crate::rod) minimizer: Minimizer,
    /// For the compliance of the tendons at rest.
    pub(super) chain: NewtonSystem,
    /// The last solve, or the last load that was reached.
    pub(in crate::rod) checkpoint: Checkpoint,
    pub(super) residuals: Residuals,
    pub(in crate::rod) ending: Ending,
    /// Share of the load that was reached.
    pub(super) load: f64,
    /// Saddles left on the way.
    pub(super) saddles_left: usize,
    /// Depth of the undeformed robot in an obstacle, which, and at which disk.
    pub(super) initial_penetration: Option<(f64, usize, usize)>,
    pub(in crate::rod) fault: Option<Fault>,
}

impl Scratch {
    /// Takes out the fault of an obstacle's function that ended the last solve, if one did.
    pub fn take_fault(&mut self) -> Option<Fault> {
        self.fault.take()
    }
}

/// A rod in its surroundings, ready to solve.
///
/// ```
/// # use nalgebra::Vector3;
/// # use tdcr::model::Model;
/// # use tdcr::obstacle::{HalfSpace, Obstacle};
/// # use tdcr::rod::contact::{LoadedRod, Scene};
/// # use tdcr::rod::{Plan, RodSettings};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, RodSettings::default())?;
/// // A wall 30 mm beside the robot.
/// let wall = HalfSpace::new(&Vector3::new(0.03, 0.0, 0.0), &-Vector3::x())?;
/// let scene = Scene::new(&robot, &plan, &[Obstacle::new(wall, false)], None, 0.0)?;
/// let rod = LoadedRod::new(&robot, &plan, &scene)?;
/// let shape = rod.shape(&[-0.01, f64::INFINITY, f64::INFINITY])?;
/// assert_eq!(shape.report.status, tdcr::Status::Converged);
/// // It leans on the wall.
/// assert!(shape.state.contacts.iter().any(|contact| contact.force.x < 0.0));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct LoadedRod<'r> {
    rod: Rod<'r>,
    scene: &'r Scene,
    /// Length of the shortest subsegment \[m\].
    pub(super) shortest: f64,
    first_fault: Option<FirstFault>,
}

impl<'r> LoadedRod<'r> {
    /// Solves with a plan and a scene that were made of this robot.
    ///
    /// # Errors
    /// `InvalidInput` for proportional tendons, which leave contacts no freedom.
    pub fn new(robot: &'r Robot, plan: &'r Plan, scene: &'r Scene) -> Result<Self, InvalidInput> {
        let expected = "\"sliding\" among obstacles or under loads";
        plan.settings.tendons.require_tensions("tendons", expected)?;
        let lengths = (0..plan.data.len()).map(|i| plan.length(i));
        let shortest = lengths.fold(f64::INFINITY, f64::min);
        Ok(Self { rod: Rod::new(robot, plan), scene, shortest, first_fault: None })
    }

    /// Rod whose solves end soon after the flag is set, with the status of an iteration limit.
    #[must_use]
    pub fn stopped_by(self, stop: Arc<AtomicBool>) -> Self {
        Self { rod: self.rod.stopped_by(stop), ..self }
    }

    /// Rod whose faults go to a cell, rather than stay in the buffers, and whose solves end soon after the cell's
    /// flag is set.
    #[must_use]
    pub fn reporting_to(self, first_fault: &FirstFault) -> Self {
        let rod = self.rod.stopped_by(Arc::clone(first_fault.stop()));
        Self { rod, first_fault: Some(first_fault.clone()), ..self }
    }

    /// Moves the fault of a solve to the cell that collects faults, if there is one.
    pub(in crate::rod) fn report_fault(&self, work: &mut Scratch) {
        if let Some(first_fault) = &self.first_fault
            && let Some(fault) = work.fault.take()
        {
            first_fault.keep(fault);
        }
    }

    pub(in crate::rod) fn plan(&self) -> &'r Plan {
        self.rod.plan
    }

    pub(in crate::rod) fn scene(&self) -> &'r Scene {
        self.scene
    }

    /// Distance up to which parts of obstacles count \[m\].
    pub(super) fn detection_distance(&self) -> f64 {
        DETECTION * self.shortest
    }

    /// Solves as [`Model::solve`], but ends soon after another flag is set.
    pub(crate) fn solve_until(
        &self,
        displacements: &[f64],
        work: &mut Scratch,
        stop: Option<&AtomicBool>,
    ) -> Report {
        let report = self.solve_from_rest(&self.length_bounds(displacements), work, stop);
        self.report_fault(work);
        report
    }

    /// Message of a solve without tensions: what stands in the way of any shape; empty when nothing does.
    pub(crate) fn slack_message(&self) -> String {
        let mut work = Scratch::default();
        let none = TendonTarget::Tensions(vec![0.0; self.plan().rest_lengths.len()]);
        self.solve_from_rest(&none, &mut work, self.rod.stop.as_deref());
        self.message(&[], &work)
    }

    /// Greatest lengths of the tendons under displacements.
    fn length_bounds(&self, displacements: &[f64]) -> TendonTarget {
        let rest = &self.plan().rest_lengths;
        TendonTarget::Lengths(rest.iter().zip(displacements).map(|(l, d)| l + d).collect())
    }

    fn solve_from_rest(
        &self,
        wanted: &TendonTarget,
        work: &mut Scratch,
        stop: Option<&AtomicBool>,
    ) -> Report {
        self.solve_in_budget(work, |work, budget| {
            self.set_rest(work);
            self.measure_penetration(work)?;
            self.step_load(wanted, None, work, budget, stop)
        })
    }

    /// Solves in at most as many Newton steps as the settings allow, and writes the shape.
    fn solve_in_budget(
        &self,
        work: &mut Scratch,
        solve: impl FnOnce(&mut Scratch, &mut usize) -> Result<(), Fault>,
    ) -> Report {
        let most = self.plan().settings.max_iterations;
        let mut budget = most;
        work.fault = None;
        if let Err(fault) = solve(work, &mut budget) {
            work.fault = Some(fault);
            work.ending = Ending::Broken;
            work.residuals.moment = f64::NAN;
        }
        self.write_shape(work);
        report(work.ending, work.residuals.largest(), most - budget)
    }

    /// Writes the shape at hand, in the world.
    pub(in crate::rod) fn write_shape<'w>(&self, work: &'w mut Scratch) -> &'w State {
        let plan = self.plan();
        let base = self.rod.robot.base();
        let Scratch { state, minimizer, .. } = work;
        let current = &minimizer.current;
        write_state(state, &self.rod, &current.strains, &current.ends, &current.tensions);
        let touching = TOUCHING * plan.total_length();
        for own in current.constraints.iter().filter(|own| own.force > 0.0 || own.gap <= touching) {
            let (disk, p, obstacle, _) = own.key;
            let point = &self.scene.points[disk][p];
            let normal = base.rotation * own.near.gradient;
            state.contacts.push(Contact {
                disk,
                kind: point.kind,
                tendon: point.tendon,
                obstacle,
                point: base.transform(&own.position),
                normal,
                gap: own.gap,
                force: normal * (own.force * plan.unit),
            });
        }
        &work.state
    }
}

impl Model for LoadedRod<'_> {
    const NAME: &'static str = Rod::NAME;

    type Scratch = Scratch;

    fn robot(&self) -> &Robot {
        self.rod.robot
    }

    fn strain_width(&self) -> usize {
        self.plan().unknowns()
    }

    fn elements(&self) -> usize {
        self.plan().settings.elements
    }

    fn solve(&self, displacements: &[f64], work: &mut Scratch) -> Result<Report, InvalidInput> {
        Ok(self.solve_until(displacements, work, self.rod.stop.as_deref()))
    }

    fn resume(&self, displacements: &[f64], work: &mut Scratch) -> Result<Report, InvalidInput> {
        let Some(from @ TendonTarget::Lengths(_)) = work.checkpoint.target.clone() else {
            return self.solve(displacements, work);
        };
        if work.ending != Ending::Converged {
            return self.solve(displacements, work);
        }
        let wanted = self.length_bounds(displacements);
        let report = self.solve_in_budget(work, |work, budget| {
            self.step_load(&wanted, Some(&from), work, budget, self.rod.stop.as_deref())
        });
        let is_final = work.fault.is_some() || work.ending == Ending::Stopped;
        self.report_fault(work);
        if report.status == Status::Converged || is_final {
            return Ok(report);
        }
        self.solve(displacements, work)
    }

    /// Solves for displacements from the strains and tensions of an earlier shape of this robot with as many
    /// elements, under the whole loads from the first step on; a start that does not help is dropped.
    ///
    /// # Errors
    /// `InvalidInput` for a start with another number of strains.
    fn solve_from(
        &self,
        start: &State,
        displacements: &[f64],
        work: &mut Scratch,
    ) -> Result<Report, InvalidInput> {
        let plan = self.plan();
        self.set_rest(work);
        let Minimizer { current, estimates, .. } = &mut work.minimizer;
        read_state(start, plan, &mut current.strains, &mut estimates.tensions)?;
        let own = estimates.tensions.iter().zip(&plan.compliance);
        let from = start.tendon_lengths.iter().zip(own).map(|(l, (t, c))| l - t * c);
        work.checkpoint.target = Some(TendonTarget::Lengths(from.collect()));
        // A fault comes again, and is reported, where the shape is evaluated.
        if self.measure_penetration(work).is_err() {
            work.initial_penetration = None;
        }
        work.ending = Ending::Converged;
        self.recall_contacts(start, work);
        self.resume(displacements, work)
    }

    /// Displacements under which a shape has the lengths and tensions that it has; see [`Rod::displacements`].
    fn displacements(&self, state: &State) -> Vec<f64> {
        self.rod.displacements(state)
    }

    /// Solves for tensions, in the unit of the results: displacements are then those of the shape
    /// ([`Self::displacements`]). Tensions, loads and contacts grow together from rest.
    ///
    /// # Errors
    /// `InvalidInput` for another number of tensions, or one that is negative or not finite.
    fn solve_tensions(&self, tensions: &[f64], work: &mut Scratch) -> Result<Report, InvalidInput> {
        self.plan().check_tensions(tensions)?;
        let tensions = tensions.iter().map(|tension| tension / self.plan().unit).collect();
        let target = TendonTarget::Tensions(tensions);
        let report = self.solve_from_rest(&target, work, self.rod.stop.as_deref());
        self.report_fault(work);
        Ok(report)
    }

    fn state<'w>(&self, work: &'w Scratch) -> &'w State {
        &work.state
    }

    fn take_state(&self, work: Scratch) -> State {
        work.state
    }

    fn message(&self, _: &[f64], work: &Scratch) -> String {
        if let Some(fault) = &work.fault {
            return format!("an obstacle's function failed: {fault}");
        }
        let mut parts = Vec::new();
        if work.ending != Ending::Converged {
            let end = match work.ending {
                Ending::Spent => "max_iterations did not suffice",
                Ending::Stopped => "stopped",
                Ending::Broken => "the arithmetic broke down",
                _ if work.residuals.locked => "tensions or contact forces grow without bound",
                _ => "no stable shape follows",
            };
            let load = 1e2 * work.load;
            parts.push(format!("{end} after {load:.1} % of the displacements and loads"));
        }
        if work.ending == Ending::Converged && work.saddles_left > 0 {
            let times = work.saddles_left;
            parts.push(format!("unstable on the way {times} times: left where it bends easiest"));
        }
        if let Some((depth, obstacle, disk)) = work.initial_penetration {
            parts.push(format!(
                "the undeformed robot is {depth:.3e} m deep in obstacles[{obstacle}] at disk {disk}"
            ));
        }
        parts.join("; ")
    }
}
