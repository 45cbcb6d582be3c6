//! From target to target along a path.

use super::{RodInverse, RodScratch, ended};
use crate::inverse::Target;
use crate::inverse::bounds::Space;
use crate::inverse::multistart::{Effort, Found, Freedom};
use crate::inverse::outcome::Answer;
use crate::status::Status;

/// Along a path no unknown changes by more in one step \[rad\], and no step is a smaller share of the way between two
/// targets.
const JUMP: f64 = 0.5;
/// Nor, on the way to less tension, by more than this times the tool's way over the robot's length.
const RATE: f64 = 50.0;
const SHORTEST: f64 = 1.0 / 64.0;
/// Where the tool goes so many times as far as before, or further, no start is read off the way before.
const FARTHEST: f64 = 2.0;
/// Starts of a target on a path that steps do not lead to.
const FEW: usize = 16;

/// Where a step along a path led.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Gone {
    There,
    Jumped,
    Astray,
}

impl RodScratch<'_> {
    /// Descends from the point at hand to the target aimed at; whether no unknown is further than a limit from
    /// where it was.
    fn descend(
        &mut self,
        space: &Space,
        effort: Effort<'_>,
        (from, limit): (&[f64], f64),
        iterations: &mut usize,
    ) -> Gone {
        let found = self.search.run(&mut self.pull, space, effort, |_, _| {});
        *iterations += found.iterations;
        let pairs = self.search.point.iter().zip(from);
        let moved = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        match found.status {
            Status::Converged if moved <= limit => Gone::There,
            Status::Converged => Gone::Jumped,
            _ => Gone::Astray,
        }
    }
}

impl RodInverse<'_> {
    /// Goes from the point at hand to the target aimed at; nothing where steps do not lead there.
    pub(super) fn walk(&self, work: &mut RodScratch<'_>) -> Option<Answer> {
        let effort = Effort { fall_back: false, nearest: false, ..self.effort(1) };
        let (from, to) = (work.pull.rod.motion().tool, work.pull.aim.aim.target());
        let (mut done, mut stride, mut iterations) = (0.0, 1.0_f64, 0);
        let way = work.pull.aim.aim.way(&from, &to);
        let mut last = work.search.point.clone();
        while done < 1.0 {
            let next = (done + stride).min(1.0);
            work.pull.aim.aim.between(&from, &to, next);
            if stride >= 1.0
                && let Some((point, place)) = &work.before
            {
                // On as before, by the share of the way that the tool goes now.
                let share = (to.position() - from.translation).norm()
                    / (from.translation - *place).norm().max(f64::MIN_POSITIVE);
                if share < FARTHEST {
                    let pairs = work.search.point.iter_mut().zip(point.iter());
                    pairs.for_each(|(own, before)| *own += share * (*own - before));
                }
            }
            let limit = if effort.freedom == Freedom::None {
                JUMP
            } else {
                JUMP.min(RATE * way * (next - done))
            };
            let mut gone = work.descend(&self.space, effort, (&last, limit), &mut iterations);
            if gone == Gone::Jumped && effort.freedom != Freedom::None {
                // The branch of least tensions may end or turn away here: on without.
                work.search.point.clone_from(&last);
                let as_it_is = Effort { freedom: Freedom::None, ..effort };
                gone = work.descend(&self.space, as_it_is, (&last, JUMP), &mut iterations);
            }
            if gone == Gone::There {
                (done, stride) = (next, 2.0 * stride);
                last.clone_from(&work.search.point);
            } else {
                work.search.point.clone_from(&last);
                stride = 0.5 * (next - done);
                if stride < SHORTEST || work.search.stopped() {
                    return None;
                }
            }
        }
        let found = Found { status: Status::Converged, iterations, starts: 1 };
        Some(ended(found, &mut work.pull, &mut work.search, |goal| goal.aim.misses()))
    }

    /// From the row before, or from a few starts where that does not lead there.
    pub(super) fn go_on(&self, target: &Target, work: &mut RodScratch<'_>) -> Answer {
        if let Some(rise) = &work.rise {
            rise.slacken(&mut work.pull);
        }
        let few = self.effort(self.settings.starts.min(FEW));
        if !work.met {
            let given = work.search.point.len() == self.units.len();
            return self.search(target, given, Effort { fall_back: false, ..few }, work);
        }
        let here = (work.search.point.clone(), work.pull.rod.motion().tool.translation);
        work.pull.aim.aim.at(*target);
        if let Some(answer) = self.walk(work) {
            work.before = Some(here);
            return answer;
        }
        work.search.point = here.0;
        work.search.fit.evaluate(&mut work.pull, &work.search.point);
        let answer = self.search(target, true, Effort { fall_back: false, ..few }, work);
        Answer { starts: answer.starts + 1, ..answer }
    }
}
