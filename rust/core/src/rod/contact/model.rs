//! The rod among obstacles and under loads as a forward model.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::descent::{Descent, Left, Surroundings};
use super::merit::Held;
use super::scene::{Point, Scene};
use crate::error::InvalidInput;
use crate::lie::Pose;
use crate::model::{Model, Report, State};
use crate::obstacle::{Fault, Near};
use crate::robot::Robot;
use crate::rod::ascent::Ending;
use crate::rod::chain::Chain;
use crate::rod::model::{Rod, read_state, told, write_state};
use crate::rod::plan::Plan;
use crate::rod::settings::TendonRule;
use crate::shape::Contact;
use crate::status::Status;

/// Share of the load that is taken first among obstacles, the least, and steps that make the next one longer.
const FIRST: f64 = 0.25;
const SHORTEST: f64 = 1e-3;
const EASY: usize = 10;
/// Evaluations that one load step may take.
const PATIENCE: usize = 200;
/// Parts of obstacles within this share of a subsegment are looked at, and points may slip by this share of
/// one in one step.
const REACH: f64 = 0.5;
const SLIP: f64 = 0.25;
/// Contacts are listed up to this gap, in shares of the robot's length.
const TOUCH: f64 = 1e-9;
/// Compliance of a contact, as a share of what the rod gives there, and the least of tendons, as one of that at the tip.
const GIVE: f64 = 0.1;
const LEAST: f64 = 0.04;

/// Buffers of a solve.
#[derive(Debug, Default)]
pub struct Workspace {
    state: State,
    descent: Descent,
    /// For the compliance of the tendons at rest.
    chain: Chain,
    /// Strains and bounds of the last solve, or at the last load that was reached.
    kept: Kept,
    left: Left,
    ending: Ending,
    /// Share of the load that was reached.
    load: f64,
    /// Saddles left on the way.
    nudged: usize,
    /// How deep the undeformed robot is in an obstacle, which, and at which disk.
    sunk: Option<(f64, usize, usize)>,
    fault: Option<Fault>,
}

#[derive(Debug, Default)]
struct Kept {
    strains: Vec<f64>,
    tensions: Vec<f64>,
    forces: Vec<Held>,
    bounds: Vec<f64>,
}

impl Workspace {
    /// What a function of an obstacle ended the last solve with, if it did.
    pub fn take_fault(&mut self) -> Option<Fault> {
        self.fault.take()
    }
}

/// A rod in its surroundings, ready to solve.
#[derive(Clone, Debug)]
pub struct LoadedRod<'r> {
    rod: Rod<'r>,
    scene: &'r Scene,
}

impl<'r> LoadedRod<'r> {
    /// Solves with a plan and a scene that were made of this robot.
    ///
    /// # Errors
    /// `InvalidInput` for proportional tendons, which leave contacts no freedom.
    pub fn new(robot: &'r Robot, plan: &'r Plan, scene: &'r Scene) -> Result<Self, InvalidInput> {
        if plan.settings.tendons == TendonRule::Proportional {
            let expected = "\"sliding\" among obstacles or under loads";
            return Err(InvalidInput::new("tendons", expected, "\"proportional\""));
        }
        Ok(Self { rod: Rod::new(robot, plan), scene })
    }

    /// The same, whose solves end soon after the flag is set, with the status of an iteration limit.
    #[must_use]
    pub fn stopped_by(self, stop: Arc<AtomicBool>) -> Self {
        Self { rod: self.rod.stopped_by(stop), ..self }
    }

