//! Exact derivatives of a solved rod by everything it was made of, by implicit differentiation.
//!
//! At a solution `H dw + Aᵀ dT = −dg` and `A dw − C dT = −d(L − b)`, where dg and d(L − b) are what a change of the
//! parameters does at fixed strains and tensions. The matrix is the one of the last Newton step, factored
//! already, and symmetric, so the adjoint is the same solve.

mod adjoint;
mod variation;

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix6xX, Vector3};

use super::model::{Rod, Scratch};
use super::plan::Plan;
use super::subsegment::{Local, Piece};
use super::tendon_law::{Equations, PieceBound};
use super::tip_rates::{Solved, Sweep};
use crate::lie::Pose;
use crate::solve::dense::{backward, dot, forward};
use crate::solve::pseudo_inverse::PseudoInverse;

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
    /// Relative change of each tendon's stiffness EA; nothing where tendons do not stretch.
    pub stiffness: Vec<f64>,
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
/// What a tendon can do to the shape, as a share of what it could from holes a piece's length away, squared,
/// when it is rounding.
const LEVERLESS: f64 = 1e-24;

/// A solved rod as its derivatives need it: factored, and without the robot.
#[derive(Clone, Debug)]
pub struct Linearized {
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

/// The derivatives of one solved shape.
#[derive(Clone, Debug)]
pub struct Sensitivity<'r> {
    rod: Rod<'r>,
    at: Arc<Linearized>,
}

impl<'r> Rod<'r> {
    /// Derivatives at the shape that the last solve for `displacements` left in `work`.
    ///
    /// Tendons under tension or exactly at their bounds count as taut; a bound that rest just meets is so
    /// followed on its pulled side. Where taut tendons depend on each other, displacements cannot change one
    /// by one: the derivatives are then those of the nearest change that the rod can follow.
    #[must_use]
    pub fn sensitivity(&self, displacements: &[f64], work: &Scratch) -> Sensitivity<'r> {
        let mut at = Linearized {
            displacements: displacements.to_vec(),
            strains: work.chain.strains.clone(),
            factors: Vec::new(),
            images: Vec::new(),
            frames: work.state.frames.clone(),
            tensions: Vec::new(),
            equations: Vec::new(),
            groups: Vec::new(),
            count: 0,
            dependent: false,
        };
        match self.plan.settings.tendons.equations() {
            Equations::PerTendon => at.assemble_whole(self.plan, work),
            Equations::PerPiece => at.assemble_pieces(self.plan, work),
        }
        self.sensitivity_at(Arc::new(at))
    }

    /// Derivatives at a shape that was linearized before, for this robot and plan.
    #[must_use]
    pub fn sensitivity_at(&self, at: Arc<Linearized>) -> Sensitivity<'r> {
        Sensitivity { rod: self.clone(), at }
    }
}

