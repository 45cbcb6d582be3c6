//! The objective of the swarms of one search, which hands over to Newton's method.

use super::super::clearance::Circle;
use super::super::least_energy::descend;
use super::super::newton_inverse::{Inverse, Solver};
use super::super::tip_equations::HEADING_WEIGHT;
use super::super::trunk::Trunk;
use super::Unknowns;
use super::cost::{depth, length_error, project_onto_target, tip_error};
use super::result::SwarmInverse;
use super::watch::WatchDecision;
use crate::solve::pso::{Objective, Progress, Report};
use crate::status::Status;

/// Value below which Newton's method is tried, as a share of the trunk's length; and the share of a
/// tried value that is tried next.
const NEAR: f64 = 0.1;
const NEARER: f64 = 0.5;

/// Handover from the swarm to Newton's method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Handover {
    /// The best one is the answer.
    None,
    /// The best one is where Newton's method starts, as soon as it gets to the target from there.
    Polish,
    /// All are brought onto the target; energy and circles choose among them.
    Constrain,
}

/// Watches the swarms of one search and evaluates their points. Values are in units of the trunk's
/// length.
pub(super) struct SwarmObjective<'s, 'a> {
    solver: Solver<'a>,
    unknowns: Unknowns,
    handover: Handover,
    circles: &'s [Circle],
    watch: &'s mut dyn FnMut(&Progress) -> WatchDecision,
    turns: Vec<f64>,
    /// The last move.
    last: Option<Progress>,
    /// Lowest value of the swarm in work, and its turns.
    lowest: (f64, Vec<f64>),
    /// No point of the swarm in work was evaluated yet.
    first_evaluation: bool,
    /// The starts of a swarm that follows one without an answer: Newton's method is tried from all.
    swarm_starts: Vec<Vec<f64>>,
    /// Value below which Newton's method is tried next, and the one that it was tried at.
    polish_below: f64,
    polished_at: f64,
    polish_count: usize,
    /// Energy and turns of the answer; unsettled as long as the energy has no minimum there.
    answer: Option<(f64, Vec<f64>)>,
    /// The answer was found; the watcher wants no other.
    done: bool,
    finish: bool,
    /// Lowest value of every swarm, with its turns.
    ends: Vec<(f64, Vec<f64>)>,
    history: Vec<f64>,
    moves: usize,
    evaluations: usize,
}

/// The watcher wants nothing any more.
pub(super) struct Abandoned;

impl Objective for SwarmObjective<'_, '_> {
    type Error = Abandoned;

    fn values(&mut self, points: &[f64], n: usize, values: &mut [f64]) -> Result<(), Abandoned> {
        let scale = self.scale();
        let again =
            self.handover == Handover::Polish && self.first_evaluation && !self.ends.is_empty();
        self.first_evaluation = false;
        for (value, point) in values.iter_mut().zip(points.chunks_exact(n)) {
            let current = self.value_of(point);
            if current < self.lowest.0 {
                self.lowest.0 = current;
                self.lowest.1.clear();
                let plain =
                    self.unknowns == Unknowns::Bends && self.handover != Handover::Constrain;
                self.lowest.1.extend_from_slice(if plain { point } else { &self.turns });
            }
            *value = scale * current;
            if again {
                let plain = self.unknowns == Unknowns::Bends;
                self.swarm_starts.push(if plain { point.to_vec() } else { self.turns.clone() });
            }
        }
        Ok(())
    }

    fn watch(&mut self, progress: &Progress) -> Result<bool, Abandoned> {
        self.last = Some(*progress);
        match (self.watch)(progress) {
            WatchDecision::GoOn => {}
            WatchDecision::Finish => {
                self.finish = true;
                return Ok(true);
            }
            WatchDecision::Abandon => return Err(Abandoned),
        }
        for turns in std::mem::take(&mut self.swarm_starts) {
            if !self.done {
                self.polish_from(&turns);
            }
        }
        if self.handover == Handover::Polish && !self.done && self.lowest.0 < self.polish_below {
            self.polish_best();
        }
        Ok(self.done)
    }
}

