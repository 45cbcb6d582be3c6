//! One subsegment: its energy and the tendons through it, with exact first and second derivatives.
//!
//! Functions are compiled for 3 or 4 unknowns per element (rotation vector, and elongation) and once more
//! for a single element, the usual case, whose loops then unroll.

use nalgebra::{Matrix3, Vector3};

use super::elasticity::Elasticity;
use super::element::Element;
use super::settings::Subsegment;
use crate::lie::Pose;
use crate::solve::dense::{backward, dot, forward};

/// A tendon between two disks: its holes in the frames of the base disk and of the next one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) tendon: usize,
    pub(super) from: Vector3<f64>,
    pub(super) to: Vector3<f64>,
}

/// Length and elasticity of a subsegment's elements, in units of the robot's stiffness.
#[derive(Clone, Copy, Debug)]
pub(super) struct Data {
    /// Rest length of an element \[m\].
    pub(super) length: f64,
    /// Elasticity of an element.
    pub(super) elasticity: Elasticity,
}

/// Values and derivatives at a point, in slices of the caller's arrays.
#[derive(Debug)]
pub(super) struct Derivatives<'a> {
    /// Gradient of the energy and the tensions' work by the strains.
    pub(super) gradient: &'a mut [f64],
    /// Hessian, lower triangle, row by row; blocks above the diagonal are written too.
    pub(super) hessian: &'a mut [f64],
    /// Gradient of every piece's length, one row per piece.
    pub(super) rows: &'a mut [f64],
    /// Length of every piece \[m\].
    pub(super) lengths: &'a mut [f64],
}

/// One element of the subsegment, in the axes of the base disk, and what the tendons do to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) element: Element,
    pub(super) base: Pose,
    pub(super) end: Pose,
    /// Angular velocity of its end, and velocity of its end, by its unknowns.
    pub(super) spin: [Vector3<f64>; 4],
    pub(super) sweep: [Vector3<f64>; 4],
    /// Velocity of the hole of the piece added last, by its unknowns.
    pub(super) moved: [Vector3<f64>; 4],
    /// Sums over tendons of force, moment and dyad for its own curvature, in its own axes.
    force: Vector3<f64>,
    moment: Vector3<f64>,
    dyad: Matrix3<f64>,
    /// Couple that turning a nearer element adds.
    couple: [Vector3<f64>; 4],
}

const NONE: [Vector3<f64>; 4] = [Vector3::new(0.0, 0.0, 0.0); 4];

impl Node {
    #[inline(always)]
    fn at<const D: usize>(kind: Subsegment, length: f64, strain: &[f64], base: Pose) -> Self {
        let elongation = if D == 4 { strain[3] } else { 0.0 };
        let turn = Vector3::new(strain[0], strain[1], strain[2]);
        let element = Element::new(kind, length, turn, elongation);
        Self {
            element,
            base,
            end: base.compose(&element.end),
            spin: NONE,
            sweep: NONE,
            moved: NONE,
            force: Vector3::zeros(),
            moment: Vector3::zeros(),
            dyad: Matrix3::zeros(),
            couple: NONE,
        }
    }

    /// Velocity of a point beyond it (base disk's axes), and angular velocity, by one of its unknowns.
    #[inline(always)]
    pub(super) fn velocity(&self, c: usize, point: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let lever = point - self.end.translation;
        (self.sweep[c] + self.spin[c].cross(&lever), self.spin[c])
    }

    #[inline(always)]
    fn set_velocities<const D: usize>(&mut self, first: bool) {
        let (spin, sweep) = if first {
            (self.element.spin, self.element.sweep)
        } else {
            (self.base.rotation * self.element.spin, self.base.rotation * self.element.sweep)
        };
        for c in 0..3 {
            self.spin[c] = spin.column(c).into();
            self.sweep[c] = sweep.column(c).into();
        }
        if D == 4 {
            self.sweep[3] = self.base.rotation * self.element.stretch();
        }
    }
}

/// Buffers of a subsegment.
#[derive(Clone, Debug, Default)]
pub(super) struct Local {
    pub(super) nodes: Vec<Node>,
    step: Vec<f64>,
    trial: Vec<f64>,
}

/// No strain moves further in one step \[rad\].
const STEP: f64 = 0.5;
/// Halvings of a step, and the share of the predicted decrease that it must deliver.
const BACKTRACKS: usize = 10;
const ARMIJO: f64 = 1e-4;
/// Share of a value that its rounding may be.
pub(super) const ROUNDING: f64 = 1e-14;

