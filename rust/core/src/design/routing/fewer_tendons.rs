//! Answers with fewer tendons, from which those with more begin: never worse than with the others unpulled.

use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use nalgebra::Vector3;

use super::canonical_task::Posed;
use super::evaluation::Judge;
use super::solver::{Answer, Begin, Design};
use super::task::{Holes, PerHole, Task};
use crate::error::InvalidInput;
use crate::inverse::Range;
use crate::rod::Plan;

/// Sets of tendons that differ, at most, of which all are designed: of more, one for every number of tendons.
const MOST: usize = 16;
/// How much worse the rod's own rounding may make a shape.
const ROUNDING: f64 = 1.0 + 1e-9;

/// An answer with one tendon less, and that tendon beside the others, unpulled.
pub(super) struct Lifted {
    pub(super) azimuths: PerHole,
    pub(super) tensions: Vec<f64>,
    /// With any azimuth.
    pub(super) relaxed: f64,
    radii: PerHole,
    holes: Option<Holes>,
    displacements: Vec<f64>,
    value: f64,
    /// The tendon that is new, and the one that it goes beside.
    new: usize,
    beside: usize,
}

impl Lifted {
    /// Of a task with one tendon more.
    fn new(task: &Task<'_>, answer: &Answer, new: usize) -> Self {
        let best = &answer.best;
        let mut tensions = best.shape.state.tensions.clone();
        let most = (0..tensions.len()).max_by(|a, b| tensions[*a].total_cmp(&tensions[*b]));
        let donor = most.unwrap_or(0);
        let along = |own: &[f64]| -> Vec<f64> {
            (0..=task.end(new)).map(|disk| own[disk.min(own.len() - 1)]).collect()
        };
        let (mut azimuths, mut radii) = (best.point.azimuths.clone(), best.point.radii.clone());
        azimuths.insert(new, along(&azimuths[donor]));
        let mut own = task.radii[new].clone();
        if let Some((low, high)) = task.settings.radius {
            for radius in &mut own {
                *radius = radius.clamp(low, high);
            }
        }
        radii.insert(new, own);
        let end = best.point.azimuths[donor].len() - 1;
        let holes = best.holes.as_ref().map(|holes| {
            let row = |(disk, row): (usize, &Vec<usize>)| {
                let mut row = row.clone();
                let hole = if disk <= task.end(new) { holes[disk.min(end)][donor] } else { 0 };
                row.insert(new, hole);
                row
            };
            holes.iter().enumerate().map(row).collect()
        });
        let mut displacements = best.point.displacements.clone();
        displacements.insert(new, 0.0_f64.clamp(task.bound(new).0, task.bound(new).1));
        tensions.insert(new, 0.0);
        let beside = donor + usize::from(new <= donor);
        let (relaxed, value) = (answer.relaxed, best.value);
        Self { azimuths, tensions, relaxed, radii, holes, displacements, value, new, beside }
    }

    /// Solves for its shape: held at its rest length, or where that pulls it, released as far as it may be.
    pub(super) fn judge(
        &self,
        task: &Task<'_>,
        judge: &mut Judge<'_, '_>,
    ) -> Result<(), InvalidInput> {
        let high = task.bound(self.new).1;
        let released = if high.is_finite() { high } else { task.length() };
        for pull in [self.displacements[self.new], released] {
            let mut pulls = self.displacements.clone();
            pulls[self.new] = pull;
            let holes = (self.azimuths.clone(), self.radii.clone());
            let numbers = self.holes.clone().zip(task.settings.holes);
            if judge.given(holes, numbers, &pulls, ROUNDING * self.value)? {
                break;
            }
        }
        Ok(())
    }

    /// The pull of one tendon shared by it and the new one, so far apart in azimuth.
    pub(super) fn shared(&self, apart: f64) -> (PerHole, Vec<f64>) {
        let (mut azimuths, mut tensions) = (self.azimuths.clone(), self.tensions.clone());
        for (k, by) in [(self.new, 0.5 * apart), (self.beside, -0.5 * apart)] {
            azimuths[k].iter_mut().for_each(|azimuth| *azimuth += by);
            tensions[k] = 0.5 * self.tensions[self.beside];
        }
        (azimuths, tensions)
    }
}

