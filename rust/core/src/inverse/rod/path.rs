//! From target to target along a path.

use super::{RodInverse, RodScratch};
use crate::inverse::Target;
use crate::inverse::bounds::SearchSpace;
use crate::inverse::multistart::{Freedom, SearchOptions, SearchOutcome};
use crate::inverse::outcome::Answer;
use crate::inverse::tension_problem::evaluate_answer;
use crate::status::Status;

/// Along a path no unknown changes by more in one step \[rad\], and no step is a smaller share of the way between two
/// targets.
const JUMP: f64 = 0.5;
/// Nor, on the way to less tension, by more than this times the tool's way over the robot's length.
const RATE: f64 = 50.0;
const SHORTEST: f64 = 1.0 / 64.0;
/// Longest step over the step before for which the start is extrapolated.
const FARTHEST: f64 = 2.0;
/// Starts of a target on a path that steps do not lead to.
const FEW: usize = 16;

/// Outcome of a step along a path.
#[derive(Clone, Copy, PartialEq, Eq)]
enum StepOutcome {
    Reached,
    Jumped,
    Failed,
}

impl RodScratch<'_> {
    /// Descends from the current point to the current target, and tests that no unknown is further than a limit from
    /// where it was.
    fn descend(
        &mut self,
        space: &SearchSpace,
        options: SearchOptions<'_>,
        (from, limit): (&[f64], f64),
        iterations: &mut usize,
    ) -> StepOutcome {
        let found = self.search.run(&mut self.problem, space, options, |_, _| {});
        *iterations += found.iterations;
        let pairs = self.search.point.iter().zip(from);
        let moved = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        match found.status {
            Status::Converged if moved <= limit => StepOutcome::Reached,
            Status::Converged => StepOutcome::Jumped,
            _ => StepOutcome::Failed,
        }
    }
}

impl RodInverse<'_> {
    /// Moves from the current point to the current target in steps; none where they do not lead there.
    pub(super) fn track_in_steps(&self, work: &mut RodScratch<'_>) -> Option<Answer> {
        let options = SearchOptions { fall_back: false, nearest: false, ..self.options(1) };
        let (from, to) = (work.problem.rod.motion().tool, work.problem.goal.pose_residual.target());
        let (mut done, mut stride, mut iterations) = (0.0, 1.0_f64, 0);
        let way = work.problem.goal.pose_residual.relative_distance(&from, &to);
        let mut last = work.search.point.clone();
        while done < 1.0 {
            let next = (done + stride).min(1.0);
            // Target at an even share of the way: position along the line, rotation about one axis.
            work.problem.goal.pose_residual.interpolate_target(&from, &to, next);
            if stride >= 1.0
                && let Some((point, place)) = &work.before
            {
                // Start extrapolated by the unknowns' last change, over the ratio of the tool's ways.
                let share = (to.position() - from.translation).norm()
                    / (from.translation - *place).norm().max(f64::MIN_POSITIVE);
                if share < FARTHEST {
                    let pairs = work.search.point.iter_mut().zip(point.iter());
                    pairs.for_each(|(own, before)| *own += share * (*own - before));
                }
            }
            // Largest change of an unknown: 0.5 rad, and 50 times the tool's relative way with least tensions.
            let limit = if options.freedom == Freedom::None {
                JUMP
            } else {
                JUMP.min(RATE * way * (next - done))
            };
            let mut step = work.descend(&self.space, options, (&last, limit), &mut iterations);
            if step == StepOutcome::Jumped && options.freedom != Freedom::None {
                // The branch of least tensions may end or turn away here: the step stays near instead.
                work.search.point.clone_from(&last);
                let as_it_is = SearchOptions { freedom: Freedom::None, ..options };
                step = work.descend(&self.space, as_it_is, (&last, JUMP), &mut iterations);
            }
            // Twice the stride after a step that arrives, half of it after one that does not.
            if step == StepOutcome::Reached {
                (done, stride) = (next, 2.0 * stride);
                last.clone_from(&work.search.point);
            } else {
                work.search.point.clone_from(&last);
                stride = 0.5 * (next - done);
                if stride < SHORTEST || work.search.is_stopped() {
                    return None;
                }
            }
        }
        let found = SearchOutcome { status: Status::Converged, iterations, starts: 1 };
        Some(evaluate_answer(found, &mut work.problem, &mut work.search, |goal| {
            goal.pose_residual.errors()
        }))
    }

    /// Solves for the next row of a path from the row before, or from a few starts where that fails.
    pub(super) fn track(&self, target: &Target, work: &mut RodScratch<'_>) -> Answer {
        if let Some(from_rest) = &work.from_rest {
            from_rest.allow_slack(&mut work.problem);
        }
        let few = self.options(self.settings.starts.min(FEW));
        if !work.met {
            let given = work.search.point.len() == self.units.len();
            return self.search(target, given, SearchOptions { fall_back: false, ..few }, work);
        }
        let here = (work.search.point.clone(), work.problem.rod.motion().tool.translation);
        work.problem.goal.pose_residual.set_target(*target);
        if let Some(answer) = self.track_in_steps(work) {
            work.before = Some(here);
            return answer;
        }
        work.search.point = here.0;
        work.search.solver.evaluate(&mut work.problem, &work.search.point);
        let answer = self.search(target, true, SearchOptions { fall_back: false, ..few }, work);
        Answer { starts: answer.starts + 1, ..answer }
    }
}
