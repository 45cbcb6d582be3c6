//! Small strictly convex quadratic programs by the dual active-set method of D. Goldfarb and
//! A. Idnani, Mathematical Programming 27 (1983), doi:10.1007/BF02591962.
//!
//! It starts from the unconstrained minimum and adds what is violated, so a program none of whose
//! constraints matter costs one Cholesky factorisation. The active rows, in the Hessian's metric, are kept
//! as an orthonormal basis and a triangle; when one leaves, which is rare, the basis is made anew.

use super::dense::{backward, cholesky, dot, forward};

/// Constraints `normal_k . p = offset_k` for the first `equalities` rows, `normal_k . p <= offset_k` for
/// the rest. Normals are about as long as 1.
///
/// ```
/// use tdcr::solve::quadratic_program::Rows;
///
/// let mut rows = Rows::default();
/// rows.push(2, 1.0).copy_from_slice(&[1.0, 0.0]);
/// assert!(rows.allow(2, &[0.5, 9.0]) && !rows.allow(2, &[1.5, 0.0]));
/// ```
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// Normals one after the other, as many numbers each as there are unknowns.
    pub normals: Vec<f64>,
    /// Right-hand sides.
    pub offsets: Vec<f64>,
    /// Number of equations, which are the first rows.
    pub equalities: usize,
}

impl Rows {
    /// Empties the rows, keeping their memory.
    pub fn clear(&mut self) {
        self.normals.clear();
        self.offsets.clear();
        self.equalities = 0;
    }

    /// Adds a row whose normal is zero and returns the normal.
    pub fn push(&mut self, size: usize, offset: f64) -> &mut [f64] {
        let start = self.normals.len();
        self.normals.resize(start + size, 0.0);
        self.offsets.push(offset);
        &mut self.normals[start..]
    }

    /// True when a step meets all rows, to rounding.
    #[must_use]
    pub fn allow(&self, size: usize, step: &[f64]) -> bool {
        self.offsets.iter().enumerate().all(|(k, offset)| {
            let off = dot(self.normal(size, k), step) - offset;
            (if k < self.equalities { off.abs() } else { off }) <= MET
        })
    }

    /// Normal of a row.
    #[must_use]
    pub fn normal(&self, size: usize, row: usize) -> &[f64] {
        &self.normals[row * size..(row + 1) * size]
    }
}

/// Outcome of a program.
///
/// ```
/// use tdcr::solve::quadratic_program::{Outcome, QuadraticProgram, Rows};
///
/// // p <= -1 and -p <= -1 exclude each other.
/// let mut rows = Rows::default();
/// rows.push(1, -1.0)[0] = 1.0;
/// rows.push(1, -1.0)[0] = -1.0;
/// let mut program = QuadraticProgram::default();
/// program.factor_identity(1);
/// program.gradient = vec![0.0];
/// assert_eq!(program.solve(&rows), Outcome::Infeasible);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The minimum.
    Solved,
    /// No point meets the constraints.
    Infeasible,
    /// The arithmetic broke down, or the active set kept changing.
    Failed,
}

/// Violations below this count as met; steps and normals are of order 1.
const MET: f64 = 1e-13;

/// An equation is dependent on others when the square of its part outside them, in the Hessian's metric, is
/// this small a share of it: rows of a Jacobian near where it is singular.
const DEPENDENT: f64 = 1e-11;
/// Dependence of an inequality: independent rows come as near as the inverse of the Hessian's condition
/// (1e13 for least squares with freedom), dependent ones as near as the rounding of their whitened rows.
const PARALLEL: f64 = 1e-16;

/// A row that depends on active ones contradicts them when it is violated by more than this; below, it is
/// the rounding of a long way to them.
const CONTRADICTION: f64 = 1e-9;

