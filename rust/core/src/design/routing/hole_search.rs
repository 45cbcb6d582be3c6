//! Which holes: beams over tensions, and around what is best so far.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::beam_search::{Leaf, Window, search};
use super::best_tensions::{Candidate, Follower};
use super::subsegment_table::{Choice, Field};
use super::task::{Holes, PerHole, Task};
use crate::error::InvalidInput;

/// Whether what a search has found is enough.
pub(super) type Enough<'e, 't, 'a> = dyn FnMut(&Search<'t, 'a>) -> Result<bool, InvalidInput> + 'e;

/// Tensions of one tendon that are tried, as multiples of what the wanted bends ask for where all of it pulls on
/// one side: from a share of their mean on, each so much more than the one before, up to a multiple of the largest,
/// and to a load that no straight subsegment bears.
const FROM: f64 = 0.3;
const RATIO: f64 = 1.15;
const TO: f64 = 8.0;
const LOAD: f64 = 24.0;
/// Leaves of a beam whose tensions are polished.
const POLISHED: usize = 12;
/// How far from its tensions a round looks, in shares of them, and how much nearer its answer must be to go on.
const NEAR: f64 = 0.03;
const WIDE: f64 = 0.3;
const NEARER: f64 = 1.0 - 1e-6;
/// Tensions below this share of the largest are given that room.
const IDLE: f64 = 0.1;
/// Turns that tell two azimuths apart.
const SAME: f64 = 1e-9;
/// Tendons whose neighbouring holes are searched all at once, at most: three each make 27 choices per disk.
const JOINT: usize = 3;

/// What was found so far.
pub(super) struct Search<'t, 'a> {
    pub(super) task: &'t Task<'a>,
    /// Holes per disk.
    pub(super) count: usize,
    pub(super) follower: Follower,
    /// Every routing whose tensions were polished.
    known: BTreeMap<Holes, Candidate>,
    /// Other valleys of the same routings, where all are looked at.
    seconds: Vec<Candidate>,
    /// Routings none of whose neighbours is nearer, and their values.
    rested: BTreeMap<Holes, f64>,
    pub(super) solved: usize,
    /// Rounds of beams.
    pub(super) rounds: usize,
    /// Least value of what was left out, where all routings were looked at.
    pub(super) left_out: Option<f64>,
}

impl<'t, 'a> Search<'t, 'a> {
    pub(super) fn new(task: &'t Task<'a>, count: usize) -> Self {
        Self {
            task,
            count,
            follower: Follower::new(task),
            known: BTreeMap::new(),
            seconds: Vec::new(),
            rested: BTreeMap::new(),
            solved: 0,
            rounds: 0,
            left_out: None,
        }
    }

    /// Equilibria of subsegments.
    pub(super) fn solved(&self) -> usize {
        self.solved + self.follower.solved()
    }

    /// Steps on tensions and rounds.
    pub(super) fn steps(&self) -> usize {
        self.follower.steps + self.rounds
    }

    /// What was found, nearest first.
    pub(super) fn found(&self) -> Vec<&Candidate> {
        let mut all: Vec<_> = self.known.values().chain(&self.seconds).collect();
        all.sort_by(|a, b| a.value.total_cmp(&b.value).then_with(|| a.holes.cmp(&b.holes)));
        all
    }

    pub(super) fn best(&self) -> Option<&Candidate> {
        self.found().first().copied()
    }

    /// Polishes the tensions of a routing and keeps it; whether it is the best.
    pub(super) fn try_holes(&mut self, holes: &Holes, tensions: &[f64]) -> bool {
        let least = self.best().map_or(f64::INFINITY, |best| best.value);
        let polished = self.follower.polish(self.task, holes, self.count, tensions);
        let Some(candidate) = polished else { return false };
        let better = candidate.value < NEARER * least;
        let known = self.known.get(holes).is_some_and(|known| known.value <= candidate.value);
        let second =
            if known { Some(candidate) } else { self.known.insert(holes.clone(), candidate) };
        // The rod may not follow the displacements of the nearest.
        if self.few() {
            self.seconds.extend(second);
        }
        better
    }

    /// Polishes the nearest leaves; whether one of them is the best.
    fn keep(&mut self, leaves: Vec<Leaf>) -> bool {
        self.rounds += 1;
        let mut better = false;
        for leaf in leaves.into_iter().take(POLISHED) {
            let known = self.known.get(&leaf.holes).map_or(f64::INFINITY, |known| known.value);
            if leaf.value < 0.5 * known && !self.task.stopped() {
                better |= self.try_holes(&leaf.holes, &leaf.tensions);
            }
        }
        better
    }

    /// What all disks may have: `own` of every tendon that comes by.
    pub(super) fn choices(&self, own: impl Fn(usize, usize) -> Vec<usize>) -> Vec<Vec<Choice>> {
        let tendons = self.task.tendons();
        let disk = |i: usize| {
            let mut all: Vec<Choice> = vec![Vec::new()];
            for k in 0..tendons {
                let may = if i <= self.task.end(k) { own(i, k) } else { vec![0] };
                let longer = all.iter().flat_map(|begun| {
                    may.iter().map(move |hole| begun.iter().copied().chain([*hole]).collect())
                });
                all = longer.collect();
            }
            all
        };
        (0..self.task.disks()).map(disk).collect()
    }

