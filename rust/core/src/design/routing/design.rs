//! From searches and descents to the answer.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::polish::Candidate;
use super::relax::{Freedom, Point, Pulls};
use super::search::Search;
use super::starts::starts;
use super::task::{Holes, PerHole, Task};
use super::{Optimality, Routed};
use crate::design::hindrance::hindrance;
use crate::error::InvalidInput;
use crate::model::Model;
use crate::robot::Robot;
use crate::rod::{Plan, Rod};
use crate::shape::Shape;
use crate::status::Status;

/// Holes per disk that a search uses before azimuths are free, and the routings from which descents then begin.
const FINE: usize = 24;
const DESCENTS: usize = 3;
/// Routings whose shape is solved for as a whole, nearest first, after a search.
const JUDGED: usize = 20;

/// What a chord may be off, in shares of its subsegment, before it is blamed: twisted arcs are a little shorter.
const OFF: f64 = 0.01;

/// A design in progress.
pub(super) struct Design<'t, 'a> {
    task: &'t Task<'a>,
    /// Where to look first: azimuths, and tensions in the unit of the results.
    start: Option<(PerHole, Vec<f64>)>,
    best: Option<Judged>,
    /// Least sum of squared distances with any azimuth that was met.
    relaxed: f64,
    tried: BTreeSet<Holes>,
    steps: usize,
    solved: usize,
    whole: bool,
}

/// A routing with the shape that comes of pulling it from rest.
struct Judged {
    point: Point,
    holes: Option<Holes>,
    shape: Shape,
    /// Sum of squared distances; infinite if the rod does not follow.
    value: f64,
}

impl<'t, 'a> Design<'t, 'a> {
    pub(super) fn new(task: &'t Task<'a>, start: Option<(&Robot, &[f64])>) -> Self {
        let start = start.map(|(robot, tensions)| {
            let azimuths = robot.paths().iter().map(|path| path.azimuths.clone());
            (azimuths.collect(), tensions.to_vec())
        });
        Self {
            task,
            start,
            best: None,
            relaxed: f64::INFINITY,
            tried: BTreeSet::new(),
            steps: 0,
            solved: 0,
            whole: false,
        }
    }

    pub(super) fn run(mut self) -> Result<Routed, InvalidInput> {
        match self.task.settings.holes {
            Some(count) => {
                self.search(count, true)?;
                self.relax()?;
            }
            None => self.free()?,
        }
        let best = match self.best.take() {
            Some(best) => best,
            None => self.unpulled()?,
        };
        Ok(self.told(best))
    }

    /// Nothing was found, or it was stopped before: straight tendons, pulled as little as may be.
    fn unpulled(&self) -> Result<Judged, InvalidInput> {
        let task = self.task;
        let holes = vec![vec![0; task.tendons()]; task.disks()];
        let count = task.settings.holes.unwrap_or(FINE);
        let (azimuths, radii) = (task.azimuths(&holes, count), self.allowed_radii());
        let robot = match task.settings.holes {
            Some(count) => task.with_holes(&holes, count)?,
            None => task.with_azimuths(&azimuths, &radii)?,
        };
        let pulls = (0..task.tendons()).map(|k| 0.0_f64.clamp(task.bound(k).0, task.bound(k).1));
        let pulls: Vec<f64> = pulls.collect();
        let plan = Plan::new(&robot, task.settings.rod)?;
        let shape = Rod::new(&robot, &plan).shape(&pulls)?;
        let value = task.value(&shape.state);
        let state = shape.state.clone();
        let point = Point { azimuths, radii, robot, state, displacements: pulls, value };
        let holes = task.settings.holes.map(|_| holes);
        Ok(Judged { point, holes, shape, value })
    }

    fn freedom(&self, azimuths: bool) -> Freedom {
        let radii = self.task.settings.radius.filter(|_| azimuths);
        Freedom { azimuths, radii, pulls: Pulls::Tensions }
    }

    /// Routings of any azimuth that a descent may begin from, the given one first.
    fn begun(&self) -> Vec<(PerHole, Vec<f64>)> {
        self.start.iter().cloned().chain(starts(self.task)).collect()
    }

    /// Which holes of so many. Unless `judge`, nothing is solved for as a whole.
    fn search(&mut self, count: usize, judge: bool) -> Result<Vec<Candidate>, InvalidInput> {
        let task = self.task;
        let mut search = Search::new(task, count);
        let least = (task.settings.tolerance * task.length()).powi(2);
        let mut done = false;
        let several = task.tendons() > 1;
        let begun = if several { self.begun() } else { self.start.clone().into_iter().collect() };
        for (azimuths, tensions) in begun {
            if done || task.stopped() {
                break;
            }
            let (azimuths, tensions) = self.loosened(azimuths, tensions, several)?;
            let holes = numbers(task, &azimuths, count);
            let tensions: Vec<f64> = tensions.iter().map(|t| t / task.plan.unit).collect();
            done = search.around(&holes, &tensions, &mut |search| {
                Ok(judge && self.judge(search, 1, least)?)
            })?;
        }
        if !several && !done {
            search.over_tensions(&mut |search| Ok(judge && self.judge(search, 1, least)?))?;
        }
        if judge {
            self.judge(&search, JUDGED, f64::INFINITY)?;
            self.whole = search.whole;
        }
        self.steps += search.steps();
        self.solved += search.solved();
        Ok(search.found().into_iter().take(DESCENTS).cloned().collect())
    }

