//! Proportional displacements: every piece of a pulled tendon shrinks by the same ratio.
//!
//! Nothing ties subsegments together then. Each is solved by the same method as a whole rod, with its pieces
//! as tendons whose lengths are equations and whose multipliers may have any sign.

use super::degenerate_rest;
use super::dual_newton::Ending;
use super::model::{Rod, Scratch};
use super::newton_system::{NewtonSystem, Residual};
use super::plan::Plan;

/// A held tendon stretches when it becomes longer by more than this share of itself.
const STRETCH: f64 = 1e-10;

impl Rod<'_> {
    /// Solves every subsegment from the strains and tensions at hand; returns the largest number of evaluations of
    /// one.
    pub(super) fn solve_pieces(&self, displacements: &[f64], work: &mut Scratch) -> usize {
        let plan = self.plan;
        // Pulled tendons drive; one that is held joins them only if it would stretch.
        let mut drives: Vec<bool> = displacements.iter().map(|d| *d < 0.0).collect();
        let start = (work.system.strains.clone(), work.system.tensions.clone());
        let mut evaluations = 0;
        loop {
            evaluations += self.solve_driven(displacements, &drives, work);
            let stretched = |k: &usize| {
                let stretch = work.state.tendon_lengths[*k] - plan.rest_lengths[*k];
                displacements[*k] == 0.0 && stretch > STRETCH * plan.rest_lengths[*k]
            };
            let join: Vec<usize> =
                (0..drives.len()).filter(|k| !drives[*k]).filter(stretched).collect();
            if join.is_empty() || work.ending != Ending::Converged {
                return evaluations;
            }
            for k in join {
                drives[k] = true;
            }
            work.system.strains.clone_from(&start.0);
            work.system.tensions.clone_from(&start.1);
        }
    }

    /// Solves every subsegment with the pieces of the tendons that drive.
    fn solve_driven(&self, displacements: &[f64], drives: &[bool], work: &mut Scratch) -> usize {
        let (plan, width) = (self.plan, self.plan.width());
        // The base piece's tension is the first guess of all.
        let tensions = work.system.tensions.iter().zip(drives);
        let tensions: Vec<f64> =
            tensions.map(|(t, drives)| if *drives { *t } else { 0.0 }).collect();
        work.piece_tensions.clear();
        work.piece_tensions.extend(plan.pieces.iter().map(|piece| tensions[piece.tendon]));
        work.drives.clear();
        work.drives.extend_from_slice(drives);
        work.state.tendon_lengths.clear();
        work.state.tendon_lengths.resize(drives.len(), 0.0);
        work.system.ends.clear();
        work.ending = Ending::Converged;
        work.residual = Residual { stable: true, ..Residual::default() };
        // Each subsegment alone, in a system of its own.
        let mut part = std::mem::take(&mut work.part);
        let mut most = 0;
        for (i, own) in plan.parts.iter().enumerate() {
            work.load_part(plan, i, displacements, &mut part);
            let mut budget = plan.settings.max_iterations;
            let (ending, residual) =
                degenerate_rest::solve(&mut work.dual_newton, own, &mut part, &mut budget);
            most = most.max(plan.settings.max_iterations - budget);
            if work.ending == Ending::Converged {
                work.ending = ending;
            }
            work.residual.moment = work.residual.moment.max(residual.moment);
            work.residual.length = work.residual.length.max(residual.length);
            // Its strains, tensions and frame, and its share of the lengths.
            work.system.strains[i * width..(i + 1) * width].copy_from_slice(&part.strains);
            let range = plan.starts[i]..plan.starts[i + 1];
            work.piece_tensions[range.clone()].copy_from_slice(&part.tensions);
            let end = part.ends[0];
            for piece in &plan.pieces[range] {
                let length = (end.transform(&piece.to) - piece.from).norm();
                work.state.tendon_lengths[piece.tendon] += length;
            }
            work.system.ends.push(end);
        }
        // The tension of a tendon is that of its base piece.
        work.part = part;
        work.system.tensions.fill(0.0);
        for (piece, tension) in plan.pieces[..plan.starts[1]].iter().zip(&work.piece_tensions) {
            work.system.tensions[piece.tendon] = *tension;
        }
        most
    }
}

impl Scratch {
    /// Copies a subsegment as it is, with its share of the displacements, into a system of its own.
    pub(super) fn load_part(
        &self,
        plan: &Plan,
        i: usize,
        displacements: &[f64],
        part: &mut NewtonSystem,
    ) {
        let (width, range) = (plan.width(), plan.starts[i]..plan.starts[i + 1]);
        part.strains.clear();
        part.strains.extend_from_slice(&self.system.strains[i * width..(i + 1) * width]);
        part.tensions.clear();
        part.tensions.extend_from_slice(&self.piece_tensions[range.clone()]);
        part.bounds.clear();
        part.active.clear();
        for (piece, rest) in plan.pieces[range.clone()].iter().zip(&plan.piece_lengths[range]) {
            let k = piece.tendon;
            let law = plan.settings.tendons;
            let bound = law.bound(*rest, plan.rest_lengths[k], displacements[k]);
            part.bounds.push(if self.drives[k] { bound } else { f64::INFINITY });
            part.active.push(self.drives[k]);
        }
    }
}
