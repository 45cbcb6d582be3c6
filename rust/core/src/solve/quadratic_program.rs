//! Small strictly convex quadratic programs by the dual active-set method of D. Goldfarb and
//! A. Idnani, Mathematical Programming 27 (1983), doi:10.1007/BF02591962.
//!
//! It starts from the unconstrained minimum and adds what is violated, so a program none of whose
//! constraints matter costs one Cholesky factorisation. The active rows, in the Hessian's metric, are kept
//! as an orthonormal basis and a triangle; when one leaves, which is rare, the basis is made anew.

/// Constraints `normal_k . p = offset_k` for the first `equalities` rows, `normal_k . p <= offset_k` for
/// the rest. Normals are about as long as 1.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// Normals one after the other, as many numbers each as there are unknowns.
    pub normals: Vec<f64>,
    /// Right-hand sides.
    pub offsets: Vec<f64>,
    /// How many of the rows, from the first, are equations.
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

    /// Whether a step meets all rows, to rounding.
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

/// How a program ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The minimum.
    Solved,
    /// No point meets the constraints.
    Infeasible,
    /// The arithmetic broke down, or the active set went on changing.
    Failed,
}

/// Violations below this count as met; steps and normals are of order 1.
const MET: f64 = 1e-13;

/// An equation is dependent on others when the square of its part outside them, in the Hessian's metric, is
/// this small a share of it: rows of a Jacobian near where it is singular.
const DEPENDENT: f64 = 1e-11;
/// The same for an inequality: independent rows come as near as the inverse of the Hessian's condition
/// (1e13 for least squares with freedom left), dependent ones as near as the rounding of their images.
const PARALLEL: f64 = 1e-16;

/// A row that depends on active ones contradicts them when it is violated by more than this; below, it is
/// the rounding of a long way to them.
const CONTRADICTION: f64 = 1e-9;

/// Buffers of a solve, and its answer.
#[derive(Clone, Debug, Default)]
pub struct Quadratic {
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
    images: Vec<f64>,
    /// Orthonormal basis of these.
    basis: Vec<f64>,
    /// The images in the basis: column k has k + 1 numbers, one column after the other.
    triangle: Vec<f64>,
    /// `L^-1 normal` of the row that is being added.
    image: Vec<f64>,
    /// Its part outside the active ones.
    outside: Vec<f64>,
    /// The direction of a move.
    direction: Vec<f64>,
    /// Its part inside: in the basis, then in the images.
    inside: Vec<f64>,
}

/// `sum_i a_i b_i`.
#[inline(always)]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (x, y)| sum + x * y)
}

/// Cholesky factor in place of the lower triangle, row by row, its diagonal inverted; false unless
/// positive definite.
pub(crate) fn cholesky(matrix: &mut [f64], size: usize) -> bool {
    for i in 0..size {
        for j in 0..=i {
            let (above, below) = matrix.split_at_mut(i * size);
            let sum = if j == i {
                below[j] - dot(&below[..j], &below[..j])
            } else {
                below[j] - dot(&below[..j], &above[j * size..j * size + j])
            };
            if j < i {
                below[j] = sum * above[j * size + j];
            } else if sum > 0.0 {
                below[j] = 1.0 / sum.sqrt();
            } else {
                return false;
            }
        }
    }
    true
}

/// Solves `L x = x` in place.
pub(crate) fn forward(factor: &[f64], size: usize, x: &mut [f64]) {
    for i in 0..size {
        let row = &factor[i * size..i * size + i];
        x[i] = (x[i] - dot(row, &x[..i])) * factor[i * size + i];
    }
}

/// Solves `L^T x = x` in place.
pub(crate) fn backward(factor: &[f64], size: usize, x: &mut [f64]) {
    for i in (0..size).rev() {
        x[i] *= factor[i * size + i];
        let value = x[i];
        for (entry, l) in x[..i].iter_mut().zip(&factor[i * size..i * size + i]) {
            *entry -= l * value;
        }
    }
}