    /// Where a descent with any azimuth leads, of several tendons: what a search is begun with.
    fn loosened(
        &mut self,
        azimuths: PerHole,
        tensions: Vec<f64>,
        several: bool,
    ) -> Result<(PerHole, Vec<f64>), InvalidInput> {
        if !several {
            return Ok((azimuths, tensions));
        }
        let task = self.task;
        let robot = task.with_azimuths(&azimuths, &task.radii)?;
        let holes = (azimuths.clone(), task.radii.clone());
        let Some(point) = Point::under(task, robot, holes, &tensions)? else {
            return Ok((azimuths, tensions));
        };
        let freedom = Freedom { radii: None, ..self.freedom(true) };
        let point = point.descend(task, &freedom, &mut self.steps)?;
        if task.bounds.is_none() {
            self.relaxed = self.relaxed.min(point.value);
        }
        Ok((point.azimuths, point.state.tensions))
    }

    /// Solves for the nearest routings of a search as a whole, of those nearer than `least`; whether one of them has
    /// every disk in its place.
    fn judge(
        &mut self,
        search: &Search<'_, '_>,
        most: usize,
        least: f64,
    ) -> Result<bool, InvalidInput> {
        let task = self.task;
        for candidate in search.found().into_iter().take(most) {
            let enough = self.best.as_ref().is_some_and(|best| candidate.value >= best.value);
            if enough || candidate.value > least || self.tried.contains(&candidate.holes) {
                continue;
            }
            self.tried.insert(candidate.holes.clone());
            let azimuths = task.azimuths(&candidate.holes, search.count);
            let robot = task.with_holes(&candidate.holes, search.count)?;
            let tensions: Vec<f64> =
                candidate.tensions.iter().map(|t| t * task.plan.unit).collect();
            let holes = (azimuths, task.radii.clone());
            if let Some(point) = Point::under(task, robot, holes, &tensions)? {
                let point = self.within(point, self.freedom(false))?;
                self.pull(point, Some((candidate.holes.clone(), search.count)))?;
            }
        }
        Ok(self.best.as_ref().is_some_and(|best| best.met(task)))
    }

    /// The same point, or if a displacement is out of its bounds, where a descent within them leads.
    fn within(&mut self, point: Point, freedom: Freedom) -> Result<Point, InvalidInput> {
        let task = self.task;
        let bounded = |(k, d): (usize, &f64)| d.clamp(task.bound(k).0, task.bound(k).1);
        let inside: Vec<f64> = point.displacements.iter().enumerate().map(bounded).collect();
        if inside == point.displacements {
            return Ok(point);
        }
        let Some(moved) = point.pulled(task, inside)? else { return Ok(point) };
        let freedom = Freedom { pulls: Pulls::Displacements, ..freedom };
        moved.descend(task, &freedom, &mut self.steps)
    }

    /// What pulling a routing from rest does; kept if it is the nearest.
    fn pull(&mut self, point: Point, holes: Option<(Holes, usize)>) -> Result<(), InvalidInput> {
        let task = self.task;
        let robot = match &holes {
            Some((holes, count)) => task.with_holes(holes, *count)?,
            None => point.robot.clone(),
        };
        let plan = Plan::new(&robot, task.settings.rod)?;
        let rod = Rod::new(&robot, &plan).stopped_by(Arc::clone(task.stop));
        let bounded = |(k, d): (usize, &f64)| d.clamp(task.bound(k).0, task.bound(k).1);
        let pulls: Vec<f64> = point.displacements.iter().enumerate().map(bounded).collect();
        let shape = rod.shape(&pulls)?;
        let follows = shape.report.status == Status::Converged;
        let value = if follows { task.value(&shape.state) } else { f64::INFINITY };
        if self.best.as_ref().is_none_or(|best| value < best.value) {
            let point = Point { robot, displacements: pulls, ..point };
            self.best = Some(Judged { point, holes: holes.map(|(holes, _)| holes), shape, value });
        }
        Ok(())
    }

    /// Any azimuth: descents from the nearest routings of a search among many holes, and from simple ones.
    fn free(&mut self) -> Result<(), InvalidInput> {
        let task = self.task;
        let freedom = self.freedom(true);
        let mut begun =
            if task.tendons() > 1 || self.start.is_some() { self.begun() } else { vec![] };
        let mut searched = false;
        loop {
            for (azimuths, tensions) in begun {
                let holes = (azimuths, self.allowed_radii());
                let robot = task.with_azimuths(&holes.0, &holes.1)?;
                if let Some(point) = Point::under(task, robot, holes, &tensions)? {
                    let point = point.descend(task, &freedom, &mut self.steps)?;
                    let point = self.within(point, freedom)?;
                    self.pull(point, None)?;
                }
                if task.stopped() || self.best.as_ref().is_some_and(|best| best.met(task)) {
                    return Ok(());
                }
            }
            if searched {
                return Ok(());
            }
            searched = true;
            let found = self.search(FINE, false)?.into_iter().map(|candidate| {
                let tensions = candidate.tensions.iter().map(|t| t * task.plan.unit);
                (task.azimuths(&candidate.holes, FINE), tensions.collect())
            });
            begun = found.collect();
        }
    }

