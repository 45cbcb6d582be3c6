//! Newton's step of a rod: subsegments that share nothing but tensions, bordered by the tendons' lengths.
//!
//! Stationarity of every subsegment, `H_i dx_i + A_iᵀ dT = −g_i`, and the lengths, `Σ A_i dx_i − C dT = b + C T − L`,
//! make a block-diagonal system with one border row per tendon. Its Schur complement `S = Σ A_i H_i⁻¹ A_iᵀ + C` has
//! a row per tendon, and dT is a small quadratic program: no tension becomes negative. With the Cholesky factors
//! `H_i = L_i L_iᵀ`, S is the product of the whitened rows `L_i⁻¹ A_iᵀ` with themselves.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::plan::Plan;
use super::subsegment::{Derivatives, Local, ROUNDING};
use crate::lie::Pose;
use crate::solve::bounded_program::BoundedProgram;
use crate::solve::dense::{backward, cholesky, dot, forward};

/// Unknowns and the buffers of a Newton step.
#[derive(Clone, Debug, Default)]
pub(super) struct NewtonSystem {
    /// Strains x of all elements, base first: rotation vector \[rad\], and elongation where there is one.
    pub(super) strains: Vec<f64>,
    /// Tensions T, in the plan's unit.
    pub(super) tensions: Vec<f64>,
    /// Bounds b: longest that each tendon may be without tension \[m\]; infinite: free.
    pub(super) bounds: Vec<f64>,
    /// Tendons that count: not free, or under a given tension.
    pub(super) active: Vec<bool>,
    /// `L − b − C T` of the active tendons at the point assembled last \[m\]; L where there is no bound.
    pub(super) length_error: Vec<f64>,
    /// ∇D: the length error once the subsegments have found their balance, to first order.
    pub(super) dual_gradient: Vec<f64>,
    /// Compliance that all tendons have besides their own \[m per unit of tension\].
    pub(super) added_compliance: f64,
    /// Set by another thread to end the solve.
    pub(super) stop: Option<Arc<AtomicBool>>,
    /// Newton step: dT and dx.
    pub(super) tension_step: Vec<f64>,
    pub(super) strain_step: Vec<f64>,
    /// Frame of every subsegment's end in its base disk's.
    pub(super) ends: Vec<Pose>,
    pub(super) local: Local,
    /// Cholesky factor of every `H_i`, its diagonal inverted.
    pub(super) factors: Vec<f64>,
    /// `L_i⁻¹ g_i` of every subsegment.
    pub(super) whitened_gradients: Vec<f64>,
    /// `L_i⁻¹ A_iᵀ`, one row per piece.
    pub(super) whitened_rows: Vec<f64>,
    lengths: Vec<f64>,
    /// S, lower triangle row by row.
    pub(super) schur: Vec<f64>,
    /// S, ∇D and the least steps of the tendons that have a bound.
    reduced_schur: Vec<f64>,
    reduced_gradient: Vec<f64>,
    least_steps: Vec<f64>,
    program: BoundedProgram,
    unfactored: Vec<f64>,
}

/// Residual of the conditions at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Residual {
    /// Largest unbalanced moment, relative to the stiffness.
    pub(super) moment: f64,
    /// Largest violation of a length and of its complementarity, relative to the tendon.
    pub(super) length: f64,
    /// Every subsegment is at a minimum, given the tensions.
    pub(super) stable: bool,
    /// Evaluations of all subsegments.
    pub(super) evaluations: usize,
    /// Furthest that a subsegment went by itself \[rad\].
    pub(super) moved: f64,
}

impl Residual {
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
/// Moment above which a subsegment on a ridge is not at rest on it, relative to the stiffness.
const ON_RIDGE: f64 = 1e-9;

impl NewtonSystem {
    /// Sets the rest shape without tensions.
    pub(super) fn reset(&mut self, plan: &Plan) {
        self.strains.clear();
        for data in &plan.data {
            for _ in 0..plan.settings.elements {
                self.strains.extend_from_slice(&data.elasticity.rest()[..plan.unknowns()]);
            }
        }
        self.tensions.clear();
        self.tensions.resize(plan.rest_lengths.len(), 0.0);
    }

    /// Removes the bounds of the lengths: they are what the tensions make them.
    pub(super) fn clear_bounds(&mut self, plan: &Plan) {
        self.bounds.clear();
        self.bounds.resize(plan.rest_lengths.len(), f64::INFINITY);
    }

