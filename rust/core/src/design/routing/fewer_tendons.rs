//! Answers with fewer tendons, from which those with more begin: never worse than with the others unpulled.

use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use nalgebra::Vector3;

use super::answer::{Answer, Begin, ExtendedAnswer};
use super::canonical_task::CanonicalTask;
use super::solver::Solver;
use super::task::Task;
use crate::error::InvalidInput;
use crate::inverse::Range;
use crate::rod::Plan;

/// Sets of tendons that differ, at most, of which all are designed: of more, one for every number of tendons.
const MOST: usize = 16;

/// Designs of the tendons of a canonical task, or of some of them, each made once.
pub(super) struct TendonSubsets<'p> {
    canonical: &'p CanonicalTask,
    stop: &'p Arc<AtomicBool>,
    known: BTreeMap<(Vec<usize>, bool), Rc<Answer>>,
    /// All sets of tendons, which are few enough, are designed.
    all: bool,
}

impl<'p> TendonSubsets<'p> {
    pub(super) fn new(canonical: &'p CanonicalTask, stop: &'p Arc<AtomicBool>) -> Self {
        let classes = canonical.classes.last().map_or(0, |last| last + 1);
        let alike = |class| canonical.classes.iter().filter(|own| **own == class).count() + 1;
        let sets = (0..classes).fold(1_usize, |sets, class| sets.saturating_mul(alike(class)));
        Self { canonical, stop, known: BTreeMap::new(), all: sets <= MOST }
    }

    /// The answer with all tendons, and the steps and equilibria of all that were asked for.
    pub(super) fn run(mut self) -> Result<(Rc<Answer>, (usize, usize)), InvalidInput> {
        let all: Vec<usize> = (0..self.canonical.classes.len()).collect();
        let answer = self.answer(&all, true)?;
        let count = |sum: (usize, usize), own: &Rc<Answer>| (sum.0 + own.steps, sum.1 + own.solved);
        let mut each: Vec<&Rc<Answer>> = Vec::new();
        for own in self.known.values() {
            if !each.iter().any(|other| Rc::ptr_eq(other, own)) {
                each.push(own);
            }
        }
        Ok((answer, each.into_iter().fold((0, 0), count)))
    }

    /// Some of the tendons, by number, within their bounds or without.
    fn answer(&mut self, tendons: &[usize], bounded: bool) -> Result<Rc<Answer>, InvalidInput> {
        // Each set is designed once.
        let bounded = bounded && self.canonical.bounds.is_some();
        let key = (tendons.to_vec(), bounded);
        if let Some(known) = self.known.get(&key) {
            return Ok(Rc::clone(known));
        }
        // The task with these tendons and their bounds.
        let canonical = self.canonical;
        let some = tendons.iter().map(|k| canonical.robot.tendons()[*k].clone());
        let robot = canonical.robot.with_tendons(some.collect())?;
        let bounds = canonical.bounds.as_ref().filter(|_| bounded).map(|range| {
            let (lower, upper) = tendons.iter().map(|k| range.at(*k)).unzip();
            Range::new("bounds", lower, upper)
        });
        let bounds = bounds.transpose()?;
        let task = Task {
            robot: &robot,
            targets: &canonical.targets,
            bounds: bounds.as_ref(),
            settings: &canonical.settings,
            stop: self.stop,
            plan: Plan::new(&robot, canonical.settings.rod)?,
            radii: robot
                .paths()
                .iter()
                .map(|path| path.holes.iter().map(Vector3::norm).collect())
                .collect(),
        };
        // Bounds that do not bind must not cost anything: what is nearest without them is.
        let free = if bounded { Some(self.answer(tendons, false)?) } else { None };
        let answer = match &free {
            Some(free) if within_bounds(&task, &free.best.point.displacements) => Rc::clone(free),
            _ => {
                // Answers with a tendon less are where this one begins.
                let mut fewer = Vec::new();
                for k in self.removable(tendons) {
                    let less: Vec<usize> =
                        tendons.iter().copied().filter(|own| *own != tendons[k]).collect();
                    fewer.push(ExtendedAnswer::new(&task, &*self.answer(&less, bounded)?, k));
                }
                let whole = tendons.len() == canonical.classes.len();
                let start = canonical.start.as_ref().filter(|_| whole);
                let found = free.as_ref().map_or(&[][..], |free| &free.found);
                Rc::new(Solver::new(&task, Begin { start, fewer, found }).run()?)
            }
        };
        self.known.insert(key, Rc::clone(&answer));
        Ok(answer)
    }

    /// Places of the tendons of which one may be left out: the last of every class, or the last of all.
    fn removable(&self, tendons: &[usize]) -> Vec<usize> {
        if tendons.len() < 2 {
            return Vec::new();
        }
        let class = |place: usize| tendons.get(place).map(|k| self.canonical.classes[*k]);
        let last = |place: &usize| class(*place) != class(place + 1);
        let places = (0..tendons.len()).filter(last);
        if self.all { places.collect() } else { vec![tendons.len() - 1] }
    }
}

fn within_bounds(task: &Task<'_>, pulls: &[f64]) -> bool {
    let inside = |(k, pull): (usize, &f64)| {
        let (low, high) = task.bound(k);
        (low..=high).contains(pull)
    };
    pulls.iter().enumerate().all(inside)
}
