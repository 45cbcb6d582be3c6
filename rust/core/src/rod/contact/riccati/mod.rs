//! Newton's step on M by a Riccati recursion: one sweep from the tip, which factors the Hessian, and one back.
//!
//! With θ the twists that a subsegment's unknowns give all that lies beyond it, Φ and W the sums of curvature and
//! slope of the potentials there, the Hessian's blocks are `H_ab = θ_aᵀ Φ_b θ_b + ½ W_b · [θ_a, θ_b]` for a nearer to
//! the base than b: the displacement x of a subsegment's base is all that it knows of the rest. Every block is
//! eliminated as in a linear-quadratic regulator,
//!
//! `Q = H_bb + θᵀ P θ,  N = (Φ + P) θ + ½ [W, θ],  P ← P - N Q⁻¹ Nᵀ`.
//!
//! Tendons that pull add a component each to x, by how much they have grown before the block: their rows of θ are
//! `tendon_rows`, their part of N is `tendon_gain`, and P has the blocks `p` (6 × 6), `p_mixed` (6 × tendons) and
//! `p_tendons`. With `Q = L Lᵀ` in `factors`, `n` and `tendon_gain` are kept as `L⁻¹ Nᵀ`, so that
//! `N Q⁻¹ Nᵀ` is the sum of their rows' squares.

mod back_substitution;

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::potential::{Potential, bracket};
use crate::lie::Pose;
use crate::lie::so3::hat;
use crate::rod::newton_system::raise;
use crate::rod::plan::Plan;
use crate::rod::subsegment::{Derivatives, Local, Node};
use crate::solve::dense::{cholesky, dot};

/// Shape, potentials and tendons of a Newton system.
pub(super) struct Linearization<'a> {
    pub(super) plan: &'a Plan,
    pub(super) strains: &'a [f64],
    /// Frame of every disk in the base's.
    pub(super) frames: &'a [Pose],
    /// Potential of every disk.
    pub(super) potentials: &'a [Potential],
    pub(super) tensions: &'a [f64],
    /// Tendons whose lengths have slopes.
    pub(super) bounded: &'a [bool],
    /// Those of them that a bound makes pull, and c + C of each.
    pub(super) pulling: &'a [bool],
    pub(super) compliance: &'a [f64],
    /// m, on the tip.
    pub(super) moment: Vector3<f64>,
    /// Added to the Hessian, in shares of the stiffness.
    pub(super) shift: f64,
}

/// Factored Hessian, gradient and step.
#[derive(Clone, Debug, Default)]
pub(super) struct Riccati {
    local: Local,
    /// Gradient of M.
    pub(super) gradient: Vec<f64>,
    /// Largest of it, relative to the stiffness \[rad\].
    pub(super) moment: f64,
    /// First block (from the tip) whose Q is not positive definite, with a direction of descent in it.
    pub(super) unstable: Option<usize>,
    block_escape: Vec<f64>,
    pub(super) step: Vec<f64>,
    /// θ, a twist per unknown.
    twists: Vec<Vector6<f64>>,
    /// L of every block.
    factors: Vec<f64>,
    /// `L⁻¹ Nᵀ`, six numbers per unknown.
    n: Vec<Vector6<f64>>,
    /// Part of `L⁻¹ Nᵀ` for the growth of the tendons that pull, a number of each per unknown.
    tendon_gain: Vec<f64>,
    /// Slopes of their lengths by every unknown.
    tendon_rows: Vec<f64>,
    /// `L⁻¹` times the gradient.
    column: Vec<f64>,
    /// Right-hand side of a solve.
    rhs: Vec<f64>,
    /// Slopes of every piece's length, and the lengths.
    rows: Vec<f64>,
    lengths: Vec<f64>,
    /// First-order displacement of every disk by the step, a twist about the origin.
    pub(super) displacements: Vec<Vector6<f64>>,
    block: Vec<f64>,
    /// Indices of the tendons that pull.
    active_tendons: Vec<usize>,
}