    fn plan(&self) -> &'r Plan {
        self.rod.plan
    }

    /// Solves for displacements from the strains and tensions of an earlier shape of this robot with as many
    /// elements, under the whole loads from the first step on; a start that does not help is dropped.
    ///
    /// # Errors
    /// `InvalidInput` for a start with another number of strains.
    pub fn solve_from(
        &self,
        start: &State,
        displacements: &[f64],
        work: &mut Workspace,
    ) -> Result<Report, InvalidInput> {
        let plan = self.plan();
        self.begin(displacements, work);
        let Descent { here, estimates, .. } = &mut work.descent;
        read_state(start, plan, &mut here.strains, &mut estimates.tensions)?;
        let own = estimates.tensions.iter().zip(&plan.compliance);
        let from = start.tendon_lengths.iter().zip(own).map(|(l, (t, give))| l - t * give);
        work.kept.bounds.clear();
        work.kept.bounds.extend(from);
        // A fault comes again, and is told, where the shape is evaluated.
        if self.sink(work).is_err() {
            work.sunk = None;
        }
        work.ending = Ending::Converged;
        self.recall(start, work);
        self.resume(displacements, work)
    }

    /// Makes the contact forces of an earlier shape the estimates, where the scene still has what they name.
    fn recall(&self, start: &State, work: &mut Workspace) {
        let (plan, base) = (self.plan(), self.rod.robot.base());
        let reach = REACH * self.shortest();
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
            work.descent.estimates.forces.push(Held::new(key, force, &at, part));
        }
        work.descent.estimates.forces.sort_by_key(|held| held.key);
    }

    /// Length of the shortest subsegment \[m\].
    fn shortest(&self) -> f64 {
        let plan = self.plan();
        (0..plan.data.len()).map(|i| plan.length(i)).fold(f64::INFINITY, f64::min)
    }

    /// Puts the rest shape without multipliers, and compliances that are small against the rod's.
    fn begin(&self, displacements: &[f64], work: &mut Workspace) {
        let plan = self.plan();
        let chain = &mut work.chain;
        chain.rest(plan);
        chain.bound(plan, displacements);
        chain.give = 0.0;
        chain.assemble(plan, f64::INFINITY);
        work.descent.here.strains.clone_from(&chain.strains);
        self.stiffen(displacements, work);
        let estimates = &mut work.descent.estimates;
        estimates.tensions.clear();
        estimates.tensions.resize(displacements.len(), 0.0);
        estimates.forces.clear();
    }

    fn stiffen(&self, displacements: &[f64], work: &mut Workspace) {
        let (plan, count) = (self.plan(), displacements.len());
        let estimates = &mut work.descent.estimates;
        contact_gives(plan, &mut estimates.gives);
        let least = LEAST * estimates.gives.last().copied().unwrap_or_default();
        estimates.stiffness = 1.0;
        estimates.tendon_give.clear();
        let own = (0..count).map(|k| work.chain.schur[k * (count + 1)].max(least));
        estimates.tendon_give.extend(own);
    }

    /// From the shape in the descent, with a share of the load there, to the whole.
    fn climb(
        &self,
        displacements: &[f64],
        from: &[f64],
        work: &mut Workspace,
        budget: &mut usize,
    ) -> Result<(), Fault> {
        let plan = self.plan();
        let wanted: Vec<f64> =
            plan.rest_lengths.iter().zip(displacements).map(|(l, d)| l + d).collect();
        let cold = from.is_empty();
        let shortest = self.shortest();
        let mut stride = if self.scene.obstacles.is_empty() || !cold { 1.0 } else { FIRST };
        (work.load, work.nudged) = (0.0, 0);
        keep(&mut work.kept, &work.descent);
        while work.load < 1.0 {
            let next = (work.load + stride).min(1.0);
            let start = |k: usize| if cold { plan.rest_lengths[k] } else { from[k] };
            let bounds: Vec<f64> = (0..wanted.len())
                .map(|k| {
                    let start = if start(k).is_finite() { start(k) } else { wanted[k] };
                    // Tendons are let out before others are pulled.
                    if wanted[k] < start { start + next * (wanted[k] - start) } else { wanted[k] }
                })
                .collect();
            let around = Surroundings {
                plan,
                scene: self.scene,
                share: if cold { next } else { 1.0 },
                bounds: &bounds,
                reach: REACH * shortest,
                slip: SLIP * shortest,
                sides: work.sunk.is_none(),
                stop: self.rod.stop.as_deref(),
            };
            let mut patience = PATIENCE.min(*budget);
            *budget -= patience;
            let before = patience;
            let (ending, left) = work.descent.go(&around, &mut patience)?;
            *budget += patience;
            work.left = left;
            if ending == Ending::Stopped {
                work.ending = ending;
                return Ok(());
            }
            if ending == Ending::Converged {
                work.load = next;
                work.nudged += left.nudged;
                stride *= if before - patience <= EASY { 2.0 } else { 1.0 };
                keep(&mut work.kept, &work.descent);
                work.kept.bounds = bounds;
                self.stiffen(displacements, work);
                continue;
            }
            work.descent.here.strains.clone_from(&work.kept.strains);
            work.descent.estimates.tensions.clone_from(&work.kept.tensions);
            work.descent.estimates.forces.clone_from(&work.kept.forces);
            self.stiffen(displacements, work);
            stride *= 0.25;
            if stride < SHORTEST || *budget == 0 {
                work.ending = if *budget == 0 && !left.locked { Ending::Spent } else { ending };
                let mut once = 1;
                let (_, here) = work.descent.go(&around, &mut once)?;
                work.left = Left { locked: left.locked, ..here };
                return Ok(());
            }
        }
        work.ending = Ending::Converged;
        Ok(())
    }

    /// How deep the undeformed robot is in the obstacles.
    fn sink(&self, work: &mut Workspace) -> Result<(), Fault> {
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

    fn finish(&self, work: &mut Workspace, evaluations: usize) -> Report {
        let plan = self.plan();
        let base = self.rod.robot.base();
        let Workspace { state, descent, .. } = work;
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
        told(work.ending, work.left.worst(), evaluations)
    }

    fn run(
        &self,
        work: &mut Workspace,
        solve: impl FnOnce(&mut Workspace, &mut usize) -> Result<(), Fault>,
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

fn keep(kept: &mut Kept, descent: &Descent) {
    kept.strains.clone_from(&descent.here.strains);
    kept.tensions.clone_from(&descent.estimates.tensions);
    kept.forces.clone_from(&descent.estimates.forces);
}

impl Model for LoadedRod<'_> {
    type Workspace = Workspace;

    fn robot(&self) -> &Robot {
        self.rod.robot
    }

    fn strain_width(&self) -> usize {
        self.plan().unknowns()
    }

    fn elements(&self) -> usize {
        self.plan().settings.elements
    }

    fn solve(&self, displacements: &[f64], work: &mut Workspace) -> Result<Report, InvalidInput> {
        Ok(self.run(work, |work, budget| {
            self.begin(displacements, work);
            self.sink(work)?;
            self.climb(displacements, &[], work, budget)
        }))
    }

    fn resume(&self, displacements: &[f64], work: &mut Workspace) -> Result<Report, InvalidInput> {
        if work.ending != Ending::Converged || work.kept.bounds.len() != displacements.len() {
            return self.solve(displacements, work);
        }
        let from = work.kept.bounds.clone();
        let report = self.run(work, |work, budget| self.climb(displacements, &from, work, budget));
        let over = work.fault.is_some() || work.ending == Ending::Stopped;
        if report.status == Status::Converged || over {
            return Ok(report);
        }
        self.solve(displacements, work)
    }

    fn state<'w>(&self, work: &'w Workspace) -> &'w State {
        &work.state
    }

    fn take_state(&self, work: Workspace) -> State {
        work.state
    }

    fn message(&self, _: &[f64], work: &Workspace) -> String {
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

/// Compliances of contacts: shares of how far the rod gives way to a force across it at each disk.
fn contact_gives(plan: &Plan, out: &mut Vec<f64>) {
    out.clear();
    // Sums of 1, s and s² over the stiffness, s the place of a subsegment.
    let (mut s, mut sums) = (0.0, [0.0; 3]);
    for i in 0..=plan.data.len() {
        out.push(GIVE * (s * s * sums[0] - 2.0 * s * sums[1] + sums[2]));
        if let Some(data) = plan.data.get(i) {
            let (l, bends) = (plan.length(i), plan.settings.elements as f64 / data.stiffness[0]);
            let middle = s + 0.5 * l;
            for (sum, power) in sums.iter_mut().zip([1.0, middle, middle * middle]) {
                *sum += power * bends;
            }
            s += l;
        }
    }
}
