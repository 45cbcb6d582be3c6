//! Search for holes: beams over tensions, and around the best routing so far.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::beam_search::{Leaf, Window, beam_search};
use super::best_tensions::{Candidate, TensionSolver};
use super::subsegment_table::{Choice, SubsegmentTables};
use super::task::{Holes, PerHole, Task};
use crate::error::InvalidInput;

/// Decision that a search has found enough.
pub(super) type Enough<'e, 't, 'a> =
    dyn FnMut(&HoleSearch<'t, 'a>) -> Result<bool, InvalidInput> + 'e;

/// Tensions of one tendon that are tried, as multiples of what the wanted bends ask for where all of it pulls on
/// one side: from a share of their mean on, each so much more than the one before, up to a multiple of the largest,
/// and to a load that no straight subsegment bears.
const FROM: f64 = 0.3;
const RATIO: f64 = 1.15;
const TO: f64 = 8.0;
const LOAD: f64 = 24.0;
/// Leaves of a beam whose best tensions are solved for.
const REFINED: usize = 12;
/// Widths of a round about its tensions, in shares of them, and factor by which its answer must be nearer to go on.
const NEAR: f64 = 0.03;
const WIDE: f64 = 0.3;
const NEARER: f64 = 1.0 - 1e-6;
/// Tensions below this share of the largest are given that room.
const IDLE: f64 = 0.1;
/// Turns that tell two azimuths apart.
const SAME: f64 = 1e-9;
/// Tendons whose neighbouring holes are searched all at once, at most: three each make 27 choices per disk.
const JOINT: usize = 3;

/// Search for the holes of all tendons, and its answers so far.
pub(super) struct HoleSearch<'t, 'a> {
    pub(super) task: &'t Task<'a>,
    /// Holes per disk.
    pub(super) count: usize,
    pub(super) tension_solver: TensionSolver,
    /// Every routing whose best tensions were solved for.
    known: BTreeMap<Holes, Candidate>,
    /// Other valleys of the same routings, where all are looked at.
    seconds: Vec<Candidate>,
    /// Routings none of whose neighbours is nearer, and their values.
    local_minima: BTreeMap<Holes, f64>,
    pub(super) solved: usize,
    /// Rounds of beams.
    pub(super) rounds: usize,
    /// Least value of what was left out, where all routings were looked at.
    pub(super) left_out: Option<f64>,
}

impl<'t, 'a> HoleSearch<'t, 'a> {
    pub(super) fn new(task: &'t Task<'a>, count: usize) -> Self {
        Self {
            task,
            count,
            tension_solver: TensionSolver::new(task),
            known: BTreeMap::new(),
            seconds: Vec::new(),
            local_minima: BTreeMap::new(),
            solved: 0,
            rounds: 0,
            left_out: None,
        }
    }

    /// Equilibria of subsegments.
    pub(super) fn equilibria(&self) -> usize {
        self.solved + self.tension_solver.equilibria()
    }

    /// Steps on tensions and rounds.
    pub(super) fn steps(&self) -> usize {
        self.tension_solver.steps + self.rounds
    }

    /// Routings that were found, nearest first.
    pub(super) fn candidates(&self) -> Vec<&Candidate> {
        let mut all: Vec<_> = self.known.values().chain(&self.seconds).collect();
        all.sort_by(|a, b| a.value.total_cmp(&b.value).then_with(|| a.holes.cmp(&b.holes)));
        all
    }

    pub(super) fn best(&self) -> Option<&Candidate> {
        self.candidates().first().copied()
    }

    /// Best tensions of a routing, which is kept; true if it is the nearest.
    pub(super) fn try_holes(&mut self, holes: &Holes, tensions: &[f64]) -> bool {
        let least = self.best().map_or(f64::INFINITY, |best| best.value);
        let best = self.tension_solver.solve(self.task, holes, self.count, tensions);
        let Some(candidate) = best else { return false };
        let better = candidate.value < NEARER * least;
        let known = self.known.get(holes).is_some_and(|known| known.value <= candidate.value);
        let second =
            if known { Some(candidate) } else { self.known.insert(holes.clone(), candidate) };
        // The rod may not follow the displacements of the nearest.
        if self.has_few_routings() {
            self.seconds.extend(second);
        }
        better
    }

