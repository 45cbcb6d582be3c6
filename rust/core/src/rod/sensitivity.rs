//! Exact derivatives of a solved rod by everything it was made of, by implicit differentiation.
//!
//! At a solution `H dw + Aᵀ dT = −dg` and `A dw − C dT = −d(L − b)`, where dg and d(L − b) are what a change of the
//! parameters does at fixed strains and tensions. The matrix is the one of the last Newton step, factored
//! already, and symmetric, so the adjoint is the same solve.

use nalgebra::{DMatrix, DVector, Matrix6xX, Vector3, Vector6};

use super::model::{Rod, Workspace};
use super::plan::Plan;
use super::settings::TendonRule;
use super::subsegment::{Local, Piece};
use crate::lie::Pose;
use crate::solve::least_squares::PseudoInverse;
use crate::solve::quadratic::{backward, dot, forward};

/// A change of what a rod is made of, or a gradient by it.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Of each displacement \[m\].
    pub displacements: Vec<f64>,
    /// Of each subsegment's rest rotation vector \[rad\].
    pub rest: Vec<Vector3<f64>>,
    /// Of each tendon's holes, disk 0 to its end, in the disks' frames \[m\].
    pub holes: Vec<Vec<Vector3<f64>>>,
    /// Of each subsegment's length, its stiffness per length unchanged \[m\].
    pub lengths: Vec<f64>,
    /// Of Poisson's ratio.
    pub poisson_ratio: f64,
}

/// What a change does to the shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Variation {
    /// Of every element's strain: rotation vector, and elongation where there is one.
    pub strains: Vec<f64>,
    /// Of each tension, in the unit of the results; of the base piece where displacements are proportional.
    pub tensions: Vec<f64>,
    /// Velocity of each disk's centre, world axes \[m\].
    pub velocities: Vec<Vector3<f64>>,
    /// Angular velocity of each disk, world axes \[rad\].
    pub spins: Vec<Vector3<f64>>,
}

/// Lengths within this share of their bounds are at them.
const AT_BOUND: f64 = 1e-9;

/// The derivatives of one solved shape.
#[derive(Clone, Debug)]
pub struct Sensitivity<'r> {
    rod: Rod<'r>,
    displacements: Vec<f64>,
    strains: Vec<f64>,
    factors: Vec<f64>,
    images: Vec<f64>,
    frames: Vec<Pose>,
    /// Tension of every piece, in the plan's unit.
    tensions: Vec<f64>,
    /// Length equation of every piece, if it is in one.
    equations: Vec<Option<usize>>,
    /// Equations that share unknowns: the first one, and the inverse of their Schur complement.
    groups: Vec<(usize, DMatrix<f64>)>,
    count: usize,
    dependent: bool,
}

impl<'r> Rod<'r> {
    /// Derivatives at the shape that the last solve for `displacements` left in `work`.
    ///
    /// Tendons under tension or exactly at their bounds count as taut; a bound that rest just meets is so
    /// followed on its pulled side. Where taut tendons depend on each other, displacements cannot change one
    /// by one: the derivatives are then those of the nearest change that the rod can follow.
    #[must_use]
    pub fn sensitivity(&self, displacements: &[f64], work: &Workspace) -> Sensitivity<'r> {
        let (plan, chain) = (self.plan, &work.chain);
        let mut out = Sensitivity {
            rod: self.clone(),
            displacements: displacements.to_vec(),
            strains: chain.strains.clone(),
            factors: Vec::new(),
            images: Vec::new(),
            frames: work.state.frames.clone(),
            tensions: Vec::new(),
            equations: Vec::new(),
            groups: Vec::new(),
            count: 0,
            dependent: false,
        };
        if plan.settings.tendons == TendonRule::Proportional {
            out.assemble_pieces(work);
        } else {
            out.assemble_whole(work);
        }
        out
    }
}

