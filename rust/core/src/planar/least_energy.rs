//! Down the bending energy with the tip on its target.

use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::Vector3;

use super::tip_equations::{Scratch, TipEquations, eliminate};

/// Largest gradient of the energy along the target that counts as none, over the energy's own.
const STATIONARY: f64 = 1e-11;

/// Largest share of a step that counts as none, where a limit ends it.
const STUCK: f64 = 1e-12;

/// Lowers the energy along the target: Newton steps in the turns that are free, each brought back
/// onto the target. Returns whether it ended at a minimum, and the steps taken; `stop` ends it where
/// it is.
pub(super) fn descend(
    problem: &TipEquations,
    turns: &mut Vec<f64>,
    tolerance: f64,
    most: usize,
    stop: &AtomicBool,
    work: &mut Scratch,
) -> (bool, usize) {
    let (mut energy, mut damping) = (problem.energy(turns), 0.0);
    let mut hold = false;
    let mut trial = turns.clone();
    // With as many free turns the target leaves no choice.
    let constraints = 2 + usize::from(problem.heading.is_some());
    for steps in 0..most {
        if stop.load(Ordering::Relaxed) {
            return (false, steps);
        }
        // Multipliers of the target, free turns, gradient of the energy along the target.
        problem.linearize(turns, work);
        let (multipliers, slope) = reduced_gradient(problem, turns, work);
        let mut free = work.free.iter().filter(|free| **free).count();
        if free <= constraints || slope <= STATIONARY * (2.0 * energy).sqrt().max(1e-3) {
            return (true, steps);
        }
        // Newton step in the tangent of the target. Where no damping helps, a turn whose limit leaves nothing of the
        // step is fixed for this step.
        tangent_step(problem, turns, &multipliers, damping, work);
        trial.clone_from(turns);
        while let Some(stuck) = step_to_limit(problem, &mut trial, work).filter(|_| hold) {
            work.free[stuck] = false;
            free -= 1;
            if free <= constraints {
                break;
            }
            tangent_step(problem, turns, &multipliers, damping, work);
            trial.clone_from(turns);
        }
        // Back onto the target: the step counts if the energy falls.
        let no_freedom = hold && free <= constraints;
        let on = !no_freedom && problem.move_onto_target(&mut trial, work) <= tolerance;
        let next = problem.energy(&trial);
        if on && next < energy {
            let small = energy - next < 1e-15 * energy;
            std::mem::swap(turns, &mut trial);
            energy = next;
            damping *= 0.1;
            hold = false;
            if small {
                return (true, steps);
            }
        } else {
            // The limits leave no step.
            if no_freedom {
                return (true, steps);
            }
            if damping > 1e8 {
                // Differences of the energy end in rounding before its gradient does.
                let flat = slope < 1e-6 * (1.0 + energy);
                if flat || hold {
                    return (flat, steps);
                }
                (hold, damping) = (true, 0.0);
                continue;
            }
            // A shorter step next time.
            damping = (10.0 * damping).max(0.1);
        }
    }
    (false, most)
}

/// Takes the step, or the part of it up to the first limit on the way; holds the turns at limits.
/// Returns the turn whose limit leaves nothing of the step.
fn step_to_limit(problem: &TipEquations, turns: &mut [f64], work: &mut Scratch) -> Option<usize> {
    let mut share = 1.0_f64;
    let mut first = None;
    for (i, (turn, step)) in turns.iter().zip(&work.step).enumerate() {
        let room = problem.limits[i] - turn * step.signum();
        share = share.min(2.0 / step.abs());
        if work.free[i] && step.abs() * share > room {
            (share, first) = ((room / step.abs()).max(0.0), Some(i));
        }
    }
    work.fixed.clear();
    work.fixed.extend(work.free.iter().map(|free| !free));
    for (turn, step) in turns.iter_mut().zip(&work.step) {
        *turn += share * step;
    }
    if let Some(i) = first {
        turns[i] = problem.limits[i].copysign(work.step[i]);
        work.fixed[i] = true;
    }
    first.filter(|_| share <= STUCK)
}

/// Multipliers of the target by least squares over the free turns, and the size of the energy's
/// gradient that they leave. A turn at its limit is free when the energy would have it come back.
fn reduced_gradient(
    problem: &TipEquations,
    turns: &[f64],
    work: &mut Scratch,
) -> (Vector3<f64>, f64) {
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
    problem: &TipEquations,
    turns: &[f64],
    multipliers: &Vector3<f64>,
    damping: f64,
    work: &mut Scratch,
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
            let second = TipEquations::second(work, i, j);
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
    let Scratch { matrix, step, .. } = work;
    eliminate(matrix, step);
    work.step.truncate(n);
}
