//! Evaluation of routings by pulling them from rest: the nearest of those that follow.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::continuous_holes::{Freedom, Point, Pulls};
use super::hole_search::HoleSearch;
use super::task::{Holes, PerHole, Task};
use crate::error::InvalidInput;
use crate::model::Model;
use crate::model::Shape;
use crate::rod::{Plan, Rod};
use crate::status::Status;

/// Routings of a search that are solved for at most, while none of them follows its displacements.
const TRIED: usize = 400;
/// Routings that do not follow theirs and are pulled by less, and by which shares of the displacements.
const EASED: usize = 3;
const SHARES: [f64; 8] = [0.97, 0.93, 0.87, 0.8, 0.7, 0.55, 0.35, 0.15];

/// A routing with the shape that comes of pulling it from rest.
#[derive(Clone, Debug)]
pub(super) struct Evaluation {
    pub(super) point: Point,
    pub(super) holes: Option<Holes>,
    pub(super) shape: Shape,
    /// Sum of squared distances; infinite if the rod does not follow.
    pub(super) value: f64,
}

impl Evaluation {
    pub(super) fn is_met(&self, task: &Task<'_>) -> bool {
        let far = task.settings.tolerance * task.length();
        self.value.is_finite() && task.errors(&self.shape.state).iter().all(|e| *e <= far)
    }
}

/// The nearest routing that follows its displacements.
pub(super) struct Evaluator<'t, 'a> {
    task: &'t Task<'a>,
    pub(super) best: Option<Evaluation>,
    /// Holes, and the bits of the tensions.
    tried: BTreeSet<(Holes, Vec<u64>)>,
    /// Those that do not.
    lost: Vec<(Point, Option<Holes>)>,
    pub(super) steps: usize,
}

impl<'t, 'a> Evaluator<'t, 'a> {
    pub(super) fn new(task: &'t Task<'a>) -> Self {
        Self { task, best: None, tried: BTreeSet::new(), lost: Vec::new(), steps: 0 }
    }

    /// Its sum of squared distances; infinite while there is none.
    pub(super) fn value(&self) -> f64 {
        self.best.as_ref().map_or(f64::INFINITY, |best| best.value)
    }

    pub(super) fn is_met(&self) -> bool {
        self.best.as_ref().is_some_and(|best| best.is_met(self.task))
    }

    /// Pulls the nearest routings of a search, of those nearer than `least`; more than `most` of them only while
    /// none follows. Whether one has every disk in its place.
    pub(super) fn evaluate_candidates(
        &mut self,
        search: &HoleSearch<'_, '_>,
        most: usize,
        least: f64,
    ) -> Result<bool, InvalidInput> {
        let task = self.task;
        // Where all were looked at, none that is nearer may be left out.
        let whole = search.left_out.is_some();
        let (most, tried) = if whole { (usize::MAX, usize::MAX) } else { (most, TRIED) };
        for (i, candidate) in search.candidates().into_iter().take(tried).enumerate() {
            let value = self.value();
            let enough = i >= most && value.is_finite();
            if enough || candidate.value >= value || candidate.value > least || task.is_stopped() {
                break;
            }
            let bits = candidate.tensions.iter().map(|t| t.to_bits()).collect();
            if self.tried.insert((candidate.holes.clone(), bits)) {
                let robot = task.with_holes(&candidate.holes, search.count)?;
                let tensions: Vec<f64> =
                    candidate.tensions.iter().map(|t| t * task.plan.unit).collect();
                let azimuths = task.azimuths(&candidate.holes, search.count);
                let holes = (azimuths, task.radii.clone());
                if let Some(point) = Point::at_tensions(task, robot, holes, &tensions)? {
                    let point = self.enforce_bounds(point, Freedom::of_pulls())?;
                    self.pull(point, Some(candidate.holes.clone()))?;
                }
            }
        }
        Ok(self.is_met())
    }

    /// Point within the bounds of displacements: itself, or where a descent within them leads.
    pub(super) fn enforce_bounds(
        &mut self,
        point: Point,
        freedom: Freedom,
    ) -> Result<Point, InvalidInput> {
        let task = self.task;
        let pulls = point.pulls(task);
        let own = point.displacements.iter().zip(&point.state.tensions);
        let out = |(pull, (own, tension)): (&f64, (&f64, &f64))| {
            pull < own || (pull > own && *tension > 0.0)
        };
        if !pulls.iter().zip(own).any(out) {
            return Ok(point);
        }
        let Some(moved) = point.at_displacements(task, pulls)? else { return Ok(point) };
        let freedom = Freedom { pulls: Pulls::Displacements, ..freedom };
        moved.descend(task, &freedom, &mut self.steps)
    }

    /// Pulls a routing from rest and keeps it if it is the nearest; whether it follows.
    pub(super) fn pull(
        &mut self,
        point: Point,
        holes: Option<Holes>,
    ) -> Result<bool, InvalidInput> {
        let pulls = point.pulls(self.task);
        let shape = self.shape(&point, &pulls)?;
        let follows = shape.report.status == Status::Converged;
        if !follows {
            self.lost.push((point, holes));
            return Ok(false);
        }
        let value = self.task.value(&shape.state);
        if value < self.value() {
            let state = shape.state.clone();
            let point = Point { displacements: pulls, state, value, ..point };
            self.best = Some(Evaluation { point, holes, shape, value });
        }
        Ok(true)
    }

