//! Out of a rest where pulling does nothing to first order.
//!
//! A tendon that crosses from one side of the backbone to the other between two disks has no leverage there: its
//! length has no first derivative at rest, and Newton's method no direction. It shortens to second order,
//! `L ≈ L₀ + ½ λ s²` along a direction of negative curvature λ, either way: two mirror images with the
//! same energy. Where rest leads nowhere, such subsegments start on one side.

use nalgebra::{DMatrix, SymmetricEigen};

use super::dual_newton::{DualNewton, Ending};
use super::newton_system::{Chain, Left};
use super::plan::Plan;
use super::subsegment::{Derivatives, Local, Piece};
use crate::solve::dense::dot;

/// A piece whose length changes by less than this share of itself per radian has no leverage.
const BLIND: f64 = 1e-4;
/// Directions whose curvatures differ by less than this share of them are one plane: the minima are a ring then,
/// and no start leads to one of them.
const RING: f64 = 1e-6;
/// No strain starts further from rest \[rad\].
const FURTHEST: f64 = 1.4;
/// Where one starts that knows no displacement \[rad\].
const ASIDE: f64 = 0.5;

/// Buffers of one subsegment with one piece.
struct Bench {
    local: Local,
    gradient: Vec<f64>,
    hessian: Vec<f64>,
    row: Vec<f64>,
    length: [f64; 1],
}

impl Bench {
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

/// A piece without leverage at rest: how far its subsegment goes to shorten it.
struct Blind {
    subsegment: usize,
    piece: Piece,
    /// Direction of the most negative curvature, of energy ½, and that curvature \[m\].
    direction: Vec<f64>,
    curvature: f64,
}

/// Goes to the bounds as [`DualNewton::climb`] does; where that way ends, once more from bent subsegments, if rest
/// has any in which a pulled tendon has no leverage.
pub(super) fn climb(
    ascent: &mut DualNewton,
    plan: &Plan,
    chain: &mut Chain,
    budget: &mut usize,
) -> (Ending, Left) {
    let outcome = ascent.climb(plan, chain, budget);
    if outcome.0 == Ending::Lost && nudge(plan, chain) {
        return ascent.climb(plan, chain, budget);
    }
    outcome
}

/// Puts a chain to rest, but for subsegments in which a pulled tendon has no leverage: they are bent as far as
/// its pull asks, and its tension is guessed. Without such subsegments nothing is done.
#[cold]
fn nudge(plan: &Plan, chain: &mut Chain) -> bool {
    let pull = |k: usize| chain.bounds[k] - plan.rest_lengths[k];
    let pulled: Vec<usize> = (0..chain.bounds.len()).filter(|k| pull(*k) < 0.0).collect();
    let mut bench = Bench::new(plan.width());
    let found = pulled.iter().map(|k| (*k, pull(*k), find(plan, *k, &mut bench)));
    let found: Vec<_> = found.filter(|(_, _, blind)| !blind.is_empty()).collect();
    if found.is_empty() {
        return false;
    }
    chain.rest(plan);
    for (k, pull, blind) in found {
        // Where it gives way most, most of it happens.
        let whole: f64 = blind.iter().map(|own| own.curvature.powi(2)).sum();
        let (mut work, mut lever) = (0.0, 0.0);
        for own in &blind {
            bend(plan, own, (2.0 * pull * own.curvature / whole).sqrt(), chain);
            let size = plan.width();
            let strains = &chain.strains[own.subsegment * size..(own.subsegment + 1) * size];
            bench.differentiate(plan, own.subsegment, own.piece, strains);
            for (k, a) in bench.row.iter().enumerate() {
                let (elasticity, c) = (&plan.data[own.subsegment].elasticity, k % plan.unknowns());
                work -= elasticity.strain_under(c, a * (bench.gradient[k] - a));
                lever += elasticity.strain_under(c, a * a);
            }
        }
        // The multiplier that leaves the least moment.
        chain.tensions[k] = if lever > 0.0 { (work / lever).max(0.0) } else { 0.0 };
    }
    true
}

/// Bends a chain at rest to one side where a tendon has no leverage; false if that is nowhere.
pub(super) fn aside(plan: &Plan, chain: &mut Chain) -> bool {
    let mut bench = Bench::new(plan.width());
    let blind: Vec<Blind> =
        (0..chain.bounds.len()).flat_map(|k| find(plan, k, &mut bench)).collect();
    for own in &blind {
        let longest = own.direction.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        bend(plan, own, ASIDE / longest, chain);
    }
    !blind.is_empty()
}

/// Pieces of a tendon without leverage at rest that bending or turning shortens all the same.
fn find(plan: &Plan, tendon: usize, bench: &mut Bench) -> Vec<Blind> {
    let width = plan.unknowns();
    let mut found = Vec::new();
    for (i, data) in plan.data.iter().enumerate() {
        let rest = data.elasticity.rest()[..width].repeat(plan.settings.elements);
        let pieces = &plan.pieces[plan.starts[i]..plan.starts[i + 1]];
        for piece in pieces.iter().filter(|piece| piece.tendon == tendon) {
            bench.differentiate(plan, i, *piece, &rest);
            // All elements bent alike; what an S-shape does to it is no way to go far.
            let lever = |c: usize| bench.row.iter().skip(c).step_by(width).sum::<f64>();
            if (0..3).all(|c| lever(c).abs() <= BLIND * bench.length[0]) {
                found.extend(bench.blind(plan, i, *piece));
            }
        }
    }
    found
}

impl Bench {
    /// The direction of the most negative curvature of the length looked at last, of those that do not change
    /// it to first order.
    fn blind(&self, plan: &Plan, i: usize, piece: Piece) -> Option<Blind> {
        let size = plan.width();
        let (elasticity, unknowns) = (&plan.data[i].elasticity, plan.unknowns());
        let stiffness = |c: usize| elasticity.stiffness(c % unknowns);
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
            let direction = oriented(components.map(|(c, v)| v / stiffness(c).sqrt()));
            let longest = direction.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
            let slope = dot(&self.row, &direction) / longest;
            if *value < 0.0 && slope.abs() <= BLIND * self.length[0] {
                found.push((*value, direction));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let ring = |least: f64| found.get(1).is_some_and(|next| next.0 <= least * (1.0 - RING));
        if ring(found.first()?.0) {
            return None;
        }
        let (curvature, direction) = found.swap_remove(0);
        Some(Blind { subsegment: i, piece, direction, curvature })
    }
}

/// With its largest component positive: of two mirror images always the same one.
fn oriented(direction: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut direction: Vec<f64> = direction.collect();
    let largest = direction
        .iter()
        .copied()
        .fold(0.0_f64, |most, v| if v.abs() > most.abs() * (1.0 + BLIND) { v } else { most });
    if largest < 0.0 {
        for v in &mut direction {
            *v = -*v;
        }
    }
    direction
}

/// Moves a subsegment along its direction.
fn bend(plan: &Plan, own: &Blind, far: f64, chain: &mut Chain) {
    let size = plan.width();
    let strains = &mut chain.strains[own.subsegment * size..(own.subsegment + 1) * size];
    let longest = own.direction.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    for (strain, v) in strains.iter_mut().zip(&own.direction) {
        *strain += far.min(FURTHEST / longest) * v;
    }
}
