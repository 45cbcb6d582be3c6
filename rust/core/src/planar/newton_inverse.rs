//! The turns of least bending energy that put the tip on a target.

use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::Vector2;

use super::least_energy::descend;
use super::tip_equations::{HEADING_WEIGHT, Scratch, TipEquations};
use super::trunk::Trunk;
use super::two_section::TwoSections;
use crate::error::{InvalidInput, finite};
use crate::status::Status;

/// Goal of the tip.
///
/// ```
/// use nalgebra::Vector2;
/// use tdcr::planar::Goal;
///
/// // The tip at (0.2, 0.06) m, pointing along x; no section turns by more than 3 rad.
/// let goal = Goal { point: Vector2::new(0.2, 0.06), heading: Some(0.0), limits: vec![3.0] };
/// assert_eq!(goal.limits.len(), 1);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Goal {
    /// Position \[m\].
    pub point: Vector2<f64>,
    /// Direction of the tip \[rad\], where it matters: whole turns do not.
    pub heading: Option<f64>,
    /// Largest |turn| of every section \[rad\], one value for all or one each, up to 2 pi.
    pub limits: Vec<f64>,
}

/// Settings of the inverse: tolerance, steps, starts.
///
/// ```
/// use tdcr::planar::InverseSettings;
///
/// let settings = InverseSettings { starts: 100, ..InverseSettings::default() };
/// assert!(settings.validate().is_ok());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseSettings {
    /// Miss of the target that counts as none \[m\]; a heading counts one trunk length per whole turn.
    pub tolerance: f64,
    /// Newton steps per start at most.
    pub max_iterations: usize,
    /// Starts spread over the turns, beside those made of two-section solutions.
    pub starts: usize,
}

impl Default for InverseSettings {
    fn default() -> Self {
        Self { tolerance: 1e-12, max_iterations: 100, starts: 16 }
    }
}

impl InverseSettings {
    /// Refuses settings out of range.
    ///
    /// # Errors
    /// `InvalidInput` that names the field.
    pub fn validate(&self) -> Result<(), InvalidInput> {
        if !(self.tolerance > 0.0 && self.tolerance.is_finite()) {
            let got = format!("{:?}", self.tolerance);
            return Err(InvalidInput::new("tolerance", "a positive finite number [m]", got));
        }
        if !(1..=10_000).contains(&self.max_iterations) {
            return Err(InvalidInput::new("max_iterations", "1 to 10000", self.max_iterations));
        }
        if !(1..=10_000).contains(&self.starts) {
            return Err(InvalidInput::new("starts", "1 to 10000", self.starts));
        }
        Ok(())
    }
}

/// Turns found, and how well they do.
///
/// ```
/// use nalgebra::Vector2;
/// use tdcr::planar::{Goal, InverseSettings, Trunk, inverse};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let trunk = Trunk::new(vec![0.14, 0.12, 0.1], 0.06)?;
/// let goal = Goal { point: Vector2::new(0.25, 0.1), heading: None, limits: vec![3.0] };
/// let found = inverse(&trunk, &goal, &InverseSettings::default())?;
/// assert_eq!(found.status, tdcr::Status::Converged);
/// assert!(found.error < 1e-12);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Inverse {
    /// Turn of every section \[rad\].
    pub turns: Vec<f64>,
    /// Distance of the tip from the target \[m\].
    pub error: f64,
    /// Angle of the tip against the heading asked for \[rad\], in \[-pi, pi\]; 0 where none was.
    pub heading_error: f64,
    /// Bending energy `sum turn^2/(2 l)` for EI = 1 \[1/m\].
    pub energy: f64,
    /// Converged, unreachable (the turns come nearest), or iteration limit.
    pub status: Status,
    /// Newton steps of all starts.
    pub iterations: usize,
    /// Starts that were tried.
    pub starts: usize,
}

/// The turns of least bending energy with the tip on the goal, over all starts; where none reaches it,
/// the turns that come nearest.
///
/// # Errors
/// `InvalidInput` for settings or a goal out of range.
pub fn inverse(
    trunk: &Trunk,
    goal: &Goal,
    settings: &InverseSettings,
) -> Result<Inverse, InvalidInput> {
    let mut solver = Solver::new(trunk, goal, settings)?;
    let starts = solver.search();
    Ok(solver.into_inverse(starts))
}

