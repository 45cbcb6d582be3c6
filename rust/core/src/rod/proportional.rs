//! Displacements in proportion: every piece of a pulled tendon shrinks by the same ratio.
//!
//! Nothing ties subsegments together then. Each is solved by the same method as a whole rod, with its pieces
//! as tendons whose lengths are equations and whose multipliers may have any sign.

use super::degenerate_rest;
use super::dual_newton::Ending;
use super::model::{Rod, Scratch};
use super::newton_system::{Chain, Left};
use super::plan::Plan;

/// A held tendon stretches when it becomes longer by more than this share of itself.
const STRETCHED: f64 = 1e-10;

impl Rod<'_> {
    /// Solves every subsegment from the strains and tensions at hand; the largest number of evaluations that
    /// one took.
    pub(super) fn solve_pieces(&self, displacements: &[f64], work: &mut Scratch) -> usize {
        let plan = self.plan;
        // FreeRod tendons drive; one that is held joins them only if it would stretch.
        let mut drives: Vec<bool> = displacements.iter().map(|d| *d < 0.0).collect();
        let start = (work.chain.strains.clone(), work.chain.tensions.clone());
        let mut rounds = 0;
        loop {
            rounds += self.solve_driven(displacements, &drives, work);
            let stretched = |k: &usize| {
                let stretch = work.state.tendon_lengths[*k] - plan.rest_lengths[*k];
                displacements[*k] == 0.0 && stretch > STRETCHED * plan.rest_lengths[*k]
            };
            let join: Vec<usize> =
                (0..drives.len()).filter(|k| !drives[*k]).filter(stretched).collect();
            if join.is_empty() || work.ending != Ending::Converged {
                return rounds;
            }
            for k in join {
                drives[k] = true;
            }
            work.chain.strains.clone_from(&start.0);
            work.chain.tensions.clone_from(&start.1);
        }
    }

    fn solve_driven(&self, displacements: &[f64], drives: &[bool], work: &mut Scratch) -> usize {
        let (plan, width) = (self.plan, self.plan.width());
        // The base piece's tension is the first guess of all.
        let tensions = work.chain.tensions.iter().zip(drives);
        let tensions: Vec<f64> =
            tensions.map(|(t, drives)| if *drives { *t } else { 0.0 }).collect();
        work.pulls.clear();
        work.pulls.extend(plan.pieces.iter().map(|piece| tensions[piece.tendon]));
        work.drives.clear();
        work.drives.extend_from_slice(drives);
        work.state.tendon_lengths.clear();
        work.state.tendon_lengths.resize(drives.len(), 0.0);
        work.chain.ends.clear();
        (work.ending, work.left) = (Ending::Converged, Left { stable: true, ..Left::default() });
        let mut part = std::mem::take(&mut work.part);
        let mut most = 0;
        for (i, own) in plan.parts.iter().enumerate() {
            work.load_part(plan, i, displacements, &mut part);
            let mut budget = plan.settings.max_iterations;
            let (ending, left) =
                degenerate_rest::climb(&mut work.ascent, own, &mut part, &mut budget);
            most = most.max(plan.settings.max_iterations - budget);
            if work.ending == Ending::Converged {
                work.ending = ending;
            }
            work.left.moment = work.left.moment.max(left.moment);
            work.left.length = work.left.length.max(left.length);
            work.chain.strains[i * width..(i + 1) * width].copy_from_slice(&part.strains);
            let range = plan.starts[i]..plan.starts[i + 1];
            work.pulls[range.clone()].copy_from_slice(&part.tensions);
            let end = part.ends[0];
            for piece in &plan.pieces[range] {
                let length = (end.transform(&piece.to) - piece.from).norm();
                work.state.tendon_lengths[piece.tendon] += length;
            }
            work.chain.ends.push(end);
        }
        work.part = part;
        work.chain.tensions.fill(0.0);
        for (piece, pull) in plan.pieces[..plan.starts[1]].iter().zip(&work.pulls) {
            work.chain.tensions[piece.tendon] = *pull;
        }
        most
    }
}

impl Scratch {
    /// Puts a subsegment as it is, with its share of the displacements, into a chain of its own.
    pub(super) fn load_part(&self, plan: &Plan, i: usize, displacements: &[f64], part: &mut Chain) {
        let (width, range) = (plan.width(), plan.starts[i]..plan.starts[i + 1]);
        part.strains.clear();
        part.strains.extend_from_slice(&self.chain.strains[i * width..(i + 1) * width]);
        part.tensions.clear();
        part.tensions.extend_from_slice(&self.pulls[range.clone()]);
        part.bounds.clear();
        part.taut.clear();
        for (piece, rest) in plan.pieces[range.clone()].iter().zip(&plan.piece_lengths[range]) {
            let k = piece.tendon;
            let ratio = 1.0 + displacements[k] / plan.rest_lengths[k];
            part.bounds.push(if self.drives[k] { ratio * rest } else { f64::INFINITY });
            part.taut.push(self.drives[k]);
        }
    }
}