impl Sensitivity<'_> {
    /// Whether taut tendons depend on each other.
    #[must_use]
    pub fn dependent(&self) -> bool {
        self.dependent
    }

    fn plan(&self) -> &Plan {
        self.rod.plan
    }

    fn assemble_whole(&mut self, work: &Workspace) {
        let (plan, chain) = (self.rod.plan, &work.chain);
        self.factors.clone_from(&chain.factors);
        self.images.clone_from(&chain.images);
        self.tensions = plan.pieces.iter().map(|p| chain.tensions[p.tendon]).collect();
        let tendons = chain.bounds.len();
        let taut: Vec<usize> = (0..tendons)
            .filter(|k| {
                chain.bounds[*k].is_finite()
                    && (chain.tensions[*k] > 0.0
                        || chain.over[*k].abs() <= AT_BOUND * plan.rest_lengths[*k])
            })
            .collect();
        self.equations =
            plan.pieces.iter().map(|p| taut.iter().position(|k| *k == p.tendon)).collect();
        let schur = DMatrix::from_fn(taut.len(), taut.len(), |a, b| {
            let (a, b) = (taut[a.max(b)], taut[a.min(b)]);
            chain.schur[a * tendons + b]
        });
        self.push_group(&schur);
    }

    fn push_group(&mut self, schur: &DMatrix<f64>) {
        let inverse = PseudoInverse::new(schur);
        self.dependent |= inverse.rank < schur.nrows();
        self.groups.push((self.count, inverse.matrix));
        self.count += schur.nrows();
    }

    fn assemble_pieces(&mut self, work: &Workspace) {
        let plan = self.rod.plan;
        let mut chain = work.part.clone();
        for (i, part) in plan.parts.iter().enumerate() {
            work.load_part(plan, i, &self.displacements, &mut chain);
            chain.give = 0.0;
            chain.assemble(part, f64::INFINITY);
            self.factors.extend_from_slice(&chain.factors);
            self.images.extend_from_slice(&chain.images);
            self.tensions.extend_from_slice(&chain.tensions);
            let count = chain.bounds.len();
            let taut: Vec<usize> = (0..count).filter(|k| chain.taut[*k]).collect();
            let first = self.count;
            let place = |k| taut.iter().position(|own| *own == k).map(|a| first + a);
            self.equations.extend((0..count).map(place));
            let schur = DMatrix::from_fn(taut.len(), taut.len(), |a, b| {
                chain.schur[taut[a.max(b)] * count + taut[a.min(b)]]
            });
            self.push_group(&schur);
        }
    }

    /// Solves `H w + Aᵀ t = right`, `A w − C t = lengths`: `right` becomes w, `lengths` becomes t.
    fn solve(&self, right: &mut [f64], lengths: &mut DVector<f64>) {
        let plan = self.plan();
        let size = plan.width();
        lengths.neg_mut();
        for (i, own) in right.chunks_exact_mut(size).enumerate() {
            forward(&self.factors[i * size * size..(i + 1) * size * size], size, own);
            for p in plan.starts[i]..plan.starts[i + 1] {
                if let Some(row) = self.equations[p] {
                    lengths[row] += dot(&self.images[p * size..(p + 1) * size], own);
                }
            }
        }
        for (first, inverse) in &self.groups {
            let solved = inverse * lengths.rows(*first, inverse.nrows());
            lengths.rows_mut(*first, inverse.nrows()).copy_from(&solved);
        }
        for (i, own) in right.chunks_exact_mut(size).enumerate() {
            for p in plan.starts[i]..plan.starts[i + 1] {
                if let Some(row) = self.equations[p] {
                    let image = &self.images[p * size..(p + 1) * size];
                    for (w, y) in own.iter_mut().zip(image) {
                        *w -= lengths[row] * y;
                    }
                }
            }
            backward(&self.factors[i * size * size..(i + 1) * size * size], size, own);
        }
    }

    /// What a displacement does to the bound of a piece's equation.
    fn bound_slope(&self, piece: usize) -> f64 {
        let plan = self.plan();
        match plan.settings.tendons {
            TendonRule::Sliding => 1.0,
            TendonRule::Proportional => {
                plan.piece_lengths[piece] / plan.rest_lengths[plan.pieces[piece].tendon]
            }
        }
    }

    /// Velocity of the tool point (a frame in that of the tip disk), then angular velocity, world axes, per
    /// metre of displacement, one column per tendon. One pass along the rod.
    #[must_use]
    pub fn jacobian(&self, tool: &Pose) -> Matrix6xX<f64> {
        match self.plan().unknowns() {
            3 => self.jacobian_of::<3>(tool),
            _ => self.jacobian_of::<4>(tool),
        }
    }

    fn jacobian_of<const D: usize>(&self, tool: &Pose) -> Matrix6xX<f64> {
        let plan = self.plan();
        let size = plan.width();
        let point = self.frames[plan.data.len()].transform(&tool.translation);
        let mut local = Local::default();
        let mut by_equation = Matrix6xX::zeros(self.count);
        let mut rows = vec![0.0; 6 * size];
        for (i, data) in plan.data.iter().enumerate() {
            let strains = &self.strains[i * size..(i + 1) * size];
            local.prepare::<D>(plan.settings.subsegment, data, strains);
            let base = &self.frames[i];
            let arm = base.rotation.tr_mul(&(point - base.translation));
            for (e, node) in local.nodes.iter().enumerate() {
                for c in 0..D {
                    let (moved, spin) = node.velocity(c, &arm);
                    let (moved, spin) = (base.rotation * moved, base.rotation * spin);
                    for k in 0..3 {
                        rows[k * size + D * e + c] = moved[k];
                        rows[(k + 3) * size + D * e + c] = spin[k];
                    }
                }
            }
            let factor = &self.factors[i * size * size..(i + 1) * size * size];
            for row in rows.chunks_exact_mut(size) {
                forward(factor, size, row);
            }
            for p in plan.starts[i]..plan.starts[i + 1] {
                if let Some(equation) = self.equations[p] {
                    let image = &self.images[p * size..(p + 1) * size];
                    let mut column = by_equation.column_mut(equation);
                    for (k, row) in rows.chunks_exact(size).enumerate() {
                        column[k] += dot(row, image);
                    }
                }
            }
        }
        self.by_displacement(&by_equation)
    }

    /// Columns by tendon from columns by equation, `H⁻¹ Aᵀ` of each.
    fn by_displacement(&self, by_equation: &Matrix6xX<f64>) -> Matrix6xX<f64> {
        let plan = self.plan();
        let mut bounds = DMatrix::zeros(self.count, self.displacements.len());
        for (p, piece) in plan.pieces.iter().enumerate() {
            if let Some(row) = self.equations[p] {
                bounds[(row, piece.tendon)] = self.bound_slope(p);
            }
        }
        let mut out = Matrix6xX::zeros(self.displacements.len());
        for (first, inverse) in &self.groups {
            let count = inverse.nrows();
            let own = by_equation.columns(*first, count) * inverse;
            out += own * bounds.rows(*first, count);
        }
        out
    }

    /// No change.
    #[must_use]
    pub fn no_change(&self) -> Change {
        let n = self.plan().data.len();
        let holes =
            self.rod.robot.paths().iter().map(|path| vec![Vector3::zeros(); path.end() + 1]);
        Change {
            displacements: vec![0.0; self.displacements.len()],
            rest: vec![Vector3::zeros(); n],
            holes: holes.collect(),
            lengths: vec![0.0; n],
            poisson_ratio: 0.0,
        }
    }

    /// What a change does to the shape, its sizes those of [`Sensitivity::no_change`].
    #[must_use]
    pub fn forward(&self, change: &Change) -> Variation {
        match self.plan().unknowns() {
            3 => self.forward_of::<3>(change),
            _ => self.forward_of::<4>(change),
        }
    }

    fn forward_of<const D: usize>(&self, change: &Change) -> Variation {
        let plan = self.plan();
        let size = plan.width();
        let mut local = Local::default();
        let mut right = vec![0.0; self.strains.len()];
        let mut lengths = DVector::zeros(self.count);
        let rest = self.rest_change::<D>(change);
        let mut whole = vec![0.0; self.displacements.len()];
        for (piece, change) in plan.pieces.iter().zip(&rest) {
            whole[piece.tendon] += change;
        }
        for (i, data) in plan.data.iter().enumerate() {
            let strains = &self.strains[i * size..(i + 1) * size];
            local.prepare::<D>(plan.settings.subsegment, data, strains);
            let share = change.lengths[i] / plan.length(i);
            let own = &mut right[i * size..(i + 1) * size];
            let count = plan.settings.elements as f64;
            for (k, own) in own.iter_mut().enumerate() {
                let c = k % D;
                let bent = data.stiffness[c] * (strains[k] - data.rest[c]);
                *own -= bent * self.stiffness_share(c, share, change.poisson_ratio);
                if c < 3 {
                    *own += data.stiffness[c] * change.rest[i][c] / count;
                }
            }
            for p in plan.starts[i]..plan.starts[i + 1] {
                let piece = &plan.pieces[p];
                let holes = &change.holes[piece.tendon];
                let (from, to) = (holes[i], holes[i + 1]);
                let at = Line::new(&local, piece);
                let end = local.end();
                let turned = end.rotation * to;
                let moved = end.translation * share + turned - from;
                let direction = (moved - at.direction * at.direction.dot(&moved)) / at.length;
                for (e, node) in local.nodes.iter().enumerate() {
                    let lever = at.point - node.end.translation;
                    let shifted = (end.translation - node.end.translation) * share + turned;
                    for c in 0..D {
                        let velocity = node.sweep[c] + node.spin[c].cross(&lever);
                        let change = node.sweep[c] * share + node.spin[c].cross(&shifted);
                        let slope = direction.dot(&velocity) + at.direction.dot(&change);
                        own[D * e + c] -= self.tensions[p] * slope;
                    }
                }
                if let Some(row) = self.equations[p] {
                    lengths[row] -= at.direction.dot(&moved);
                    if plan.settings.tendons == TendonRule::Proportional {
                        lengths[row] += self.bound_change(p, rest[p], whole[piece.tendon], change);
                    } else if i == 0 {
                        let whole = whole[piece.tendon];
                        lengths[row] += self.bound_change(p, whole, whole, change);
                    }
                }
            }
        }
        self.solve(&mut right, &mut lengths);
        self.variation::<D>(right, &lengths, change)
    }

    /// Relative change of a stiffness.
    fn stiffness_share(&self, c: usize, share: f64, poisson_ratio: f64) -> f64 {
        match c {
            2 => -share - poisson_ratio / (1.0 + self.poisson_ratio()),
            3 => share,
            _ => -share,
        }
    }

    fn poisson_ratio(&self) -> f64 {
        self.rod.robot.backbone().spec().poisson_ratio
    }

    /// Change of the bound of an equation, elasticity of the tendon included, for changes of the rest lengths
    /// of its own part and of the whole tendon.
    fn bound_change(&self, p: usize, own: f64, whole: f64, change: &Change) -> f64 {
        let plan = self.plan();
        let k = plan.pieces[p].tendon;
        let give = plan.compliance[k] / plan.rest_lengths[k] * self.tensions[p];
        match plan.settings.tendons {
            TendonRule::Sliding => own * (1.0 + give) + change.displacements[k],
            TendonRule::Proportional => {
                let (length, d) = (plan.rest_lengths[k], self.displacements[k]);
                let ratio = (change.displacements[k] - d * whole / length) / length;
                own * (1.0 + d / length + give) + plan.piece_lengths[p] * ratio
            }
        }
    }

    /// Change of the rest length of every piece.
    fn rest_change<const D: usize>(&self, change: &Change) -> Vec<f64> {
        let plan = self.plan();
        let mut out = Vec::with_capacity(plan.pieces.len());
        let mut local = Local::default();
        for (i, data) in plan.data.iter().enumerate() {
            let rest = data.rest[..D].repeat(plan.settings.elements);
            local.prepare::<D>(plan.settings.subsegment, data, &rest);
            let end = local.end();
            let share = change.lengths[i] / plan.length(i);
            let turn = change.rest[i] / plan.settings.elements as f64;
            for piece in &plan.pieces[plan.starts[i]..plan.starts[i + 1]] {
                let at = Line::new(&local, piece);
                let holes = &change.holes[piece.tendon];
                let mut moved = end.translation * share + end.rotation * holes[i + 1] - holes[i];
                for node in &local.nodes {
                    for c in 0..3 {
                        moved += node.velocity(c, &at.point).0 * turn[c];
                    }
                }
                out.push(at.direction.dot(&moved));
            }
        }
        out
    }

    fn variation<const D: usize>(
        &self,
        strains: Vec<f64>,
        pulls: &DVector<f64>,
        change: &Change,
    ) -> Variation {
        let plan = self.plan();
        let size = plan.width();
        let mut tensions = vec![0.0; self.displacements.len()];
        for p in plan.starts[0]..plan.starts[1] {
            if let Some(row) = self.equations[p] {
                tensions[plan.pieces[p].tendon] = pulls[row] * plan.unit;
            }
        }
        let (mut velocity, mut spin) = (Vector3::zeros(), Vector3::zeros());
        let (mut velocities, mut spins) = (vec![velocity], vec![spin]);
        let mut local = Local::default();
        for (i, data) in plan.data.iter().enumerate() {
            let own = &self.strains[i * size..(i + 1) * size];
            local.prepare::<D>(plan.settings.subsegment, data, own);
            let end = local.end().translation;
            let mut moved = end * (change.lengths[i] / plan.length(i));
            let mut turned = Vector3::zeros();
            for (e, node) in local.nodes.iter().enumerate() {
                for c in 0..D {
                    let (v, s) = node.velocity(c, &end);
                    moved += v * strains[i * size + D * e + c];
                    turned += s * strains[i * size + D * e + c];
                }
            }
            let rotation = &self.frames[i].rotation;
            velocity += spin.cross(&(rotation * end)) + rotation * moved;
            spin += rotation * turned;
            velocities.push(velocity);
            spins.push(spin);
        }
        Variation { strains, tensions, velocities, spins }
    }

    /// Gradient of `Σ positions·(disk centres) + Σ moments·(disk rotations)` by everything, world axes, one
    /// vector per disk.
    #[must_use]
    pub fn adjoint(&self, positions: &[Vector3<f64>], moments: &[Vector3<f64>]) -> Change {
        match self.plan().unknowns() {
            3 => self.adjoint_of::<3>(positions, moments),
            _ => self.adjoint_of::<4>(positions, moments),
        }
    }

    fn adjoint_of<const D: usize>(
        &self,
        positions: &[Vector3<f64>],
        moments: &[Vector3<f64>],
    ) -> Change {
        let plan = self.plan();
        let (size, n) = (plan.width(), plan.data.len());
        let mut out = self.no_change();
        let mut local = Local::default();
        let mut right = vec![0.0; self.strains.len()];
        // Force and moment about the world's origin of all that lies beyond.
        let mut wrench = Vector6::zeros();
        for i in (0..n).rev() {
            let at = self.frames[i + 1].translation;
            let moment = moments[i + 1] + at.cross(&positions[i + 1]);
            wrench += Vector6::new(
                positions[i + 1].x,
                positions[i + 1].y,
                positions[i + 1].z,
                moment.x,
                moment.y,
                moment.z,
            );
            let base = &self.frames[i];
            let force: Vector3<f64> = wrench.fixed_rows::<3>(0).into();
            let about: Vector3<f64> = wrench.fixed_rows::<3>(3).into();
            let (force, about) = (
                base.rotation.tr_mul(&force),
                base.rotation.tr_mul(&(about - base.translation.cross(&force))),
            );
            let own = &self.strains[i * size..(i + 1) * size];
            local.prepare::<D>(plan.settings.subsegment, &plan.data[i], own);
            for (e, node) in local.nodes.iter().enumerate() {
                let about = about - node.end.translation.cross(&force);
                for c in 0..D {
                    right[i * size + D * e + c] =
                        node.sweep[c].dot(&force) + node.spin[c].dot(&about);
                }
            }
            out.lengths[i] += local.end().translation.dot(&force) / plan.length(i);
        }
        let mut lengths = DVector::zeros(self.count);
        self.solve(&mut right, &mut lengths);
        self.contract::<D>(&right, &lengths, &mut out);
        out
    }

    /// Adds `−w·dg − t·d(L − b)` as a gradient by everything.
    fn contract<const D: usize>(&self, w: &[f64], t: &DVector<f64>, out: &mut Change) {
        let plan = self.plan();
        let size = plan.width();
        let mut local = Local::default();
        let mut weights = vec![0.0; plan.pieces.len()];
        let mut whole = vec![0.0; self.displacements.len()];
        for (i, data) in plan.data.iter().enumerate() {
            let strains = &self.strains[i * size..(i + 1) * size];
            let w = &w[i * size..(i + 1) * size];
            local.prepare::<D>(plan.settings.subsegment, data, strains);
            let mut share = 0.0;
            for (k, w) in w.iter().enumerate() {
                let c = k % D;
                let bent = w * data.stiffness[c] * (strains[k] - data.rest[c]);
                share += if c == 3 { -bent } else { bent };
                if c == 2 {
                    out.poisson_ratio += bent / (1.0 + self.poisson_ratio());
                }
                if c < 3 {
                    out.rest[i][c] += w * data.stiffness[c] / plan.settings.elements as f64;
                }
            }
            for p in plan.starts[i]..plan.starts[i + 1] {
                let piece = &plan.pieces[p];
                let pull = self.equations[p].map_or(0.0, |row| t[row]);
                let at = Line::new(&local, piece);
                let by = at.gradient::<D>(&local, w, self.tensions[p], pull);
                out.holes[piece.tendon][i] += by.from;
                out.holes[piece.tendon][i + 1] += by.to;
                share += by.share;
                if self.equations[p].is_some() {
                    self.contract_bound(p, i, pull, &mut weights, &mut whole, out);
                }
            }
            out.lengths[i] += share / plan.length(i);
        }
        for (weight, piece) in weights.iter_mut().zip(&plan.pieces) {
            *weight += whole[piece.tendon];
        }
        self.contract_rest::<D>(&weights, out);
    }

    /// Adds `t·db`: weights of the rest lengths of the pieces, and of the whole tendons.
    fn contract_bound(
        &self,
        p: usize,
        i: usize,
        pull: f64,
        weights: &mut [f64],
        whole: &mut [f64],
        out: &mut Change,
    ) {
        let plan = self.plan();
        let k = plan.pieces[p].tendon;
        let give = plan.compliance[k] / plan.rest_lengths[k] * self.tensions[p];
        match plan.settings.tendons {
            TendonRule::Sliding if i == 0 => {
                whole[k] += pull * (1.0 + give);
                out.displacements[k] += pull;
            }
            TendonRule::Sliding => {}
            TendonRule::Proportional => {
                let (length, d) = (plan.rest_lengths[k], self.displacements[k]);
                weights[p] += pull * (1.0 + d / length + give);
                let share = pull * plan.piece_lengths[p] / length;
                out.displacements[k] += share;
                whole[k] -= share * d / length;
            }
        }
    }

    /// Adds the gradient of weighted rest lengths of the pieces.
    fn contract_rest<const D: usize>(&self, weights: &[f64], out: &mut Change) {
        let plan = self.plan();
        let mut local = Local::default();
        for (i, data) in plan.data.iter().enumerate() {
            let rest = data.rest[..D].repeat(plan.settings.elements);
            local.prepare::<D>(plan.settings.subsegment, data, &rest);
            let end = local.end();
            for p in plan.starts[i]..plan.starts[i + 1] {
                let piece = &plan.pieces[p];
                let at = Line::new(&local, piece);
                let force = at.direction * weights[p];
                out.holes[piece.tendon][i] -= force;
                out.holes[piece.tendon][i + 1] += end.rotation.tr_mul(&force);
                out.lengths[i] += end.translation.dot(&force) / plan.length(i);
                for node in &local.nodes {
                    for c in 0..3 {
                        let velocity = node.velocity(c, &at.point).0;
                        out.rest[i][c] += velocity.dot(&force) / plan.settings.elements as f64;
                    }
                }
            }
        }
    }
}