/// Designs of the tendons of a posed task, or of some of them, each made once.
pub(super) struct Designs<'p> {
    posed: &'p Posed,
    stop: &'p Arc<AtomicBool>,
    known: BTreeMap<(Vec<usize>, bool), Rc<Answer>>,
    /// Whether there are few enough sets of tendons.
    all: bool,
}

impl<'p> Designs<'p> {
    pub(super) fn new(posed: &'p Posed, stop: &'p Arc<AtomicBool>) -> Self {
        let classes = posed.classes.last().map_or(0, |last| last + 1);
        let alike = |class| posed.classes.iter().filter(|own| **own == class).count() + 1;
        let sets = (0..classes).fold(1_usize, |sets, class| sets.saturating_mul(alike(class)));
        Self { posed, stop, known: BTreeMap::new(), all: sets <= MOST }
    }

    /// The answer with all tendons, and the steps and equilibria of all that were asked for.
    pub(super) fn run(mut self) -> Result<(Rc<Answer>, (usize, usize)), InvalidInput> {
        let all: Vec<usize> = (0..self.posed.classes.len()).collect();
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
        let bounded = bounded && self.posed.bounds.is_some();
        let key = (tendons.to_vec(), bounded);
        if let Some(known) = self.known.get(&key) {
            return Ok(Rc::clone(known));
        }
        let posed = self.posed;
        let some = tendons.iter().map(|k| posed.robot.tendons()[*k].clone());
        let robot = posed.robot.with_tendons(some.collect())?;
        let bounds = posed.bounds.as_ref().filter(|_| bounded).map(|range| {
            let (lower, upper) = tendons.iter().map(|k| range.at(*k)).unzip();
            Range::new("bounds", lower, upper)
        });
        let bounds = bounds.transpose()?;
        let task = Task {
            robot: &robot,
            targets: &posed.targets,
            bounds: bounds.as_ref(),
            settings: &posed.settings,
            stop: self.stop,
            plan: Plan::new(&robot, posed.settings.rod)?,
            radii: robot
                .paths()
                .iter()
                .map(|path| path.holes.iter().map(Vector3::norm).collect())
                .collect(),
        };
        // Bounds that do not bind must not cost anything: what is nearest without them is.
        let free = if bounded { Some(self.answer(tendons, false)?) } else { None };
        let answer = match &free {
            Some(free) if within(&task, &free.best.point.displacements) => Rc::clone(free),
            _ => {
                let mut fewer = Vec::new();
                for k in self.spared(tendons) {
                    let less: Vec<usize> =
                        tendons.iter().copied().filter(|own| *own != tendons[k]).collect();
                    fewer.push(Lifted::new(&task, &*self.answer(&less, bounded)?, k));
                }
                let whole = tendons.len() == posed.classes.len();
                let start = posed.start.as_ref().filter(|_| whole);
                let found = free.as_ref().map_or(&[][..], |free| &free.found);
                Rc::new(Design::new(&task, Begin { start, fewer, found }).run()?)
            }
        };
        self.known.insert(key, Rc::clone(&answer));
        Ok(answer)
    }

    /// Places of the tendons of which one may be left out: the last of every class, or the last of all.
    fn spared(&self, tendons: &[usize]) -> Vec<usize> {
        if tendons.len() < 2 {
            return Vec::new();
        }
        let class = |place: usize| tendons.get(place).map(|k| self.posed.classes[*k]);
        let last = |place: &usize| class(*place) != class(place + 1);
        let places = (0..tendons.len()).filter(last);
        if self.all { places.collect() } else { vec![tendons.len() - 1] }
    }
}

fn within(task: &Task<'_>, pulls: &[f64]) -> bool {
    let inside = |(k, pull): (usize, &f64)| {
        let (low, high) = task.bound(k);
        (low..=high).contains(pull)
    };
    pulls.iter().enumerate().all(inside)
}
