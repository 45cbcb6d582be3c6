//! How much of a step is taken.

use nalgebra::Vector3;

use super::{CHANGE, Descent, SHIFT, SHIFTS, Surroundings};
use crate::lie::so3;
use crate::obstacle::Fault;
use crate::solve::dense::dot;

/// No strain moves further in one step \[rad\].
const STEP: f64 = 0.5;
/// Halvings of a step, and the share of the predicted decrease that it must deliver.
const BACKTRACKS: usize = 30;
const ARMIJO: f64 = 1e-4;
/// The same where a step looks ahead to other sets of conditions.
const FORESIGHT: usize = 3;
/// Share of a value that its rounding may be: steps that promise less are not judged by it.
const ROUNDING: f64 = 1e-12;
/// How often the way of a point in one step is cut in halves, to see whether it leads through an obstacle.
const CUTS: usize = 8;

impl Descent {
    /// Takes as much of the Newton step as lowers the value; false when nothing does.
    pub(super) fn step(&mut self, around: &Surroundings<'_>) -> Result<bool, Fault> {
        if self.sweep.step != self.first {
            // Sets that lie so far ahead that the step has to be cut are not worth it.
            if self.along(around, FORESIGHT)? {
                return Ok(true);
            }
            self.sweep.step.clone_from(&self.first);
        }
        self.along(around, BACKTRACKS)
    }

    /// Takes as much of the step, halved so often, as lowers the value.
    fn along(&mut self, around: &Surroundings<'_>, halvings: usize) -> Result<bool, Fault> {
        let slope = dot(&self.slope, &self.sweep.step);
        let longest = longest(&self.sweep.step);
        if !slope.is_finite() || slope > 0.0 || !(longest > 0.0 && longest.is_finite()) {
            return Ok(false);
        }
        let whole = 1.0_f64.min(STEP / longest);
        let mut share = whole;
        for trial in 0..halvings {
            if self.goes_down(around, share, slope)? {
                return Ok(self.take(share, whole));
            }
            if trial == 0 && share == 1.0 {
                if self.correct(around) && self.goes_down(around, 1.0, slope)? {
                    return Ok(self.take(share, whole));
                }
                self.sweep.step.clone_from(&self.straight);
            }
            share *= 0.5;
        }
        Ok(false)
    }

    fn take(&mut self, share: f64, whole: f64) -> bool {
        self.relax(share, whole);
        std::mem::swap(&mut self.here, &mut self.there);
        true
    }

    /// A shorter step next time if this one was cut, a longer one if not.
    fn relax(&mut self, share: f64, whole: f64) {
        if share < 0.2 * whole {
            self.shift = SHIFT.max(CHANGE * self.shift).min(SHIFTS);
        } else if share == whole {
            self.shift = if self.shift > SHIFT { self.shift / CHANGE } else { 0.0 };
        }
    }

    /// Evaluates `there` at a share of the step; whether that lowers the value by what the slope tells.
    fn goes_down(
        &mut self,
        around: &Surroundings<'_>,
        share: f64,
        slope: f64,
    ) -> Result<bool, Fault> {
        self.there.strains.clear();
        let moved = self.here.strains.iter().zip(&self.sweep.step);
        self.there.strains.extend(moved.map(|(own, step)| own + share * step));
        let Surroundings { plan, scene, drive, share: loads, reach, .. } = *around;
        self.there.evaluate(plan, scene, drive, loads, &self.estimates, reach)?;
        let blind = -slope <= ROUNDING * self.here.size;
        let rounding = if blind { ROUNDING } else { 1e-2 * ROUNDING };
        let wanted = self.here.value
            + ARMIJO * share * slope
            + rounding * self.here.size
            + self.moment_work(around);
        let down = self.there.value <= wanted && self.passes(around)?;
        self.blind += usize::from(down && blind);
        Ok(down)
    }

    /// The step that meets the conditions as they bend on the way `there`, if it is one to take, the end of the whole step, which
    /// is kept in `straight`.
    fn correct(&mut self, around: &Surroundings<'_>) -> bool {
        self.straight.clone_from(&self.sweep.step);
        self.sweep.lengthen(around.plan, &mut self.lengthened);
        let (here, there) = (&mut self.here, &self.there);
        let pushes: Vec<f64> = here.entries.iter().map(|entry| entry.push).collect();
        for entry in &mut here.entries {
            let Ok(found) = there.entries.binary_search_by(|other| other.key.cmp(&entry.key))
            else {
                continue;
            };
            let bent = there.entries[found].gap - entry.gap - entry.closing(&self.sweep.moved);
            entry.push -= bent / entry.give;
        }
        let pulls = here.pulls.clone();
        for (k, pull) in here.pulls.iter_mut().enumerate().filter(|(k, _)| self.pulling[*k]) {
            let bent = there.over[k] - here.over[k] - self.lengthened[k];
            *pull += bent / self.gives[k];
        }
        self.sweep_once(around);
        self.here.pulls = pulls;
        for (entry, push) in self.here.entries.iter_mut().zip(pushes) {
            entry.push = push;
        }
        self.sweep.unstable.is_none() && longest(&self.sweep.step) <= STEP
    }

    /// Work that a moment on the tip, which has no potential, does on the way there.
    fn moment_work(&self, around: &Surroundings<'_>) -> f64 {
        let moment = around.scene.moment * around.share;
        let (Some(from), Some(to)) = (self.here.frames.last(), self.there.frames.last()) else {
            return 0.0;
        };
        if moment == Vector3::zeros() {
            return 0.0;
        }
        moment.dot(&so3::log(&(to.rotation * from.rotation.transpose())))
    }

    /// Whether no point can have gone through an obstacle.
    pub(super) fn passes(&self, around: &Surroundings<'_>) -> Result<bool, Fault> {
        let ways = self.here.spots.iter().zip(&self.there.spots);
        for (point, (from, to)) in around.scene.points.iter().flatten().zip(ways) {
            let Surroundings { scene, slip, sides, .. } = *around;
            if !scene.leads(point.radius, from, to, slip, sides, CUTS)? {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// Largest part of a step; infinite if one is not a number.
fn longest(step: &[f64]) -> f64 {
    step.iter().fold(0.0, |most, s| if s.is_nan() { f64::INFINITY } else { s.abs().max(most) })
}
