//! From searches and descents to the nearest routing.

use std::f64::consts::TAU;

use super::best_tensions::Candidate;
use super::continuous_holes::{Freedom, Point};
use super::evaluation::{Judge, Judged};
use super::fewer_tendons::Lifted;
use super::hole_search::{Search, numbers};
use super::starts::starts;
use super::task::{PerHole, Task};
use crate::error::InvalidInput;

/// Holes per disk that a search uses before azimuths are free, and the routings from which descents then begin.
pub(super) const FINE: usize = 24;
const DESCENTS: usize = 3;
/// Routings whose shape is solved for as a whole, nearest first, after a search.
const JUDGED: usize = 20;
/// Routings of a search that a search within bounds begins with.
const KEPT: usize = 64;
/// Rounds that search on from the best of the last one, at most, and how much nearer they must come to go on.
const AGAIN: usize = 20;
const NEARER: f64 = 1.0 - 1e-9;
/// Azimuth between two tendons that share what one did \[rad\].
const APART: f64 = TAU / 12.0;

/// What a design came to.
pub(super) struct Answer {
    pub(super) best: Judged,
    /// Least sum of squared distances with any azimuth that was met.
    pub(super) relaxed: f64,
    /// Every routing was looked at over a row of tensions.
    pub(super) whole: bool,
    /// The nearest routings of the search, in holes.
    pub(super) found: Vec<Candidate>,
    pub(super) steps: usize,
    pub(super) solved: usize,
}

/// What a design may begin with.
#[derive(Default)]
pub(super) struct Begin<'b> {
    /// Where to look first: azimuths, and tensions in the unit of the results.
    pub(super) start: Option<&'b (PerHole, Vec<f64>)>,
    /// Answers with a tendon less.
    pub(super) fewer: Vec<Lifted>,
    /// Routings that a search without bounds found.
    pub(super) found: &'b [Candidate],
}

/// Azimuths, and tensions in the unit of the results; and how a search begins there.
type Start = ((PerHole, Vec<f64>), Looks);

/// Where a search looks: around a routing, around where a descent with any azimuth leads from it, or both.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Looks {
    Around,
    Loosened,
    Both,
}

/// A design in progress.
pub(super) struct Design<'t, 'a> {
    task: &'t Task<'a>,
    begin: Begin<'t>,
    judge: Judge<'t, 'a>,
    relaxed: f64,
    found: Vec<Candidate>,
    steps: usize,
    solved: usize,
    /// Least value of the routings that were left out.
    left_out: f64,
}

impl<'t, 'a> Design<'t, 'a> {
    pub(super) fn new(task: &'t Task<'a>, begin: Begin<'t>) -> Self {
        Self {
            task,
            begin,
            judge: Judge::new(task),
            relaxed: f64::INFINITY,
            found: Vec::new(),
            steps: 0,
            solved: 0,
            left_out: 0.0,
        }
    }

    pub(super) fn run(mut self) -> Result<Answer, InvalidInput> {
        for lifted in &self.begin.fewer {
            lifted.judge(self.task, &mut self.judge)?;
            self.relaxed = self.relaxed.min(lifted.relaxed);
        }
        if !self.judge.met() {
            match self.task.settings.holes {
                Some(count) => {
                    self.search(count, true)?;
                    self.judge.ease()?;
                    self.relax()?;
                }
                None => self.free()?,
            }
        }
        self.told()
    }

    fn told(self) -> Result<Answer, InvalidInput> {
        let task = self.task;
        let count = task.settings.holes.unwrap_or(FINE);
        let simple = self.judge.simple(count, &self.allowed_radii())?;
        let best = match self.judge.best {
            Some(best) if best.value <= simple.value => best,
            _ => simple,
        };
        let whole = best.value.is_finite() && best.value <= self.left_out;
        Ok(Answer {
            relaxed: self.relaxed.min(best.value),
            best,
            whole,
            found: self.found,
            steps: self.steps + self.judge.steps,
            solved: self.solved,
        })
    }

