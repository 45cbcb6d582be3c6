//! Linearized rod: what the derivatives of a solved shape need of it, for any tendon law.

use nalgebra::DMatrix;

use crate::lie::Pose;
use crate::rod::model::Scratch;
use crate::rod::plan::Plan;
use crate::rod::tendon_law::Equations;
use crate::solve::pseudo_inverse::PseudoInverse;

/// Lengths within this share of their bounds are at them.
const AT_BOUND: f64 = 1e-9;
/// Leverage of a tendon on the shape that is rounding, squared, as a share of that from holes a piece's length away.
const LEVERLESS: f64 = 1e-24;

/// Solved rod, linearized: factored, and without the robot.
///
/// ```
/// use std::sync::Arc;
/// # use tdcr::model::Model;
/// # use tdcr::rod::{Change, Plan, Rod, RodSettings, Scratch};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// # let plan = Plan::new(&robot, RodSettings::default())?;
/// # let rod = Rod::new(&robot, &plan);
/// # let mut scratch = Scratch::default();
/// let displacements = [-0.005, f64::INFINITY, f64::INFINITY];
/// rod.solve(&displacements, &mut scratch)?;
/// let sensitivity = rod.sensitivity(&displacements, &scratch);
/// let zero = sensitivity.no_change();
/// // Kept without the robot, for as long as its derivatives are wanted.
/// let kept: Arc<tdcr::rod::Linearized> = sensitivity.linearization();
/// let again = rod.sensitivity_at(kept);
/// assert_eq!(again.forward(&zero).tensions, sensitivity.forward(&zero).tensions);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Linearized {
    pub(super) displacements: Vec<f64>,
    pub(super) strains: Vec<f64>,
    pub(super) factors: Vec<f64>,
    pub(super) whitened_rows: Vec<f64>,
    pub(super) frames: Vec<Pose>,
    /// Tension of every piece, in the plan's unit.
    pub(super) tensions: Vec<f64>,
    /// Length equation of every piece, if it is in one.
    pub(super) equations: Vec<Option<usize>>,
    /// Equations that share unknowns: the first one, and the inverse of their Schur complement.
    pub(super) groups: Vec<(usize, DMatrix<f64>)>,
    pub(super) count: usize,
    pub(super) dependent: bool,
}

impl Linearized {
    /// Linearizes the shape that the last solve for `displacements` left in `work`.
    pub(super) fn new(plan: &Plan, displacements: &[f64], work: &Scratch) -> Self {
        let mut at = Self {
            displacements: displacements.to_vec(),
            strains: work.system.strains.clone(),
            factors: Vec::new(),
            whitened_rows: Vec::new(),
            frames: work.state.frames.clone(),
            tensions: Vec::new(),
            equations: Vec::new(),
            groups: Vec::new(),
            count: 0,
            dependent: false,
        };
        match plan.settings.tendons.equations() {
            Equations::PerTendon => at.assemble_whole(plan, work),
            Equations::PerPiece => at.assemble_pieces(plan, work),
        }
        at
    }

    /// Takes factors and rows from a solve with one equation per tendon.
    fn assemble_whole(&mut self, plan: &Plan, work: &Scratch) {
        let system = &work.system;
        self.factors.clone_from(&system.factors);
        self.whitened_rows.clone_from(&system.whitened_rows);
        self.tensions = plan.pieces.iter().map(|p| system.tensions[p.tendon]).collect();
        let tendons = system.bounds.len();
        // Tendons that count: under tension, or at their bounds.
        let active: Vec<usize> = (0..tendons)
            .filter(|k| {
                system.bounds[*k].is_finite()
                    && (system.tensions[*k] > 0.0
                        || system.length_error[*k].abs() <= AT_BOUND * plan.rest_lengths[*k])
            })
            .collect();
        // One that crosses sides has no first derivative at rest: rounding is none.
        let mut leverage = vec![0.0; tendons];
        for (i, data) in plan.data.iter().enumerate() {
            for p in plan.starts[i]..plan.starts[i + 1] {
                let length = plan.piece_lengths[p];
                leverage[plan.pieces[p].tendon] += length * length / data.elasticity.bending();
            }
        }
        let count = active.len();
        let active: Vec<usize> = active
            .into_iter()
            .filter(|k| system.schur[k * (tendons + 1)] > LEVERLESS * leverage[*k])
            .collect();
        self.dependent |= active.len() < count;
        self.equations =
            plan.pieces.iter().map(|p| active.iter().position(|k| *k == p.tendon)).collect();
        // S of these.
        let schur = DMatrix::from_fn(active.len(), active.len(), |a, b| {
            let (a, b) = (active[a.max(b)], active[a.min(b)]);
            system.schur[a * tendons + b]
        });
        self.push_group(&schur);
    }

    /// Adds equations that share unknowns, with their S⁻¹ (its pseudo-inverse where they are dependent).
    fn push_group(&mut self, schur: &DMatrix<f64>) {
        let inverse = PseudoInverse::new(schur);
        self.dependent |= inverse.rank < schur.nrows();
        self.groups.push((self.count, inverse.matrix));
        self.count += schur.nrows();
    }

    /// Takes factors and rows of every subsegment, with one equation per piece.
    fn assemble_pieces(&mut self, plan: &Plan, work: &Scratch) {
        let mut system = work.part.clone();
        // One that is held at the length that it has at rest drives as soon as it is pulled.
        let lengths = work.state.tendon_lengths.iter().zip(&plan.rest_lengths);
        let held: Vec<bool> = lengths
            .zip(&self.displacements)
            .map(|((own, rest), d)| *d == 0.0 && (own - rest).abs() <= AT_BOUND * rest)
            .collect();
        for (i, part) in plan.parts.iter().enumerate() {
            work.load_part(plan, i, &self.displacements, &mut system);
            let range = plan.starts[i]..plan.starts[i + 1];
            for (k, (piece, rest)) in
                plan.pieces[range.clone()].iter().zip(&plan.piece_lengths[range]).enumerate()
            {
                if held[piece.tendon] {
                    (system.bounds[k], system.active[k]) = (*rest, true);
                }
            }
            // Factors and rows at the shape as it is.
            system.added_compliance = 0.0;
            system.assemble(part, f64::INFINITY);
            self.factors.extend_from_slice(&system.factors);
            self.whitened_rows.extend_from_slice(&system.whitened_rows);
            self.tensions.extend_from_slice(&system.tensions);
            let count = system.bounds.len();
            // Equations of the pieces that count, a group of their own.
            let active: Vec<usize> = (0..count).filter(|k| system.active[*k]).collect();
            let first = self.count;
            let equation = |k| active.iter().position(|own| *own == k).map(|a| first + a);
            self.equations.extend((0..count).map(equation));
            let schur = DMatrix::from_fn(active.len(), active.len(), |a, b| {
                system.schur[active[a.max(b)] * count + active[a.min(b)]]
            });
            self.push_group(&schur);
        }
    }
}
