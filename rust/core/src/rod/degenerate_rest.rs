//! Degenerate rest: a start where a tendon has no leverage to first order.
//!
//! A tendon that crosses from one side of the backbone to the other between two disks has no leverage there: its
//! length has no first derivative at rest, and Newton's method no direction. It shortens to second order,
//! `L ≈ L₀ + ½ λ s²` along a direction n of negative curvature λ, either way: two mirror images with the
//! same energy. Where rest leads nowhere, such subsegments start on one side.

use nalgebra::{DMatrix, SymmetricEigen};

use super::dual_newton::{DualNewton, Ending};
use super::newton_system::{NewtonSystem, Residual};
use super::plan::Plan;
use super::subsegment::{Derivatives, Local, Piece};
use crate::solve::dense::dot;

/// A piece whose length changes by less than this share of itself per radian has no leverage.
const NO_LEVER: f64 = 1e-4;
/// Directions whose curvatures differ by less than this share of them are one plane: the minima are a ring then,
/// and no start leads to one of them.
const RING: f64 = 1e-6;
/// No strain starts further from rest \[rad\].
const FURTHEST: f64 = 1.4;
/// Largest strain of a start for given tensions \[rad\].
const ASIDE: f64 = 0.5;

/// Buffers of one subsegment with one piece.
struct Scratch {
    local: Local,
    gradient: Vec<f64>,
    hessian: Vec<f64>,
    row: Vec<f64>,
    length: [f64; 1],
}

impl Scratch {
    fn new(size: usize) -> Self {
        Self {
            local: Local::default(),
            gradient: vec![0.0; size],
            hessian: vec![0.0; size * size],
            row: vec![0.0; size],
            length: [0.0],
        }
    }

    /// Derivatives of the energy and of the piece under a unit of tension.
    fn differentiate(&mut self, plan: &Plan, i: usize, piece: Piece, strains: &[f64]) {
        let piece = [Piece { tendon: 0, ..piece }];
        let mut out = Derivatives {
            gradient: &mut self.gradient,
            hessian: &mut self.hessian,
            rows: &mut self.row,
            lengths: &mut self.length,
        };
        let (data, kind) = (&plan.data[i], plan.settings.subsegment);
        if plan.unknowns() == 3 {
            self.local.place::<3>(kind, data, strains);
            self.local.differentiate::<3, false>(data, &piece, strains, &[1.0], &[true], &mut out);
        } else {
            self.local.place::<4>(kind, data, strains);
            self.local.differentiate::<4, false>(data, &piece, strains, &[1.0], &[true], &mut out);
        }
    }
}

/// A piece without leverage at rest, and the direction in which its subsegment bends to shorten it.
struct NoLeverage {
    subsegment: usize,
    piece: Piece,
    /// Direction of the most negative curvature, of energy ½, and that curvature \[m\].
    direction: Vec<f64>,
    curvature: f64,
}

/// Solves to the bounds as [`DualNewton::solve`] does; where that path ends, once more from bent subsegments, if rest
/// has any in which a pulled tendon has no leverage.
pub(super) fn solve(
    dual_newton: &mut DualNewton,
    plan: &Plan,
    system: &mut NewtonSystem,
    budget: &mut usize,
) -> (Ending, Residual) {
    let outcome = dual_newton.solve(plan, system, budget);
    if outcome.0 == Ending::Lost && bend_pulled(plan, system) {
        return dual_newton.solve(plan, system, budget);
    }
    outcome
}

/// Resets a system, but for subsegments in which a pulled tendon has no leverage: they are bent as far as its pull
/// asks, and its tension is guessed. Does nothing without such subsegments.
#[cold]
fn bend_pulled(plan: &Plan, system: &mut NewtonSystem) -> bool {
    let pull = |k: usize| system.bounds[k] - plan.rest_lengths[k];
    let pulled: Vec<usize> = (0..system.bounds.len()).filter(|k| pull(*k) < 0.0).collect();
    let mut scratch = Scratch::new(plan.width());
    let found = pulled.iter().map(|k| (*k, pull(*k), find(plan, *k, &mut scratch)));
    let found: Vec<_> = found.filter(|(_, _, pieces)| !pieces.is_empty()).collect();
    if found.is_empty() {
        return false;
    }
    system.reset(plan);
    for (k, pull, pieces) in found {
        // s² = 2 (b − L_rest) λ_i / Σ λ_j²: where it gives way most, most of it happens.
        let squares: f64 = pieces.iter().map(|own| own.curvature.powi(2)).sum();
        let (mut work, mut lever) = (0.0, 0.0);
        for own in &pieces {
            bend(plan, own, (2.0 * pull * own.curvature / squares).sqrt(), system);
            let size = plan.width();
            let strains = &system.strains[own.subsegment * size..(own.subsegment + 1) * size];
            scratch.differentiate(plan, own.subsegment, own.piece, strains);
            for (k, a) in scratch.row.iter().enumerate() {
                let (elasticity, c) = (&plan.data[own.subsegment].elasticity, k % plan.unknowns());
                work -= elasticity.strain_under(c, a * (scratch.gradient[k] - a));
                lever += elasticity.strain_under(c, a * a);
            }
        }
        // The multiplier that leaves the least moment, in the metric of K.
        system.tensions[k] = if lever > 0.0 { (work / lever).max(0.0) } else { 0.0 };
    }
    true
}

