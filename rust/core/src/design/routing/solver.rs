//! From searches and descents to the nearest routing.

use std::f64::consts::TAU;

use super::answer::{Answer, Begin};
use super::best_tensions::Candidate;
use super::continuous_holes::{Freedom, Point};
use super::evaluation::Evaluator;
use super::hole_search::{HoleSearch, nearest_holes};
use super::starts::starts;
use super::task::{FINE, PerHole, Task};
use crate::error::InvalidInput;

/// Routings from which descents with any azimuth begin, nearest first.
const DESCENTS: usize = 3;
/// Routings whose shape is solved for as a whole, nearest first, after a search.
const EVALUATED: usize = 20;
/// Routings of a search that a search within bounds begins with.
const KEPT: usize = 64;
/// Rounds that search on from the best of the last one, at most, and how much nearer they must come to go on.
const AGAIN: usize = 20;
const NEARER: f64 = 1.0 - 1e-9;
/// Azimuth between two tendons that share what one did \[rad\].
const APART: f64 = TAU / 12.0;

/// Azimuths, and tensions in the unit of the results; and how a search begins there.
type Start = ((PerHole, Vec<f64>), Looks);

/// Neighbourhood of a search: around a routing, around where a descent with any azimuth leads from it, or both.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Looks {
    Around,
    AnyAzimuth,
    Both,
}

/// A design in progress.
pub(super) struct Solver<'t, 'a> {
    task: &'t Task<'a>,
    begin: Begin<'t>,
    evaluator: Evaluator<'t, 'a>,
    relaxed: f64,
    found: Vec<Candidate>,
    steps: usize,
    solved: usize,
    /// Least value of the routings that were left out.
    left_out: f64,
}

impl<'t, 'a> Solver<'t, 'a> {
    pub(super) fn new(task: &'t Task<'a>, begin: Begin<'t>) -> Self {
        Self {
            task,
            begin,
            evaluator: Evaluator::new(task),
            relaxed: f64::INFINITY,
            found: Vec::new(),
            steps: 0,
            solved: 0,
            left_out: 0.0,
        }
    }

    pub(super) fn run(mut self) -> Result<Answer, InvalidInput> {
        for extended in &self.begin.fewer {
            extended.evaluate(self.task, &mut self.evaluator)?;
            self.relaxed = self.relaxed.min(extended.relaxed);
        }
        if !self.evaluator.is_met() {
            match self.task.settings.holes {
                Some(count) => {
                    self.search(count, true)?;
                    self.evaluator.pull_by_less()?;
                    self.descend_any_azimuth()?;
                }
                None => self.solve_continuous()?,
            }
        }
        self.finish()
    }

    fn finish(self) -> Result<Answer, InvalidInput> {
        let task = self.task;
        let count = task.settings.holes.unwrap_or(FINE);
        let simple = self.evaluator.regular_routing(count, &self.allowed_radii())?;
        let best = match self.evaluator.best {
            Some(best) if best.value <= simple.value => best,
            _ => simple,
        };
        let whole = best.value.is_finite() && best.value <= self.left_out;
        Ok(Answer {
            relaxed: self.relaxed.min(best.value),
            best,
            whole,
            found: self.found,
            steps: self.steps + self.evaluator.steps,
            solved: self.solved,
        })
    }

    /// Routings of any azimuth that a search may begin from, the given one first.
    fn start_routings(&self) -> Vec<Start> {
        let fewer = self.begin.fewer.iter().flat_map(|extended| {
            let own = (extended.azimuths.clone(), extended.tensions.clone());
            [(own, Looks::Around), (extended.share_pull(APART), Looks::AnyAzimuth)]
        });
        let start = self.begin.start.iter().map(|start| ((*start).clone(), Looks::Both));
        let simple = starts(self.task).into_iter().map(|start| (start, Looks::AnyAzimuth));
        start.chain(fewer).chain(simple).collect()
    }

    /// Search among so many holes. Unless `evaluate`, nothing is solved for as a whole.
    fn search(&mut self, count: usize, evaluate: bool) -> Result<(), InvalidInput> {
        let task = self.task;
        let mut search = HoleSearch::new(task, count);
        for candidate in self.begin.found {
            if !task.is_stopped() {
                search.try_holes(&candidate.holes, &candidate.tensions);
            }
        }
        let done = if task.tendons() > 1 {
            self.several_tendons(&mut search, evaluate)?
        } else {
            self.one_tendon(&mut search, evaluate)?
        };
        if evaluate && !done {
            self.evaluator.evaluate_candidates(&search, EVALUATED, f64::INFINITY)?;
            self.search_again(&mut search)?;
            self.left_out = search.left_out.unwrap_or(0.0);
        }
        self.steps += search.steps();
        self.solved += search.equilibria();
        self.found = search.candidates().into_iter().take(KEPT).cloned().collect();
        Ok(())
    }

    /// Decision that one of the best of a search has every disk in its place.
    fn enough(
        &mut self,
        search: &HoleSearch<'_, '_>,
        evaluate: bool,
    ) -> Result<bool, InvalidInput> {
        let least = (self.task.settings.tolerance * self.task.length()).powi(2);
        Ok(evaluate && self.evaluator.evaluate_candidates(search, 1, least)?)
    }

