//! From a shape to the nearest minimum among the obstacles: Newton's method on the augmented Lagrangian.

mod line_search;
mod linear_response;

use std::sync::atomic::{AtomicBool, Ordering};

use super::lagrangian::{Estimates, Lagrangian, MultiplierEstimate, TendonInput};
use super::potential::Field;
use super::riccati::{At, Sweep};
use super::scene::Scene;
use crate::obstacle::Fault;
use crate::rod::dual_newton::Ending;
use crate::rod::plan::Plan;
use crate::solve::dense::dot;

/// So many steps below the value's rounding may pass without the moment halving.
const BLIND: usize = 4;
/// Every renewal of the estimates makes the conditions stiffer by this, up to so many times the first.
const STIFFER: f64 = 0.1;
const STIFFEST: f64 = 1e4;
/// So many renewals of the stiffest may pass without the violation halving.
const STUCK: usize = 4;
/// Residuals are not asked to be smaller: what stiff conditions make of rounding.
const ROUGH: f64 = 5e-11;
/// Estimates are renewed when the shape is this near balance \[rad of the whole chain\], and the
/// more often the nearer they are.
const LOOSE: f64 = 1.0;
/// Sets of active conditions that are tried for one step.
const SETS: usize = 8;
/// The least shift of the Hessian where steps turn out too long, in shares of the stiffness, the largest, and how
/// it changes.
const SHIFT: f64 = 1e-5;
const SHIFTS: f64 = 1e2;
const CHANGE: f64 = 8.0;
/// A nudge off a saddle \[rad, all subsegments together\], and how often.
const NUDGE: f64 = 1e-1;
const NUDGES: usize = 6;
/// Halvings of a nudge that would lead through an obstacle.
const HALVINGS: usize = 10;
/// Steps on which a shape may be unstable before it is nudged, if its slope does not lead out \[rad\].
const BALANCED: usize = 3;
const SYMMETRIC: f64 = 1e-9;

/// What a descent is made in.
pub(in crate::rod) struct Surroundings<'a> {
    pub(in crate::rod) plan: &'a Plan,
    pub(in crate::rod) scene: &'a Scene,
    /// Share of the loads.
    pub(in crate::rod) share: f64,
    pub(in crate::rod::contact) drive: TendonInput<'a>,
    /// How far off parts of obstacles are looked at \[m\].
    pub(in crate::rod) reach: f64,
    /// How far a point may go past another than through free space, in one step \[m\].
    pub(in crate::rod) slip: f64,
    /// Whether no point may come to an obstacle's other side: not where the robot rests in one.
    pub(in crate::rod) sides: bool,
    pub(in crate::rod) stop: Option<&'a AtomicBool>,
}

/// What is left of the conditions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::rod) struct Left {
    /// Unbalanced moment, relative to the stiffness.
    pub(in crate::rod) moment: f64,
    /// Violations of lengths, of gaps and of their complementarity, relative to lengths.
    pub(in crate::rod) length: f64,
    /// Newton steps off a saddle.
    pub(in crate::rod) nudged: usize,
    /// Whether multipliers grew without an end.
    pub(in crate::rod) locked: bool,
}

impl Left {
    pub(in crate::rod) fn worst(&self) -> f64 {
        self.moment.max(self.length)
    }
}

/// Buffers of a descent.
#[derive(Clone, Debug, Default)]
pub(in crate::rod) struct Descent {
    pub(in crate::rod) here: Lagrangian,
    there: Lagrangian,
    pub(in crate::rod) estimates: Estimates,
    sweep: Sweep,
    fields: Vec<Field>,
    /// Tendons that matter, those of them that a bound makes pull and entries that push at the end of the step.
    bounded: Vec<bool>,
    pulling: Vec<bool>,
    active: Vec<bool>,
    tensions: Vec<f64>,
    gives: Vec<f64>,
    lengthened: Vec<f64>,
    /// Slope of the value here, whatever the sets, and the step with the sets of this shape.
    slope: Vec<f64>,
    first: Vec<f64>,
    straight: Vec<f64>,
    moment: f64,
    unstable: Option<usize>,
    /// Direction out of an unstable shape, its largest component 1.
    escape: Vec<f64>,
    /// Of the Hessian: steps that turned out too long become shorter.
    shift: f64,
    /// Whether stability was looked at with it.
    shifted: bool,
    /// Steps in a row at unstable shapes.
    balanced: usize,
    /// Renewals of the stiffest conditions in a row that did not halve their violation, and what it was.
    stuck: usize,
    violated: f64,
    /// Steps too small for the value to tell since the moment halved last, and what it was then.
    blind: usize,
    halved: f64,
}