impl<'s, 'a> SwarmObjective<'s, 'a> {
    pub(super) fn new(
        solver: Solver<'a>,
        unknowns: Unknowns,
        handover: Handover,
        circles: &'s [Circle],
        watch: &'s mut dyn FnMut(&Progress) -> WatchDecision,
    ) -> Self {
        Self {
            solver,
            unknowns,
            handover,
            circles,
            watch,
            turns: Vec::new(),
            last: None,
            lowest: (f64::INFINITY, Vec::new()),
            first_evaluation: true,
            swarm_starts: Vec::new(),
            polish_below: NEAR,
            polished_at: f64::INFINITY,
            polish_count: 0,
            answer: None,
            done: false,
            finish: false,
            ends: Vec::new(),
            history: Vec::new(),
            moves: 0,
            evaluations: 0,
        }
    }

    /// Scale of the values that the swarm reports: metres, or energies in 1/m.
    fn scale(&self) -> f64 {
        if self.handover == Handover::Constrain {
            1.0 / self.solver.total_length
        } else {
            self.solver.total_length
        }
    }

    /// Value of a particle. Where its coordinates are not the turns, these are written to `turns`.
    fn value_of(&mut self, point: &[f64]) -> f64 {
        if self.unknowns == Unknowns::Points {
            return length_error(&self.solver, point, &mut self.turns);
        }
        if self.handover == Handover::Constrain {
            self.turns.clear();
            self.turns.extend_from_slice(point);
            return project_onto_target(&mut self.solver, &mut self.turns, self.circles).value;
        }
        tip_error(&self.solver, point) + depth(&self.solver, point, self.circles)
    }

    /// Newton's method from the best point.
    fn polish_best(&mut self) {
        self.polished_at = self.lowest.0;
        self.polish_below = NEARER * self.polished_at;
        let turns = std::mem::take(&mut self.lowest.1);
        self.polish_from(&turns);
        self.lowest.1 = turns;
    }

    /// Newton's method: onto the target, and to the least energy nearby.
    fn polish_from(&mut self, turns: &[f64]) {
        self.polish_count += 1;
        self.solver.try_start(turns);
        let Some((energy, stationary, turns)) = self.solver.best.take() else { return };
        self.done = stationary;
        if stationary || self.answer.as_ref().is_none_or(|(least, _)| energy < *least) {
            self.answer = Some((energy, turns));
        }
    }

    /// Before every swarm.
    pub(super) fn begin(&mut self) {
        self.first_evaluation = true;
        self.polish_below = NEAR;
        self.polished_at = f64::INFINITY;
        self.lowest.0 = f64::INFINITY;
        self.lowest.1.clear();
    }

    /// After every swarm: takes its count and its best point. Returns whether it was the last one.
    pub(super) fn end(&mut self, report: &Report, history: &[f64]) -> bool {
        self.moves += report.iterations;
        self.evaluations += report.evaluations;
        let mut least = self.history.last().copied().unwrap_or(f64::INFINITY);
        self.history.extend(history.iter().map(|value| {
            least = least.min(*value);
            least
        }));
        match self.handover {
            Handover::None => self.done = report.status == Status::Converged,
            Handover::Polish if !self.done && self.lowest.0 < self.polished_at => {
                self.polish_best();
            }
            Handover::Polish => {}
            Handover::Constrain => self.select_clear(),
        }
        self.ends.push(self.lowest.clone());
        self.done || self.finish
    }

    /// Among circles: the swarm's best is the answer if it is clear of them, and so is the least energy
    /// nearby if that is clear as well.
    fn select_clear(&mut self) {
        let mut turns = self.lowest.1.clone();
        if turns.is_empty() {
            return;
        }
        self.polish_count += 1;
        let solver = &mut self.solver;
        self.done = project_onto_target(solver, &mut turns, self.circles).clear;
        if !self.done {
            return;
        }
        let clear = turns.clone();
        let tolerance = solver.settings.tolerance / solver.total_length;
        let most = solver.settings.max_iterations;
        solver.work.fixed.clear();
        let (stationary, steps) =
            descend(&solver.problem, &mut turns, tolerance, most, solver.stop, &mut solver.work);
        solver.iterations += steps;
        if !stationary || depth(solver, &turns, self.circles) > 0.0 {
            turns = clear;
        }
        self.answer = Some((solver.problem.energy(&turns), turns));
    }