impl Riccati {
    /// Gradient, factors and step.
    pub(super) fn factor_and_solve(&mut self, at: &Linearization<'_>) {
        match (at.plan.unknowns(), at.plan.settings.elements) {
            (3, 1) => self.factor::<3, true>(at),
            (3, _) => self.factor::<3, false>(at),
            (_, 1) => self.factor::<4, true>(at),
            _ => self.factor::<4, false>(at),
        }
        self.rhs.clone_from(&self.gradient);
        self.solve(at.plan);
        if at.moment != Vector3::zeros() {
            self.add_tip_moment(at.plan, &at.moment);
        }
    }

    /// Gradient and factors: the sweep from the tip to the base.
    ///
    /// For every block: Φ and W beyond it, its own derivatives, N, Q and its factor L, `L⁻¹ Nᵀ`, and P for the next.
    fn factor<const D: usize, const ONE: bool>(&mut self, at: &Linearization<'_>) {
        self.prepare(at);
        let plan = at.plan;
        let width = plan.width();
        let count = self.active_tendons.len();
        // At the tip P is 1 / (c + C) of the tendons, and zero elsewhere.
        let mut beyond = Potential::zero();
        let mut p = Matrix6::zeros();
        let mut p_mixed = vec![Vector6::zeros(); count];
        let mut p_tendons = vec![0.0; count * count];
        for (k, tendon) in self.active_tendons.iter().enumerate() {
            p_tendons[k * (count + 1)] = 1.0 / at.compliance[*tendon];
        }
        for i in (0..plan.data.len()).rev() {
            // Φ and W beyond this block, its gradient and H_bb.
            beyond.add(&at.potentials[i + 1]);
            self.differentiate::<D, ONE>(at, i);
            self.add_potential::<D>(at, i, &beyond);
            self.gather_tendon_rows(plan, i);
            let range = i * width..(i + 1) * width;
            let tendon_rows = &self.tendon_rows[i * width * count..(i + 1) * width * count];
            let tendon_gain = &mut self.tendon_gain[i * width * count..(i + 1) * width * count];
            let twists = &self.twists[range.clone()];
            let n = &mut self.n[range.clone()];
            // N = (Φ + P) θ + ½ [W, θ], and the largest moment.
            for ((twist, own), (k, slope)) in
                twists.iter().zip(&mut *n).zip(self.gradient[range.clone()].iter().enumerate())
            {
                let elasticity = &plan.data[i].elasticity;
                self.moment = self.moment.max(elasticity.strain_under(k % D, slope.abs()));
                if slope.is_nan() {
                    self.moment = f64::NAN;
                }
                *own = (beyond.curvature + p) * twist + bracket(&beyond.slope, twist) * 0.5;
            }
            // N of the tendons: their rows of θ join the twists.
            for a in 0..width {
                let (twist, row) = (&twists[a], &tendon_rows[a * count..(a + 1) * count]);
                for k in 0..count {
                    n[a] += p_mixed[k] * row[k];
                    tendon_gain[a * count + k] =
                        p_mixed[k].dot(twist) + dot(&p_tendons[k * count..(k + 1) * count], row);
                }
            }
            // Q = H_bb + θᵀ P θ, shifted.
            let q = &mut self.factors[i * width * width..(i + 1) * width * width];
            for a in 0..width {
                for b in 0..=a {
                    q[a * width + b] += twists[a].dot(&(p * twists[b]));
                    for k in 0..count {
                        let (own, other) = (tendon_rows[a * count + k], tendon_rows[b * count + k]);
                        q[a * width + b] += own * tendon_gain[b * count + k];
                        q[a * width + b] += other * p_mixed[k].dot(&twists[a]);
                    }
                }
                q[a * (width + 1)] += at.shift * plan.data[i].elasticity.stiffness(a % D);
            }
            // L, and the first block that is not positive definite.
            self.factor_block(i, width, plan.data[i].elasticity.bending());
            // L⁻¹ Nᵀ, by rows.
            let l = &self.factors[i * width * width..(i + 1) * width * width];
            let tendon_gain = &mut self.tendon_gain[i * width * count..(i + 1) * width * count];
            let n = &mut self.n[range.clone()];
            for a in 0..width {
                let row = &l[a * width..=a * width + a];
                let (before, after) = n.split_at_mut(a);
                let (nearer, own) = tendon_gain.split_at_mut(a * count);
                for (b, l) in row[..a].iter().enumerate() {
                    after[0] -= before[b] * *l;
                    for k in 0..count {
                        own[k] -= nearer[b * count + k] * l;
                    }
                }
                after[0] *= row[a];
                own[..count].iter_mut().for_each(|own| *own *= row[a]);
            }
            // P ← P - N Q⁻¹ Nᵀ.
            for a in 0..width {
                let gain = &tendon_gain[a * count..(a + 1) * count];
                for k in 0..count {
                    p_mixed[k] -= n[a] * gain[k];
                    for l in 0..count {
                        p_tendons[k * count + l] -= gain[k] * gain[l];
                    }
                }
            }
            for n in &*n {
                p -= n * n.transpose();
            }
        }
    }

