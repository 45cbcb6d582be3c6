//! The tip as a function of the turns, with derivatives, and the two iterations on it: onto the target
//! with the least change, and as near to it as can be. Lengths are in units of the trunk's.

use nalgebra::{Matrix3, Vector3};

use super::chord::{Chord, Point};

/// Equations of the tip: position, and heading where one is asked for.
#[derive(Clone, Debug)]
pub(super) struct TipEquations {
    pub(super) lengths: Vec<f64>,
    pub(super) limits: Vec<f64>,
    pub(super) target: Point,
    /// Sum of the turns \[rad\].
    pub(super) heading: Option<f64>,
}

/// Misses of the heading count as lengths at this rate \[1/rad\]: a whole turn as the trunk's length.
pub(super) const HEADING_WEIGHT: f64 = 1.0 / std::f64::consts::TAU;

/// Buffers of the iterations, and what the last linearisation found.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    /// Derivatives of the tip by every turn.
    pub(super) first: Vec<Point>,
    /// Second derivative of the tip by a turn twice.
    pub(super) second: Vec<Point>,
    pub(super) free: Vec<bool>,
    /// Turns that [`TipEquations::move_onto_target`] leaves as they are.
    pub(super) fixed: Vec<bool>,
    pub(super) trial: Vec<f64>,
    pub(super) step: Vec<f64>,
    pub(super) matrix: Vec<f64>,
    ends: Vec<Point>,
}

impl TipEquations {
    /// Misses of position and heading; fills the derivatives in `work`.
    pub(super) fn linearize(&self, turns: &[f64], work: &mut Scratch) -> Vector3<f64> {
        let (mut at, mut frame) = (Point::new(0.0, 0.0), Point::new(1.0, 0.0));
        work.first.clear();
        work.second.clear();
        work.ends.clear();
        for (turn, length) in turns.iter().zip(&self.lengths) {
            let chord = Chord::new(*turn);
            let unit = frame * *length;
            at += unit * chord.value;
            work.first.push(unit * chord.first);
            work.second.push(unit * chord.second);
            work.ends.push(at);
            frame *= chord.heading;
        }
        for (i, end) in work.ends.iter().enumerate() {
            // What lies beyond the section turns with it.
            let beyond = at - end;
            work.first[i] += Point::new(-beyond.im, beyond.re);
            work.second[i] -= beyond;
        }
        let off = at - self.target;
        Vector3::new(off.re, off.im, self.heading_miss(turns))
    }

    fn heading_miss(&self, turns: &[f64]) -> f64 {
        self.heading.map_or(0.0, |heading| HEADING_WEIGHT * (turns.iter().sum::<f64>() - heading))
    }

    /// Row of the misses' derivative by turn i.
    pub(super) fn row(&self, work: &Scratch, i: usize) -> Vector3<f64> {
        Vector3::new(
            work.first[i].re,
            work.first[i].im,
            if self.heading.is_some() { HEADING_WEIGHT } else { 0.0 },
        )
    }

    /// Second derivative of the tip by turns i and j: what lies beyond section i turns with it.
    pub(super) fn second(work: &Scratch, i: usize, j: usize) -> Point {
        if i == j {
            return work.second[i];
        }
        let later = work.first[i.max(j)];
        Point::new(-later.im, later.re)
    }

    /// Bending energy for EI = 1 and a trunk of length one.
    pub(super) fn energy(&self, turns: &[f64]) -> f64 {
        0.5 * turns
            .iter()
            .zip(&self.lengths)
            .map(|(turn, length)| turn * turn / length)
            .sum::<f64>()
    }

    pub(super) fn clamp(&self, turns: &mut [f64]) {
        for (turn, limit) in turns.iter_mut().zip(&self.limits) {
            *turn = turn.clamp(-limit, *limit);
        }
    }

    /// Turns that are free to move by `step`: not at a limit, or away from it.
    fn release(&self, turns: &[f64], step: &[f64], free: &mut [bool]) -> bool {
        let mut changed = false;
        for i in 0..turns.len() {
            if free[i] && turns[i].abs() >= self.limits[i] && step[i] * turns[i] > 0.0 {
                (free[i], changed) = (false, true);
            }
        }
        changed
    }

    /// The change of least energy that takes the misses away to first order, `damping` added to the
    /// matrix of the normal equations.
    fn least_change(&self, turns: &[f64], off: &Vector3<f64>, damping: f64, work: &mut Scratch) {
        let n = turns.len();
        work.fixed.resize(n, false);
        work.free.clear();
        work.free.extend(work.fixed.iter().map(|fixed| !fixed));
        work.step.resize(n, 0.0);
        for _ in 0..=n {
            let multipliers = self.gram(work, damping) * off;
            for i in 0..n {
                let change = self.lengths[i] * self.row(work, i).dot(&multipliers);
                work.step[i] = if work.free[i] { -change } else { 0.0 };
            }
            let Scratch { step, free, .. } = work;
            if !self.release(turns, step, free) {
                return;
            }
        }
    }

    /// Inverse of `J W J^T + damping` over the free turns, W the inverse weights of the energy.
    pub(super) fn gram(&self, work: &Scratch, damping: f64) -> Matrix3<f64> {
        let mut gram = Matrix3::zeros();
        for i in (0..self.lengths.len()).filter(|i| work.free[*i]) {
            let row = self.row(work, i);
            gram += row * row.transpose() * self.lengths[i];
        }
        let floor = damping.max(1e-15) * gram.trace().max(1e-300);
        gram += Matrix3::identity() * floor;
        if self.heading.is_none() {
            gram[(2, 2)] = 1.0;
        }
        gram.try_inverse().unwrap_or_else(Matrix3::zeros)
    }

