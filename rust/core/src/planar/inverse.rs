//! The turns of least bending energy that put the tip on a target.

use nalgebra::{Vector2, Vector3};

use super::problem::{HEADING, Problem, Work, eliminate};
use super::trunk::Trunk;
use super::two_section::TwoSections;
use crate::error::{InvalidInput, finite};
use crate::status::Status;

/// What is asked of the tip.
#[derive(Clone, Debug, PartialEq)]
pub struct Goal {
    /// Position \[m\].
    pub point: Vector2<f64>,
    /// Direction of the tip \[rad\], where it matters: whole turns do not.
    pub heading: Option<f64>,
    /// Largest |turn| of every section \[rad\], one value for all or one each, up to 2 pi.
    pub limits: Vec<f64>,
}

/// How precisely and from how many starts.
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

/// Largest gradient of the energy along the target that counts as none, over the energy's own.
const STATIONARY: f64 = 1e-11;

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
    let mut starts = solver.exact_starts();
    let certain = starts.len();
    // Two sections without a heading: the exact solutions are all there are.
    if solver.problem.lengths.len() != 2 || goal.heading.is_some() || certain == 0 {
        starts.extend(solver.spread_starts());
    }
    for start in &starts {
        solver.try_start(start);
    }
    if solver.best.is_none() {
        for start in &starts {
            solver.try_nearest(start);
        }
    }
    Ok(solver.answer(starts.len()))
}

/// As [`inverse`], from given turns alone: the least energy near them, or the nearest point.
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
    Ok(solver.answer(1))
}

/// The problem, its buffers and the best answers so far.
struct Solver<'a> {
    problem: Problem,
    heading: Option<f64>,
    whole: f64,
    settings: &'a InverseSettings,
    work: Work,
    iterations: usize,
    /// Energy, whether it is stationary, turns.
    best: Option<(f64, bool, Vec<f64>)>,
    /// Miss, whether it is stationary, turns.
    nearest: Option<(f64, bool, Vec<f64>)>,
}

impl<'a> Solver<'a> {
    fn new(
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
        let whole: f64 = trunk.lengths().iter().sum();
        let lengths = trunk.lengths().iter().map(|length| length / whole).collect();
        let target = super::chord::Point::new(x / whole, y / whole);
        let problem = Problem { lengths, limits, target, heading };
        Ok(Self {
            problem,
            heading,
            whole,
            settings,
            work: Work::default(),
            iterations: 0,
            best: None,
            nearest: None,
        })
    }

    /// Sections in two groups of one curvature each: every exact solution.
    fn exact_starts(&self) -> Vec<Vec<f64>> {
        let lengths = &self.problem.lengths;
        let (mut starts, mut found) = (Vec::new(), Vec::new());
        for split in 1..lengths.len() {
            let groups = [&lengths[..split], &lengths[split..]];
            let [l1, l2] = groups.map(|group| group.iter().sum::<f64>());
            let Ok(two) = TwoSections::new(l1, l2, std::f64::consts::TAU) else { continue };
            two.solutions(self.problem.target.re, self.problem.target.im, &mut found);
            for turns in &found {
                let spread = |(group, (turn, whole)): (&[f64], (f64, f64))| {
                    group.iter().map(move |l| turn * l / whole).collect::<Vec<f64>>()
                };
                let parts = groups.into_iter().zip([(turns[0], l1), (turns[1], l2)]);
                starts.push(parts.flat_map(spread).collect());
            }
        }
        starts
    }

