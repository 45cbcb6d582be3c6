//! Small convex quadratic programs with lower bounds, by the active-set method of Lawson & Hanson,
//! *Solving Least Squares Problems*, 1974, ch. 23.
//!
//! Variables leave their bounds one by one, so that ones that depend on those already free stay where they
//! are: a singular matrix, as of tendons of which some are slack, costs no precision.

use super::dense::{backward, cholesky, forward};

/// Gradients below this share of the largest linear term that pulls a variable off its bound count as zero: how far
/// others are pushed onto theirs does not round those.
const FLAT: f64 = 1e-14;

/// Buffers, and the answer.
///
/// ```
/// use tdcr::solve::bounded_program::BoundedProgram;
///
/// // min x² / 2 + y² / 2 - x + y with x, y >= 0.
/// let mut program = BoundedProgram::default();
/// assert!(program.solve(&[1.0, 0.0, 0.0, 1.0], &[1.0, -1.0], &[0.0, 0.0], |_| false));
/// assert_eq!(program.step, [1.0, 0.0]);
/// ```
#[derive(Clone, Debug, Default)]
pub struct BoundedProgram {
    /// The minimiser.
    pub step: Vec<f64>,
    /// Free variables, in the order of the factor.
    free: Vec<usize>,
    factor: Vec<f64>,
    trial: Vec<f64>,
}

impl BoundedProgram {
    /// Minimises `x·M x / 2 − right·x` subject to `x ≥ lower`, where `lower ≤ 0`, from zero; variables with
    /// `first` start free. `matrix` is symmetric, row by row, of which the lower triangle is read. False when
    /// the arithmetic breaks down or the active set goes on changing.
    pub fn solve(
        &mut self,
        matrix: &[f64],
        right: &[f64],
        lower: &[f64],
        first: impl Fn(usize) -> bool,
    ) -> bool {
        let size = right.len();
        let at = |i: usize, j: usize| matrix[i.max(j) * size + i.min(j)];
        self.step.clear();
        self.step.resize(size, 0.0);
        self.free.clear();
        self.free.extend((0..size).filter(|k| first(*k)));
        let pulls = right.iter().enumerate().map(|(k, r)| if first(k) { r.abs() } else { *r });
        let flat = FLAT * pulls.fold(0.0_f64, f64::max);
        // A variable may come and go; each round lowers the value.
        for _ in 0..=4 * size + 4 {
            if !self.descend(&at, right, lower) {
                return false;
            }
            let gradient =
                |k: usize| right[k] - (0..size).map(|j| at(k, j) * self.step[j]).sum::<f64>();
            let (mut most, mut next) = (flat, None);
            for k in 0..size {
                let slope = gradient(k);
                if slope > most && !self.free.contains(&k) {
                    (most, next) = (slope, Some(k));
                }
            }
            let Some(next) = next else { return true };
            self.free.push(next);
        }
        false
    }

    /// Minimises over the free variables, of which those that meet their bounds stay there.
    fn descend(&mut self, at: &impl Fn(usize, usize) -> f64, right: &[f64], lower: &[f64]) -> bool {
        loop {
            let count = self.free.len();
            if count == 0 {
                return true;
            }
            // M and right-hand side of the free variables, the others fixed.
            self.factor.clear();
            self.trial.clear();
            for (a, &i) in self.free.iter().enumerate() {
                self.factor.extend(self.free[..=a].iter().map(|j| at(i, *j)));
                self.factor.resize((a + 1) * count, 0.0);
                let fixed = (0..right.len()).filter(|j| !self.free.contains(j));
                self.trial.push(right[i] - fixed.map(|j| at(i, j) * self.step[j]).sum::<f64>());
            }
            // Their unconstrained minimum.
            if !cholesky(&mut self.factor, count) {
                return false;
            }
            forward(&self.factor, count, &mut self.trial);
            backward(&self.factor, count, &mut self.trial);
            // Share of the way until the first of them meets its bound.
            let (mut share, mut first) = (1.0_f64, None);
            for (a, &i) in self.free.iter().enumerate() {
                let (from, to) = (self.step[i], self.trial[a]);
                if to.is_nan() {
                    return false;
                }
                let room = (from - lower[i]) / (from - to);
                if to < lower[i] && (first.is_none() || room < share) {
                    (share, first) = (room, Some(i));
                }
            }
            for (a, &i) in self.free.iter().enumerate() {
                let moved = self.step[i] + share * (self.trial[a] - self.step[i]);
                self.step[i] = moved.max(lower[i]);
            }
            // Variables on their bounds are free no more.
            let Some(first) = first else { return true };
            self.step[first] = lower[first];
            let step = &self.step;
            self.free.retain(|i| step[*i] > lower[*i]);
        }
    }
}
