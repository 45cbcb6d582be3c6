//! The rod among obstacles and under loads as a forward model.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::augmented_lagrangian::{Descent, Left};
use super::continuation::{Checkpoint, REACH, TendonTarget};
use super::lagrangian::MultiplierEstimate;
use super::scene::{Point, Scene};
use crate::error::InvalidInput;
use crate::lie::Pose;
use crate::model::Contact;
use crate::model::{Model, Report, State};
use crate::obstacle::{Fault, FirstFault, Near};
use crate::robot::Robot;
use crate::rod::dual_newton::Ending;
use crate::rod::model::{Rod, read_state, report, write_state};
use crate::rod::newton_system::NewtonSystem;
use crate::rod::plan::Plan;
use crate::status::Status;

/// Contacts are listed up to this gap, in shares of the robot's length.
const TOUCH: f64 = 1e-9;
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
    pub(in crate::rod) state: State,
    pub(in crate::rod) descent: Descent,
    /// For the compliance of the tendons at rest.
    pub(in crate::rod) chain: NewtonSystem,
    /// The last solve, or the last load that was reached.
    pub(in crate::rod) kept: Checkpoint,
    pub(in crate::rod) left: Left,
    pub(in crate::rod) ending: Ending,
    /// Share of the load that was reached.
    pub(in crate::rod) load: f64,
    /// Saddles left on the way.
    pub(in crate::rod) nudged: usize,
    /// How deep the undeformed robot is in an obstacle, which, and at which disk.
    pub(in crate::rod) sunk: Option<(f64, usize, usize)>,
    pub(in crate::rod) fault: Option<Fault>,
}

impl Scratch {
    /// What a function of an obstacle ended the last solve with, if it did.
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
    pub(in crate::rod) shortest: f64,
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

    /// The same, whose solves end soon after the flag is set, with the status of an iteration limit.
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

    /// Makes the contact forces of an earlier shape the estimates, where the scene still has what they name.
    pub(in crate::rod) fn recall(&self, start: &State, work: &mut Scratch) {
        let (plan, base) = (self.plan(), self.rod.robot.base());
        let reach = REACH * self.shortest;
        let mut near = Vec::new();
        for contact in start.contacts.iter().filter(|c| c.disk < self.scene.points.len()) {
            let same = |p: &Point| (p.kind, p.tendon) == (contact.kind, contact.tendon);
            let points = &self.scene.points[contact.disk];
            let (Some(p), Some(obstacle)) =
                (points.iter().position(same), self.scene.obstacles.get(contact.obstacle))
            else {
                continue;
            };
            let at = base.inverse().transform(&contact.point);
            let normal = base.rotation.tr_mul(&contact.normal);
            near.clear();
            // A fault comes again, and is told, where the shape is evaluated.
            if obstacle.constraints(&at, reach + points[p].radius, &mut near).is_err() {
                return;
            }
            let along = |part: &Near| part.gradient.dot(&normal);
            let Some(part) = near.iter().max_by(|a, b| along(a).total_cmp(&along(b))) else {
                continue;
            };
            let key = (contact.disk, p, contact.obstacle, part.feature);
            let force = contact.force.norm() / plan.unit;
            work.descent.estimates.forces.push(MultiplierEstimate::new(key, force, &at, part));
        }
        work.descent.estimates.forces.sort_by_key(|held| held.key);
    }

    /// How deep the undeformed robot is in the obstacles.
    pub(in crate::rod) fn sink(&self, work: &mut Scratch) -> Result<(), Fault> {
        work.sunk = None;
        let mut frame = Pose::identity();
        let plan = self.plan();
        for (disk, points) in self.scene.points.iter().enumerate() {
            if disk > 0 {
                frame = frame.compose(&work.chain.ends[disk - 1]);
            }
            for point in points {
                for (o, obstacle) in self.scene.obstacles.iter().enumerate() {
                    let near = obstacle.nearest(&frame.transform(&point.at))?;
                    let depth = point.radius - near.distance;
                    let least = work.sunk.map_or(TOUCH * plan.total_length(), |(d, _, _)| d);
                    if depth > least {
                        work.sunk = Some((depth, o, disk));
                    }
                }
            }
        }
        Ok(())
    }

    fn finish(&self, work: &mut Scratch, evaluations: usize) -> Report {
        self.written(work);
        report(work.ending, work.left.worst(), evaluations)
    }