impl Linearized {
    fn assemble_whole(&mut self, plan: &Plan, work: &Scratch) {
        let chain = &work.chain;
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
        // One that crosses sides has no first derivative at rest: rounding is none.
        let mut most = vec![0.0; tendons];
        for (i, data) in plan.data.iter().enumerate() {
            for p in plan.starts[i]..plan.starts[i + 1] {
                let length = plan.piece_lengths[p];
                most[plan.pieces[p].tendon] += length * length / data.elasticity.bending();
            }
        }
        let count = taut.len();
        let taut: Vec<usize> = taut
            .into_iter()
            .filter(|k| chain.schur[k * (tendons + 1)] > LEVERLESS * most[*k])
            .collect();
        self.dependent |= taut.len() < count;
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

    fn assemble_pieces(&mut self, plan: &Plan, work: &Scratch) {
        let mut chain = work.part.clone();
        // One that is held at the length that it has at rest drives as soon as it is pulled.
        let lengths = work.state.tendon_lengths.iter().zip(&plan.rest_lengths);
        let held: Vec<bool> = lengths
            .zip(&self.displacements)
            .map(|((own, rest), d)| *d == 0.0 && (own - rest).abs() <= AT_BOUND * rest)
            .collect();
        for (i, part) in plan.parts.iter().enumerate() {
            work.load_part(plan, i, &self.displacements, &mut chain);
            let range = plan.starts[i]..plan.starts[i + 1];
            for (k, (piece, rest)) in
                plan.pieces[range.clone()].iter().zip(&plan.piece_lengths[range]).enumerate()
            {
                if held[piece.tendon] {
                    (chain.bounds[k], chain.taut[k]) = (*rest, true);
                }
            }
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
}

impl Sensitivity<'_> {
    /// Whether taut tendons depend on each other.
    #[must_use]
    pub fn dependent(&self) -> bool {
        self.at.dependent
    }

    /// What it was made of, to be kept without the robot.
    #[must_use]
    pub fn linearized(&self) -> Arc<Linearized> {
        Arc::clone(&self.at)
    }

    fn poisson_ratio(&self) -> f64 {
        self.rod.robot.backbone().spec().poisson_ratio
    }

    fn plan(&self) -> &Plan {
        self.rod.plan
    }

    /// Solves `H w + Aᵀ t = right`, `A w − C t = lengths`: `right` becomes w, `lengths` becomes t.
    fn solve(&self, right: &mut [f64], lengths: &mut DVector<f64>) {
        let plan = self.plan();
        let size = plan.width();
        lengths.neg_mut();
        for (i, own) in right.chunks_exact_mut(size).enumerate() {
            forward(&self.at.factors[i * size * size..(i + 1) * size * size], size, own);
            for p in plan.starts[i]..plan.starts[i + 1] {
                if let Some(row) = self.at.equations[p] {
                    lengths[row] += dot(&self.at.images[p * size..(p + 1) * size], own);
                }
            }
        }
        for (first, inverse) in &self.at.groups {
            let solved = inverse * lengths.rows(*first, inverse.nrows());
            lengths.rows_mut(*first, inverse.nrows()).copy_from(&solved);
        }
        for (i, own) in right.chunks_exact_mut(size).enumerate() {
            for p in plan.starts[i]..plan.starts[i + 1] {
                if let Some(row) = self.at.equations[p] {
                    let image = &self.at.images[p * size..(p + 1) * size];
                    for (w, y) in own.iter_mut().zip(image) {
                        *w -= lengths[row] * y;
                    }
                }
            }
            backward(&self.at.factors[i * size * size..(i + 1) * size * size], size, own);
        }
    }

    /// Numbers of the bound of a piece's equation.
    fn piece_bound(&self, p: usize) -> PieceBound {
        let plan = self.plan();
        let k = plan.pieces[p].tendon;
        let tendon = plan.rest_lengths[k];
        PieceBound {
            first: p < plan.starts[1],
            piece: plan.piece_lengths[p],
            tendon,
            displacement: self.at.displacements[k],
            strain: plan.compliance[k] / tendon * self.at.tensions[p],
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
        let point = self.at.frames[plan.data.len()].transform(&tool.translation);
        let mut by_equation = Matrix6xX::zeros(self.at.count);
        let at = Solved {
            strains: &self.at.strains,
            factors: &self.at.factors,
            frames: &self.at.frames,
        };
        Sweep::default().run::<D>(plan, &at, &point, |i, rows| {
            for p in plan.starts[i]..plan.starts[i + 1] {
                if let Some(equation) = self.at.equations[p] {
                    let image = &self.at.images[p * size..(p + 1) * size];
                    let mut column = by_equation.column_mut(equation);
                    for (k, row) in rows.chunks_exact(size).enumerate() {
                        column[k] += dot(row, image);
                    }
                }
            }
        });
        self.by_displacement(&by_equation)
    }

    /// Columns by tendon from columns by equation, `H⁻¹ Aᵀ` of each.
    fn by_displacement(&self, by_equation: &Matrix6xX<f64>) -> Matrix6xX<f64> {
        let plan = self.plan();
        let mut bounds = DMatrix::zeros(self.at.count, self.at.displacements.len());
        for (p, piece) in plan.pieces.iter().enumerate() {
            if let Some(row) = self.at.equations[p] {
                let (own, tendon) = (plan.piece_lengths[p], plan.rest_lengths[piece.tendon]);
                bounds[(row, piece.tendon)] = plan.settings.tendons.bound_slope(own, tendon);
            }
        }
        let mut out = Matrix6xX::zeros(self.at.displacements.len());
        for (first, inverse) in &self.at.groups {
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
            displacements: vec![0.0; self.at.displacements.len()],
            rest: vec![Vector3::zeros(); n],
            holes: holes.collect(),
            lengths: vec![0.0; n],
            poisson_ratio: 0.0,
            stiffness: vec![0.0; self.at.displacements.len()],
        }
    }
}

/// A tendon between two disks.
struct Line {
    point: Vector3<f64>,
    direction: Vector3<f64>,
    length: f64,
}

impl Line {
    fn new(local: &Local, piece: &Piece) -> Self {
        let point = local.end().transform(&piece.to);
        let line = point - piece.from;
        let length = line.norm();
        Self { point, direction: line / length, length }
    }
}