    /// Turns spread evenly over the limits (the sequence of fractions of powers of the generalised
    /// golden ratio), the circle through the target first.
    fn spread_starts(&self) -> Vec<Vec<f64>> {
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

    /// Whole turns of the heading do not matter: those nearest to a start's are taken.
    fn unwind(&mut self, start: &[f64]) {
        let turn = std::f64::consts::TAU;
        let sum: f64 = start.iter().sum();
        self.problem.heading = self.heading.map(|h| h + turn * ((sum - h) / turn).round());
    }

    fn try_start(&mut self, start: &[f64]) {
        self.unwind(start);
        let mut turns = start.to_vec();
        self.work.held.clear();
        if self.problem.reach(&mut turns, &mut self.work) * self.whole > self.settings.tolerance {
            return;
        }
        let stationary = self.descend(&mut turns);
        let energy = self.problem.energy(&turns);
        if self.best.as_ref().is_none_or(|(least, _, _)| energy < least * (1.0 - 1e-12)) {
            self.best = Some((energy, stationary, turns));
        }
    }

    fn try_nearest(&mut self, start: &[f64]) {
        self.unwind(start);
        let mut turns = start.to_vec();
        let (miss, flat) = self.problem.approach(&mut turns, &mut self.work);
        if self.nearest.as_ref().is_none_or(|(least, _, _)| miss < least * (1.0 - 1e-12)) {
            self.nearest = Some((miss, flat, turns));
        }
    }

    /// Lowers the energy along the target: Newton steps in the turns that are free, each brought back
    /// onto the target. Returns whether it ended at a minimum.
    fn descend(&mut self, turns: &mut Vec<f64>) -> bool {
        let Self { problem, work, .. } = self;
        let (mut energy, mut damping) = (problem.energy(turns), 0.0);
        let mut trial = turns.clone();
        for _ in 0..self.settings.max_iterations {
            problem.linearize(turns, work);
            let (multipliers, slope) = reduced(problem, turns, work);
            let free = work.free.iter().filter(|free| **free).count();
            // With two free turns the target leaves no choice.
            let fixed = free <= 2 + usize::from(problem.heading.is_some());
            if fixed || slope <= STATIONARY * (2.0 * energy).sqrt().max(1e-3) {
                return true;
            }
            self.iterations += 1;
            tangent_step(problem, turns, &multipliers, damping, work);
            trial.clone_from(turns);
            to_the_limit(problem, &mut trial, work);
            let on = problem.reach(&mut trial, work) * self.whole <= self.settings.tolerance;
            let next = problem.energy(&trial);
            if on && next < energy {
                let small = energy - next < 1e-15 * energy;
                std::mem::swap(turns, &mut trial);
                energy = next;
                damping *= 0.1;
                if small {
                    return true;
                }
            } else {
                // Differences of the energy end in rounding before its gradient does.
                if damping > 1e8 {
                    return slope < 1e-6 * (1.0 + energy);
                }
                damping = (10.0 * damping).max(0.1);
            }
        }
        false
    }

    fn answer(mut self, starts: usize) -> Inverse {
        let (converged, settled, turns) = match (self.best.take(), self.nearest.take()) {
            (Some((_, settled, turns)), _) => (true, settled, turns),
            (None, Some((_, settled, turns))) => (false, settled, turns),
            (None, None) => (false, false, vec![0.0; self.problem.lengths.len()]),
        };
        self.unwind(&turns);
        let off = self.problem.linearize(&turns, &mut self.work);
        let error = self.whole * off.x.hypot(off.y);
        let miss = self.whole * off.norm();
        // A nearest point may turn out to be the target.
        let converged = converged || miss <= self.settings.tolerance;
        let status = match (converged, settled) {
            (true, true) => Status::Converged,
            (false, true) => Status::Unreachable,
            (_, false) => Status::IterationLimit,
        };
        Inverse {
            error,
            heading_error: off.z / HEADING,
            energy: self.problem.energy(&turns) / self.whole,
            turns,
            status,
            iterations: self.iterations,
            starts,
        }
    }
}

/// Takes the step, or the part of it up to the first limit on the way; holds the turns at limits.
fn to_the_limit(problem: &Problem, turns: &mut [f64], work: &mut Work) {
    let mut share = 1.0_f64;
    let mut first = None;
    for (i, (turn, step)) in turns.iter().zip(&work.step).enumerate() {
        let room = problem.limits[i] - turn * step.signum();
        share = share.min(2.0 / step.abs());
        if work.free[i] && step.abs() * share > room {
            (share, first) = ((room / step.abs()).max(0.0), Some(i));
        }
    }
    work.held.clear();
    work.held.extend(work.free.iter().map(|free| !free));
    for (turn, step) in turns.iter_mut().zip(&work.step) {
        *turn += share * step;
    }
    if let Some(i) = first {
        turns[i] = problem.limits[i].copysign(work.step[i]);
        work.held[i] = true;
    }
}

/// Multipliers of the target by least squares over the free turns, and the size of the energy's
/// gradient that they leave. A turn at its limit is free when the energy would have it come back.
fn reduced(problem: &Problem, turns: &[f64], work: &mut Work) -> (Vector3<f64>, f64) {
    let n = turns.len();
    work.free.clear();
    work.free.extend(turns.iter().zip(&problem.limits).map(|(turn, limit)| turn.abs() < *limit));
    for _ in 0..=n {
        let gram = problem.gram(work, 0.0);
        let free = |i: &usize| work.free[*i];
        // The gradient of the energy is turn/length, its weight the length.
        let right = (0..n)
            .filter(free)
            .fold(Vector3::zeros(), |sum: Vector3<f64>, i| sum + problem.row(work, i) * turns[i]);
        let multipliers = -(gram * right);
        let left =
            |i: usize| turns[i] / problem.lengths[i] + problem.row(work, i).dot(&multipliers);
        let pulled = |i: &usize| !work.free[*i] && left(*i) * turns[*i] > 1e-9;
        let strength = |i: &usize| left(*i).abs();
        let back = (0..n).filter(pulled).max_by(|a, b| strength(a).total_cmp(&strength(b)));
        let slope =
            (0..n).filter(free).map(|i| problem.lengths[i] * left(i) * left(i)).sum::<f64>();
        match back {
            Some(i) => work.free[i] = true,
            None => return (multipliers, slope.sqrt()),
        }
    }
    (Vector3::zeros(), f64::INFINITY)
}

/// Newton step of the energy on the linearised target: the saddle-point system of the free turns and
/// the multipliers, with the second derivatives of the target.
fn tangent_step(
    problem: &Problem,
    turns: &[f64],
    multipliers: &Vector3<f64>,
    damping: f64,
    work: &mut Work,
) {
    let n = turns.len();
    let held = if problem.heading.is_some() { 3 } else { 2 };
    let size = n + held;
    work.matrix.clear();
    work.matrix.resize(size * size, 0.0);
    work.step.clear();
    work.step.resize(size, 0.0);
    for i in 0..n {
        if !work.free[i] {
            work.matrix[size * i + i] = 1.0;
            continue;
        }
        for j in (0..n).filter(|j| work.free[*j]) {
            let second = Problem::second(work, i, j);
            work.matrix[size * i + j] = multipliers.x * second.re + multipliers.y * second.im;
        }
        work.matrix[size * i + i] += (1.0 + damping) / problem.lengths[i];
        let row = problem.row(work, i);
        for k in 0..held {
            work.matrix[size * i + n + k] = row[k];
            work.matrix[size * (n + k) + i] = row[k];
        }
        work.step[i] = -turns[i] / problem.lengths[i];
    }
    let Work { matrix, step, .. } = work;
    eliminate(matrix, step);
    work.step.truncate(n);
}