    /// The shape at hand, written out.
    pub(in crate::rod) fn written<'w>(&self, work: &'w mut Scratch) -> &'w State {
        let plan = self.plan();
        let base = self.rod.robot.base();
        let Scratch { state, descent, .. } = work;
        let here = &descent.here;
        write_state(state, &self.rod, &here.strains, &here.ends, &here.tensions);
        let touch = TOUCH * plan.total_length();
        for entry in here.entries.iter().filter(|e| e.force > 0.0 || e.gap <= touch) {
            let (disk, p, obstacle, _) = entry.key;
            let point = &self.scene.points[disk][p];
            let normal = base.rotation * entry.near.gradient;
            state.contacts.push(Contact {
                disk,
                kind: point.kind,
                tendon: point.tendon,
                obstacle,
                point: base.transform(&entry.at),
                normal,
                gap: entry.gap,
                force: normal * (entry.force * plan.unit),
            });
        }
        &work.state
    }

    pub(in crate::rod) fn scene(&self) -> &'r Scene {
        self.scene
    }

    /// Greatest lengths of the tendons under displacements.
    fn lengths(&self, displacements: &[f64]) -> TendonTarget {
        let rest = &self.plan().rest_lengths;
        TendonTarget::Lengths(rest.iter().zip(displacements).map(|(l, d)| l + d).collect())
    }

    /// What stands in the way of a shape without tensions; empty when nothing does.
    pub(crate) fn hindrance(&self) -> String {
        let mut work = Scratch::default();
        let none = TendonTarget::Tensions(vec![0.0; self.plan().rest_lengths.len()]);
        self.rise(&none, &mut work, self.rod.stop.as_deref());
        self.message(&[], &work)
    }

    /// [`Model::solve`] that ends soon after another flag is set.
    pub(crate) fn lead(
        &self,
        displacements: &[f64],
        work: &mut Scratch,
        stop: Option<&AtomicBool>,
    ) -> Report {
        let report = self.rise(&self.lengths(displacements), work, stop);
        self.report_fault(work);
        report
    }

    fn rise(&self, wanted: &TendonTarget, work: &mut Scratch, stop: Option<&AtomicBool>) -> Report {
        self.run(work, |work, budget| {
            self.begin(work);
            self.sink(work)?;
            self.climb(wanted, None, work, budget, stop)
        })
    }

    fn run(
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
            work.left.moment = f64::NAN;
        }
        self.finish(work, most - budget)
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
        Ok(self.lead(displacements, work, self.rod.stop.as_deref()))
    }

    fn resume(&self, displacements: &[f64], work: &mut Scratch) -> Result<Report, InvalidInput> {
        let Some(from @ TendonTarget::Lengths(_)) = work.kept.given.clone() else {
            return self.solve(displacements, work);
        };
        if work.ending != Ending::Converged {
            return self.solve(displacements, work);
        }
        let wanted = self.lengths(displacements);
        let report = self.run(work, |work, budget| {
            self.climb(&wanted, Some(&from), work, budget, self.rod.stop.as_deref())
        });
        let over = work.fault.is_some() || work.ending == Ending::Stopped;
        self.report_fault(work);
        if report.status == Status::Converged || over {
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
        self.begin(work);
        let Descent { here, estimates, .. } = &mut work.descent;
        read_state(start, plan, &mut here.strains, &mut estimates.tensions)?;
        let own = estimates.tensions.iter().zip(&plan.compliance);
        let from = start.tendon_lengths.iter().zip(own).map(|(l, (t, give))| l - t * give);
        work.kept.given = Some(TendonTarget::Lengths(from.collect()));
        // A fault comes again, and is told, where the shape is evaluated.
        if self.sink(work).is_err() {
            work.sunk = None;
        }
        work.ending = Ending::Converged;
        self.recall(start, work);
        self.resume(displacements, work)
    }

    /// The shape under given tensions, in the unit of the results: displacements are then what it has
    /// ([`Self::displacements`]). Tensions, loads and contacts grow together from rest.
    ///
    /// # Errors
    /// `InvalidInput` for another number of tensions, or one that is negative or not finite.
    fn solve_tensions(&self, tensions: &[f64], work: &mut Scratch) -> Result<Report, InvalidInput> {
        self.plan().check_tensions(tensions)?;
        let tensions = tensions.iter().map(|tension| tension / self.plan().unit).collect();
        let report = self.rise(&TendonTarget::Tensions(tensions), work, self.rod.stop.as_deref());
        self.report_fault(work);
        Ok(report)
    }

    /// Displacements under which a shape has the lengths and tensions that it has; see [`Rod::displacements`].
    fn displacements(&self, state: &State) -> Vec<f64> {
        self.rod.displacements(state)
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
                _ if work.left.locked => "tensions or contact forces grow without bound",
                _ => "no stable shape follows",
            };
            let load = 1e2 * work.load;
            parts.push(format!("{end} after {load:.1} % of the displacements and loads"));
        }
        if work.ending == Ending::Converged && work.nudged > 0 {
            let times = work.nudged;
            parts.push(format!("unstable on the way {times} times: left where it bends easiest"));
        }
        if let Some((depth, obstacle, disk)) = work.sunk {
            parts.push(format!(
                "the undeformed robot is {depth:.3e} m deep in obstacles[{obstacle}] at disk {disk}"
            ));
        }
        parts.join("; ")
    }
}
