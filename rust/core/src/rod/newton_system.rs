//! Newton's method on a chain of subsegments that share nothing but tensions.
//!
//! Stationarity of every subsegment, `∇E_i + A_iᵀ T = 0`, and the tendons' lengths, `Σ A_i dω_i = ...`, make a
//! block-diagonal system with one border row per tendon. Its Schur complement `S = Σ A_i H_i⁻¹ A_iᵀ` has the
//! size of the number of tendons, and the step in the tensions is a small quadratic program: no tension
//! becomes negative.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::plan::Plan;
use super::subsegment::{Derivatives, Local, ROUNDING};
use crate::lie::Pose;
use crate::solve::bounded_program::BoundedProgram;
use crate::solve::dense::{backward, cholesky, dot, forward};

/// Unknowns and the buffers of a Newton step.
#[derive(Clone, Debug, Default)]
pub(super) struct Chain {
    /// Strains of all elements, base first: rotation vector \[rad\], and elongation where there is one.
    pub(super) strains: Vec<f64>,
    /// Tensions, in the plan's unit.
    pub(super) tensions: Vec<f64>,
    /// Longest that each tendon may be without tension \[m\]; infinite: free.
    pub(super) bounds: Vec<f64>,
    /// Tendons that count: not free, or under a given tension.
    pub(super) taut: Vec<bool>,
    /// What the tendons that count are longer than their bounds and elasticity allow \[m\], at the point
    /// assembled last.
    pub(super) over: Vec<f64>,
    /// The same once the subsegments have found their balance, to first order: the slope of the dual.
    pub(super) slope: Vec<f64>,
    /// Compliance that all tendons have besides their own \[m per unit of tension\].
    pub(super) give: f64,
    /// Set by another thread to end the solve.
    pub(super) stop: Option<Arc<AtomicBool>>,
    /// Steps of the tensions and of the strains.
    pub(super) pulls: Vec<f64>,
    pub(super) step: Vec<f64>,
    /// Frame of every subsegment's end in its base disk's.
    pub(super) ends: Vec<Pose>,
    pub(super) local: Local,
    /// Per subsegment: the Hessian's factor, and `L⁻¹` times the gradient.
    pub(super) factors: Vec<f64>,
    pub(super) gradients: Vec<f64>,
    /// `L⁻¹ A`, one row per piece.
    pub(super) images: Vec<f64>,
    lengths: Vec<f64>,
    /// `Σ A H⁻¹ Aᵀ` and the tendons' compliance.
    pub(super) schur: Vec<f64>,
    reduced: Vec<f64>,
    right: Vec<f64>,
    least: Vec<f64>,
    program: BoundedProgram,
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
    /// Evaluations of all subsegments.
    pub(super) rounds: usize,
    /// Furthest that a subsegment went by itself \[rad\].
    pub(super) moved: f64,
}

impl Left {
    pub(super) fn worst(&self) -> f64 {
        self.moment.max(self.length)
    }
}

/// A subsegment whose Hessian is not positive definite gets this share of its stiffness, and more.
const SHIFT: f64 = 1e-3;
/// Steps that a subsegment off balance gets at most.
const RELAXATIONS: usize = 30;
/// One that went further by itself has jumped \[rad\].
pub(super) const JUMP: f64 = 1.0;
/// Share of the Schur complement's trace that keeps dependent tendons from exploding.
pub(super) const RIDGE: f64 = 1e-14;

impl Chain {
    /// The rest shape without tensions.
    pub(super) fn rest(&mut self, plan: &Plan) {
        self.strains.clear();
        let (width, elements) = (plan.unknowns(), plan.settings.elements);
        for data in &plan.data {
            for _ in 0..elements {
                self.strains.extend_from_slice(&data.elasticity.rest()[..width]);
            }
        }
        self.tensions.clear();
        self.tensions.resize(plan.rest_lengths.len(), 0.0);
    }