    /// Newton's method after all swarms missed the target, from its own starts, the straight trunk, and
    /// the straight one turned towards the target by its first section. The watcher is asked between.
    pub(super) fn last_resort(&mut self) -> Result<(), Abandoned> {
        if self.handover != Handover::Polish || self.done || self.finish {
            return Ok(());
        }
        let n = self.solver.problem.lengths.len();
        let target = self.solver.problem.target;
        let mut towards = vec![0.0; n];
        towards[0] = target.im.atan2(target.re);
        let mut starts = vec![vec![0.0; n], towards];
        starts.extend(self.solver.exact_starts());
        starts.extend(self.solver.spread_starts());
        for start in &starts {
            self.polish_from(start);
            if self.done || self.poll_watcher()? {
                return Ok(());
            }
        }
        if self.answer.is_none() {
            for start in &starts {
                self.solver.try_nearest(start);
                if self.poll_watcher()? {
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    /// Calls the watcher with the last move again; true when it wants the best answer so far.
    fn poll_watcher(&mut self) -> Result<bool, Abandoned> {
        let Some(last) = &self.last else { return Ok(false) };
        match (self.watch)(last) {
            WatchDecision::GoOn => {}
            WatchDecision::Finish => self.finish = true,
            WatchDecision::Abandon => return Err(Abandoned),
        }
        Ok(self.finish)
    }

    /// The answer of a search from a seed, for a trunk and circles in metres; a miss up to `tolerance`
    /// \[m\] counts as none where Newton's method has not decided.
    pub(super) fn into_result(
        mut self,
        seed: u64,
        tolerance: f64,
        trunk: &Trunk,
        circles: &[Circle],
    ) -> SwarmInverse {
        // Lowest points of the swarms, best first.
        let mut ends = std::mem::take(&mut self.ends);
        let swarms = ends.len();
        // A swarm that saw no value below infinity has no best.
        ends.retain(|end| !end.1.is_empty());
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        // The answer on the target; else the nearest points from all ends; without polish the best end.
        if let Some((energy, turns)) = self.answer.take() {
            self.solver.best = Some((energy, self.done, turns));
        } else if self.handover == Handover::Polish {
            for end in &ends {
                self.polish_count += 1;
                self.solver.try_nearest(&end.1);
            }
        } else {
            // Limits are but a penalty where the platforms are unknown.
            self.solver.best = ends.into_iter().next().map(|(_, mut turns)| {
                self.solver.problem.clamp(&mut turns);
                (0.0, true, turns)
            });
        }
        // Status: Newton's, or that of the swarm's own point.
        let total_length = self.solver.total_length;
        let mut inverse = self.solver.into_inverse(self.polish_count);
        let clearance = trunk.clearance(&inverse.turns, circles);
        if self.handover != Handover::Polish {
            inverse.status = status_of_swarm(&inverse, clearance, total_length, tolerance);
        } else if self.finish && inverse.status == Status::Unreachable {
            inverse.status = Status::IterationLimit;
        }
        SwarmInverse {
            inverse,
            clearance,
            value: self.history.last().copied().unwrap_or(f64::INFINITY),
            swarms,
            history: self.history,
            moves: self.moves,
            evaluations: self.evaluations,
            seed,
        }
    }
}

/// Status of turns that Newton's method has not polished.
fn status_of_swarm(inverse: &Inverse, clearance: f64, total_length: f64, tolerance: f64) -> Status {
    let miss = inverse.error.hypot(total_length * HEADING_WEIGHT * inverse.heading_error);
    match (miss <= tolerance, clearance >= 0.0) {
        (true, true) => Status::Converged,
        (true, false) => Status::Infeasible,
        (false, _) => Status::IterationLimit,
    }
}