    /// One round among choices, at tensions and within a share of them.
    fn round(&mut self, choices: Vec<Vec<Choice>>, tensions: &[f64], share: f64) -> bool {
        let mut field = Field::new(self.task, choices, self.count);
        // What is hardly pulled may be by as much as the others.
        let most = tensions.iter().fold(0.0_f64, |most, t| most.max(*t));
        let width: Vec<f64> = tensions.iter().map(|t| share * t.max(IDLE * most)).collect();
        let found = if field.fill(self.task, tensions) {
            search(self.task, &field, &Window { tensions, width: &width })
        } else {
            None
        };
        self.solved += field.solved();
        found.is_some_and(|found| self.keep(found))
    }

    /// One tendon: all holes, over all tensions that the wanted bends may ask for. Ends early where `enough` says so.
    pub(super) fn over_tensions(
        &mut self,
        enough: &mut Enough<'_, 't, 'a>,
    ) -> Result<bool, InvalidInput> {
        let task = self.task;
        let bends = task.bends();
        let asked: Vec<f64> =
            bends.iter().enumerate().map(|(i, (_, angle))| task.tension_for(i, *angle)).collect();
        let mean = (asked.iter().map(|t| t * t).sum::<f64>() / asked.len() as f64).sqrt();
        let largest = asked.iter().fold(0.0_f64, |most, t| most.max(*t));
        let last = (TO * largest).min(LOAD / task.plan.slenderness);
        let mut tension = (FROM * mean).min(last);
        let all = self.choices(|_, _| (0..self.count).collect());
        let mut field = Field::new(task, all.clone(), self.count);
        let mut done = false;
        loop {
            let width = [tension * (RATIO - 1.0)];
            let window = Window { tensions: &[tension], width: &width };
            let filled = field.fill(task, &[tension]);
            let Some(found) = filled.then(|| search(task, &field, &window)).flatten() else {
                break;
            };
            if self.keep(found) && enough(self)? {
                done = true;
                break;
            }
            if tension >= last {
                break;
            }
            tension = (tension * RATIO).min(last);
        }
        self.solved += field.solved();
        // Once more where the best ones are: their neighbours at their own tension.
        while let Some(best) = self.best().filter(|_| !done && !task.stopped()) {
            let tensions = best.tensions.clone();
            if !self.round(all.clone(), &tensions, NEAR) {
                break;
            }
            done = enough(self)?;
        }
        Ok(done)
    }

    /// Several tendons, from a routing: rounds over neighbouring holes of all at once, and over each one's holes, in
    /// turn, until none of them brings it nearer.
    pub(super) fn around(
        &mut self,
        start: &Holes,
        tensions: &[f64],
        enough: &mut Enough<'_, 't, 'a>,
    ) -> Result<bool, InvalidInput> {
        let (task, count) = (self.task, self.count);
        let first = self.follower.polish(task, start, count, tensions);
        let Some(mut here) = first else { return Ok(false) };
        self.known.entry(start.clone()).or_insert_with(|| here.clone());
        let kinds = task.tendons() + usize::from(task.tendons() <= JOINT);
        let mut still = 0;
        for turn in 0..kinds.saturating_mul(task.settings.max_iterations) {
            let rested = self.rested.get(&here.holes);
            if task.stopped() || rested.is_some_and(|value| here.value >= NEARER * value) {
                return Ok(false);
            }
            match self.beside(&here, kinds - 1 - turn % kinds) {
                Some(best) => {
                    here = best;
                    still = 0;
                    if enough(self)? {
                        return Ok(true);
                    }
                }
                None => still += 1,
            }
            if still == kinds {
                self.rested.insert(here.holes, here.value);
                break;
            }
        }
        enough(self)
    }

    /// What is nearer than a routing among its neighbours: with other holes of one tendon, or beyond the last, with
    /// neighbouring holes of all.
    fn beside(&mut self, here: &Candidate, kind: usize) -> Option<Candidate> {
        let (task, count) = (self.task, self.count);
        let choices = self.choices(|disk, tendon| {
            let own = here.holes[disk][tendon];
            if kind == task.tendons() {
                let mut near = vec![own, (own + 1) % count, (own + count - 1) % count];
                near.sort_unstable();
                near.dedup();
                near
            } else if kind == tendon {
                (0..count).collect()
            } else {
                vec![own]
            }
        });
        // What is known elsewhere is no neighbour of what is here: the round's own best counts.
        let known = std::mem::take(&mut self.known);
        self.round(choices, &here.tensions, WIDE);
        let best = self.best().cloned();
        let found = std::mem::replace(&mut self.known, known);
        for (holes, candidate) in found {
            let known = self.known.get(&holes);
            if known.is_none_or(|known| candidate.value < known.value) {
                self.known.insert(holes, candidate);
            }
        }
        best.filter(|best| best.value < NEARER * here.value)
    }
}

/// The nearest of so many holes, from disk to disk no further on than a tendon may.
pub(super) fn numbers(task: &Task<'_>, azimuths: &PerHole, count: usize) -> Holes {
    let mut holes = vec![vec![0; task.tendons()]; task.disks()];
    for (k, own) in azimuths.iter().enumerate() {
        let mut last = None;
        for (disk, azimuth) in own.iter().enumerate() {
            // Holes that are as far off but for a rounding are equally near.
            let far = |hole: &usize| {
                let turns = (azimuth - task.azimuth(*hole, count)) / TAU;
                ((turns - turns.round()).abs() / SAME).round()
            };
            let nearest = (0..count)
                .filter(|hole| last.is_none_or(|last| task.allows(last, *hole, count)))
                .min_by(|a, b| far(a).total_cmp(&far(b)));
            let hole = nearest.unwrap_or(0);
            holes[disk][k] = hole;
            last = Some(hole);
        }
    }
    holes
}
