//! One subsegment between chosen holes: its shape under given tensions, and how tensions change it.
//!
//! Given the tensions, the equilibrium of a subsegment depends on nothing beyond its own two disks, so that a search
//! over holes solves each of their pairs once.

use nalgebra::{Matrix6xX, Vector3, Vector6};

use super::degenerate_rest::bend_to_one_side;
use super::dual_newton::Ending;
use super::load_stepping::{Limits, LoadStepping, solve_near};
use super::newton_system::NewtonSystem;
use super::plan::Plan;
use crate::lie::Pose;
use crate::solve::dense::{backward, dot};

/// Newton steps per load step, and the shortest load step.
const NEWTON_STEPS: usize = 20;
const SHORTEST: f64 = 1e-2;

/// A subsegment whose tendons' holes may be moved, and the shape that it was solved for last.
#[derive(Clone, Debug)]
pub(crate) struct OneSubsegment {
    part: Plan,
    /// The robot's tendons that run through it.
    tendons: Vec<usize>,
    system: NewtonSystem,
    load_stepping: LoadStepping,
    /// Equilibria that were asked for.
    pub(crate) solved: usize,
}

impl OneSubsegment {
    /// Subsegment `i` of a plan, its tendons through the robot's own holes.
    pub(crate) fn new(plan: &Plan, i: usize) -> Self {
        let pieces = &plan.pieces[plan.starts[i]..plan.starts[i + 1]];
        let tendons: Vec<usize> = pieces.iter().map(|piece| piece.tendon).collect();
        let mut system = NewtonSystem::default();
        system.bounds = vec![f64::INFINITY; tendons.len()];
        system.active = vec![true; tendons.len()];
        Self {
            part: plan.part(i),
            tendons,
            system,
            load_stepping: LoadStepping::default(),
            solved: 0,
        }
    }

    /// The robot's tendons that run through it.
    pub(crate) fn tendons(&self) -> &[usize] {
        &self.tendons
    }

    /// Compares with another subsegment: true if it bends in the same way between the same holes.
    pub(crate) fn bends_like(&self, other: &Self) -> bool {
        let (own, its) = (&self.part.data[0], &other.part.data[0]);
        (own.length, own.elasticity) == (its.length, its.elasticity)
            && self.tendons == other.tendons
    }

    /// Sets the holes of the tendons that run through it, each robot's tendon's from the base disk's frame to
    /// the next one's.
    pub(crate) fn route(&mut self, hole: impl Fn(usize) -> (Vector3<f64>, Vector3<f64>)) {
        for (piece, tendon) in self.part.pieces.iter_mut().zip(&self.tendons) {
            (piece.from, piece.to) = hole(*tendon);
        }
    }

    /// Strains of the last solve.
    pub(crate) fn strains(&self) -> &[f64] {
        &self.system.strains
    }

    /// Solves for the minimum under the robot's tensions (in the plan's unit): from strains near it, or along growing
    /// tensions from rest. False where there is none.
    pub(crate) fn solve(&mut self, tensions: &[f64], near: &[f64]) -> bool {
        self.solved += 1;
        self.system.reset(&self.part);
        if near.len() == self.system.strains.len() {
            self.system.strains.copy_from_slice(near);
            self.set_tensions(tensions);
            if self.solve_near() {
                return true;
            }
            self.system.reset(&self.part);
        }
        let (limits, mut budget) = (self.limits(), usize::MAX);
        let Self { part, tendons, system, load_stepping, .. } = self;
        let target = tendons.iter().map(|tendon| tensions[*tendon]);
        let (ending, _) = load_stepping.solve(part, system, target, 1.0, &limits, &mut budget);
        ending == Ending::Converged || {
            // A tendon that crosses sides may go either way.
            self.system.reset(&self.part);
            self.set_tensions(tensions);
            bend_to_one_side(&self.part, &mut self.system) && self.solve_near()
        }
    }

    fn set_tensions(&mut self, tensions: &[f64]) {
        for (own, tendon) in self.system.tensions.iter_mut().zip(&self.tendons) {
            *own = tensions[*tendon];
        }
    }

    fn limits(&self) -> Limits {
        let tolerance = self.part.settings.tolerance;
        Limits { newton_steps: NEWTON_STEPS, tolerance, shortest_load_step: SHORTEST }
    }

    fn solve_near(&mut self) -> bool {
        let (limits, mut budget) = (self.limits(), usize::MAX);
        solve_near(&self.part, &mut self.system, &limits, &mut budget).0
    }

    /// Frame of the next disk in the base disk's.
    pub(crate) fn end(&self) -> Pose {
        self.system.local.end()
    }

    /// Velocity and angular velocity of that frame by each of its tendons' tensions, base disk's axes, one
    /// column per tendon that runs through.
    pub(crate) fn rates(&self) -> Matrix6xX<f64> {
        let (size, width) = (self.part.width(), self.part.unknowns());
        let end = self.end().translation;
        let mut rates = Matrix6xX::zeros(self.tendons.len());
        for (row, mut rate) in
            self.system.whitened_rows.chunks_exact(size).zip(rates.column_iter_mut())
        {
            // −H⁻¹ Aᵀ, then the velocities that it causes.
            let mut rate_of_strains = row.to_vec();
            backward(&self.system.factors, size, &mut rate_of_strains);
            for (e, node) in self.system.local.nodes.iter().enumerate() {
                for c in 0..width {
                    let (velocity, spin) = node.velocity(c, &end);
                    let by = -rate_of_strains[width * e + c];
                    rate +=
                        Vector6::new(velocity.x, velocity.y, velocity.z, spin.x, spin.y, spin.z)
                            * by;
                }
            }
        }
        rates
    }

    /// Displacements of the robot's tendons from this subsegment, elasticity apart \[m\], and their derivatives by the
    /// tensions, row by row: zeros for those of its `count` tendons that end before.
    pub(crate) fn displacements(&mut self, count: usize) -> (Vec<f64>, Vec<f64>) {
        let (mut displacements, mut slopes) = (vec![0.0; count], vec![0.0; count * count]);
        let size = self.part.width();
        let end = self.end();
        let at_rest = self.part.lengths_at_rest();
        for (s, (piece, rest)) in self.part.pieces.iter().zip(at_rest).enumerate() {
            let k = self.tendons[s];
            // Elasticity is in proportion to the length at rest.
            let compliance = rest * self.part.compliance[s] / self.part.rest_lengths[s];
            let length = (end.transform(&piece.to) - piece.from).norm();
            displacements[k] = length - rest - compliance * self.system.tensions[s];
            slopes[k * count + k] = -compliance;
            let row = &self.system.whitened_rows[s * size..(s + 1) * size];
            for (other, l) in self.system.whitened_rows.chunks_exact(size).zip(&self.tendons) {
                slopes[k * count + l] -= dot(row, other);
            }
        }
        (displacements, slopes)
    }
}