/// Buffers of a solve, and its answer.
///
/// ```
/// use tdcr::solve::quadratic_program::{Outcome, QuadraticProgram, Rows};
///
/// // min |p|² / 2 - 2 p_0 with p_0 + p_1 <= 1.
/// let mut rows = Rows::default();
/// rows.push(2, 1.0).copy_from_slice(&[1.0, 1.0]);
/// let mut program = QuadraticProgram::default();
/// program.factor_identity(2);
/// program.gradient = vec![-2.0, 0.0];
/// assert_eq!(program.solve(&rows), Outcome::Solved);
/// assert!((program.step[0] - 1.5).abs() < 1e-12 && (program.step[1] + 0.5).abs() < 1e-12);
/// assert!((program.multipliers[0] - 0.5).abs() < 1e-12);
/// ```
#[derive(Clone, Debug, Default)]
pub struct QuadraticProgram {
    size: usize,
    /// Cholesky factor of the Hessian, lower, row by row, its diagonal inverted.
    factor: Vec<f64>,
    /// The linear term, set before a solve.
    pub gradient: Vec<f64>,
    /// The minimiser.
    pub step: Vec<f64>,
    /// Active rows, equations first.
    pub active: Vec<usize>,
    /// Their multipliers: `H p + g + sum_k multiplier_k normal_k = 0`; not negative for inequalities.
    pub multipliers: Vec<f64>,
    /// Rows that depend on active ones and hold as nearly as these do.
    implied: Vec<usize>,
    /// `L^-1 normal` of every active row.
    whitened_rows: Vec<f64>,
    /// Orthonormal basis of these.
    basis: Vec<f64>,
    /// The images in the basis: column k has k + 1 numbers, one column after the other.
    triangle: Vec<f64>,
    /// `L^-1 normal` of the row that is being added.
    whitened: Vec<f64>,
    /// Its part outside the active ones.
    orthogonal: Vec<f64>,
    /// The direction of a move.
    direction: Vec<f64>,
    /// Its part inside: in the basis, then in the images.
    coefficients: Vec<f64>,
}

impl QuadraticProgram {
    /// Factors a symmetric Hessian, of which the lower triangle is read (row by row); false unless it
    /// is positive definite.
    pub fn factor(&mut self, hessian: &[f64], size: usize) -> bool {
        self.size = size;
        self.factor.clear();
        self.factor.extend_from_slice(hessian);
        cholesky(&mut self.factor, size)
    }

    /// Makes the Hessian the identity.
    pub fn factor_identity(&mut self, size: usize) {
        self.size = size;
        self.factor.clear();
        self.factor.resize(size * size, 0.0);
        for i in 0..size {
            self.factor[i * (size + 1)] = 1.0;
        }
    }

    /// Minimises `p . H p / 2 + gradient . p` without constraints, with the Hessian factored last.
    pub fn solve_free(&mut self) {
        self.active.clear();
        self.multipliers.clear();
        self.implied.clear();
        self.whitened_rows.clear();
        self.basis.clear();
        self.triangle.clear();
        self.step.clear();
        self.step.extend(self.gradient.iter().map(|g| -g));
        forward(&self.factor, self.size, &mut self.step);
        backward(&self.factor, self.size, &mut self.step);
    }

    /// Minimises `p . H p / 2 + gradient . p` under `rows`, with the Hessian factored last.
    pub fn solve(&mut self, rows: &Rows) -> Outcome {
        self.solve_free();
        if rows.equalities > 0 && !self.meet_equations(rows) {
            return Outcome::Infeasible;
        }
        let size = self.size;
        // Every pass adds a row for good or ends; the bound is for arithmetic gone wrong.
        for _ in 0..=4 * (size + rows.offsets.len()) {
            let (mut worst, mut row) = (MET, usize::MAX);
            for k in rows.equalities..rows.offsets.len() {
                let off = dot(rows.normal(size, k), &self.step) - rows.offsets[k];
                if off > worst * (1.0 + rows.offsets[k].abs())
                    && !self.active.contains(&k)
                    && !self.implied.contains(&k)
                {
                    (worst, row) = (off, k);
                }
            }
            if row == usize::MAX {
                let finite = self.step.iter().all(|p| p.is_finite());
                return if finite { Outcome::Solved } else { Outcome::Failed };
            }
            match self.activate(rows, row, worst) {
                Outcome::Solved => {}
                other => return other,
            }
        }
        Outcome::Failed
    }

