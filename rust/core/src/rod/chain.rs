//! Newton's method on a chain of subsegments that share nothing but tensions.
//!
//! Stationarity of every subsegment, `∇E_i + A_iᵀ T = 0`, and the tendons' lengths, `Σ A_i dω_i = ...`, make a
//! block-diagonal system with one border row per tendon. Its Schur complement `S = Σ A_i H_i⁻¹ A_iᵀ` has the
//! size of the number of tendons, and the step in the tensions is a small quadratic program: no tension
//! becomes negative.

use super::plan::Plan;
use super::subsegment::{Derivatives, Local};
use crate::solve::quadratic::{Outcome, Quadratic, Rows, backward, cholesky, dot, forward};

/// Unknowns and the buffers of a Newton step.
#[derive(Clone, Debug, Default)]
pub(super) struct Chain {
    /// Rotation vectors of all elements, base first \[rad\].
    pub(super) strains: Vec<f64>,
    /// Tensions, in the plan's unit.
    pub(super) tensions: Vec<f64>,
    /// Length of every tendon at the strains evaluated last \[m\].
    pub(super) lengths: Vec<f64>,
    pub(super) local: Local,
    /// Per subsegment: the Hessian's factor, and `L⁻¹` times the gradient.
    factors: Vec<f64>,
    gradients: Vec<f64>,
    /// `L⁻¹ A`, one row per piece.
    images: Vec<f64>,
    pieces: Vec<f64>,
    schur: Vec<f64>,
    right: Vec<f64>,
    program: Quadratic,
    rows: Rows,
    /// Steps of the strains and of the tensions.
    step: Vec<f64>,
    /// Tendons that are not free.
    taut: Vec<usize>,
    /// Step of every tension.
    pulls: Vec<f64>,
    whole: Vec<f64>,
}

/// What is left of the conditions at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Left {
    /// Largest unbalanced moment, relative to the stiffness.
    pub(super) moment: f64,
    /// Largest violation of a length and of its complementarity, relative to the tendon.
    pub(super) length: f64,
    /// Every subsegment is at a minimum, given the tensions.
    pub(super) stable: bool,
}

impl Left {
    pub(super) fn worst(&self) -> f64 {
        self.moment.max(self.length)
    }
}

/// A subsegment whose Hessian is not positive definite gets this share of its stiffness, and more.
const SHIFT: f64 = 1e-3;
/// Share of the Schur complement's trace that keeps dependent tendons from exploding.
const RIDGE: f64 = 1e-14;

impl Chain {
    /// The rest shape without tensions.
    pub(super) fn rest(&mut self, plan: &Plan) {
        self.strains.clear();
        for data in &plan.data {
            for _ in 0..plan.settings.elements {
                self.strains.extend_from_slice(data.rest.as_slice());
            }
        }
        self.tensions.clear();
        self.tensions.resize(plan.rest_lengths.len(), 0.0);
    }

    /// Derivatives, factors and the Schur complement at the point at hand; what is left there for lengths of
    /// at most `bounds` (infinite: free).
    pub(super) fn assemble(&mut self, plan: &Plan, bounds: &[f64]) -> Left {
        let (size, tendons) = (plan.width(), bounds.len());
        self.factors.resize(plan.data.len() * size * size, 0.0);
        self.gradients.resize(plan.data.len() * size, 0.0);
        self.images.resize(plan.pieces.len() * size, 0.0);
        self.pieces.resize(plan.pieces.len(), 0.0);
        self.lengths.clear();
        self.lengths.resize(tendons, 0.0);
        self.schur.clear();
        self.schur.resize(tendons * tendons, 0.0);
        self.right.clear();
        self.right.resize(tendons, 0.0);
        let mut left = Left { stable: true, ..Left::default() };
        for (i, data) in plan.data.iter().enumerate() {
            let (first, last) = (plan.starts[i], plan.starts[i + 1]);
            let strains = &self.strains[i * size..(i + 1) * size];
            let factor = &mut self.factors[i * size * size..(i + 1) * size * size];
            let gradient = &mut self.gradients[i * size..(i + 1) * size];
            let images = &mut self.images[first * size..last * size];
            self.local.place(plan.settings.subsegment, data, strains);
            let mut out = Derivatives {
                gradient,
                hessian: factor,
                rows: images,
                lengths: &mut self.pieces[first..last],
            };
            let pieces = &plan.pieces[first..last];
            self.local.differentiate(data, pieces, strains, &self.tensions, &mut out);
            let largest = gradient.iter().fold(0.0_f64, |most, g| most.max(g.abs()));
            left.moment = left.moment.max(largest / data.stiffness.x);
            left.stable &= factorize(factor, &mut self.whole, size, data.stiffness.x);
            forward(factor, size, gradient);
            for (k, piece) in pieces.iter().enumerate() {
                self.lengths[piece.tendon] += self.pieces[first + k];
                let image = &mut images[k * size..(k + 1) * size];
                forward(factor, size, image);
                self.right[piece.tendon] -= dot(image, gradient);
            }
            for (k, piece) in pieces.iter().enumerate() {
                let image = &images[k * size..(k + 1) * size];
                for (l, other) in pieces[..=k].iter().enumerate() {
                    let product = dot(image, &images[l * size..(l + 1) * size]);
                    self.schur[piece.tendon * tendons + other.tendon] += product;
                }
            }
        }
        for (k, bound) in bounds.iter().enumerate() {
            let over = self.lengths[k] - bound;
            self.right[k] += over;
            let off = if self.tensions[k] > 0.0 { over.abs() } else { over.max(0.0) };
            if bound.is_finite() {
                left.length = left.length.max(off / plan.rest_lengths[k]);
            }
        }
        left
    }

