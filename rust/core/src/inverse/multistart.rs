//! Descents from many starts until one meets the target.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::solve::levenberg_marquardt::{Ending, Problem, Purpose, Scratch};
use crate::solve::pso::{PsoSettings, Swarm};
use crate::status::Status;

use super::Method;
use super::bounds::SearchSpace;

/// Ends of descents that are kept as candidates for the nearest point.
const CANDIDATES: usize = 4;
/// Steps that find the nearest point from a candidate.
const POLISH: usize = 300;
/// Steps that lower the energy.
const LOWER: usize = 500;
/// Steps that lower the energy where derivatives jump.
const LOWER_KINKS: usize = 30;

/// Buffers of a search, and the point it found.
#[derive(Clone, Debug, Default)]
pub(super) struct Multistart<'a, const R: usize = 6> {
    pub(super) solver: Scratch<R>,
    /// The unknowns found.
    pub(super) point: Vec<f64>,
    /// Ends the search before its next start when it is set.
    pub(super) stop: Option<&'a AtomicBool>,
    pub(super) swarm: Option<Swarm>,
    /// Ends of descents that did not meet the target, with their squared residuals, best first.
    pub(super) candidates: Vec<(f64, Vec<f64>)>,
}

/// Outcome of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SearchOutcome {
    pub(super) status: Status,
    pub(super) iterations: usize,
    pub(super) starts: usize,
}

/// Freedom that is spent on the energy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Freedom {
    /// No freedom, or none to be spent.
    None,
    Smooth,
    /// Derivatives jump: the energy is least where no step leads lower.
    Kinked,
}

/// Options of one search.
#[derive(Clone, Copy, Debug)]
pub(super) struct SearchOptions<'s> {
    /// The first start, and how many.
    pub(super) first: usize,
    pub(super) starts: usize,
    pub(super) max_iterations: usize,
    /// Freedom that the target leaves, to spend on the energy.
    pub(super) freedom: Freedom,
    pub(super) method: Method,
    /// No start beyond these is from a swarm.
    pub(super) swarms: usize,
    /// A swarm is the last resort.
    pub(super) fall_back: bool,
    /// True for the nearest point where none meets the target.
    pub(super) nearest: bool,
    pub(super) swarm: &'s PsoSettings,
}

