//! One subsegment: its energy and the tendons through it, with exact first and second derivatives.

use nalgebra::{Matrix3, Vector3};

use super::element::Element;
use super::settings::Subsegment;
use crate::lie::{Pose, so3};

/// A tendon between two disks: its holes in the frames of the base disk and of the next one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) tendon: usize,
    pub(super) from: Vector3<f64>,
    pub(super) to: Vector3<f64>,
}

/// What a subsegment is, in units of the robot's stiffness.
#[derive(Clone, Copy, Debug)]
pub(super) struct Data {
    /// Rest length of an element \[m\].
    pub(super) length: f64,
    /// Bending and torsional stiffness of an element over its length.
    pub(super) stiffness: Vector3<f64>,
    /// Rest strain of an element \[rad\].
    pub(super) rest: Vector3<f64>,
}

/// Values and derivatives at a point, in slices of the caller's arrays.
#[derive(Debug)]
pub(super) struct Derivatives<'a> {
    /// Of the energy and the tensions' work, by the strains.
    pub(super) gradient: &'a mut [f64],
    /// Lower triangle, row by row; blocks above the diagonal are written too.
    pub(super) hessian: &'a mut [f64],
    /// Of every piece's length, one row per piece.
    pub(super) rows: &'a mut [f64],
    /// Length of every piece \[m\].
    pub(super) lengths: &'a mut [f64],
}

/// Buffers of a subsegment.
#[derive(Clone, Debug, Default)]
pub(super) struct Local {
    elements: Vec<Element>,
    /// Frames of the elements' bases and of the last one's end, in the base disk's.
    frames: Vec<Pose>,
    /// Angular velocity of each element's end by its strain, base disk's axes.
    spins: Vec<Matrix3<f64>>,
    sweeps: Vec<Matrix3<f64>>,
    /// Per element: sums over tendons of force, moment and dyad for its own curvature, and of the couple
    /// that turning a nearer element adds.
    forces: Vec<Vector3<f64>>,
    moments: Vec<Vector3<f64>>,
    dyads: Vec<Matrix3<f64>>,
    couples: Vec<Matrix3<f64>>,
    levers: Vec<Matrix3<f64>>,
}

impl Local {
    /// Places the elements.
    pub(super) fn place(&mut self, kind: Subsegment, data: &Data, strains: &[f64]) {
        self.elements.clear();
        self.frames.clear();
        let mut frame = Pose::identity();
        self.frames.push(frame);
        for strain in strains.chunks_exact(3) {
            let strain = Vector3::from_column_slice(strain);
            let element = Element::new(kind, data.length, strain);
            frame = frame.compose(&element.end);
            self.frames.push(frame);
            self.elements.push(element);
        }
    }

    /// Frame of the next disk.
    pub(super) fn end(&self) -> &Pose {
        &self.frames[self.frames.len() - 1]
    }

    /// Derivatives at the strains placed last, for tensions by tendon.
    pub(super) fn differentiate(
        &mut self,
        data: &Data,
        pieces: &[Piece],
        strains: &[f64],
        tensions: &[f64],
        out: &mut Derivatives<'_>,
    ) {
        let size = strains.len();
        self.begin();
        out.hessian.fill(0.0);
        for (k, (strain, gradient)) in strains.iter().zip(out.gradient.iter_mut()).enumerate() {
            *gradient = data.stiffness[k % 3] * (strain - data.rest[k % 3]);
            out.hessian[k * (size + 1)] = data.stiffness[k % 3];
        }
        for (p, piece) in pieces.iter().enumerate() {
            let row = &mut out.rows[p * size..(p + 1) * size];
            let tension = tensions[piece.tendon];
            out.lengths[p] = self.pull(piece, tension, row, out.hessian);
            if tension > 0.0 {
                for (gradient, a) in out.gradient.iter_mut().zip(row.iter()) {
                    *gradient += tension * a;
                }
            }
        }
        self.add_curvature(out.hessian);
    }

    fn begin(&mut self) {
        let count = self.elements.len();
        self.spins.clear();
        self.sweeps.clear();
        for (element, frame) in self.elements.iter().zip(&self.frames) {
            self.spins.push(frame.rotation * element.spin);
            self.sweeps.push(frame.rotation * element.sweep);
        }
        self.forces.clear();
        self.forces.resize(count, Vector3::zeros());
        self.moments.clear();
        self.moments.resize(count, Vector3::zeros());
        self.dyads.clear();
        self.dyads.resize(count, Matrix3::zeros());
        self.couples.clear();
        self.couples.resize(count, Matrix3::zeros());
    }

    /// One tendon: the derivatives of its length into `row`, what its direction adds to the Hessian, and the
    /// sums for the curvature of the path of its hole. Returns its length.
    fn pull(&mut self, piece: &Piece, tension: f64, row: &mut [f64], hessian: &mut [f64]) -> f64 {
        let size = row.len();
        let point = self.end().transform(&piece.to);
        let line = point - piece.from;
        let length = line.norm();
        let u = line / length;
        self.levers.clear();
        for e in 0..self.elements.len() {
            let lever = point - self.frames[e + 1].translation;
            let moved = self.sweeps[e] - so3::hat(&lever) * self.spins[e];
            row[3 * e..3 * e + 3].copy_from_slice((moved.transpose() * u).as_slice());
            if tension > 0.0 {
                let pull = self.frames[e].rotation.transpose() * (u * tension);
                let x = self.frames[e + 1].rotation.transpose() * lever;
                self.forces[e] += pull;
                self.moments[e] += x.cross(&pull);
                self.dyads[e] += pull * x.transpose();
                if e > 0 {
                    for a in 0..3 {
                        let couple = moved.column(a).cross(&u) * tension;
                        let mut place = self.couples[e].column_mut(a);
                        place += couple;
                    }
                }
                self.levers.push(moved);
            }
        }
        if tension > 0.0 {
            let weight = tension / length;
            for (e, moved) in self.levers.iter().enumerate() {
                for (f, other) in self.levers[..=e].iter().enumerate() {
                    let block = moved.tr_mul(other);
                    for a in 0..3 {
                        let (i, along) = (3 * e + a, row[3 * e + a]);
                        for b in 0..3 {
                            let j = 3 * f + b;
                            hessian[i * size + j] += weight * (block[(a, b)] - along * row[j]);
                        }
                    }
                }
            }
        }
        length
    }

    fn add_curvature(&self, hessian: &mut [f64]) {
        let size = 3 * self.elements.len();
        for (e, element) in self.elements.iter().enumerate() {
            let block = element.curvature(&self.forces[e], &self.moments[e], &self.dyads[e]);
            for a in 0..3 {
                for b in 0..3 {
                    hessian[(3 * e + a) * size + 3 * e + b] += block[(a, b)];
                }
            }
            for (f, spin) in self.spins[..e].iter().enumerate() {
                // A nearer element turns all that this one moves.
                let block = self.couples[e].tr_mul(spin);
                for a in 0..3 {
                    for b in 0..3 {
                        hessian[(3 * e + a) * size + 3 * f + b] += block[(a, b)];
                    }
                }
            }
        }
    }
}