    /// The Newton step at the point assembled last; false when the program has no solution.
    pub(super) fn solve(&mut self, plan: &Plan, bounds: &[f64]) -> bool {
        let (size, tendons) = (plan.width(), bounds.len());
        self.taut.clear();
        self.taut.extend((0..tendons).filter(|k| bounds[*k].is_finite()));
        let count = self.taut.len();
        let trace: f64 = self.taut.iter().map(|k| self.schur[k * (tendons + 1)]).sum();
        let mut reduced = std::mem::take(&mut self.step);
        reduced.clear();
        reduced.resize(count * count, 0.0);
        self.program.gradient.clear();
        self.rows.clear();
        for (a, &k) in self.taut.iter().enumerate() {
            for (b, &l) in self.taut[..=a].iter().enumerate() {
                reduced[a * count + b] = self.schur[k * tendons + l];
            }
            reduced[a * (count + 1)] += RIDGE * trace + f64::MIN_POSITIVE;
            self.program.gradient.push(-self.right[k]);
        }
        for (a, &k) in self.taut.iter().enumerate() {
            let tension = self.tensions[k];
            self.rows.push(count, tension)[a] = -1.0;
        }
        let solved = self.program.factor(&reduced, count)
            && self.program.solve(&self.rows) == Outcome::Solved;
        self.step = reduced;
        if !solved {
            return false;
        }
        self.pulls.clear();
        self.pulls.resize(tendons, 0.0);
        for (a, &k) in self.taut.iter().enumerate() {
            self.pulls[k] = self.program.step[a];
        }
        self.step.clear();
        for i in 0..plan.data.len() {
            let factor = &self.factors[i * size * size..(i + 1) * size * size];
            let start = self.step.len();
            self.step.extend(self.gradients[i * size..(i + 1) * size].iter().map(|g| -g));
            let place = &mut self.step[start..];
            for p in plan.starts[i]..plan.starts[i + 1] {
                let pull = self.pulls[plan.pieces[p].tendon];
                let image = &self.images[p * size..(p + 1) * size];
                for (s, y) in place.iter_mut().zip(image) {
                    *s -= pull * y;
                }
            }
            backward(factor, size, place);
        }
        self.step.iter().all(|s| s.is_finite())
    }

    /// Longest step of a strain \[rad\].
    pub(super) fn longest(&self) -> f64 {
        self.step.iter().fold(0.0_f64, |most, s| most.max(s.abs()))
    }

    /// Takes a share of the step.
    pub(super) fn take(&mut self, share: f64) {
        for (strain, step) in self.strains.iter_mut().zip(&self.step) {
            *strain += share * step;
        }
        for (tension, pull) in self.tensions.iter_mut().zip(&self.pulls) {
            // Rounding leaves no tension below zero.
            *tension = (*tension + share * pull).max(0.0);
        }
    }
}

/// Factors a Hessian, raised until it is positive definite; whether it was.
fn factorize(hessian: &mut [f64], whole: &mut Vec<f64>, size: usize, stiffness: f64) -> bool {
    whole.clear();
    whole.extend_from_slice(hessian);
    let mut shift = 0.0_f64;
    loop {
        if cholesky(hessian, size) {
            return shift == 0.0;
        }
        shift = (2.0 * shift).max(SHIFT * stiffness);
        hessian.copy_from_slice(whole);
        if shift > 1e9 * stiffness || shift.is_nan() {
            // Not a number somewhere: the caller sees it in the residual.
            hessian.fill(0.0);
            (0..size).for_each(|k| hessian[k * (size + 1)] = 1.0 / stiffness.sqrt());
            return false;
        }
        for k in 0..size {
            hessian[k * (size + 1)] += shift;
        }
    }
}