    /// One tendon; whether it is enough.
    fn one_tendon(
        &mut self,
        search: &mut HoleSearch<'t, 'a>,
        evaluate: bool,
    ) -> Result<bool, InvalidInput> {
        if let Some((azimuths, tensions)) = self.begin.start
            && self.search_from(search, (azimuths, tensions), Looks::Around, evaluate)?
        {
            return Ok(true);
        }
        if search.has_few_routings() {
            search.try_all();
            return Ok(false);
        }
        search.scan_tensions(&mut |search| self.enough(search, evaluate))
    }

    /// Several tendons, from all that a search may begin with; whether it is enough.
    fn several_tendons(
        &mut self,
        search: &mut HoleSearch<'t, 'a>,
        evaluate: bool,
    ) -> Result<bool, InvalidInput> {
        for ((azimuths, tensions), looks) in self.start_routings() {
            if self.task.is_stopped() {
                break;
            }
            if self.search_from(search, (&azimuths, &tensions), looks, evaluate)? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// From a routing; whether what that leads to is enough. The last bits of azimuths and tensions do not count.
    fn search_from(
        &mut self,
        search: &mut HoleSearch<'t, 'a>,
        (azimuths, tensions): (&PerHole, &[f64]),
        looks: Looks,
        evaluate: bool,
    ) -> Result<bool, InvalidInput> {
        let (task, count) = (self.task, search.count);
        let tensions: Vec<f64> = tensions.iter().map(|t| round_bits(*t)).collect();
        let mut around = |own: &mut Self, azimuths: &PerHole, tensions: &[f64]| {
            let tensions: Vec<f64> =
                tensions.iter().map(|t| round_bits(t / task.plan.unit)).collect();
            let holes = nearest_holes(task, azimuths, count);
            search.search_around(&holes, &tensions, &mut |search| own.enough(search, evaluate))
        };
        if looks != Looks::AnyAzimuth && around(self, azimuths, &tensions)? {
            return Ok(true);
        }
        if looks == Looks::Around || task.is_stopped() {
            return Ok(false);
        }
        match self.free_azimuths(azimuths.clone(), &tensions)? {
            Some(point) => around(self, &point.azimuths, &point.state.tensions),
            None => around(self, azimuths, &tensions),
        }
    }

    /// Descent with any azimuth.
    fn free_azimuths(
        &mut self,
        azimuths: PerHole,
        tensions: &[f64],
    ) -> Result<Option<Point>, InvalidInput> {
        let task = self.task;
        let robot = task.with_azimuths(&azimuths, &task.radii)?;
        let holes = (azimuths, task.radii.clone());
        let Some(point) = Point::at_tensions(task, robot, holes, tensions)? else {
            return Ok(None);
        };
        let freedom = Freedom { azimuths: true, ..Freedom::of_pulls() };
        let point = point.descend(task, &freedom, &mut self.steps)?;
        if task.bounds.is_none() {
            self.relaxed = self.relaxed.min(point.value);
        }
        Ok(Some(point))
    }

    /// From the best answer, until that leads to no nearer one: what a search that starts with it would do.
    fn search_again(&mut self, search: &mut HoleSearch<'t, 'a>) -> Result<(), InvalidInput> {
        for _ in 0..AGAIN.min(self.task.settings.max_iterations) {
            let Some(best) = &self.evaluator.best else { break };
            let before = best.value;
            let (azimuths, tensions) =
                (best.point.azimuths.clone(), best.shape.state.tensions.clone());
            let looks = if tensions.len() > 1 { Looks::Both } else { Looks::Around };
            if self.task.is_stopped()
                || self.search_from(search, (&azimuths, &tensions), looks, true)?
            {
                break;
            }
            self.evaluator.evaluate_candidates(search, EVALUATED, f64::INFINITY)?;
            if self.evaluator.value() >= NEARER * before {
                break;
            }
        }
        Ok(())
    }

    /// Any azimuth: descents from the nearest routings of a search among many holes, and from simple ones.
    fn solve_continuous(&mut self) -> Result<(), InvalidInput> {
        let task = self.task;
        let several = task.tendons() > 1 || self.begin.start.is_some();
        let begun = if several { self.start_routings() } else { vec![] };
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
        self.evaluator.pull_by_less()?;
        for begun in others {
            if self.evaluator.best.is_some() || self.descents(vec![begun.clone()])? {
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
            if let Some(point) = Point::at_tensions(task, robot, holes, &tensions)? {
                let point = point.descend(task, &freedom, &mut self.steps)?;
                let point = self.evaluator.enforce_bounds(point, freedom)?;
                self.evaluator.pull(point, None)?;
            }
            if task.is_stopped() || self.evaluator.is_met() {
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

    /// Bound on what holes cost, by a descent with any azimuth from the best ones.
    fn descend_any_azimuth(&mut self) -> Result<(), InvalidInput> {
        let task = self.task;
        if let Some(best) = self.evaluator.best.as_ref().filter(|best| !best.is_met(task)) {
            let freedom = Freedom::whole(task);
            let point = best.point.clone().descend(task, &freedom, &mut self.steps)?;
            let point = self.evaluator.enforce_bounds(point, freedom)?;
            self.relaxed = self.relaxed.min(point.value);
        }
        Ok(())
    }
}

/// Number rounded to 31 bits.
fn round_bits(value: f64) -> f64 {
    const LOST: u64 = 1 << 21;
    f64::from_bits((value.to_bits() + LOST / 2) & !(LOST - 1))
}