    /// Best tensions of the nearest leaves; true if one of them is the nearest.
    fn refine_leaves(&mut self, leaves: Vec<Leaf>) -> bool {
        self.rounds += 1;
        let mut better = false;
        for leaf in leaves.into_iter().take(REFINED) {
            let known = self.known.get(&leaf.holes).map_or(f64::INFINITY, |known| known.value);
            if leaf.value < 0.5 * known && !self.task.is_stopped() {
                better |= self.try_holes(&leaf.holes, &leaf.tensions);
            }
        }
        better
    }

    /// Choices of all disks: `own` of every tendon that comes by.
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
        let mut tables = SubsegmentTables::new(self.task, choices, self.count);
        // What is hardly pulled may be by as much as the others.
        let most = tensions.iter().fold(0.0_f64, |most, t| most.max(*t));
        let width: Vec<f64> = tensions.iter().map(|t| share * t.max(IDLE * most)).collect();
        let found = if tables.fill(self.task, tensions) {
            beam_search(self.task, &tables, &Window { tensions, width: &width })
        } else {
            None
        };
        self.solved += tables.equilibria();
        found.is_some_and(|found| self.refine_leaves(found))
    }

    /// One tendon: all holes, over all tensions that the wanted bends may ask for. Ends early where `enough` says so.
    pub(super) fn scan_tensions(
        &mut self,
        enough: &mut Enough<'_, 't, 'a>,
    ) -> Result<bool, InvalidInput> {
        // Row of tensions, from a share of the mean of what the bends ask for.
        let task = self.task;
        let bends = task.bends();
        let asked: Vec<f64> =
            bends.iter().enumerate().map(|(i, (_, angle))| task.tension_for(i, *angle)).collect();
        let mean = (asked.iter().map(|t| t * t).sum::<f64>() / asked.len() as f64).sqrt();
        let largest = asked.iter().fold(0.0_f64, |most, t| most.max(*t));
        let last = (TO * largest).min(LOAD / task.plan.slenderness);
        let mut tension = (FROM * mean).min(last);
        // Tables are continued from one tension to the next.
        let all = self.choices(|_, _| (0..self.count).collect());
        let mut tables = SubsegmentTables::new(task, all.clone(), self.count);
        let mut done = false;
        loop {
            // Beam over the window up to the next tension.
            let width = [tension * (RATIO - 1.0)];
            let window = Window { tensions: &[tension], width: &width };
            let filled = tables.fill(task, &[tension]);
            let Some(found) = filled.then(|| beam_search(task, &tables, &window)).flatten() else {
                break;
            };
            if self.refine_leaves(found) && enough(self)? {
                done = true;
                break;
            }
            if tension >= last {
                break;
            }
            tension = (tension * RATIO).min(last);
        }
        self.solved += tables.equilibria();
        // Once more where the best ones are: their neighbours at their own tension.
        while let Some(best) = self.best().filter(|_| !done && !task.is_stopped()) {
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
    pub(super) fn search_around(
        &mut self,
        start: &Holes,
        tensions: &[f64],
        enough: &mut Enough<'_, 't, 'a>,
    ) -> Result<bool, InvalidInput> {
        let (task, count) = (self.task, self.count);
        let first = self.tension_solver.solve(task, start, count, tensions);
        let Some(mut here) = first else { return Ok(false) };
        self.known.entry(start.clone()).or_insert_with(|| here.clone());
        let kinds = task.tendons() + usize::from(task.tendons() <= JOINT);
        let mut still = 0;
        for turn in 0..kinds.saturating_mul(task.settings.max_iterations) {
            let local_minima = self.local_minima.get(&here.holes);
            if task.is_stopped() || local_minima.is_some_and(|value| here.value >= NEARER * value) {
                return Ok(false);
            }
            match self.nearer_neighbour(&here, kinds - 1 - turn % kinds) {
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
                self.local_minima.insert(here.holes, here.value);
                break;
            }
        }
        enough(self)
    }

    /// Nearest neighbour of a routing, if it is nearer: with other holes of one tendon, or beyond the last, with
    /// neighbouring holes of all.
    fn nearer_neighbour(&mut self, here: &Candidate, kind: usize) -> Option<Candidate> {
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
pub(super) fn nearest_holes(task: &Task<'_>, azimuths: &PerHole, count: usize) -> Holes {
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