    /// No bounds on lengths: they are what the tensions make them.
    pub(super) fn unbound(&mut self, plan: &Plan) {
        self.bounds.clear();
        self.bounds.resize(plan.rest_lengths.len(), f64::INFINITY);
    }

    /// Whether the solve is to end.
    pub(super) fn stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed))
    }

    /// Bounds of the lengths for displacements (infinite: free, and without tension).
    pub(super) fn bound(&mut self, plan: &Plan, displacements: &[f64]) {
        self.bounds.clear();
        let rest = plan.rest_lengths.iter();
        self.bounds.extend(rest.zip(displacements).map(|(length, d)| length + d));
        self.taut.clear();
        self.taut.extend(displacements.iter().map(|d| d.is_finite()));
        for (tension, d) in self.tensions.iter_mut().zip(displacements) {
            if !d.is_finite() {
                *tension = 0.0;
            }
        }
    }

    /// Derivatives, factors and the Schur complement at the point at hand, and what is left there. Subsegments
    /// that are off balance by more than `balance` \[rad of their own stiffness\] are brought nearer first, each by itself.
    pub(super) fn assemble(&mut self, plan: &Plan, balance: f64) -> Left {
        let (size, tendons) = (plan.width(), self.bounds.len());
        self.factors.resize(plan.data.len() * size * size, 0.0);
        self.gradients.resize(plan.data.len() * size, 0.0);
        self.images.resize(plan.pieces.len() * size, 0.0);
        self.lengths.resize(plan.pieces.len(), 0.0);
        self.schur.clear();
        self.schur.resize(tendons * tendons, 0.0);
        self.slope.clear();
        self.slope.resize(tendons, 0.0);
        self.over.clear();
        self.over.resize(tendons, 0.0);
        self.ends.clear();
        let mut left = match (plan.unknowns(), plan.settings.elements) {
            (3, 1) => self.differentiate::<3, true>(plan, balance),
            (3, _) => self.differentiate::<3, false>(plan, balance),
            (_, 1) => self.differentiate::<4, true>(plan, balance),
            _ => self.differentiate::<4, false>(plan, balance),
        };
        for (k, bound) in self.bounds.iter().enumerate() {
            if bound.is_finite() {
                let give = plan.compliance[k] + self.give;
                let over = self.over[k] - bound - give * self.tensions[k];
                self.schur[k * (tendons + 1)] += give;
                self.over[k] = over;
                self.slope[k] += over;
                let relative = over / plan.rest_lengths[k];
                // A tendon is as long as it may be, or slack.
                let off = if plan.signed {
                    relative.abs()
                } else {
                    relative.max((-relative).min(self.tensions[k] * plan.slenderness))
                };
                left.length = left.length.max(off);
            }
        }
        left
    }

    fn differentiate<const D: usize, const ONE: bool>(
        &mut self,
        plan: &Plan,
        balance: f64,
    ) -> Left {
        let size = if ONE { D } else { plan.width() };
        let kind = plan.settings.subsegment;
        let tendons = self.bounds.len();
        let mut left = Left { stable: true, ..Left::default() };
        for (i, data) in plan.data.iter().enumerate() {
            if self.stopped() {
                self.local.place::<D>(kind, data, &self.strains[i * size..(i + 1) * size]);
                self.ends.push(self.local.end());
                // Out of evaluations.
                (left.moment, left.rounds) = (f64::INFINITY, usize::MAX);
                continue;
            }
            let (first, last) = (plan.starts[i], plan.starts[i + 1]);
            let pieces = &plan.pieces[first..last];
            let strains = &mut self.strains[i * size..(i + 1) * size];
            let images = &mut self.images[first * size..last * size];
            let mut out = Derivatives {
                gradient: &mut self.gradients[i * size..(i + 1) * size],
                hessian: &mut self.factors[i * size * size..(i + 1) * size * size],
                rows: images,
                lengths: &mut self.lengths[first..last],
            };
            let (tensions, taut) = (&self.tensions, &self.taut);
            let (mut moved, mut round) = (0.0, 0);
            loop {
                self.local.place::<D>(kind, data, strains);
                self.local.differentiate::<D, ONE>(data, pieces, strains, tensions, taut, &mut out);
                let stable =
                    factorize(out.hessian, &mut self.whole, size, data.elasticity.bending());
                let mut largest = 0.0_f64;
                for (k, g) in out.gradient.iter().enumerate() {
                    largest = largest.max(data.elasticity.strain_under(k % D, g.abs()));
                }
                round += 1;
                let far = largest > balance || (!stable && largest > 1e-9);
                let went = if far && round <= RELAXATIONS && moved < JUMP {
                    self.local.relax::<D>(kind, data, pieces, strains, tensions, &out)
                } else {
                    None
                };
                if let Some(step) = went {
                    moved += step;
                    continue;
                }
                left.moment = left.moment.max(largest);
                if largest.is_nan() {
                    left.moment = f64::NAN;
                }
                left.stable &= stable;
                break;
            }
            left.rounds = left.rounds.max(round);
            left.moved = left.moved.max(moved);
            self.ends.push(self.local.end());
            let Derivatives { gradient, hessian: factor, rows: images, lengths } = out;
            forward(factor, size, gradient);
            for (k, piece) in pieces.iter().enumerate() {
                if !taut[piece.tendon] {
                    continue;
                }
                self.over[piece.tendon] += lengths[k];
                let (before, image) = images.split_at_mut(k * size);
                let image = &mut image[..size];
                forward(factor, size, image);
                self.slope[piece.tendon] -= dot(image, gradient);
                let row = &mut self.schur[piece.tendon * tendons..(piece.tendon + 1) * tendons];
                for (other, earlier) in pieces.iter().zip(before.chunks_exact(size)) {
                    if taut[other.tendon] {
                        row[other.tendon] += dot(image, earlier);
                    }
                }
                row[piece.tendon] += dot(image, image);
            }
        }
        left
    }

    /// Puts subsegments back to earlier strains where these are better under the tensions at hand.
    pub(super) fn choose(&mut self, plan: &Plan, earlier: &[f64]) {
        match plan.unknowns() {
            3 => self.choose_of::<3>(plan, earlier),
            _ => self.choose_of::<4>(plan, earlier),
        }
    }

    fn choose_of<const D: usize>(&mut self, plan: &Plan, earlier: &[f64]) {
        let (size, kind) = (plan.width(), plan.settings.subsegment);
        let rows = self.strains.chunks_exact_mut(size).zip(earlier.chunks_exact(size));
        for (i, (own, earlier)) in rows.enumerate() {
            let (data, pieces) = (&plan.data[i], &plan.pieces[plan.starts[i]..plan.starts[i + 1]]);
            let mut value = |strains: &[f64]| {
                self.local.place::<D>(kind, data, strains);
                self.local.value::<D>(data, pieces, strains, &self.tensions)
            };
            let (before, after) = (value(earlier), value(own));
            // Rounding decides nothing.
            if after.is_nan() || after > before + ROUNDING * before.abs() {
                own.copy_from_slice(earlier);
            }
        }
    }

    /// The Newton step at the point assembled last, with a share `ridge` of the Schur complement's trace added
    /// to its diagonal; false when the program has no solution.
    pub(super) fn solve(&mut self, plan: &Plan, ridge: f64) -> bool {
        self.solve_tensions(plan, ridge) && self.bend(plan)
    }

    /// The step of the strains that goes with the step of the tensions at hand; false unless it is finite.
    pub(super) fn bend(&mut self, plan: &Plan) -> bool {
        let size = plan.width();
        self.step.clear();
        for i in 0..plan.data.len() {
            let factor = &self.factors[i * size * size..(i + 1) * size * size];
            let start = self.step.len();
            self.step.extend(self.gradients[i * size..(i + 1) * size].iter().map(|g| -g));
            let place = &mut self.step[start..];
            for p in plan.starts[i]..plan.starts[i + 1] {
                let pull = self.pulls[plan.pieces[p].tendon];
                if pull != 0.0 {
                    let image = &self.images[p * size..(p + 1) * size];
                    for (s, y) in place.iter_mut().zip(image) {
                        *s -= pull * y;
                    }
                }
            }
            backward(factor, size, place);
        }
        self.step.iter().all(|s| s.is_finite())
    }

    /// The step of the tensions.
    fn solve_tensions(&mut self, plan: &Plan, ridge: f64) -> bool {
        let tendons = self.bounds.len();
        self.pulls.clear();
        self.pulls.resize(tendons, 0.0);
        let bounded = |k: &usize| self.bounds[*k].is_finite();
        let count = (0..tendons).filter(bounded).count();
        let trace: f64 = (0..tendons).filter(bounded).map(|k| self.schur[k * (tendons + 1)]).sum();
        let ridge = ridge * trace + f64::MIN_POSITIVE;
        self.reduced.clear();
        self.right.clear();
        self.least.clear();
        for k in (0..tendons).filter(bounded) {
            for l in (0..=k).filter(bounded) {
                self.reduced.push(self.schur[k * tendons + l]);
            }
            if let Some(diagonal) = self.reduced.last_mut() {
                *diagonal += ridge;
            }
            self.right.push(self.slope[k]);
            self.reduced.resize(self.right.len() * count, 0.0);
            let least = if plan.signed { f64::NEG_INFINITY } else { -self.tensions[k] };
            self.least.push(least);
        }
        let Self { program, reduced, right, least, .. } = self;
        if !program.solve(reduced, right, least, |k| least[k] < 0.0) {
            return false;
        }
        let steps = program.step.iter();
        for (k, step) in (0..tendons).filter(|k| self.bounds[*k].is_finite()).zip(steps) {
            self.pulls[k] = *step;
        }
        true
    }

    /// What a unit of tension shortens the tendons by, at most, at the point assembled last \[m\].
    pub(super) fn softness(&self) -> f64 {
        let tendons = self.bounds.len();
        (0..tendons).fold(0.0_f64, |most, k| most.max(self.schur[k * (tendons + 1)]))
    }

    /// Longest step of a strain \[rad\].
    pub(super) fn longest(&self) -> f64 {
        self.step.iter().fold(0.0_f64, |most, s| most.max(s.abs()))
    }

    /// Growth of the dual along the step of the tensions, per share of it.
    pub(super) fn growth(&self, pulls: &[f64]) -> f64 {
        let bounded = self.bounds.iter().zip(&self.slope).zip(pulls);
        bounded.filter(|((b, _), _)| b.is_finite()).map(|((_, slope), pull)| slope * pull).sum()
    }
}

/// Factors a Hessian, raised until it is positive definite; whether it was.
#[inline(always)]
fn factorize(hessian: &mut [f64], whole: &mut Vec<f64>, size: usize, stiffness: f64) -> bool {
    whole.clear();
    whole.extend_from_slice(hessian);
    cholesky(hessian, size) || {
        raise(hessian, whole, size, stiffness, 2.0);
        false
    }
}

/// Factors `whole`, which is not positive definite, in `hessian`, with a share of the stiffness on its diagonal
/// that grows by `factor` until it is.
#[cold]
pub(super) fn raise(hessian: &mut [f64], whole: &[f64], size: usize, stiffness: f64, factor: f64) {
    let mut shift = SHIFT * stiffness;
    loop {
        hessian.copy_from_slice(whole);
        if shift > 1e9 * stiffness || shift.is_nan() {
            // Not a number somewhere: the caller sees it in the residual.
            hessian.fill(0.0);
            (0..size).for_each(|k| hessian[k * (size + 1)] = 1.0 / stiffness.sqrt());
            return;
        }
        for k in 0..size {
            hessian[k * (size + 1)] += shift;
        }
        if cholesky(hessian, size) {
            return;
        }
        shift *= factor;
    }
}