    /// Routings of any azimuth that a search may begin from, the given one first.
    fn begun(&self) -> Vec<Start> {
        let fewer = self.begin.fewer.iter().flat_map(|lifted| {
            let own = (lifted.azimuths.clone(), lifted.tensions.clone());
            [(own, Looks::Around), (lifted.shared(APART), Looks::Loosened)]
        });
        let start = self.begin.start.iter().map(|start| ((*start).clone(), Looks::Both));
        let simple = starts(self.task).into_iter().map(|start| (start, Looks::Loosened));
        start.chain(fewer).chain(simple).collect()
    }

    /// Which holes of so many. Unless `judge`, nothing is solved for as a whole.
    fn search(&mut self, count: usize, judge: bool) -> Result<(), InvalidInput> {
        let task = self.task;
        let mut search = Search::new(task, count);
        for candidate in self.begin.found {
            if !task.stopped() {
                search.try_holes(&candidate.holes, &candidate.tensions);
            }
        }
        let done = if task.tendons() > 1 {
            self.several(&mut search, judge)?
        } else {
            self.single(&mut search, judge)?
        };
        if judge && !done {
            self.judge.found(&search, JUDGED, f64::INFINITY)?;
            self.again(&mut search)?;
            self.left_out = search.left_out.unwrap_or(0.0);
        }
        self.steps += search.steps();
        self.solved += search.solved();
        self.found = search.found().into_iter().take(KEPT).cloned().collect();
        Ok(())
    }

    /// Whether one of the best of a search has every disk in its place.
    fn enough(&mut self, search: &Search<'_, '_>, judge: bool) -> Result<bool, InvalidInput> {
        let least = (self.task.settings.tolerance * self.task.length()).powi(2);
        Ok(judge && self.judge.found(search, 1, least)?)
    }

    /// One tendon; whether it is enough.
    fn single(&mut self, search: &mut Search<'t, 'a>, judge: bool) -> Result<bool, InvalidInput> {
        if let Some((azimuths, tensions)) = self.begin.start
            && self.from(search, (azimuths, tensions), Looks::Around, judge)?
        {
            return Ok(true);
        }
        if search.few() {
            search.every();
            return Ok(false);
        }
        search.over_tensions(&mut |search| self.enough(search, judge))
    }