impl Local {
    /// Places the elements.
    #[inline(always)]
    pub(super) fn place<const D: usize>(&mut self, kind: Subsegment, data: &Data, strains: &[f64]) {
        self.nodes.clear();
        let mut base = Pose::identity();
        for strain in strains.chunks_exact(D) {
            let node = Node::at::<D>(kind, data.length, strain, base);
            base = node.end;
            self.nodes.push(node);
        }
    }

    /// Places the elements and their velocities.
    pub(super) fn prepare<const D: usize>(
        &mut self,
        kind: Subsegment,
        data: &Data,
        strains: &[f64],
    ) {
        self.place::<D>(kind, data, strains);
        for (e, node) in self.nodes.iter_mut().enumerate() {
            node.set_velocities::<D>(e == 0);
        }
    }

    /// Frame of the next disk.
    #[inline(always)]
    pub(super) fn end(&self) -> Pose {
        self.nodes.last().map_or_else(Pose::identity, |node| node.end)
    }

    /// Derivatives at the strains placed last, for tensions by tendon; pieces of tendons that are not `active`
    /// are left out.
    #[inline(always)]
    pub(super) fn differentiate<const D: usize, const ONE: bool>(
        &mut self,
        data: &Data,
        pieces: &[Piece],
        strains: &[f64],
        tensions: &[f64],
        active: &[bool],
        out: &mut Derivatives<'_>,
    ) {
        let count = if ONE { 1 } else { self.nodes.len() };
        let size = D * count;
        for (e, node) in self.nodes.iter_mut().enumerate() {
            node.set_velocities::<D>(e == 0);
        }
        // Energy: K (w − w_rest) and K.
        out.hessian.fill(0.0);
        for e in 0..count {
            let elasticity = &data.elasticity;
            elasticity.differentiate::<D>(strains, D * e, size, out.gradient, out.hessian);
        }
        // Work of the tensions: T ∂L/∂x, and T ∂²L/∂x² but for the curvature of the paths of the holes.
        let mut any_tension = false;
        for (p, piece) in pieces.iter().enumerate() {
            if !active[piece.tendon] {
                continue;
            }
            let row = &mut out.rows[p * size..(p + 1) * size];
            let tension = tensions[piece.tendon];
            // A tendon without tension has a row, but does no work.
            out.lengths[p] = self.add_piece::<D, ONE>(piece, tension, row, out.hessian);
            if tension != 0.0 {
                any_tension = true;
                for (gradient, a) in out.gradient.iter_mut().zip(row.iter()) {
                    *gradient += tension * a;
                }
            }
        }
        // That curvature, for all tendons at once.
        if any_tension {
            self.add_curvature::<D, ONE>(out.hessian);
        }
    }

    /// Adds one piece: the derivatives of its length into `row`, the turn of its direction to the Hessian, and its
    /// force to the sums for the curvature of the path of its hole. Returns its length.
    #[inline(always)]
    fn add_piece<const D: usize, const ONE: bool>(
        &mut self,
        piece: &Piece,
        tension: f64,
        row: &mut [f64],
        hessian: &mut [f64],
    ) -> f64 {
        let count = if ONE { 1 } else { self.nodes.len() };
        let size = D * count;
        // Direction u of the piece, which pulls the hole back along it.
        let point = self.end().transform(&piece.to);
        let line = point - piece.from;
        let length = line.norm();
        let u = line / length;
        let force = u * tension;
        let weight = tension / length;
        for e in 0..count {
            let node = &mut self.nodes[e];
            let lever = point - node.end.translation;
            // ∂L/∂x = u·∂p/∂x.
            let turned = lever.cross(&u);
            for c in 0..3 {
                row[D * e + c] = node.sweep[c].dot(&u) + node.spin[c].dot(&turned);
            }
            if D == 4 {
                row[D * e + 3] = node.sweep[3].dot(&u);
            }
            if tension != 0.0 {
                // Sums of u, x × u and u xᵀ in the element's own axes.
                let own = if e == 0 { force } else { node.base.rotation.tr_mul(&force) };
                let x = if ONE { piece.to } else { node.end.rotation.tr_mul(&lever) };
                node.force += own;
                node.moment += x.cross(&own);
                node.dyad += own * x.transpose();
                // ∂p/∂x, the velocity of the hole.
                for c in 0..3 {
                    node.moved[c] = node.sweep[c] + node.spin[c].cross(&lever);
                }
                if D == 4 {
                    node.moved[3] = node.sweep[3];
                }
                // ω_b × ∂p/∂a of the elements nearer to the base.
                if e > 0 {
                    for c in 0..D {
                        node.couple[c] += node.moved[c].cross(&force);
                    }
                }
            }
        }
        // T/L (∂p/∂a·∂p/∂b − ∂L/∂a ∂L/∂b): the turn of the direction.
        if tension != 0.0 {
            for e in 0..count {
                for f in 0..=e {
                    for a in 0..D {
                        let (i, along) = (D * e + a, row[D * e + a]);
                        let most = if e == f { a + 1 } else { D };
                        for b in 0..most {
                            let j = D * f + b;
                            let product = self.nodes[e].moved[a].dot(&self.nodes[f].moved[b]);
                            hessian[i * size + j] += weight * (product - along * row[j]);
                        }
                    }
                }
            }
        }
        length
    }