/// Inverse that a flag stops: [`inverse`], with no answer once `stop` is set, which every step reads.
///
/// # Errors
/// As [`inverse`].
pub fn inverse_until(
    trunk: &Trunk,
    goal: &Goal,
    settings: &InverseSettings,
    stop: &AtomicBool,
) -> Result<Option<Inverse>, InvalidInput> {
    let mut solver = Solver { stop, ..Solver::new(trunk, goal, settings)? };
    let starts = solver.search();
    Ok((!solver.is_stopped()).then(|| solver.into_inverse(starts)))
}

/// Inverse from given turns alone: the least energy near them, or the nearest point.
///
/// # Errors
/// As [`inverse`], and for turns that do not fit the trunk.
pub fn polish(
    trunk: &Trunk,
    goal: &Goal,
    turns: &[f64],
    settings: &InverseSettings,
) -> Result<Inverse, InvalidInput> {
    trunk.check_turns(turns)?;
    let mut solver = Solver::new(trunk, goal, settings)?;
    solver.try_start(turns);
    if solver.best.is_none() {
        solver.try_nearest(turns);
    }
    Ok(solver.into_inverse(1))
}

/// The flag of a search that nobody stops.
static NEVER: AtomicBool = AtomicBool::new(false);

/// The problem, its buffers and the best answers so far.
pub(super) struct Solver<'a> {
    pub(super) problem: TipEquations,
    pub(super) heading: Option<f64>,
    pub(super) total_length: f64,
    pub(super) settings: &'a InverseSettings,
    pub(super) stop: &'a AtomicBool,
    pub(super) work: Scratch,
    pub(super) iterations: usize,
    /// Energy, whether it is stationary, turns.
    pub(super) best: Option<(f64, bool, Vec<f64>)>,
    /// Miss, whether it is stationary, turns.
    nearest: Option<(f64, bool, Vec<f64>)>,
}