    /// Several tendons, from all that a search may begin with; whether it is enough.
    fn several(&mut self, search: &mut Search<'t, 'a>, judge: bool) -> Result<bool, InvalidInput> {
        for ((azimuths, tensions), looks) in self.begun() {
            if self.task.stopped() {
                break;
            }
            if self.from(search, (&azimuths, &tensions), looks, judge)? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// From a routing; whether what that leads to is enough. The last bits of azimuths and tensions do not count.
    fn from(
        &mut self,
        search: &mut Search<'t, 'a>,
        (azimuths, tensions): (&PerHole, &[f64]),
        looks: Looks,
        judge: bool,
    ) -> Result<bool, InvalidInput> {
        let (task, count) = (self.task, search.count);
        let tensions: Vec<f64> = tensions.iter().map(|t| blunt(*t)).collect();
        let mut around = |own: &mut Self, azimuths: &PerHole, tensions: &[f64]| {
            let tensions: Vec<f64> = tensions.iter().map(|t| blunt(t / task.plan.unit)).collect();
            let holes = numbers(task, azimuths, count);
            search.around(&holes, &tensions, &mut |search| own.enough(search, judge))
        };
        if looks != Looks::Loosened && around(self, azimuths, &tensions)? {
            return Ok(true);
        }
        if looks == Looks::Around || task.stopped() {
            return Ok(false);
        }
        match self.loosened(azimuths.clone(), &tensions)? {
            Some(point) => around(self, &point.azimuths, &point.state.tensions),
            None => around(self, azimuths, &tensions),
        }
    }

    /// Where a descent with any azimuth leads.
    fn loosened(
        &mut self,
        azimuths: PerHole,
        tensions: &[f64],
    ) -> Result<Option<Point>, InvalidInput> {
        let task = self.task;
        let robot = task.with_azimuths(&azimuths, &task.radii)?;
        let holes = (azimuths, task.radii.clone());
        let Some(point) = Point::under(task, robot, holes, tensions)? else { return Ok(None) };
        let freedom = Freedom { azimuths: true, ..Freedom::of_pulls() };
        let point = point.descend(task, &freedom, &mut self.steps)?;
        if task.bounds.is_none() {
            self.relaxed = self.relaxed.min(point.value);
        }
        Ok(Some(point))
    }

    /// From the best answer, until that leads to no nearer one: what a search that starts with it would do.
    fn again(&mut self, search: &mut Search<'t, 'a>) -> Result<(), InvalidInput> {
        for _ in 0..AGAIN.min(self.task.settings.max_iterations) {
            let Some(best) = &self.judge.best else { break };
            let before = best.value;
            let (azimuths, tensions) =
                (best.point.azimuths.clone(), best.shape.state.tensions.clone());
            let looks = if tensions.len() > 1 { Looks::Both } else { Looks::Around };
            if self.task.stopped() || self.from(search, (&azimuths, &tensions), looks, true)? {
                break;
            }
            self.judge.found(search, JUDGED, f64::INFINITY)?;
            if self.judge.value() >= NEARER * before {
                break;
            }
        }
        Ok(())
    }

    /// Any azimuth: descents from the nearest routings of a search among many holes, and from simple ones.
    fn free(&mut self) -> Result<(), InvalidInput> {
        let task = self.task;
        let several = task.tendons() > 1 || self.begin.start.is_some();
        let begun = if several { self.begun() } else { vec![] };
        if self.descents(begun.into_iter().map(|(start, _)| start).collect())? {
            return Ok(());
        }
        self.search(FINE, false)?;
        let turned = |candidate: &Candidate| {
            let tensions = candidate.tensions.iter().map(|t| t * task.plan.unit);
            (task.azimuths(&candidate.holes, FINE), tensions.collect())
        };
        let found: Vec<_> = self.found.iter().map(turned).collect();
        let (first, others) = found.split_at(found.len().min(DESCENTS));
        if self.descents(first.to_vec())? {
            return Ok(());
        }
        self.judge.ease()?;
        for begun in others {
            if self.judge.best.is_some() || self.descents(vec![begun.clone()])? {
                break;
            }
        }
        Ok(())
    }

    /// Descents with any azimuth; whether that is enough, or all that is wanted.
    fn descents(&mut self, begun: Vec<(PerHole, Vec<f64>)>) -> Result<bool, InvalidInput> {
        let task = self.task;
        let freedom = Freedom::whole(task);
        for (azimuths, tensions) in begun {
            let holes = (azimuths, self.allowed_radii());
            let robot = task.with_azimuths(&holes.0, &holes.1)?;
            if let Some(point) = Point::under(task, robot, holes, &tensions)? {
                let point = point.descend(task, &freedom, &mut self.steps)?;
                let point = self.judge.within(point, freedom)?;
                self.judge.pull(point, None)?;
            }
            if task.stopped() || self.judge.met() {
                return Ok(true);
            }
        }
        Ok(false)
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
        if let Some(best) = self.judge.best.as_ref().filter(|best| !best.met(task)) {
            let freedom = Freedom::whole(task);
            let point = best.point.clone().descend(task, &freedom, &mut self.steps)?;
            let point = self.judge.within(point, freedom)?;
            self.relaxed = self.relaxed.min(point.value);
        }
        Ok(())
    }
}

/// The same number to 31 bits.
fn blunt(value: f64) -> f64 {
    const LOST: u64 = 1 << 21;
    f64::from_bits((value.to_bits() + LOST / 2) & !(LOST - 1))
}