impl<const R: usize> Multistart<'_, R> {
    /// Tries `start(k, point)` for one k after the other until a descent meets the target; else finds the point
    /// nearest to it. `point` holds the answer whatever the status, and was evaluated last.
    pub(super) fn run<P: Problem<R>>(
        &mut self,
        problem: &mut P,
        space: &SearchSpace,
        options: SearchOptions<'_>,
        start: impl FnMut(usize, &mut Vec<f64>),
    ) -> SearchOutcome {
        let (status, starts) = self.try_starts(problem, space, options, start);
        if status != Status::Converged {
            self.solver.evaluate(problem, &self.point);
        }
        SearchOutcome { status, iterations: self.solver.iterations, starts }
    }

    /// Status of the search and the number of starts tried.
    fn try_starts<P: Problem<R>>(
        &mut self,
        problem: &mut P,
        space: &SearchSpace,
        options: SearchOptions<'_>,
        mut start: impl FnMut(usize, &mut Vec<f64>),
    ) -> (Status, usize) {
        self.solver.iterations = 0;
        self.candidates.clear();
        let mut descended = false;
        for tried in 0..options.starts {
            if tried > 0 && self.is_stopped() {
                return (Status::IterationLimit, tried);
            }
            // Start k, brought into the region: from the caller, or from a swarm.
            let k = options.first + tried;
            if tried > 0 {
                problem.restart();
            }
            let inside = if options.method == Method::Newton || k >= options.swarms {
                start(k, &mut self.point);
                self.solver.restore(&space.region, &mut self.point)
            } else {
                self.swarm_start(problem, space, options.swarm, k)
            };
            if !inside {
                // A start may be too far away to be brought back; the middle of the box is not.
                if tried == 0 && !self.find_inner_point(space) {
                    return (Status::Infeasible, 1);
                }
                continue;
            }
            // A descent that meets the target ends the search.
            descended = true;
            if let Some(status) = self.descend(problem, space, options) {
                return (status, tried + 1);
            }
        }
        // A swarm searches where the starts did not, unless none of them had a value at all.
        if options.fall_back && !(descended && self.candidates.is_empty()) {
            problem.restart();
            if self.swarm_start(problem, space, options.swarm, 0)
                && let Some(status) = self.descend(problem, space, options)
            {
                return (status, options.starts);
            }
        }
        // Out of reach: the nearest point, from the best ends.
        if !options.nearest {
            return (Status::Unreachable, options.starts);
        }
        (self.nearest(problem, space, options), options.starts)
    }

    /// True when the region has a point, which is then the current one.
    fn find_inner_point(&mut self, space: &SearchSpace) -> bool {
        self.point.clear();
        self.point.extend(space.lower.iter().zip(&space.upper).map(|(l, u)| 0.5 * (l + u)));
        self.solver.restore(&space.region, &mut self.point)
    }

    /// Descends from the current point: the status if it meets the target.
    fn descend<P: Problem<R>>(
        &mut self,
        problem: &mut P,
        space: &SearchSpace,
        options: SearchOptions<'_>,
    ) -> Option<Status> {
        let limit = options.max_iterations;
        match self.solver.descend(problem, &space.region, &mut self.point, Purpose::Meet, limit) {
            Ending::Met => return Some(self.spend_freedom(problem, space, options)),
            Ending::Failed => {}
            Ending::Stalled | Ending::IterationLimit => self.keep_candidate(),
        }
        None
    }

    /// True when the stop flag is set.
    pub(super) fn is_stopped(&self) -> bool {
        self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed))
    }

    /// Lowers the energy where the target leaves freedom.
    fn spend_freedom<P: Problem<R>>(
        &mut self,
        problem: &mut P,
        space: &SearchSpace,
        options: SearchOptions<'_>,
    ) -> Status {
        let (kinks, most) = match options.freedom {
            Freedom::None => return Status::Converged,
            Freedom::Smooth => (false, LOWER),
            Freedom::Kinked => (true, LOWER_KINKS),
        };
        match self.solver.minimize_energy(problem, &space.region, &mut self.point, most) {
            Ending::Met => Status::Converged,
            _ if kinks && problem.is_met(&self.solver.residual) => Status::Converged,
            _ => Status::IterationLimit,
        }
    }

    /// Keeps the point if it is among the best.
    fn keep_candidate(&mut self) {
        let squared = self.solver.residual.norm_squared();
        let place = self.candidates.partition_point(|(other, _)| *other <= squared);
        if squared.is_finite() && place < CANDIDATES {
            self.candidates.truncate(CANDIDATES - 1);
            self.candidates.insert(place.min(self.candidates.len()), (squared, self.point.clone()));
        }
    }

    /// Descends to a minimum from the best candidates and keeps the best.
    fn nearest<P: Problem<R>>(
        &mut self,
        problem: &mut P,
        space: &SearchSpace,
        options: SearchOptions<'_>,
    ) -> Status {
        let mut best: Option<(f64, Status, Vec<f64>)> = None;
        for (_, mut point) in std::mem::take(&mut self.candidates) {
            problem.restart();
            let ending =
                self.solver.descend(problem, &space.region, &mut point, Purpose::Nearest, POLISH);
            let squared = self.solver.residual.norm_squared();
            if ending == Ending::Met {
                self.point = point;
                return self.spend_freedom(problem, space, options);
            }
            let status = match ending {
                Ending::Stalled => Status::Unreachable,
                _ => Status::IterationLimit,
            };
            let nearer = best.as_ref().is_none_or(|(least, _, _)| squared < *least);
            if squared.is_finite() && nearer {
                // After a step that was refused.
                self.solver.evaluate(problem, &point);
                problem.save_state();
                best = Some((squared, status, point));
            }
        }
        let Some((_, status, point)) = best else { return Status::NumericalError };
        // Restored only from this search: another one's equilibrium would depend on the rows before.
        problem.restore_state();
        self.point = point;
        status
    }
}