impl Quadratic {
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
        self.images.clear();
        self.basis.clear();
        self.triangle.clear();
        self.step.clear();
        self.step.extend(self.gradient.iter().map(|g| -g));
        forward(&self.factor, self.size, &mut self.step);
        backward(&self.factor, self.size, &mut self.step);
    }

    /// The same under `rows`.
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
            match self.add(rows, row, worst) {
                Outcome::Solved => {}
                other => return other,
            }
        }
        Outcome::Failed
    }

    /// Largest component of `gradient + sum_k multiplier_k normal_k` after a solve under `rows`: 0 where
    /// the gradient is held by the constraints.
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
            self.image.clear();
            self.image.extend_from_slice(rows.normal(size, row));
            forward(&self.factor, size, &mut self.image);
            self.split();
            let whole = dot(&self.image, &self.image);
            if dot(&self.outside, &self.outside) > DEPENDENT * whole {
                self.active.push(row);
                self.images.extend_from_slice(&self.image);
                self.extend_basis();
            }
        }
        self.inside.clear();
        for (k, &row) in self.active.iter().enumerate() {
            let column = &self.triangle[k * (k + 1) / 2..(k + 1) * (k + 2) / 2];
            let off = rows.offsets[row] - dot(rows.normal(size, row), &self.step);
            let rest = off - dot(&column[..k], &self.inside);
            self.inside.push(rest / column[k]);
        }
        self.direction.clear();
        self.direction.resize(size, 0.0);
        for (along, basis) in self.inside.iter().zip(self.basis.chunks_exact(size)) {
            for (entry, b) in self.direction.iter_mut().zip(basis) {
                *entry += along * b;
            }
        }
        backward(&self.factor, size, &mut self.direction);
        self.step.iter_mut().zip(&self.direction).for_each(|(p, d)| *p += d);
        self.solve_triangle();
        self.multipliers.extend(self.inside.iter().map(|along| -along));
        // Those that depend on others hold by themselves, or never.
        (0..rows.equalities).all(|row| {
            let off = dot(rows.normal(size, row), &self.step) - rows.offsets[row];
            self.active.contains(&row) || off.abs() < MET.sqrt()
        })
    }

    /// Moves to the minimum with a violated row active as well, dropping those that let go.
    fn add(&mut self, rows: &Rows, row: usize, violation: f64) -> Outcome {
        let size = self.size;
        let mut violation = violation;
        let mut multiplier = 0.0;
        self.image.clear();
        self.image.extend_from_slice(rows.normal(size, row));
        forward(&self.factor, size, &mut self.image);
        let whole = dot(&self.image, &self.image);
        loop {
            self.split();
            let outside = dot(&self.outside, &self.outside);
            self.solve_triangle();
            let (length, leaving) = self.first_to_leave(rows.equalities);
            let full = outside > PARALLEL * whole;
            if !full && leaving == usize::MAX {
                if violation > CONTRADICTION || multiplier > 0.0 {
                    return Outcome::Infeasible;
                }
                self.implied.push(row);
                return Outcome::Solved;
            }
            // |outside|^2 is the curvature along the move.
            let whole_move = if full { violation / outside } else { f64::INFINITY };
            let step = whole_move.min(length);
            if full {
                self.direction.clone_from(&self.outside);
                backward(&self.factor, size, &mut self.direction);
                for (p, d) in self.step.iter_mut().zip(&self.direction) {
                    *p -= step * d;
                }
                violation -= step * outside;
            }
            for (held, along) in self.multipliers.iter_mut().zip(&self.inside) {
                *held -= step * along;
            }
            multiplier += step;
            if whole_move <= length {
                self.active.push(row);
                self.multipliers.push(multiplier);
                self.images.extend_from_slice(&self.image);
                // Coefficients have overwritten the components.
                self.split();
                self.extend_basis();
                return Outcome::Solved;
            }
            self.active.remove(leaving);
            self.multipliers.remove(leaving);
            self.images.drain(leaving * size..(leaving + 1) * size);
            self.rebuild_basis();
        }
    }

    /// How far a move can go until the multiplier of an active inequality vanishes, and which.
    fn first_to_leave(&self, equalities: usize) -> (f64, usize) {
        let (mut length, mut leaving) = (f64::INFINITY, usize::MAX);
        for (k, &row) in self.active.iter().enumerate() {
            if row >= equalities && self.inside[k] > 0.0 {
                let ratio = self.multipliers[k] / self.inside[k];
                if ratio < length {
                    (length, leaving) = (ratio, k);
                }
            }
        }
        (length, leaving)
    }

    /// Splits `image` into its components in the basis, `inside`, and the rest, `outside`.
    fn split(&mut self) {
        let size = self.size;
        self.inside.clear();
        self.outside.clone_from(&self.image);
        for direction in self.basis.chunks_exact(size) {
            let along = dot(direction, &self.outside);
            self.inside.push(along);
            for (rest, d) in self.outside.iter_mut().zip(direction) {
                *rest -= along * d;
            }
        }
        // What is small is mostly rounding: once more.
        for (k, direction) in self.basis.chunks_exact(size).enumerate() {
            let along = dot(direction, &self.outside);
            self.inside[k] += along;
            for (rest, d) in self.outside.iter_mut().zip(direction) {
                *rest -= along * d;
            }
        }
    }

    /// From components in the basis to coefficients of the active images.
    fn solve_triangle(&mut self) {
        let count = self.inside.len();
        for k in (0..count).rev() {
            let column = &self.triangle[k * (k + 1) / 2..(k + 1) * (k + 2) / 2];
            self.inside[k] /= column[k];
            let value = self.inside[k];
            for (entry, r) in self.inside[..k].iter_mut().zip(column) {
                *entry -= value * r;
            }
        }
    }

    /// Adds `image`, split last, which has a part outside the basis.
    fn extend_basis(&mut self) {
        let norm = dot(&self.outside, &self.outside).sqrt();
        self.triangle.extend_from_slice(&self.inside);
        self.triangle.push(norm);
        self.basis.extend(self.outside.iter().map(|y| y / norm));
    }

    fn rebuild_basis(&mut self) {
        let size = self.size;
        let image = std::mem::take(&mut self.image);
        let images = std::mem::take(&mut self.images);
        self.basis.clear();
        self.triangle.clear();
        for active in images.chunks_exact(size) {
            self.image.clear();
            self.image.extend_from_slice(active);
            self.split();
            self.extend_basis();
        }
        self.images = images;
        self.image = image;
    }
}