impl<'a> Solver<'a> {
    pub(super) fn new(
        trunk: &Trunk,
        goal: &Goal,
        settings: &'a InverseSettings,
    ) -> Result<Self, InvalidInput> {
        settings.validate()?;
        let (x, y) = (finite("x", "m", goal.point.x)?, finite("y", "m", goal.point.y)?);
        let heading = goal.heading.map(|angle| finite("heading", "rad", angle)).transpose()?;
        let count = trunk.lengths().len();
        let limits = match goal.limits[..] {
            [limit] => vec![limit; count],
            _ => goal.limits.clone(),
        };
        if limits.len() != count {
            let expected = format!("one value or {count}, one per section");
            return Err(InvalidInput::new("limit", expected, limits.len()));
        }
        if let Some(bad) = limits.iter().find(|l| !(**l > 0.0 && **l <= std::f64::consts::TAU)) {
            let expected = "turns above 0 and up to 2 pi [rad]";
            return Err(InvalidInput::new("limit", expected, format!("{bad:?}")));
        }
        let total_length: f64 = trunk.lengths().iter().sum();
        let lengths = trunk.lengths().iter().map(|length| length / total_length).collect();
        let target = super::chord::Point::new(x / total_length, y / total_length);
        let problem = TipEquations { lengths, limits, target, heading };
        Ok(Self {
            problem,
            heading,
            total_length,
            settings,
            stop: &NEVER,
            work: Scratch::default(),
            iterations: 0,
            best: None,
            nearest: None,
        })
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Tries all starts; returns how many.
    fn search(&mut self) -> usize {
        let mut starts = self.exact_starts();
        for start in &starts {
            self.try_start(start);
        }
        // Two sections without a heading: the exact solutions are all there are.
        if self.best.is_none() || self.problem.lengths.len() != 2 || self.heading.is_some() {
            let spread = self.spread_starts();
            for start in &spread {
                self.try_start(start);
            }
            starts.extend(spread);
        }
        if self.best.is_none() {
            starts.extend(self.nearest_start());
            for start in &starts {
                self.try_nearest(start);
            }
        }
        starts.len()
    }

    /// Sections in two groups of one curvature each: every exact solution.
    pub(super) fn exact_starts(&self) -> Vec<Vec<f64>> {
        let lengths = &self.problem.lengths;
        let (mut starts, mut found) = (Vec::new(), Vec::new());
        for split in 1..lengths.len() {
            let groups = [&lengths[..split], &lengths[split..]];
            let [l1, l2] = groups.map(|group| group.iter().sum::<f64>());
            let Ok(two) = TwoSections::new(l1, l2, std::f64::consts::TAU) else { continue };
            two.solutions(self.problem.target.re, self.problem.target.im, &mut found);
            for turns in &found {
                let spread = |(group, (turn, group_length)): (&[f64], (f64, f64))| {
                    group.iter().map(move |l| turn * l / group_length).collect::<Vec<f64>>()
                };
                let parts = groups.into_iter().zip([(turns[0], l1), (turns[1], l2)]);
                starts.push(parts.flat_map(spread).collect());
            }
        }
        starts
    }

    /// Turns spread evenly over the limits (the sequence of fractions of powers of the generalised
    /// golden ratio), the circle through the target first.
    pub(super) fn spread_starts(&self) -> Vec<Vec<f64>> {
        let limits = &self.problem.limits;
        let target = self.problem.target;
        let circle = 2.0 * target.im.atan2(target.re);
        let mut starts =
            vec![self.problem.lengths.iter().map(|length| circle * length).collect::<Vec<f64>>()];
        // The root above 1 of g^(m + 1) = g + 1.
        let mut g = 1.5_f64;
        for _ in 0..40 {
            g = (1.0 + g).powf(1.0 / (limits.len() as f64 + 1.0));
        }
        starts.extend((1..=self.settings.starts).map(|k| {
            let mut share = 1.0;
            let place = limits.iter().map(|limit| {
                share /= g;
                limit * (2.0 * (0.5 + k as f64 * share).fract() - 1.0)
            });
            place.collect()
        }));
        starts
    }

    /// The nearest point of two sections.
    fn nearest_start(&self) -> Option<Vec<f64>> {
        let &[l1, l2] = &self.problem.lengths[..] else { return None };
        let limit = self.problem.limits[0].max(self.problem.limits[1]);
        let two = TwoSections::new(l1, l2, limit).ok()?;
        Some(two.nearest(self.problem.target.re, self.problem.target.im).0.to_vec())
    }

    /// Adds whole turns to the heading, those nearest to a start's sum of turns.
    pub(super) fn unwind(&mut self, start: &[f64]) {
        let turn = std::f64::consts::TAU;
        let sum: f64 = start.iter().sum();
        self.problem.heading = self.heading.map(|h| h + turn * ((sum - h) / turn).round());
    }

    pub(super) fn try_start(&mut self, start: &[f64]) {
        if self.is_stopped() {
            return;
        }
        self.unwind(start);
        let mut turns = start.to_vec();
        self.work.fixed.clear();
        if self.problem.move_onto_target(&mut turns, &mut self.work) * self.total_length
            > self.settings.tolerance
        {
            return;
        }
        let (stationary, steps) = descend(
            &self.problem,
            &mut turns,
            self.settings.tolerance / self.total_length,
            self.settings.max_iterations,
            self.stop,
            &mut self.work,
        );
        self.iterations += steps;
        let energy = self.problem.energy(&turns);
        if self.best.as_ref().is_none_or(|(least, _, _)| energy < least * (1.0 - 1e-12)) {
            self.best = Some((energy, stationary, turns));
        }
    }

    pub(super) fn try_nearest(&mut self, start: &[f64]) {
        if self.is_stopped() {
            return;
        }
        self.unwind(start);
        let mut turns = start.to_vec();
        let (miss, flat) = self.problem.minimize_miss(&mut turns, &mut self.work);
        if self.nearest.as_ref().is_none_or(|(least, _, _)| miss < least * (1.0 - 1e-12)) {
            self.nearest = Some((miss, flat, turns));
        }
    }

    pub(super) fn into_inverse(mut self, starts: usize) -> Inverse {
        let (converged, stationary, turns) = match (self.best.take(), self.nearest.take()) {
            (Some((_, stationary, turns)), _) => (true, stationary, turns),
            (None, Some((_, stationary, turns))) => (false, stationary, turns),
            (None, None) => (false, false, vec![0.0; self.problem.lengths.len()]),
        };
        self.unwind(&turns);
        let off = self.problem.linearize(&turns, &mut self.work);
        let error = self.total_length * off.x.hypot(off.y);
        let miss = self.total_length * off.norm();
        // A nearest point may turn out to be the target.
        let converged = converged || miss <= self.settings.tolerance;
        let status = match (converged, stationary) {
            (true, true) => Status::Converged,
            (false, true) => Status::Unreachable,
            (_, false) => Status::IterationLimit,
        };
        Inverse {
            error,
            heading_error: off.z / HEADING_WEIGHT,
            energy: self.problem.energy(&turns) / self.total_length,
            turns,
            status,
            iterations: self.iterations,
            starts,
        }
    }
}