    /// Largest component of `gradient + sum_k multiplier_k normal_k` after a solve under `rows`: 0 where
    /// the constraints balance the gradient.
    #[must_use]
    pub fn lagrangian_gradient(&self, rows: &Rows) -> f64 {
        (0..self.size).fold(0.0, |most, i| {
            let held = self.active.iter().zip(&self.multipliers);
            let sum = held.fold(self.gradient[i], |sum, (&row, multiplier)| {
                sum + multiplier * rows.normal(self.size, row)[i]
            });
            most.max(sum.abs())
        })
    }

    /// Moves from the free minimum to the one on all equations at once; false when they exclude each other.
    ///
    /// In `y = L^T p` the way is the shortest one: `y - y_free` in the span of the images, each image
    /// times `y` the right-hand side.
    fn meet_equations(&mut self, rows: &Rows) -> bool {
        let size = self.size;
        for row in 0..rows.equalities {
            self.whitened.clear();
            self.whitened.extend_from_slice(rows.normal(size, row));
            forward(&self.factor, size, &mut self.whitened);
            self.project();
            let squared_norm = dot(&self.whitened, &self.whitened);
            if dot(&self.orthogonal, &self.orthogonal) > DEPENDENT * squared_norm {
                self.active.push(row);
                self.whitened_rows.extend_from_slice(&self.whitened);
                self.extend_basis();
            }
        }
        self.coefficients.clear();
        for (k, &row) in self.active.iter().enumerate() {
            let column = &self.triangle[k * (k + 1) / 2..(k + 1) * (k + 2) / 2];
            let off = rows.offsets[row] - dot(rows.normal(size, row), &self.step);
            let rest = off - dot(&column[..k], &self.coefficients);
            self.coefficients.push(rest / column[k]);
        }
        self.direction.clear();
        self.direction.resize(size, 0.0);
        for (along, basis) in self.coefficients.iter().zip(self.basis.chunks_exact(size)) {
            for (entry, b) in self.direction.iter_mut().zip(basis) {
                *entry += along * b;
            }
        }
        backward(&self.factor, size, &mut self.direction);
        self.step.iter_mut().zip(&self.direction).for_each(|(p, d)| *p += d);
        self.solve_triangle();
        self.multipliers.extend(self.coefficients.iter().map(|along| -along));
        // Those that depend on others hold by themselves, or never.
        (0..rows.equalities).all(|row| {
            let off = dot(rows.normal(size, row), &self.step) - rows.offsets[row];
            self.active.contains(&row) || off.abs() < MET.sqrt()
        })
    }

