//! Starting tensions of a search.

use nalgebra::{Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{RodInverse, WIDEST};
use crate::inverse::Target;
use crate::inverse::constant_curvature::{self, arc_to};
use crate::solve::bounded_program::BoundedProgram;

/// Every other random start is no wider than this.
const USUAL: f64 = 1.5;
/// Share of the trace that makes first guesses unique.
const RIDGE: f64 = 1e-6;

impl RodInverse<'_> {
    /// The k-th start: what tensions come nearest to the arcs of constant curvature, or to a single arc to the
    /// target; hardly pulled; and random ones, each from its own stream.
    pub(super) fn start_point(
        &self,
        target: &Target,
        k: usize,
        guess: Option<&mut constant_curvature::Scratch<'_>>,
        bends: &mut Vec<Vector2<f64>>,
        point: &mut Vec<f64>,
    ) {
        match (&self.arcs, guess) {
            (Some(arcs), Some(guess)) if k.is_multiple_of(2) => {
                arcs.guess_bends(target, k / 2, guess, bends);
                self.tensions_for_bends(bends, point);
            }
            _ if k == 0 => {
                self.single_arc(target, bends);
                self.tensions_for_bends(bends, point);
            }
            _ => self.random(k, point),
        }
    }

    /// Tensions that bend the rod most nearly so, by its stiffness at rest.
    pub(super) fn tensions_for_bends(&self, bends: &[Vector2<f64>], point: &mut Vec<f64>) {
        let turns: Vec<_> = bends.iter().map(|b| Vector3::new(-b.y, b.x, 0.0)).collect();
        let mut right = Vec::new();
        let mut matrix = self.rest.shorten(&turns, &mut right).to_vec();
        let count = right.len();
        let trace: f64 = (0..count).map(|k| matrix[k * (count + 1)]).sum();
        (0..count).for_each(|k| matrix[k * (count + 1)] += RIDGE * trace);
        let mut program = BoundedProgram::default();
        // What it leaves when it does not end is a start too.
        let _ = program.solve(&matrix, &right, &vec![0.0; count], |_| false);
        point.clear();
        point.extend(program.step.iter().zip(&self.units).map(|(tension, unit)| tension / unit));
    }

    /// The circle that leaves the base along z and brings the tool to the target.
    pub(super) fn single_arc(&self, target: &Target, bends: &mut Vec<Vector2<f64>>) {
        let (base, tool) = (self.robot.base().inverse(), self.robot.tool());
        let backbone = self.robot.backbone();
        let length = backbone.total_length();
        let (bend, _) = match target {
            Target::Pose(pose) => {
                let tip = pose.compose(&tool.inverse()).translation;
                arc_to(&base.transform(&tip), &Vector3::zeros(), length)
            }
            Target::Position(position) => {
                arc_to(&base.transform(position), &tool.translation, length)
            }
        };
        bends.clear();
        bends.extend(backbone.lengths().iter().map(|own| bend * (own / length)));
    }

    pub(super) fn random(&self, k: usize, point: &mut Vec<f64>) {
        let mut draws = ChaCha8Rng::seed_from_u64(self.settings.seed);
        draws.set_stream(k as u64);
        let share = if k.is_multiple_of(4) { 1.0 } else { USUAL / WIDEST };
        point.clear();
        for (lower, upper) in self.space.lower.iter().zip(&self.space.upper) {
            let pulls = draws.random::<bool>();
            let more = draws.random::<f64>() * share * (upper - lower);
            point.push(if pulls { lower + more } else { *lower });
        }
    }
}
