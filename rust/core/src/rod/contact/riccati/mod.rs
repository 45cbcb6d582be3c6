//! Newton's step of a chain whose frames have potentials, in one sweep from the tip and one back.
//!
//! With θ the twists that a subsegment's unknowns give all that lies beyond it, Φ and W the sums of curvature and
//! slope of the potentials there, the Hessian's blocks are `θ_aᵀ M_b θ_b` for a nearer to the base than b, with
//! `x·M θ = x·Φ θ + ½ W·[x, θ]`: the displacement x of a subsegment's base is all that it knows of the rest.
//! The elimination is that of a linear-quadratic regulator.

mod back_substitution;

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::potential::{Field, bracket};
use crate::lie::Pose;
use crate::lie::so3::hat;
use crate::rod::newton_system::raise;
use crate::rod::plan::Plan;
use crate::rod::subsegment::{Derivatives, Local, Node};
use crate::solve::dense::{cholesky, dot};
use back_substitution::escape;

/// What a sweep is made at.
pub(super) struct At<'a> {
    pub(super) plan: &'a Plan,
    pub(super) strains: &'a [f64],
    /// Frame of every disk in the base's.
    pub(super) frames: &'a [Pose],
    pub(super) fields: &'a [Field],
    pub(super) tensions: &'a [f64],
    pub(super) taut: &'a [bool],
    /// Which of them pull; slopes of the lengths are found for the bounded ones.
    pub(super) pulling: &'a [bool],
    /// Compliance of the taut tendons beyond what the rod gives.
    pub(super) give: &'a [f64],
    /// On the tip.
    pub(super) moment: Vector3<f64>,
    /// Added to the Hessian, in shares of the stiffness.
    pub(super) shift: f64,
}

/// The factored Hessian, the gradient and the step.
#[derive(Clone, Debug, Default)]
pub(super) struct Sweep {
    local: Local,
    /// Slope by every unknown.
    pub(super) gradient: Vec<f64>,
    /// Largest of it, relative to the stiffness \[rad\].
    pub(super) moment: f64,
    /// First block (from the tip) that is not positive definite, with a direction of descent in it.
    pub(super) unstable: Option<usize>,
    escape: Vec<f64>,
    pub(super) step: Vec<f64>,
    twists: Vec<Vector6<f64>>,
    factors: Vec<f64>,
    /// `L⁻¹` times the coupling to the base's displacement, six numbers per unknown.
    coupling: Vec<Vector6<f64>>,
    /// The same to what the tendons have grown by up to the base, one number per tendon that pulls.
    growing: Vec<f64>,
    /// Slopes of their lengths by every unknown.
    reins: Vec<f64>,
    /// `L⁻¹` times the gradient.
    column: Vec<f64>,
    /// What a step is to answer.
    right: Vec<f64>,
    /// Slopes of every piece's length.
    rows: Vec<f64>,
    lengths: Vec<f64>,
    /// First-order displacement of every disk by the step, a twist about the origin.
    pub(super) moved: Vec<Vector6<f64>>,
    block: Vec<f64>,
    taut: Vec<usize>,
}

impl Sweep {
    /// Gradient and factors.
    pub(super) fn factor(&mut self, at: &At<'_>) {
        match (at.plan.unknowns(), at.plan.settings.elements) {
            (3, 1) => self.factor_of::<3, true>(at),
            (3, _) => self.factor_of::<3, false>(at),
            (_, 1) => self.factor_of::<4, true>(at),
            _ => self.factor_of::<4, false>(at),
        }
    }