    /// Moves to the minimum with a violated row active as well, dropping rows whose multiplier vanishes.
    fn activate(&mut self, rows: &Rows, row: usize, violation: f64) -> Outcome {
        let size = self.size;
        let mut violation = violation;
        let mut multiplier = 0.0;
        self.whitened.clear();
        self.whitened.extend_from_slice(rows.normal(size, row));
        forward(&self.factor, size, &mut self.whitened);
        let squared_norm = dot(&self.whitened, &self.whitened);
        // Each pass drops an active row that lets go, until the new one is active too.
        loop {
            // Primal direction z and dual direction r of the paper: L⁻¹n outside and inside the active rows.
            self.project();
            let orthogonal = dot(&self.orthogonal, &self.orthogonal);
            self.solve_triangle();
            let (length, blocking) = self.blocking_constraint(rows.equalities);
            // A row that depends on the active ones contradicts them or holds with them.
            let independent = orthogonal > PARALLEL * squared_norm;
            if !independent && blocking == usize::MAX {
                if violation > CONTRADICTION || multiplier > 0.0 {
                    return Outcome::Infeasible;
                }
                self.implied.push(row);
                return Outcome::Solved;
            }
            // |outside|^2 is the curvature along the move.
            let full_step = if independent { violation / orthogonal } else { f64::INFINITY };
            // Step length: full (t2), or partial up to the blocking multiplier (t1).
            let step = full_step.min(length);
            if independent {
                self.direction.clone_from(&self.orthogonal);
                backward(&self.factor, size, &mut self.direction);
                for (p, d) in self.step.iter_mut().zip(&self.direction) {
                    *p -= step * d;
                }
                violation -= step * orthogonal;
            }
            for (held, along) in self.multipliers.iter_mut().zip(&self.coefficients) {
                *held -= step * along;
            }
            multiplier += step;
            // A full step makes the row active; a partial one drops the blocking row.
            if full_step <= length {
                self.active.push(row);
                self.multipliers.push(multiplier);
                self.whitened_rows.extend_from_slice(&self.whitened);
                // Coefficients have overwritten the components.
                self.project();
                self.extend_basis();
                return Outcome::Solved;
            }
            self.active.remove(blocking);
            self.multipliers.remove(blocking);
            self.whitened_rows.drain(blocking * size..(blocking + 1) * size);
            self.rebuild_basis();
        }
    }

    /// Longest step (t1 of the paper) until the multiplier of an active inequality vanishes, and its place.
    fn blocking_constraint(&self, equalities: usize) -> (f64, usize) {
        let (mut length, mut blocking) = (f64::INFINITY, usize::MAX);
        for (k, &row) in self.active.iter().enumerate() {
            if row >= equalities && self.coefficients[k] > 0.0 {
                let ratio = self.multipliers[k] / self.coefficients[k];
                if ratio < length {
                    (length, blocking) = (ratio, k);
                }
            }
        }
        (length, blocking)
    }

    /// Splits `whitened` into its components in the basis, `coefficients`, and the rest, `orthogonal`.
    fn project(&mut self) {
        let size = self.size;
        self.coefficients.clear();
        self.orthogonal.clone_from(&self.whitened);
        for direction in self.basis.chunks_exact(size) {
            let along = dot(direction, &self.orthogonal);
            self.coefficients.push(along);
            for (rest, d) in self.orthogonal.iter_mut().zip(direction) {
                *rest -= along * d;
            }
        }
        // What is small is mostly rounding: once more.
        for (k, direction) in self.basis.chunks_exact(size).enumerate() {
            let along = dot(direction, &self.orthogonal);
            self.coefficients[k] += along;
            for (rest, d) in self.orthogonal.iter_mut().zip(direction) {
                *rest -= along * d;
            }
        }
    }

    /// From components in the basis to coefficients of the active images.
    fn solve_triangle(&mut self) {
        let count = self.coefficients.len();
        for k in (0..count).rev() {
            let column = &self.triangle[k * (k + 1) / 2..(k + 1) * (k + 2) / 2];
            self.coefficients[k] /= column[k];
            let value = self.coefficients[k];
            for (entry, r) in self.coefficients[..k].iter_mut().zip(column) {
                *entry -= value * r;
            }
        }
    }

    /// Adds `whitened`, split last, which has a part outside the basis.
    fn extend_basis(&mut self) {
        let norm = dot(&self.orthogonal, &self.orthogonal).sqrt();
        self.triangle.extend_from_slice(&self.coefficients);
        self.triangle.push(norm);
        self.basis.extend(self.orthogonal.iter().map(|y| y / norm));
    }

    fn rebuild_basis(&mut self) {
        let size = self.size;
        let whitened = std::mem::take(&mut self.whitened);
        let whitened_rows = std::mem::take(&mut self.whitened_rows);
        self.basis.clear();
        self.triangle.clear();
        for active in whitened_rows.chunks_exact(size) {
            self.whitened.clear();
            self.whitened.extend_from_slice(active);
            self.project();
            self.extend_basis();
        }
        self.whitened_rows = whitened_rows;
        self.whitened = whitened;
    }
}