    /// The robot's radii, within what is allowed.
    fn allowed_radii(&self) -> PerHole {
        let mut radii = self.task.radii.clone();
        if let Some((low, high)) = self.task.settings.radius {
            radii.iter_mut().flatten().for_each(|radius| *radius = radius.clamp(low, high));
        }
        radii
    }

    /// How near any azimuth comes, by a descent from the best holes.
    fn relax(&mut self) -> Result<(), InvalidInput> {
        let task = self.task;
        if let Some(best) =
            self.best.as_ref().filter(|best| !best.met(task) && best.value.is_finite())
        {
            let point =
                Point { state: best.shape.state.clone(), value: best.value, ..best.point.clone() };
            let freedom = self.freedom(true);
            let point = point.descend(task, &freedom, &mut self.steps)?;
            let point = self.within(point, freedom)?;
            self.relaxed = self.relaxed.min(point.value);
        }
        Ok(())
    }

    fn told(self, best: Judged) -> Routed {
        let task = self.task;
        let errors = task.errors(&best.shape.state);
        let rms = |value: f64| (value / task.targets.len() as f64).sqrt();
        let own = rms(task.value(&best.shape.state));
        let relaxed =
            if task.settings.holes.is_some() { rms(self.relaxed.min(best.value)) } else { own };
        let optimality = if best.met(task) {
            Optimality::Reached
        } else if self.whole && task.bounds.is_none() && !task.stopped() {
            Optimality::Exhaustive
        } else {
            Optimality::Searched
        };
        let status = if best.shape.report.status != Status::Converged {
            best.shape.report.status
        } else if best.met(task) {
            Status::Converged
        } else if task.stopped() {
            Status::IterationLimit
        } else {
            Status::Unreachable
        };
        let mut out = Routed {
            message: String::new(),
            holes: best
                .holes
                .map(|holes| (0..task.tendons()).map(|k| task.indices(&holes, k)).collect()),
            robot: best.point.robot,
            shape: best.shape,
            displacements: best.point.displacements,
            errors,
            rms: own,
            relaxed_rms: relaxed,
            optimality,
            iterations: self.steps,
            evaluations: self.solved,
            status,
        };
        out.message = message(task, &out);
        out
    }
}

impl Judged {
    fn met(&self, task: &Task<'_>) -> bool {
        let far = task.settings.tolerance * task.length();
        self.value.is_finite() && task.errors(&self.shape.state).iter().all(|e| *e <= far)
    }
}

/// What stood in the way.
fn message(task: &Task<'_>, out: &Routed) -> String {
    let worst = out.errors.iter().copied().fold(0.0_f64, f64::max);
    let disk = out.errors.iter().position(|e| *e == worst).unwrap_or(0);
    let off = || {
        let known = match (task.settings.holes, out.optimality) {
            (None, _) => "the nearest that descents led to".to_owned(),
            (_, Optimality::Exhaustive) => {
                format!(
                    "every routing was tried; any azimuth would leave {:.3e} m",
                    out.relaxed_rms
                )
            }
            _ => format!(
                "the nearest that the search met; any azimuth would leave {:.3e} m",
                out.relaxed_rms
            ),
        };
        let why = hindrance(task.robot, task.targets, task.settings.rod.subsegment, OFF);
        format!(
            "disk {disk} stays {worst:.3e} m from its place, {:.3e} m root mean square: {known}{why}",
            out.rms
        )
    };
    match out.status {
        Status::Converged => String::new(),
        Status::Unreachable => off(),
        Status::IterationLimit if task.stopped() => "the design was stopped".to_owned(),
        _ => format!("the rod does not follow the displacements: {}", out.shape.message),
    }
}

/// The nearest of so many holes, from disk to disk no further on than a tendon may.
fn numbers(task: &Task<'_>, azimuths: &PerHole, count: usize) -> Holes {
    let mut holes = vec![vec![0; task.tendons()]; task.disks()];
    for (k, own) in azimuths.iter().enumerate() {
        let mut last = None;
        for (disk, azimuth) in own.iter().enumerate() {
            let near = |hole: &usize| (azimuth - task.azimuth(*hole, count)).cos();
            let nearest = (0..count)
                .filter(|hole| last.is_none_or(|last| task.allows(last, *hole, count)))
                .max_by(|a, b| near(a).total_cmp(&near(b)));
            let hole = nearest.unwrap_or(0);
            holes[disk][k] = hole;
            last = Some(hole);
        }
    }
    holes
}
