//! The objective of the swarms of one search, which hands over to Newton's method.

use super::super::clearance::Circle;
use super::super::least_energy::descend;
use super::super::newton_inverse::{Inverse, Solver};
use super::super::tip_equations::HEADING;
use super::super::trunk::Trunk;
use super::Unknowns;
use super::cost::{depth, land, of_bends, of_points};
use super::result::SwarmInverse;
use super::search::WatchDecision;
use crate::solve::pso::{Objective, Progress, Report};
use crate::status::Status;

/// Value below which Newton's method is tried, as a share of the trunk's length; and the share of a
/// tried value that is tried next.
const NEAR: f64 = 0.1;
const NEARER: f64 = 0.5;

/// What becomes of the swarm's points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Task {
    /// The best one is the answer.
    AsItIs,
    /// The best one is where Newton's method starts, as soon as it gets to the target from there.
    Polish,
    /// All are brought onto the target; energy and circles choose among them.
    Choose,
}

/// Watches the swarms of one search and evaluates their points. Values are in units of the trunk's
/// length.
pub(super) struct Hunt<'s, 'a> {
    solver: Solver<'a>,
    unknowns: Unknowns,
    task: Task,
    circles: &'s [Circle],
    watch: &'s mut dyn FnMut(&Progress) -> WatchDecision,
    turns: Vec<f64>,
    /// The last move.
    last: Option<Progress>,
    /// Lowest value of the swarm in work, and its turns.
    lowest: (f64, Vec<f64>),
    /// No point of the swarm in work was evaluated yet.
    fresh: bool,
    /// The starts of a swarm that follows one without an answer: Newton's method is tried from all.
    crowd: Vec<Vec<f64>>,
    /// Value below which Newton's method is tried next, and the one that it was tried at.
    near: f64,
    tried: f64,
    tries: usize,
    /// Energy and turns of the answer; unsettled as long as the energy has no minimum there.
    reached: Option<(f64, Vec<f64>)>,
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

impl Objective for Hunt<'_, '_> {
    type Error = Abandoned;