    /// Tendons that pull, and room for all.
    fn prepare(&mut self, at: &Linearization<'_>) {
        let plan = at.plan;
        let width = plan.width();
        let blocks = plan.data.len();
        self.active_tendons.clear();
        self.active_tendons.extend((0..at.bounded.len()).filter(|k| at.pulling[*k]));
        self.gradient.resize(blocks * width, 0.0);
        self.factors.resize(blocks * width * width, 0.0);
        self.twists.resize(blocks * width, Vector6::zeros());
        self.n.resize(blocks * width, Vector6::zeros());
        let count = self.active_tendons.len();
        self.column.resize(blocks * width, 0.0);
        self.tendon_gain.resize(blocks * width * count, 0.0);
        self.tendon_rows.clear();
        self.tendon_rows.resize(blocks * width * count, 0.0);
        self.rows.resize(plan.pieces.len() * width, 0.0);
        self.lengths.resize(plan.pieces.len(), 0.0);
        (self.moment, self.unstable) = (0.0, None);
    }

    /// Factors one Q, raised if it is not positive definite.
    fn factor_block(&mut self, i: usize, width: usize, stiffness: f64) {
        let q = &mut self.factors[i * width * width..(i + 1) * width * width];
        self.block.clear();
        self.block.extend_from_slice(q);
        if !cholesky(q, width) {
            if self.unstable.is_none() {
                self.unstable = Some(i);
                write_least_curvature(&self.block, width, &mut self.block_escape);
            }
            raise(q, &self.block, width, stiffness, 4.0);
        }
    }

    /// Gathers the slopes of the pulling tendons' lengths by one subsegment's unknowns.
    fn gather_tendon_rows(&mut self, plan: &Plan, i: usize) {
        let (width, count) = (plan.width(), self.active_tendons.len());
        let (first, pieces) = (plan.starts[i], &plan.pieces[plan.starts[i]..plan.starts[i + 1]]);
        for (k, tendon) in self.active_tendons.iter().enumerate() {
            if let Some(p) = pieces.iter().position(|piece| piece.tendon == *tendon) {
                for a in 0..width {
                    self.tendon_rows[(i * width + a) * count + k] =
                        self.rows[(first + p) * width + a];
                }
            }
        }
    }

    /// Derivatives of energy and tendons of one subsegment, and its twists θ.
    fn differentiate<const D: usize, const ONE: bool>(&mut self, at: &Linearization<'_>, i: usize) {
        let plan = at.plan;
        let width = plan.width();
        let data = &plan.data[i];
        let pieces = &plan.pieces[plan.starts[i]..plan.starts[i + 1]];
        let strains = &at.strains[i * width..(i + 1) * width];
        let range = plan.starts[i]..plan.starts[i + 1];
        self.local.place::<D>(plan.settings.subsegment, data, strains);
        let mut out = Derivatives {
            gradient: &mut self.gradient[i * width..(i + 1) * width],
            hessian: &mut self.factors[i * width * width..(i + 1) * width * width],
            rows: &mut self.rows[range.start * width..range.end * width],
            lengths: &mut self.lengths[range],
        };
        let (tensions, bounded) = (at.tensions, at.bounded);
        self.local.differentiate::<D, ONE>(data, pieces, strains, tensions, bounded, &mut out);
        // θ about the origin, in the base's axes.
        let (base, tip) = (&at.frames[i], &at.frames[i + 1].translation);
        let end = self.local.end().translation;
        for (e, node) in self.local.nodes.iter().enumerate() {
            for c in 0..D {
                let (velocity, spin) = node.velocity(c, &end);
                let spin = base.rotation * spin;
                let velocity = base.rotation * velocity - spin.cross(tip);
                self.twists[i * width + D * e + c] =
                    Vector6::new(spin.x, spin.y, spin.z, velocity.x, velocity.y, velocity.z);
            }
        }
    }