    /// Checks the flag that ends the solve.
    pub(super) fn stops(&self) -> bool {
        self.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed))
    }

    /// Sets the bounds b of the lengths for displacements (infinite: free, and without tension).
    pub(super) fn set_bounds(&mut self, plan: &Plan, displacements: &[f64]) {
        self.bounds.clear();
        let rest = plan.rest_lengths.iter();
        self.bounds.extend(rest.zip(displacements).map(|(length, d)| length + d));
        self.active.clear();
        self.active.extend(displacements.iter().map(|d| d.is_finite()));
        for (tension, d) in self.tensions.iter_mut().zip(displacements) {
            if !d.is_finite() {
                *tension = 0.0;
            }
        }
    }

    /// Assembles derivatives, factors and the Schur complement at the point at hand, and returns the residual there.
    /// Subsegments that are off balance by more than `balance` \[rad of their own stiffness\] are brought nearer
    /// first, each by itself.
    pub(super) fn assemble(&mut self, plan: &Plan, balance: f64) -> Residual {
        // Buffers of the size of the plan; sums begin at zero.
        let (size, tendons) = (plan.width(), self.bounds.len());
        self.factors.resize(plan.data.len() * size * size, 0.0);
        self.whitened_gradients.resize(plan.data.len() * size, 0.0);
        self.whitened_rows.resize(plan.pieces.len() * size, 0.0);
        self.lengths.resize(plan.pieces.len(), 0.0);
        self.schur.clear();
        self.schur.resize(tendons * tendons, 0.0);
        self.dual_gradient.clear();
        self.dual_gradient.resize(tendons, 0.0);
        self.length_error.clear();
        self.length_error.resize(tendons, 0.0);
        self.ends.clear();
        // Sums over the subsegments: L, −Σ A_i H_i⁻¹ g_i and Σ A_i H_i⁻¹ A_iᵀ.
        let mut residual = match (plan.unknowns(), plan.settings.elements) {
            (3, 1) => self.assemble_subsegments::<3, true>(plan, balance),
            (3, _) => self.assemble_subsegments::<3, false>(plan, balance),
            (_, 1) => self.assemble_subsegments::<4, true>(plan, balance),
            _ => self.assemble_subsegments::<4, false>(plan, balance),
        };
        // ∇D = L − b − C T − Σ A_i H_i⁻¹ g_i, and C on the diagonal of S.
        for (k, bound) in self.bounds.iter().enumerate() {
            if bound.is_finite() {
                let compliance = plan.compliance[k] + self.added_compliance;
                let error = self.length_error[k] - bound - compliance * self.tensions[k];
                self.schur[k * (tendons + 1)] += compliance;
                self.length_error[k] = error;
                self.dual_gradient[k] += error;
                let relative = error / plan.rest_lengths[k];
                // Complementarity: a tendon is as long as it may be, or slack.
                let violation = if plan.signed {
                    relative.abs()
                } else {
                    relative.max((-relative).min(self.tensions[k] * plan.slenderness))
                };
                residual.length = residual.length.max(violation);
            }
        }
        residual
    }

    /// Assembles every subsegment for `D` unknowns per element, one element or several: factors, whitened rows and
    /// gradients, and the sums over subsegments that ∇D and S are made of.
    fn assemble_subsegments<const D: usize, const ONE: bool>(
        &mut self,
        plan: &Plan,
        balance: f64,
    ) -> Residual {
        let size = if ONE { D } else { plan.width() };
        let kind = plan.settings.subsegment;
        let tendons = self.bounds.len();
        let mut residual = Residual { stable: true, ..Residual::default() };
        for (i, data) in plan.data.iter().enumerate() {
            if self.stops() {
                self.local.place::<D>(kind, data, &self.strains[i * size..(i + 1) * size]);
                self.ends.push(self.local.end());
                // Out of evaluations.
                (residual.moment, residual.evaluations) = (f64::INFINITY, usize::MAX);
                continue;
            }
            // The derivatives of the subsegment, in its parts of the buffers.
            let (first, last) = (plan.starts[i], plan.starts[i + 1]);
            let pieces = &plan.pieces[first..last];
            let strains = &mut self.strains[i * size..(i + 1) * size];
            let mut out = Derivatives {
                gradient: &mut self.whitened_gradients[i * size..(i + 1) * size],
                hessian: &mut self.factors[i * size * size..(i + 1) * size * size],
                rows: &mut self.whitened_rows[first * size..last * size],
                lengths: &mut self.lengths[first..last],
            };
            let (local, tensions, active) = (&mut self.local, &self.tensions, &self.active);
            let (mut moved, mut evaluations) = (0.0, 0);
            // Balance: g_i, A_i and the factor of H_i, after Newton steps of the subsegment alone where it is off.
            loop {
                local.place::<D>(kind, data, strains);
                local.differentiate::<D, ONE>(data, pieces, strains, tensions, active, &mut out);
                let scale = data.elasticity.bending();
                let stable = factorize(out.hessian, &mut self.unfactored, size, scale);
                // max |g| / K.
                let mut moment = 0.0_f64;
                for (k, g) in out.gradient.iter().enumerate() {
                    moment = moment.max(data.elasticity.strain_under(k % D, g.abs()));
                }
                evaluations += 1;
                // Relaxation, until it is balanced or has jumped.
                let off = moment > balance || (!stable && moment > ON_RIDGE);
                if (off && evaluations <= RELAXATIONS && moved < JUMP)
                    && let Some(step) =
                        local.relax::<D>(kind, data, pieces, strains, tensions, &out)
                {
                    moved += step;
                    continue;
                }
                residual.moment = residual.moment.max(moment);
                if moment.is_nan() {
                    residual.moment = f64::NAN;
                }
                residual.stable &= stable;
                break;
            }
            residual.evaluations = residual.evaluations.max(evaluations);
            residual.moved = residual.moved.max(moved);
            self.ends.push(local.end());
            // Whitening, L_i⁻¹ g_i and L_i⁻¹ A_iᵀ: products of these are what the subsegment adds to ∇D and S.
            let Derivatives { gradient, hessian: factor, rows, lengths } = out;
            forward(factor, size, gradient);
            for (k, piece) in pieces.iter().enumerate() {
                if !active[piece.tendon] {
                    continue;
                }
                self.length_error[piece.tendon] += lengths[k];
                // −A_i H_i⁻¹ g_i and A_i H_i⁻¹ A_iᵀ, lower triangle.
                let (before, row) = rows.split_at_mut(k * size);
                let row = &mut row[..size];
                forward(factor, size, row);
                self.dual_gradient[piece.tendon] -= dot(row, gradient);
                let schur = &mut self.schur[piece.tendon * tendons..(piece.tendon + 1) * tendons];
                for (other, earlier) in pieces.iter().zip(before.chunks_exact(size)) {
                    if active[other.tendon] {
                        schur[other.tendon] += dot(row, earlier);
                    }
                }
                schur[piece.tendon] += dot(row, row);
            }
        }
        residual
    }

    /// Puts subsegments back to earlier strains where these have less energy under the tensions at hand.
    pub(super) fn keep_lower_energy(&mut self, plan: &Plan, earlier: &[f64]) {
        match plan.unknowns() {
            3 => self.keep_lower_energy_of::<3>(plan, earlier),
            _ => self.keep_lower_energy_of::<4>(plan, earlier),
        }
    }

    fn keep_lower_energy_of<const D: usize>(&mut self, plan: &Plan, earlier: &[f64]) {
        let (size, kind) = (plan.width(), plan.settings.subsegment);
        let rows = self.strains.chunks_exact_mut(size).zip(earlier.chunks_exact(size));
        for (i, (own, earlier)) in rows.enumerate() {
            let (data, pieces) = (&plan.data[i], &plan.pieces[plan.starts[i]..plan.starts[i + 1]]);
            let mut energy = |strains: &[f64]| {
                self.local.place::<D>(kind, data, strains);
                self.local.value::<D>(data, pieces, strains, &self.tensions)
            };
            let (before, after) = (energy(earlier), energy(own));
            // Rounding decides nothing.
            if after.is_nan() || after > before + ROUNDING * before.abs() {
                own.copy_from_slice(earlier);
            }
        }
    }

    /// Solves for the Newton step at the point assembled last, with a share `ridge` of the Schur complement's trace
    /// added to its diagonal; false when the program has no solution.
    pub(super) fn solve(&mut self, plan: &Plan, ridge: f64) -> bool {
        self.solve_tension_step(plan, ridge) && self.solve_strain_step(plan)
    }

    /// Solves `H_i dx_i = −g_i − A_iᵀ dT` for the step of the tensions at hand; false unless it is finite.
    pub(super) fn solve_strain_step(&mut self, plan: &Plan) -> bool {
        let size = plan.width();
        self.strain_step.clear();
        for i in 0..plan.data.len() {
            let factor = &self.factors[i * size * size..(i + 1) * size * size];
            let start = self.strain_step.len();
            let gradient = &self.whitened_gradients[i * size..(i + 1) * size];
            self.strain_step.extend(gradient.iter().map(|g| -g));
            let step = &mut self.strain_step[start..];
            for p in plan.starts[i]..plan.starts[i + 1] {
                let tension = self.tension_step[plan.pieces[p].tendon];
                if tension != 0.0 {
                    let row = &self.whitened_rows[p * size..(p + 1) * size];
                    for (s, a) in step.iter_mut().zip(row) {
                        *s -= tension * a;
                    }
                }
            }
            backward(factor, size, step);
        }
        self.strain_step.iter().all(|s| s.is_finite())
    }

    /// Newton step of the tensions: `dT = argmax ∇D·dT − ½ dT·S dT` subject to `T + dT ≥ 0`; false when the program
    /// has no solution.
    fn solve_tension_step(&mut self, plan: &Plan, ridge: f64) -> bool {
        let tendons = self.bounds.len();
        self.tension_step.clear();
        self.tension_step.resize(tendons, 0.0);
        let bounded = |k: &usize| self.bounds[*k].is_finite();
        let count = (0..tendons).filter(bounded).count();
        let trace: f64 = (0..tendons).filter(bounded).map(|k| self.schur[k * (tendons + 1)]).sum();
        let ridge = ridge * trace + f64::MIN_POSITIVE;
        self.reduced_schur.clear();
        self.reduced_gradient.clear();
        self.least_steps.clear();
        // Rows of the tendons that have a bound.
        for k in (0..tendons).filter(bounded) {
            for l in (0..=k).filter(bounded) {
                self.reduced_schur.push(self.schur[k * tendons + l]);
            }
            if let Some(diagonal) = self.reduced_schur.last_mut() {
                *diagonal += ridge;
            }
            self.reduced_gradient.push(self.dual_gradient[k]);
            self.reduced_schur.resize(self.reduced_gradient.len() * count, 0.0);
            self.least_steps.push(if plan.signed { f64::NEG_INFINITY } else { -self.tensions[k] });
        }
        let Self { program, reduced_schur, reduced_gradient, least_steps, .. } = self;
        if !program.solve(reduced_schur, reduced_gradient, least_steps, |k| least_steps[k] < 0.0) {
            return false;
        }
        let steps = self.tension_step.iter_mut().zip(&self.bounds).filter(|(_, b)| b.is_finite());
        steps.zip(&program.step).for_each(|((own, _), step)| *own = *step);
        true
    }

    /// Largest diagonal entry of S: what a unit of tension shortens a tendon by, at most \[m\].
    pub(super) fn largest_compliance(&self) -> f64 {
        let tendons = self.bounds.len();
        (0..tendons).fold(0.0_f64, |most, k| most.max(self.schur[k * (tendons + 1)]))
    }

    /// Longest step of a strain \[rad\].
    pub(super) fn longest_strain_step(&self) -> f64 {
        self.strain_step.iter().fold(0.0_f64, |most, s| most.max(s.abs()))
    }

    /// Slope of the dual along a step of the tensions, `∇D·dT`.
    pub(super) fn dual_slope(&self, tension_step: &[f64]) -> f64 {
        let bounded = self.bounds.iter().zip(&self.dual_gradient).zip(tension_step);
        bounded.filter(|((b, _), _)| b.is_finite()).map(|((_, slope), step)| slope * step).sum()
    }
}

/// Factors a Hessian, raised until it is positive definite; returns whether it was.
#[inline(always)]
fn factorize(hessian: &mut [f64], unfactored: &mut Vec<f64>, size: usize, stiffness: f64) -> bool {
    unfactored.clear();
    unfactored.extend_from_slice(hessian);
    cholesky(hessian, size) || {
        raise(hessian, unfactored, size, stiffness, 2.0);
        false
    }
}

/// Factors a Hessian that is not positive definite into `factor`, with a share of the stiffness's scale on its diagonal
/// that grows by `growth` until it is.
#[cold]
pub(super) fn raise(factor: &mut [f64], hessian: &[f64], size: usize, scale: f64, growth: f64) {
    let mut shift = SHIFT * scale;
    loop {
        factor.copy_from_slice(hessian);
        if shift > 1e9 * scale || shift.is_nan() {
            // Not a number somewhere: the caller sees it in the residual.
            factor.fill(0.0);
            (0..size).for_each(|k| factor[k * (size + 1)] = 1.0 / scale.sqrt());
            return;
        }
        for k in 0..size {
            factor[k * (size + 1)] += shift;
        }
        if cholesky(factor, size) {
            return;
        }
        shift *= growth;
    }
}
