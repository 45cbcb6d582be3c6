//! Displacements in proportion: every piece of a pulled tendon shrinks by the same ratio.
//!
//! Nothing ties subsegments together then. Each is solved by the same method as a whole rod, with its pieces
//! as tendons whose lengths are equations and whose multipliers may have any sign.

use super::ascent::Ending;
use super::chain::Left;
use super::model::{Rod, Workspace};

/// A held tendon stretches when it becomes longer by more than this share of itself.
const STRETCHED: f64 = 1e-10;

impl Rod<'_> {
    /// Solves every subsegment from the strains and tensions at hand; the largest number of evaluations that
    /// one took.
    pub(super) fn solve_pieces(&self, displacements: &[f64], work: &mut Workspace) -> usize {
        let plan = self.plan;
        // Pulled tendons drive; one that is held joins them only if it would stretch.
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

    fn solve_driven(&self, displacements: &[f64], drives: &[bool], work: &mut Workspace) -> usize {
        let (plan, width) = (self.plan, self.plan.width());
        let Workspace { chain, part, ascent, state, .. } = work;
        chain.ends.clear();
        state.tendon_lengths.clear();
        state.tendon_lengths.resize(drives.len(), 0.0);
        let start = chain.tensions.clone();
        chain.tensions.fill(0.0);
        (work.ending, work.left) = (Ending::Converged, Left { stable: true, ..Left::default() });
        let mut most = 0;
        for (i, own) in plan.parts.iter().enumerate() {
            let pieces = &plan.pieces[plan.starts[i]..plan.starts[i + 1]];
            part.strains.clear();
            part.strains.extend_from_slice(&chain.strains[i * width..(i + 1) * width]);
            part.tensions.clear();
            part.bounds.clear();
            part.taut.clear();
            for (piece, rest) in pieces.iter().zip(&own.rest_lengths) {
                let k = piece.tendon;
                let ratio = 1.0 + displacements[k] / plan.rest_lengths[k];
                part.tensions.push(if drives[k] { start[k] } else { 0.0 });
                part.bounds.push(if drives[k] { ratio * rest } else { f64::INFINITY });
                part.taut.push(drives[k]);
            }
            let mut budget = plan.settings.max_iterations;
            let (ending, left) = ascent.climb(own, part, &mut budget);
            most = most.max(plan.settings.max_iterations - budget);
            if work.ending == Ending::Converged {
                work.ending = ending;
            }
            work.left.moment = work.left.moment.max(left.moment);
            work.left.length = work.left.length.max(left.length);
            chain.strains[i * width..(i + 1) * width].copy_from_slice(&part.strains);
            for (j, piece) in pieces.iter().enumerate() {
                let end = &part.ends[0];
                let length = (end.transform(&piece.to) - piece.from).norm();
                state.tendon_lengths[piece.tendon] += length;
                if i == 0 {
                    chain.tensions[piece.tendon] = part.tensions[j];
                }
            }
            chain.ends.push(part.ends[0]);
        }
        most
    }
}