    fn values(&mut self, points: &[f64], n: usize, values: &mut [f64]) -> Result<(), Abandoned> {
        let scale = self.scale();
        let again = self.task == Task::Polish && self.fresh && !self.ends.is_empty();
        self.fresh = false;
        for (value, point) in values.iter_mut().zip(points.chunks_exact(n)) {
            let own = self.weigh(point);
            if own < self.lowest.0 {
                self.lowest.0 = own;
                self.lowest.1.clear();
                let plain = self.unknowns == Unknowns::Bends && self.task != Task::Choose;
                self.lowest.1.extend_from_slice(if plain { point } else { &self.turns });
            }
            *value = scale * own;
            if again {
                let plain = self.unknowns == Unknowns::Bends;
                self.crowd.push(if plain { point.to_vec() } else { self.turns.clone() });
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
        for turns in std::mem::take(&mut self.crowd) {
            if !self.done {
                self.try_from(&turns);
            }
        }
        if self.task == Task::Polish && !self.done && self.lowest.0 < self.near {
            self.take_over();
        }
        Ok(self.done)
    }
}

impl<'s, 'a> Hunt<'s, 'a> {
    pub(super) fn new(
        solver: Solver<'a>,
        unknowns: Unknowns,
        task: Task,
        circles: &'s [Circle],
        watch: &'s mut dyn FnMut(&Progress) -> WatchDecision,
    ) -> Self {
        Self {
            solver,
            unknowns,
            task,
            circles,
            watch,
            turns: Vec::new(),
            last: None,
            lowest: (f64::INFINITY, Vec::new()),
            fresh: true,
            crowd: Vec::new(),
            near: NEAR,
            tried: f64::INFINITY,
            tries: 0,
            reached: None,
            done: false,
            finish: false,
            ends: Vec::new(),
            history: Vec::new(),
            moves: 0,
            evaluations: 0,
        }
    }

    /// From values to what is told: metres, or energies in 1/m.
    fn scale(&self) -> f64 {
        if self.task == Task::Choose { 1.0 / self.solver.whole } else { self.solver.whole }
    }

    /// The value of a particle. Where its coordinates are not the turns, these are left in `turns`.
    fn weigh(&mut self, point: &[f64]) -> f64 {
        if self.unknowns == Unknowns::Points {
            return of_points(&self.solver, point, &mut self.turns);
        }
        if self.task == Task::Choose {
            self.turns.clear();
            self.turns.extend_from_slice(point);
            return land(&mut self.solver, &mut self.turns, self.circles).value;
        }
        of_bends(&self.solver, point) + depth(&self.solver, point, self.circles)
    }

    /// Newton's method from the best point.
    fn take_over(&mut self) {
        self.tried = self.lowest.0;
        self.near = NEARER * self.tried;
        let turns = std::mem::take(&mut self.lowest.1);
        self.try_from(&turns);
        self.lowest.1 = turns;
    }

    /// Newton's method: onto the target, and to the least energy nearby.
    fn try_from(&mut self, turns: &[f64]) {
        self.tries += 1;
        self.solver.try_start(turns);
        let Some((energy, settled, turns)) = self.solver.best.take() else { return };
        self.done = settled;
        if settled || self.reached.as_ref().is_none_or(|(least, _)| energy < *least) {
            self.reached = Some((energy, turns));
        }
    }

    /// Before every swarm.
    pub(super) fn begin(&mut self) {
        self.fresh = true;
        self.near = NEAR;
        self.tried = f64::INFINITY;
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
        match self.task {
            Task::AsItIs => self.done = report.status == Status::Converged,
            Task::Polish if !self.done && self.lowest.0 < self.tried => self.take_over(),
            Task::Polish => {}
            Task::Choose => self.settle(),
        }
        self.ends.push(self.lowest.clone());
        self.done || self.finish
    }

    /// Among circles: the swarm's best is the answer if it is clear of them, and so is the least energy
    /// nearby if that is clear as well.
    fn settle(&mut self) {
        let mut turns = self.lowest.1.clone();
        if turns.is_empty() {
            return;
        }
        self.tries += 1;
        let solver = &mut self.solver;
        self.done = land(solver, &mut turns, self.circles).clear;
        if !self.done {
            return;
        }
        let clear = turns.clone();
        let tolerance = solver.settings.tolerance / solver.whole;
        let most = solver.settings.max_iterations;
        solver.work.held.clear();
        let (settled, steps) =
            descend(&solver.problem, &mut turns, tolerance, most, solver.stop, &mut solver.work);
        solver.iterations += steps;
        if !settled || depth(solver, &turns, self.circles) > 0.0 {
            turns = clear;
        }
        self.reached = Some((solver.problem.energy(&turns), turns));
    }

    /// Where all swarms missed the target: Newton's method from its own starts, the straight trunk, and
    /// the straight one turned towards the target by its first section. The watcher is asked between.
    pub(super) fn last_resort(&mut self) -> Result<(), Abandoned> {
        if self.task != Task::Polish || self.done || self.finish {
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
            self.try_from(start);
            if self.done || self.asked()? {
                return Ok(());
            }
        }
        if self.reached.is_none() {
            for start in &starts {
                self.solver.try_nearest(start);
                if self.asked()? {
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    /// Whether the watcher, told of the last move again, wants the best that there is by now.
    fn asked(&mut self) -> Result<bool, Abandoned> {
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
    pub(super) fn answer(
        mut self,
        seed: u64,
        tolerance: f64,
        trunk: &Trunk,
        circles: &[Circle],
    ) -> SwarmInverse {
        let mut ends = std::mem::take(&mut self.ends);
        let swarms = ends.len();
        // A swarm that saw no value below infinity has no best.
        ends.retain(|end| !end.1.is_empty());
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((energy, turns)) = self.reached.take() {
            self.solver.best = Some((energy, self.done, turns));
        } else if self.task == Task::Polish {
            for end in &ends {
                self.tries += 1;
                self.solver.try_nearest(&end.1);
            }
        } else {
            // Limits are but a penalty where the platforms are unknown.
            self.solver.best = ends.into_iter().next().map(|(_, mut turns)| {
                self.solver.problem.clamp(&mut turns);
                (0.0, true, turns)
            });
        }
        let whole = self.solver.whole;
        let mut inverse = self.solver.answer(self.tries);
        let clearance = trunk.clearance(&inverse.turns, circles);
        if self.task != Task::Polish {
            inverse.status = standing(&inverse, clearance, whole, tolerance);
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

/// How turns stand that Newton's method has not judged.
fn standing(inverse: &Inverse, clearance: f64, whole: f64, tolerance: f64) -> Status {
    let miss = inverse.error.hypot(whole * HEADING * inverse.heading_error);
    match (miss <= tolerance, clearance >= 0.0) {
        (true, true) => Status::Converged,
        (true, false) => Status::Infeasible,
        (false, _) => Status::IterationLimit,
    }
}