    #[inline(always)]
    fn add_curvature<const D: usize, const ONE: bool>(&self, hessian: &mut [f64]) {
        let count = if ONE { 1 } else { self.nodes.len() };
        let size = D * count;
        for e in 0..count {
            let node = &self.nodes[e];
            let block = node.element.curvature(&node.force, &node.moment, &node.dyad);
            for a in 0..3 {
                for b in 0..=a {
                    hessian[(D * e + a) * size + D * e + b] += block[(a, b)];
                }
            }
            if D == 4 {
                let mixed = node.element.stretch_slope(&node.force);
                for b in 0..3 {
                    hessian[(D * e + 3) * size + D * e + b] += mixed[b];
                }
            }
            for f in 0..e {
                // A nearer element turns all that this one moves.
                for a in 0..D {
                    for b in 0..3 {
                        hessian[(D * e + a) * size + D * f + b] +=
                            node.couple[a].dot(&self.nodes[f].spin[b]);
                    }
                }
            }
        }
    }

    /// The energy and the tensions' work at the strains placed last.
    pub(super) fn value<const D: usize>(
        &self,
        data: &Data,
        pieces: &[Piece],
        strains: &[f64],
        tensions: &[f64],
    ) -> f64 {
        let mut energy = 0.0;
        for strain in strains.chunks_exact(D) {
            data.elasticity.add_energy(strain, &mut energy);
        }
        let end = self.end();
        let work = pieces
            .iter()
            .filter(|piece| tensions[piece.tendon] != 0.0)
            .map(|p| tensions[p.tendon] * (end.transform(&p.to) - p.from).norm());
        energy + work.sum::<f64>()
    }

    /// Moves by a share of the Newton step of factored derivatives that lowers energy and work (Armijo's rule), and
    /// returns the largest change of a strain; nothing when no share does.
    pub(super) fn relax<const D: usize>(
        &mut self,
        kind: Subsegment,
        data: &Data,
        pieces: &[Piece],
        strains: &mut [f64],
        tensions: &[f64],
        at: &Derivatives<'_>,
    ) -> Option<f64> {
        let size = strains.len();
        let (mut step, mut trial) =
            (std::mem::take(&mut self.step), std::mem::take(&mut self.trial));
        // −H⁻¹ g.
        step.clear();
        step.extend(at.gradient.iter().map(|g| -g));
        forward(at.hessian, size, &mut step);
        backward(at.hessian, size, &mut step);
        let before = self.value::<D>(data, pieces, strains, tensions);
        let slope = dot(at.gradient, &step);
        let longest = step.iter().fold(0.0_f64, |most, s| most.max(s.abs()));
        // Backtracking.
        let mut share = if longest > STEP { STEP / longest } else { 1.0 };
        let mut moved = None;
        for _ in 0..BACKTRACKS {
            trial.clear();
            trial.extend(strains.iter().zip(&step).map(|(strain, s)| strain + share * s));
            self.place::<D>(kind, data, &trial);
            let after = self.value::<D>(data, pieces, &trial, tensions);
            if after <= before + ARMIJO * share * slope + ROUNDING * before {
                strains.copy_from_slice(&trial);
                moved = Some(share * longest);
                break;
            }
            share *= 0.5;
        }
        (self.step, self.trial) = (step, trial);
        moved
    }
}