/// A tendon between two disks.
struct Line {
    point: Vector3<f64>,
    direction: Vector3<f64>,
    length: f64,
}

/// Gradient by the holes and by the relative length of the subsegment.
struct ByPiece {
    from: Vector3<f64>,
    to: Vector3<f64>,
    share: f64,
}

impl Line {
    fn new(local: &Local, piece: &Piece) -> Self {
        let point = local.end().transform(&piece.to);
        let line = point - piece.from;
        let length = line.norm();
        Self { point, direction: line / length, length }
    }

    /// Of `−tension w·d(∂L/∂w) − pull dL`.
    fn gradient<const D: usize>(
        &self,
        local: &Local,
        w: &[f64],
        tension: f64,
        pull: f64,
    ) -> ByPiece {
        let (u, end) = (self.direction, local.end());
        let (mut velocity, mut levers, mut share) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        for (e, node) in local.nodes.iter().enumerate() {
            let (mut swept, mut spun) = (Vector3::zeros(), Vector3::zeros());
            for c in 0..D {
                swept += node.sweep[c] * w[D * e + c];
                spun += node.spin[c] * w[D * e + c];
            }
            velocity += swept + spun.cross(&(self.point - node.end.translation));
            let by_lever = u.cross(&spun) * -tension;
            levers += by_lever;
            share += (end.translation - node.end.translation).dot(&by_lever);
            share -= tension * u.dot(&swept);
        }
        let across = velocity - u * u.dot(&velocity);
        let by_line = across * (-tension / self.length) - u * pull;
        share += end.translation.dot(&by_line);
        ByPiece { from: -by_line, to: end.rotation.tr_mul(&(by_line + levers)), share }
    }
}