    fn shape(&self, point: &Point, pulls: &[f64]) -> Result<Shape, InvalidInput> {
        let plan = Plan::new(&point.robot, self.task.settings.rod)?;
        let rod = Rod::new(&point.robot, &plan).stopped_by(Arc::clone(self.task.stop));
        rod.shape(pulls)
    }

    /// Given holes and displacements; whether the rod follows them to within `value`, or a nearer one is known.
    pub(super) fn evaluate_given(
        &mut self,
        (azimuths, radii): (PerHole, PerHole),
        holes: Option<(Holes, usize)>,
        pulls: &[f64],
        value: f64,
    ) -> Result<bool, InvalidInput> {
        let task = self.task;
        let robot = match &holes {
            Some((holes, count)) => task.with_holes(holes, *count)?,
            None => task.with_azimuths(&azimuths, &radii)?,
        };
        let plan = Plan::new(&robot, task.settings.rod)?;
        let rod = Rod::new(&robot, &plan).stopped_by(Arc::clone(task.stop));
        let shape = rod.shape(pulls)?;
        let state = shape.state;
        let displacements = pulls.to_vec();
        let point = Point { azimuths, radii, robot, state, displacements, value };
        self.pull(point, holes.map(|(holes, _)| holes))?;
        Ok(self.value() <= value)
    }

    /// Routings that are nearer than the best but do not follow their displacements, pulled by less.
    pub(super) fn pull_by_less(&mut self) -> Result<(), InvalidInput> {
        let task = self.task;
        let mut lost = std::mem::take(&mut self.lost);
        lost.sort_by(|a, b| a.0.value.total_cmp(&b.0.value));
        for (point, holes) in lost.into_iter().take(EASED) {
            if point.value >= self.value() || task.is_stopped() {
                break;
            }
            let mut nearest: Option<Point> = None;
            for share in SHARES {
                let displacements = point.displacements.iter().map(|d| share * d).collect();
                let eased = Point { displacements, ..point.clone() };
                let pulls = eased.pulls(task);
                let shape = self.shape(&eased, &pulls)?;
                let value = task.value(&shape.state);
                let least = nearest.as_ref().map_or(f64::INFINITY, |nearest| nearest.value);
                if shape.report.status == Status::Converged && value < least {
                    let state = shape.state;
                    nearest = Some(Point { displacements: pulls, state, value, ..eased });
                }
            }
            let Some(point) = nearest else { continue };
            self.pull(point.clone(), holes.clone())?;
            let freedom = Freedom { pulls: Pulls::Displacements, ..Freedom::of_pulls() };
            let point = point.descend(task, &freedom, &mut self.steps)?;
            self.pull(point, holes)?;
        }
        Ok(())
    }

    /// All tendons straight through the same holes, pulled as little as may be; where the rod does not follow that,
    /// the nearest of those through holes that go on or to and fro by as many from disk to disk that it follows.
    pub(super) fn regular_routing(
        &self,
        count: usize,
        radii: &PerHole,
    ) -> Result<Evaluation, InvalidInput> {
        let task = self.task;
        let mut nearest = self.stepped_routing(count, radii, |_| 0)?;
        let follows = nearest.value.is_finite();
        let most = if follows { 0 } else { task.settings.max_jump.unwrap_or(count).min(count / 2) };
        for jump in 1..=most {
            for to_and_fro in [false, true] {
                let times = |disk: usize| if to_and_fro { disk % 2 } else { disk };
                let next = self.stepped_routing(count, radii, |disk| jump * times(disk) % count)?;
                if next.value < nearest.value && !task.is_stopped() {
                    nearest = next;
                }
            }
        }
        Ok(nearest)
    }

    fn stepped_routing(
        &self,
        count: usize,
        radii: &PerHole,
        hole: impl Fn(usize) -> usize,
    ) -> Result<Evaluation, InvalidInput> {
        let task = self.task;
        let holes: Holes = (0..task.disks()).map(|disk| vec![hole(disk); task.tendons()]).collect();
        let azimuths = task.azimuths(&holes, count);
        let given = task.settings.holes.is_some();
        let robot = if given {
            task.with_holes(&holes, count)?
        } else {
            task.with_azimuths(&azimuths, radii)?
        };
        let pulls = (0..task.tendons()).map(|k| 0.0_f64.clamp(task.bound(k).0, task.bound(k).1));
        let displacements: Vec<f64> = pulls.collect();
        let plan = Plan::new(&robot, task.settings.rod)?;
        let shape = Rod::new(&robot, &plan).shape(&displacements)?;
        let follows = shape.report.status == Status::Converged;
        let value = if follows { task.value(&shape.state) } else { f64::INFINITY };
        let (radii, state) = (radii.clone(), shape.state.clone());
        let point = Point { azimuths, radii, robot, state, displacements, value };
        Ok(Evaluation { point, holes: given.then_some(holes), shape, value })
    }
}