    /// Adds the potentials beyond to a subsegment's gradient and Hessian.
    fn add_potential<const D: usize>(
        &mut self,
        at: &Linearization<'_>,
        i: usize,
        beyond: &Potential,
    ) {
        let width = at.plan.width();
        let twists = &self.twists[i * width..(i + 1) * width];
        let gradient = &mut self.gradient[i * width..(i + 1) * width];
        let hessian = &mut self.factors[i * width * width..(i + 1) * width * width];
        // θᵀ Φ θ, and ½ W · [θ_a, θ_b] between elements.
        for (a, twist) in twists.iter().enumerate() {
            gradient[a] += twist.dot(&beyond.slope);
            let curved = beyond.curvature * twist;
            let bracket = bracket(&beyond.slope, twist) * 0.5;
            for (b, other) in twists[..=a].iter().enumerate() {
                hessian[a * width + b] += other.dot(&curved);
                if b / D < a / D {
                    hessian[a * width + b] += other.dot(&bracket);
                }
            }
        }
        // W · ∂²η of every element.
        let base = &at.frames[i];
        let force = Vector3::new(beyond.slope[3], beyond.slope[4], beyond.slope[5]);
        let moment = Vector3::new(beyond.slope[0], beyond.slope[1], beyond.slope[2]);
        for (e, node) in self.local.nodes.iter().enumerate() {
            let rotation = base.rotation * node.base.rotation;
            let end = base.transform(&node.end.translation);
            let about_end = rotation.tr_mul(&(moment - end.cross(&force)));
            let own = twist_hessian::<D>(node, &rotation.tr_mul(&force), &about_end);
            for a in 0..D {
                for b in 0..=a {
                    hessian[(D * e + a) * width + D * e + b] += own[a][b];
                }
            }
        }
    }
}

/// Second derivatives `W · ∂²η` by the unknowns of an element, η the twist that they give its end, in exponential
/// coordinates: `f·∂²p - sym(f · (∂ω × ∂p)) + sym ∂(Jᵀ m)/∂w`, force f and moment m about its end, in the axes of its
/// base.
fn twist_hessian<const D: usize>(
    node: &Node,
    force: &Vector3<f64>,
    moment: &Vector3<f64>,
) -> [[f64; 4]; 4] {
    let element = &node.element;
    let none = Vector3::zeros();
    let mut block = element.curvature(force, &none, &Matrix3::zeros());
    // f · (ω × p'): the twist's velocity is not that of the end.
    let crossed = element.spin.transpose() * hat(force).transpose() * element.sweep;
    block -= (crossed + crossed.transpose()) * 0.5;
    block += element.spin_curvature(moment);
    let mut out = [[0.0; 4]; 4];
    for a in 0..3 {
        for b in 0..=a {
            out[a][b] = block[(a, b)];
        }
    }
    if D == 4 {
        let stretch = element.stretch();
        let mixed =
            element.stretch_slope(force) - element.spin.transpose() * stretch.cross(force) * 0.5;
        for b in 0..3 {
            out[3][b] = mixed[b];
        }
    }
    out
}

/// Writes the direction of least curvature of a small symmetric matrix: of its least eigenvalue, the largest component
/// positive.
fn write_least_curvature(matrix: &[f64], size: usize, out: &mut Vec<f64>) {
    let full = nalgebra::DMatrix::from_fn(size, size, |a, b| matrix[a.max(b) * size + a.min(b)]);
    out.clear();
    if full.iter().any(|x| !x.is_finite()) {
        out.resize(size, 0.0);
        return;
    }
    let eigen = full.symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    let vector = eigen.eigenvectors.column(least);
    let sign = vector[vector.iamax()].signum();
    out.extend(vector.iter().map(|x| x * sign));
}