    fn factor_of<const D: usize, const ONE: bool>(&mut self, at: &At<'_>) {
        self.prepare(at);
        let plan = at.plan;
        let size = plan.width();
        let n = plan.data.len();
        let count = self.taut.len();
        let mut beyond = Field::zero();
        let mut value = Matrix6::zeros();
        let mut mixed = vec![Vector6::zeros(); count];
        let mut held = vec![0.0; count * count];
        for (k, tendon) in self.taut.iter().enumerate() {
            held[k * (count + 1)] = 1.0 / at.give[*tendon];
        }
        for i in (0..n).rev() {
            beyond.add(&at.fields[i + 1]);
            self.differentiate::<D, ONE>(at, i);
            self.add_fields::<D>(at, i, &beyond);
            self.rein(plan, i);
            let range = i * size..(i + 1) * size;
            let reins = &self.reins[i * size * count..(i + 1) * size * count];
            let growing = &mut self.growing[i * size * count..(i + 1) * size * count];
            let twists = &self.twists[range.clone()];
            let coupling = &mut self.coupling[range.clone()];
            for ((twist, own), (k, slope)) in twists
                .iter()
                .zip(&mut *coupling)
                .zip(self.gradient[range.clone()].iter().enumerate())
            {
                let elasticity = &plan.data[i].elasticity;
                self.moment = self.moment.max(elasticity.strain_under(k % D, slope.abs()));
                if slope.is_nan() {
                    self.moment = f64::NAN;
                }
                *own = (beyond.curvature + value) * twist + bracket(&beyond.slope, twist) * 0.5;
            }
            for a in 0..size {
                let (twist, rein) = (&twists[a], &reins[a * count..(a + 1) * count]);
                for k in 0..count {
                    coupling[a] += mixed[k] * rein[k];
                    growing[a * count + k] =
                        mixed[k].dot(twist) + dot(&held[k * count..(k + 1) * count], rein);
                }
            }
            let factor = &mut self.factors[i * size * size..(i + 1) * size * size];
            for a in 0..size {
                for b in 0..=a {
                    factor[a * size + b] += twists[a].dot(&(value * twists[b]));
                    for k in 0..count {
                        let (own, other) = (reins[a * count + k], reins[b * count + k]);
                        factor[a * size + b] += own * growing[b * count + k];
                        factor[a * size + b] += other * mixed[k].dot(&twists[a]);
                    }
                }
                factor[a * (size + 1)] += at.shift * plan.data[i].elasticity.stiffness(a % D);
            }
            self.factor_block(i, size, plan.data[i].elasticity.bending());
            let factor = &self.factors[i * size * size..(i + 1) * size * size];
            let growing = &mut self.growing[i * size * count..(i + 1) * size * count];
            let coupling = &mut self.coupling[range.clone()];
            for a in 0..size {
                let row = &factor[a * size..=a * size + a];
                let (before, after) = coupling.split_at_mut(a);
                let (nearer, own) = growing.split_at_mut(a * count);
                for (b, l) in row[..a].iter().enumerate() {
                    after[0] -= before[b] * *l;
                    for k in 0..count {
                        own[k] -= nearer[b * count + k] * l;
                    }
                }
                after[0] *= row[a];
                own[..count].iter_mut().for_each(|own| *own *= row[a]);
            }
            for a in 0..size {
                let growing = &growing[a * count..(a + 1) * count];
                for k in 0..count {
                    mixed[k] -= coupling[a] * growing[k];
                    for l in 0..count {
                        held[k * count + l] -= growing[k] * growing[l];
                    }
                }
            }
            for coupling in &*coupling {
                value -= coupling * coupling.transpose();
            }
        }
        self.right.clone_from(&self.gradient);
        self.answer(plan);
        if at.moment != Vector3::zeros() {
            self.turn(plan, &at.moment);
        }
    }

    /// Which tendons pull, and room for all.
    fn prepare(&mut self, at: &At<'_>) {
        let plan = at.plan;
        let size = plan.width();
        let n = plan.data.len();
        self.taut.clear();
        self.taut.extend((0..at.taut.len()).filter(|k| at.pulling[*k]));
        self.gradient.resize(n * size, 0.0);
        self.factors.resize(n * size * size, 0.0);
        self.twists.resize(n * size, Vector6::zeros());
        self.coupling.resize(n * size, Vector6::zeros());
        let count = self.taut.len();
        self.column.resize(n * size, 0.0);
        self.growing.resize(n * size * count, 0.0);
        self.reins.clear();
        self.reins.resize(n * size * count, 0.0);
        self.rows.resize(plan.pieces.len() * size, 0.0);
        self.lengths.resize(plan.pieces.len(), 0.0);
        (self.moment, self.unstable) = (0.0, None);
    }

    /// Factors one block, raised if it is not positive definite.
    fn factor_block(&mut self, i: usize, size: usize, stiffness: f64) {
        let factor = &mut self.factors[i * size * size..(i + 1) * size * size];
        self.block.clear();
        self.block.extend_from_slice(factor);
        if !cholesky(factor, size) {
            if self.unstable.is_none() {
                self.unstable = Some(i);
                escape(&self.block, size, &mut self.escape);
            }
            raise(factor, &self.block, size, stiffness, 4.0);
        }
    }