impl Descent {
    /// Goes from the strains in `here` and the estimates to a minimum, in at most `budget` evaluations of
    /// derivatives, which are counted down.
    pub(in crate::rod) fn go(
        &mut self,
        around: &Surroundings<'_>,
        budget: &mut usize,
    ) -> Result<(Ending, Left), Fault> {
        let tolerance = around.plan.settings.tolerance.max(ROUGH);
        let mut left = Left::default();
        let loosest = LOOSE / around.plan.data.len() as f64;
        let mut loose = loosest;
        self.shift = 0.0;
        (self.balanced, self.blind, self.halved) = (0, 0, f64::INFINITY);
        (self.stuck, self.violated) = (0, f64::INFINITY);
        self.evaluate_here(around)?;
        loop {
            self.look(around);
            *budget = budget.saturating_sub(1);
            left = Left { moment: self.moment, ..self.left(around, left.nudged) };
            if !left.worst().is_finite() {
                return Ok((Ending::Broken, left));
            }
            if left.worst() <= tolerance && self.shifted {
                // Whether this is a minimum is not known yet.
                self.shift = 0.0;
                continue;
            }
            if left.worst() <= tolerance && self.unstable.is_none() {
                return Ok((Ending::Converged, left));
            }
            self.balanced = if self.unstable.is_some() { self.balanced + 1 } else { 0 };
            let stays = self.balanced >= BALANCED && self.symmetric(around.plan);
            if left.worst() <= tolerance || (stays && left.nudged < NUDGES) {
                // What soft conditions leave unstable may be a minimum under stiff ones.
                if self.estimates.stiffness < STIFFEST {
                    self.estimates.scale(STIFFER);
                    self.evaluate_here(around)?;
                } else if left.nudged < NUDGES {
                    self.nudge(around)?;
                    left.nudged += 1;
                    loose = loosest;
                } else {
                    return Ok((Ending::Lost, left));
                }
                continue;
            }
            if *budget == 0 {
                return Ok((Ending::Spent, left));
            }
            if around.stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
                return Ok((Ending::Stopped, left));
            }
            if left.moment <= loose && left.length > tolerance {
                if self.locks(left.length) {
                    return Ok((Ending::Lost, Left { locked: true, ..left }));
                }
                self.renew();
                loose = (0.1 * loose).max(0.5 * tolerance);
                self.evaluate_here(around)?;
                self.look(around);
            } else if self.stalled(left.moment) {
                self.soften();
                self.evaluate_here(around)?;
                self.look(around);
            }
            self.aim(around);
            if !self.step(around)? {
                // No further decrease: the rounding of the value, or a kink.
                if left.moment > 1e3 * tolerance {
                    return Ok((Ending::Lost, left));
                }
                self.renew();
                self.evaluate_here(around)?;
            }
        }
    }

    fn evaluate_here(&mut self, around: &Surroundings<'_>) -> Result<(), Fault> {
        let Surroundings { plan, scene, drive, share, reach, .. } = *around;
        self.here.evaluate(plan, scene, drive, share, &self.estimates, reach)
    }

    /// Gradient and step with the conditions that are active here.
    fn look(&mut self, around: &Surroundings<'_>) {
        self.bounded.clear();
        self.pulling.clear();
        match around.drive {
            TendonInput::Lengths(bounds) => {
                self.bounded.extend(bounds.iter().map(|bound| bound.is_finite()));
                self.pulling.extend(self.here.tensions.iter().map(|tension| *tension > 0.0));
            }
            TendonInput::Tensions(tensions) => {
                self.bounded.resize(tensions.len(), true);
                self.pulling.resize(tensions.len(), false);
            }
        }
        self.gives.clear();
        let own = self.estimates.tendon_give.iter().zip(&around.plan.compliance);
        self.gives.extend(own.map(|(give, own)| give + own));
        self.active.clear();
        self.active.extend(self.here.entries.iter().map(|entry| entry.force > 0.0));
        self.shifted = self.shift > 0.0;
        self.sweep_once(around);
        self.slope.clone_from(&self.sweep.gradient);
        (self.moment, self.unstable) = (self.sweep.moment, self.sweep.unstable);
        if self.unstable.is_some() {
            self.sweep.lead_out(around.plan, &mut self.escape);
        }
    }

    /// Step downhill, with those conditions active that are so at its end.
    fn aim(&mut self, around: &Surroundings<'_>) {
        while self.sweep.unstable.is_some() && self.shift <= SHIFTS {
            self.shift = SHIFT.max(CHANGE * self.shift);
            self.sweep_once(around);
        }
        self.first.clone_from(&self.sweep.step);
        for _ in 0..SETS {
            if !self.foresee(around) {
                return;
            }
            self.sweep_once(around);
            if self.sweep.unstable.is_some() {
                break;
            }
        }
        // The sets go round, or lead to no minimum: the ones of this shape lead down.
        self.sweep.step.clone_from(&self.first);
    }

    fn sweep_once(&mut self, around: &Surroundings<'_>) {
        self.here.fields(around.scene, around.share, &self.active, &mut self.fields);
        self.tensions.clear();
        match around.drive {
            TendonInput::Lengths(_) => {
                let pulls = self.here.pulls.iter().zip(&self.pulling);
                self.tensions.extend(pulls.map(|(pull, on)| if *on { *pull } else { 0.0 }));
            }
            TendonInput::Tensions(tensions) => self.tensions.extend_from_slice(tensions),
        }
        self.sweep.factor(&At {
            plan: around.plan,
            strains: &self.here.strains,
            frames: &self.here.frames,
            fields: &self.fields,
            tensions: &self.tensions,
            taut: &self.bounded,
            pulling: &self.pulling,
            give: &self.gives,
            moment: around.scene.moment * around.share,
            shift: self.shift,
        });
    }

    /// Sets of conditions that push or pull at the end of the step, to first order; whether they are others.
    fn foresee(&mut self, around: &Surroundings<'_>) -> bool {
        let mut others = false;
        for (entry, active) in self.here.entries.iter().zip(&mut self.active) {
            let pushes = entry.push - entry.closing(&self.sweep.moved) / entry.give > 0.0;
            others |= pushes != *active;
            *active = pushes;
        }
        if matches!(around.drive, TendonInput::Tensions(_)) {
            return others;
        }
        self.sweep.lengthen(around.plan, &mut self.lengthened);
        for (k, pulling) in self.pulling.iter_mut().enumerate() {
            let pulls =
                self.bounded[k] && self.here.pulls[k] + self.lengthened[k] / self.gives[k] > 0.0;
            others |= pulls != *pulling;
            *pulling = pulls;
        }
        others
    }

    /// Violations at this shape: of what the multipliers stand for.
    fn left(&self, around: &Surroundings<'_>, nudged: usize) -> Left {
        let plan = around.plan;
        let mut length = 0.0_f64;
        let held = matches!(around.drive, TendonInput::Lengths(_));
        for (k, tension) in self.here.tensions.iter().enumerate() {
            if held && self.bounded[k] {
                let over = self.here.over[k] - plan.compliance[k] * tension;
                let off = if *tension > 0.0 { over.abs() } else { over.max(0.0) };
                length = length.max(off / plan.rest_lengths[k]);
            }
        }
        let whole = plan.total_length();
        for entry in &self.here.entries {
            let off = if entry.force > 0.0 { entry.gap.abs() } else { (-entry.gap).max(0.0) };
            length = length.max(off / whole);
        }
        Left { length, nudged, ..Default::default() }
    }

    /// Makes the multipliers the estimates, and the conditions stiffer.
    fn renew(&mut self) {
        let estimates = &mut self.estimates;
        estimates.tensions.clone_from(&self.here.tensions);
        estimates.forces.clear();
        let pushing = self.here.entries.iter().filter(|entry| entry.force > 0.0);
        estimates.forces.extend(pushing.map(MultiplierEstimate::of));
        if estimates.stiffness < STIFFEST {
            estimates.scale(STIFFER);
        }
    }

    /// Whether the stiffest conditions stay violated by as much however large their multipliers become.
    fn locks(&mut self, violation: f64) -> bool {
        let still = self.estimates.stiffness >= STIFFEST && violation > 0.5 * self.violated;
        self.stuck = if still { self.stuck + 1 } else { 0 };
        self.violated = violation;
        self.stuck >= STUCK
    }

    /// Whether the last steps were below what the value resolves, and moments do not fall either.
    fn stalled(&mut self, moment: f64) -> bool {
        if moment <= 0.5 * self.halved {
            (self.halved, self.blind) = (moment, 0);
        }
        self.blind >= BLIND
    }

    /// Makes the conditions softer, which makes less of the rounding of places.
    fn soften(&mut self) {
        (self.blind, self.halved) = (0, f64::INFINITY);
        if self.estimates.stiffness > 1.0 {
            self.estimates.scale(1.0 / STIFFER);
        }
    }

    /// Whether an unstable shape stays so on the way down, as the slope has no part out of it.
    fn symmetric(&self, plan: &Plan) -> bool {
        let (width, data) = (plan.width(), &plan.data);
        let mut size = 0.0;
        for (k, escape) in self.escape.iter().enumerate() {
            let elasticity = &data[k / width].elasticity;
            size += escape * escape * elasticity.stiffness(k % width % plan.unknowns());
        }
        dot(&self.slope, &self.escape).abs() <= SYMMETRIC * size
    }

    /// Leaves a saddle.
    fn nudge(&mut self, around: &Surroundings<'_>) -> Result<(), Fault> {
        self.balanced = 0;
        self.estimates.scale(self.estimates.stiffness);
        self.evaluate_here(around)?;
        let whole: f64 = self.escape.iter().map(|escape| escape.abs()).sum();
        let Surroundings { plan, scene, drive, share, reach, .. } = *around;
        let mut size = NUDGE / whole;
        for _ in 0..HALVINGS {
            self.there.strains.clear();
            let moved = self.here.strains.iter().zip(&self.escape);
            self.there.strains.extend(moved.map(|(own, escape)| own + size * escape));
            self.there.evaluate(plan, scene, drive, share, &self.estimates, reach)?;
            if self.passes(around)? {
                break;
            }
            size *= 0.5;
        }
        std::mem::swap(&mut self.here, &mut self.there);
        Ok(())
    }
}