    /// Moves the turns onto the target with little change, by damped Newton steps; returns the miss.
    pub(super) fn move_onto_target(&self, turns: &mut Vec<f64>, work: &mut Scratch) -> f64 {
        self.clamp(turns);
        let mut off = self.linearize(turns, work);
        let (mut miss, mut damping) = (off.norm(), 0.0);
        for _ in 0..60 {
            if miss < 1e-16 {
                break;
            }
            self.least_change(turns, &off, damping, work);
            work.trial.clear();
            work.trial.extend(turns.iter().zip(&work.step).map(|(turn, step)| turn + step));
            let mut trial = std::mem::take(&mut work.trial);
            self.clamp(&mut trial);
            let ahead = self.linearize(&trial, work);
            if ahead.norm() < miss {
                let slow = ahead.norm() > 0.999_9 * miss && damping > 0.0;
                (off, miss) = (ahead, ahead.norm());
                std::mem::swap(turns, &mut trial);
                damping = if damping < 1e-9 { 0.0 } else { 0.1 * damping };
                if slow {
                    work.trial = trial;
                    break;
                }
            } else {
                if miss < 1e-14 || damping > 1e6 {
                    work.trial = trial;
                    break;
                }
                damping = (10.0 * damping).max(1e-3);
                off = self.linearize(turns, work);
            }
            work.trial = trial;
        }
        self.linearize(turns, work);
        miss
    }

    /// Moves the turns to where the miss has a local minimum, by Newton steps with the exact second
    /// derivatives. Returns the miss and whether the gradient vanishes there.
    pub(super) fn minimize_miss(&self, turns: &mut Vec<f64>, work: &mut Scratch) -> (f64, bool) {
        let n = turns.len();
        self.clamp(turns);
        let mut off = self.linearize(turns, work);
        let (mut miss, mut damping) = (off.norm(), 1e-3);
        for _ in 0..200 {
            let mut gradient: Vec<f64> = (0..n).map(|i| self.row(work, i).dot(&off)).collect();
            for (g, (turn, limit)) in gradient.iter_mut().zip(turns.iter().zip(&self.limits)) {
                if turn.abs() >= *limit && *g * turn < 0.0 {
                    *g = 0.0;
                }
            }
            let flat = gradient.iter().fold(0.0_f64, |most, g| most.max(g.abs()));
            if miss < 1e-16 || flat < 1e-15 {
                return (miss, true);
            }
            self.damped_newton(&gradient, &off, damping, work);
            work.trial.clear();
            work.trial.extend(turns.iter().zip(&work.step).map(|(turn, step)| turn + step));
            let mut trial = std::mem::take(&mut work.trial);
            self.clamp(&mut trial);
            let ahead = self.linearize(&trial, work);
            if ahead.norm() < miss {
                (off, miss) = (ahead, ahead.norm());
                std::mem::swap(turns, &mut trial);
                damping *= 0.1;
            } else {
                if flat < 1e-9 || damping > 1e12 {
                    work.trial = trial;
                    return (miss, flat < 1e-6);
                }
                damping = (10.0 * damping).max(1e-9);
                off = self.linearize(turns, work);
            }
            work.trial = trial;
        }
        (miss, false)
    }

    /// `(J^T J + sum off_k H_k + damping/lengths) step = -gradient`, entries of zero gradient at a
    /// limit fixed.
    fn damped_newton(
        &self,
        gradient: &[f64],
        off: &Vector3<f64>,
        damping: f64,
        work: &mut Scratch,
    ) {
        let n = gradient.len();
        work.matrix.clear();
        work.matrix.resize(n * n, 0.0);
        for i in 0..n {
            for j in 0..n {
                let second = Self::second(work, i, j);
                work.matrix[n * i + j] = self.row(work, i).dot(&self.row(work, j))
                    + off.x * second.re
                    + off.y * second.im;
            }
            work.matrix[n * i + i] += damping / self.lengths[i];
        }
        work.step.clear();
        work.step.extend(gradient.iter().map(|g| -g));
        for i in (0..n).filter(|i| gradient[*i] == 0.0) {
            for j in 0..n {
                work.matrix[n * i + j] = 0.0;
                work.matrix[n * j + i] = 0.0;
            }
            work.matrix[n * i + i] = 1.0;
        }
        eliminate(&mut work.matrix, &mut work.step);
    }
}

/// Solves a dense system in place by elimination with row pivots; where it is singular the unknown is zero.
pub(super) fn eliminate(matrix: &mut [f64], right: &mut [f64]) {
    let n = right.len();
    for k in 0..n {
        let size = |row: usize| matrix[n * row + k].abs();
        let pivot = (k..n).max_by(|a, b| size(*a).total_cmp(&size(*b))).unwrap_or(k);
        if pivot != k {
            for j in 0..n {
                matrix.swap(n * k + j, n * pivot + j);
            }
            right.swap(k, pivot);
        }
        let inverse = 1.0 / matrix[n * k + k];
        if !inverse.is_finite() {
            right[k] = 0.0;
            continue;
        }
        for row in k + 1..n {
            let share = matrix[n * row + k] * inverse;
            if share != 0.0 {
                for j in k..n {
                    matrix[n * row + j] -= share * matrix[n * k + j];
                }
                right[row] -= share * right[k];
            }
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| matrix[n * k + j] * right[j]).sum();
        let solved = (right[k] - known) / matrix[n * k + k];
        right[k] = if solved.is_finite() { solved } else { 0.0 };
    }
}