    /// Slopes of the pulling tendons' lengths by one subsegment's unknowns.
    fn rein(&mut self, plan: &Plan, i: usize) {
        let (size, count) = (plan.width(), self.taut.len());
        let (first, pieces) = (plan.starts[i], &plan.pieces[plan.starts[i]..plan.starts[i + 1]]);
        for (k, tendon) in self.taut.iter().enumerate() {
            if let Some(p) = pieces.iter().position(|piece| piece.tendon == *tendon) {
                for a in 0..size {
                    self.reins[(i * size + a) * count + k] = self.rows[(first + p) * size + a];
                }
            }
        }
    }

    /// Energy and tendons of one subsegment, and its twists.
    fn differentiate<const D: usize, const ONE: bool>(&mut self, at: &At<'_>, i: usize) {
        let plan = at.plan;
        let size = plan.width();
        let data = &plan.data[i];
        let pieces = &plan.pieces[plan.starts[i]..plan.starts[i + 1]];
        let strains = &at.strains[i * size..(i + 1) * size];
        let range = plan.starts[i]..plan.starts[i + 1];
        self.local.place::<D>(plan.settings.subsegment, data, strains);
        let mut out = Derivatives {
            gradient: &mut self.gradient[i * size..(i + 1) * size],
            hessian: &mut self.factors[i * size * size..(i + 1) * size * size],
            rows: &mut self.rows[range.start * size..range.end * size],
            lengths: &mut self.lengths[range],
        };
        self.local.differentiate::<D, ONE>(data, pieces, strains, at.tensions, at.taut, &mut out);
        let (base, tip) = (&at.frames[i], &at.frames[i + 1].translation);
        let end = self.local.end().translation;
        for (e, node) in self.local.nodes.iter().enumerate() {
            for c in 0..D {
                let (moved, spin) = node.velocity(c, &end);
                let spin = base.rotation * spin;
                let moved = base.rotation * moved - spin.cross(tip);
                self.twists[i * size + D * e + c] =
                    Vector6::new(spin.x, spin.y, spin.z, moved.x, moved.y, moved.z);
            }
        }
    }

    /// What the potentials beyond add to a subsegment's gradient and Hessian.
    fn add_fields<const D: usize>(&mut self, at: &At<'_>, i: usize, beyond: &Field) {
        let size = at.plan.width();
        let twists = &self.twists[i * size..(i + 1) * size];
        let gradient = &mut self.gradient[i * size..(i + 1) * size];
        let hessian = &mut self.factors[i * size * size..(i + 1) * size * size];
        for (a, twist) in twists.iter().enumerate() {
            gradient[a] += twist.dot(&beyond.slope);
            let bent = beyond.curvature * twist;
            let bracket = bracket(&beyond.slope, twist) * 0.5;
            for (b, other) in twists[..=a].iter().enumerate() {
                hessian[a * size + b] += other.dot(&bent);
                if b / D < a / D {
                    hessian[a * size + b] += other.dot(&bracket);
                }
            }
        }
        let base = &at.frames[i];
        let force = Vector3::new(beyond.slope[3], beyond.slope[4], beyond.slope[5]);
        let moment = Vector3::new(beyond.slope[0], beyond.slope[1], beyond.slope[2]);
        for (e, node) in self.local.nodes.iter().enumerate() {
            let rotation = base.rotation * node.base.rotation;
            let place = base.transform(&node.end.translation);
            let about = rotation.tr_mul(&(moment - place.cross(&force)));
            let own = second::<D>(node, &rotation.tr_mul(&force), &about);
            for a in 0..D {
                for b in 0..=a {
                    hessian[(D * e + a) * size + D * e + b] += own[a][b];
                }
            }
        }
    }
}

/// Second derivatives of `W · η` by the unknowns of an element, η the twist that they give its end, in
/// exponential coordinates: force and moment about its end, in the axes of its base.
fn second<const D: usize>(
    node: &Node,
    force: &Vector3<f64>,
    moment: &Vector3<f64>,
) -> [[f64; 4]; 4] {
    let element = &node.element;
    let none = Vector3::zeros();
    let mut block = element.curvature(force, &none, &Matrix3::zeros());
    // f · (ω × p'): the twist's velocity is not that of the end.
    let swept = element.spin.transpose() * hat(force).transpose() * element.sweep;
    block -= (swept + swept.transpose()) * 0.5;
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