/// Bends a system at rest to one side where a tendon has no leverage; false if that is nowhere.
pub(super) fn bend_to_one_side(plan: &Plan, system: &mut NewtonSystem) -> bool {
    let mut scratch = Scratch::new(plan.width());
    let pieces: Vec<NoLeverage> =
        (0..system.bounds.len()).flat_map(|k| find(plan, k, &mut scratch)).collect();
    for own in &pieces {
        let longest = own.direction.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        bend(plan, own, ASIDE / longest, system);
    }
    !pieces.is_empty()
}

/// Pieces of a tendon without leverage at rest that bending or turning shortens all the same.
fn find(plan: &Plan, tendon: usize, scratch: &mut Scratch) -> Vec<NoLeverage> {
    let width = plan.unknowns();
    let mut found = Vec::new();
    for (i, data) in plan.data.iter().enumerate() {
        let rest = data.elasticity.rest()[..width].repeat(plan.settings.elements);
        let pieces = &plan.pieces[plan.starts[i]..plan.starts[i + 1]];
        for piece in pieces.iter().filter(|piece| piece.tendon == tendon) {
            scratch.differentiate(plan, i, *piece, &rest);
            // All elements bent alike; what an S-shape does to it is no way to go far.
            let lever = |c: usize| scratch.row.iter().skip(c).step_by(width).sum::<f64>();
            if (0..3).all(|c| lever(c).abs() <= NO_LEVER * scratch.length[0]) {
                found.extend(scratch.steepest(plan, i, *piece));
            }
        }
    }
    found
}

impl Scratch {
    /// Direction n of the most negative curvature λ of the length differentiated last, in the metric of K, of those
    /// that do not change it to first order.
    fn steepest(&self, plan: &Plan, i: usize, piece: Piece) -> Option<NoLeverage> {
        let size = plan.width();
        let (elasticity, unknowns) = (&plan.data[i].elasticity, plan.unknowns());
        let stiffness = |c: usize| elasticity.stiffness(c % unknowns);
        // K^(-1/2) ∂²L/∂x² K^(-1/2): the derivatives at rest under a unit of tension without those of the energy.
        let matrix = DMatrix::from_fn(size, size, |a, b| {
            let (a, b) = (a.max(b), a.min(b));
            let same = a / unknowns == b / unknowns;
            let own = if same { elasticity.rest_hessian(a % unknowns, b % unknowns) } else { 0.0 };
            (self.hessian[a * size + b] - own) / (stiffness(a) * stiffness(b)).sqrt()
        });
        let eigen = SymmetricEigen::new(matrix);
        let mut found: Vec<(f64, Vec<f64>)> = Vec::new();
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            let components = vector.iter().enumerate();
            let direction = orient(components.map(|(c, v)| v / stiffness(c).sqrt()));
            let longest = direction.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
            let slope = dot(&self.row, &direction) / longest;
            if *value < 0.0 && slope.abs() <= NO_LEVER * self.length[0] {
                found.push((*value, direction));
            }
        }
        // No direction is singled out where the two most negative ones are alike.
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let is_ring = |least: f64| found.get(1).is_some_and(|next| next.0 <= least * (1.0 - RING));
        if is_ring(found.first()?.0) {
            return None;
        }
        let (curvature, direction) = found.swap_remove(0);
        Some(NoLeverage { subsegment: i, piece, direction, curvature })
    }
}

/// Direction with its largest component positive: of two mirror images always the same one.
fn orient(direction: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut direction: Vec<f64> = direction.collect();
    let largest = direction
        .iter()
        .copied()
        .fold(0.0_f64, |most, v| if v.abs() > most.abs() * (1.0 + NO_LEVER) { v } else { most });
    if largest < 0.0 {
        for v in &mut direction {
            *v = -*v;
        }
    }
    direction
}

/// Moves a subsegment along its direction.
fn bend(plan: &Plan, own: &NoLeverage, distance: f64, system: &mut NewtonSystem) {
    let size = plan.width();
    let strains = &mut system.strains[own.subsegment * size..(own.subsegment + 1) * size];
    let longest = own.direction.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    for (strain, v) in strains.iter_mut().zip(&own.direction) {
        *strain += distance.min(FURTHEST / longest) * v;
    }
}
