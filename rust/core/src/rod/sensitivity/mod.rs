//! Exact derivatives of a solved rod by everything it was made of, by implicit differentiation.
//!
//! At a solution `H dw + Aᵀ dT = −dg` and `A dw − C dT = −d(L − b)`, where dg and d(L − b) are what a change of the
//! parameters does at fixed strains and tensions. The matrix is the one of the last Newton step, factored
//! already, and symmetric, so the adjoint is the same solve.

mod adjoint;
mod linearized;
mod variation;

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix6xX, Vector3};

use super::model::{Rod, Scratch};
use super::plan::Plan;
use super::subsegment::{Local, Piece};
use super::tendon_law::PieceBound;
use super::tip_rates::{SolvedRod, TipRates};
use crate::lie::Pose;
use crate::solve::dense::{backward, dot, forward};

pub use linearized::Linearized;

/// Change q of what a rod is made of, or a gradient by it.
///
/// ```
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
/// // No change of anything moves nothing.
/// assert_eq!(sensitivity.forward(&zero).velocities[10].norm(), 0.0);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Change of each displacement \[m\].
    pub displacements: Vec<f64>,
    /// Change of each subsegment's rest rotation vector \[rad\].
    pub rest: Vec<Vector3<f64>>,
    /// Change of each tendon's holes, disk 0 to its end, in the disks' frames \[m\].
    pub holes: Vec<Vec<Vector3<f64>>>,
    /// Change of each subsegment's length, its stiffness per length unchanged \[m\].
    pub lengths: Vec<f64>,
    /// Change of Poisson's ratio.
    pub poisson_ratio: f64,
    /// Relative change of each tendon's stiffness EA; nothing where tendons do not stretch.
    pub stiffness: Vec<f64>,
}

/// Variation of the shape by a change.
///
/// ```
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
/// let change = Change { displacements: vec![1.0, 0.0, 0.0], ..zero };
/// let variation = sensitivity.forward(&change);
/// assert_eq!((variation.strains.len(), variation.spins.len()), (3 * 10, 11));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Variation {
    /// Rate of every element's strain: rotation vector, and elongation where there is one.
    pub strains: Vec<f64>,
    /// Rate of each tension, in the unit of the results; of the base piece where displacements are proportional.
    pub tensions: Vec<f64>,
    /// Velocity of each disk's centre, world axes \[m\].
    pub velocities: Vec<Vector3<f64>>,
    /// Angular velocity of each disk, world axes \[rad\].
    pub spins: Vec<Vector3<f64>>,
}

/// Derivatives of one solved shape.
///
/// ```
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
/// // Tip velocity per metre of each displacement.
/// let change = Change { displacements: vec![1.0, 0.0, 0.0], ..zero };
/// let variation = sensitivity.forward(&change);
/// assert!(variation.velocities[10].x < 0.0);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Sensitivity<'r> {
    rod: Rod<'r>,
    at: Arc<Linearized>,
}

impl<'r> Rod<'r> {
    /// Derivatives at the shape that the last solve for `displacements` left in `work`.
    ///
    /// Tendons under tension or exactly at their bounds count as active; a bound that rest just meets is so
    /// followed on its pulled side. Where active tendons depend on each other, displacements cannot change one
    /// by one: the derivatives are then those of the nearest change that the rod can follow.
    #[must_use]
    pub fn sensitivity(&self, displacements: &[f64], work: &Scratch) -> Sensitivity<'r> {
        self.sensitivity_at(Arc::new(Linearized::new(self.plan, displacements, work)))
    }

    /// Derivatives at a shape that was linearized before, for this robot and plan.
    #[must_use]
    pub fn sensitivity_at(&self, at: Arc<Linearized>) -> Sensitivity<'r> {
        Sensitivity { rod: self.clone(), at }
    }
}

impl Sensitivity<'_> {
    /// Dependence of active tendons on each other.
    #[must_use]
    pub fn dependent(&self) -> bool {
        self.at.dependent
    }

    /// Linearized rod, to be kept without the robot.
    #[must_use]
    pub fn linearization(&self) -> Arc<Linearized> {
        Arc::clone(&self.at)
    }

    fn poisson_ratio(&self) -> f64 {
        self.rod.robot.backbone().spec().poisson_ratio
    }

    fn plan(&self) -> &Plan {
        self.rod.plan
    }

    /// Solves `H w + Aᵀ t = right`, `A w − C t = lengths`: `right` becomes w, `lengths` becomes t.
    fn solve(&self, right: &mut [f64], lengths: &mut DVector<f64>) {
        let plan = self.plan();
        let size = plan.width();
        // A H⁻¹ right − lengths.
        lengths.neg_mut();
        for (i, own) in right.chunks_exact_mut(size).enumerate() {
            forward(&self.at.factors[i * size * size..(i + 1) * size * size], size, own);
            for p in plan.starts[i]..plan.starts[i + 1] {
                if let Some(row) = self.at.equations[p] {
                    lengths[row] += dot(&self.at.whitened_rows[p * size..(p + 1) * size], own);
                }
            }
        }
        // t = S⁻¹ of that.
        for (first, inverse) in &self.at.groups {
            let solved = inverse * lengths.rows(*first, inverse.nrows());
            lengths.rows_mut(*first, inverse.nrows()).copy_from(&solved);
        }
        // w = H⁻¹ (right − Aᵀ t).
        for (i, own) in right.chunks_exact_mut(size).enumerate() {
            for p in plan.starts[i]..plan.starts[i + 1] {
                if let Some(row) = self.at.equations[p] {
                    let whitened = &self.at.whitened_rows[p * size..(p + 1) * size];
                    for (w, a) in own.iter_mut().zip(whitened) {
                        *w -= lengths[row] * a;
                    }
                }
            }
            backward(&self.at.factors[i * size * size..(i + 1) * size * size], size, own);
        }
    }

    /// Numbers of the bound of a piece's equation.
    fn piece_bound(&self, p: usize) -> PieceBound {
        let plan = self.plan();
        let k = plan.pieces[p].tendon;
        let tendon = plan.rest_lengths[k];
        PieceBound {
            first: p < plan.starts[1],
            piece: plan.piece_lengths[p],
            tendon,
            displacement: self.at.displacements[k],
            strain: plan.compliance[k] / tendon * self.at.tensions[p],
        }
    }

    /// Velocity of the tool point (a frame in that of the tip disk), then angular velocity, world axes, per
    /// metre of displacement, one column per tendon. One pass along the rod.
    #[must_use]
    pub fn jacobian(&self, tool: &Pose) -> Matrix6xX<f64> {
        match self.plan().unknowns() {
            3 => self.jacobian_of::<3>(tool),
            _ => self.jacobian_of::<4>(tool),
        }
    }

    fn jacobian_of<const D: usize>(&self, tool: &Pose) -> Matrix6xX<f64> {
        let plan = self.plan();
        let size = plan.width();
        let point = self.at.frames[plan.data.len()].transform(&tool.translation);
        let mut by_equation = Matrix6xX::zeros(self.at.count);
        let at = SolvedRod {
            strains: &self.at.strains,
            factors: &self.at.factors,
            frames: &self.at.frames,
        };
        TipRates::default().for_each_subsegment::<D>(plan, &at, &point, |i, rows| {
            for p in plan.starts[i]..plan.starts[i + 1] {
                if let Some(equation) = self.at.equations[p] {
                    let whitened = &self.at.whitened_rows[p * size..(p + 1) * size];
                    let mut column = by_equation.column_mut(equation);
                    for (k, row) in rows.chunks_exact(size).enumerate() {
                        column[k] += dot(row, whitened);
                    }
                }
            }
        });
        self.by_displacement(&by_equation)
    }

    /// Columns by tendon from columns by equation, `H⁻¹ Aᵀ` of each.
    fn by_displacement(&self, by_equation: &Matrix6xX<f64>) -> Matrix6xX<f64> {
        let plan = self.plan();
        let mut bounds = DMatrix::zeros(self.at.count, self.at.displacements.len());
        for (p, piece) in plan.pieces.iter().enumerate() {
            if let Some(row) = self.at.equations[p] {
                let (own, tendon) = (plan.piece_lengths[p], plan.rest_lengths[piece.tendon]);
                bounds[(row, piece.tendon)] = plan.settings.tendons.bound_slope(own, tendon);
            }
        }
        let mut out = Matrix6xX::zeros(self.at.displacements.len());
        for (first, inverse) in &self.at.groups {
            let count = inverse.nrows();
            let own = by_equation.columns(*first, count) * inverse;
            out += own * bounds.rows(*first, count);
        }
        out
    }

    /// Change of nothing.
    #[must_use]
    pub fn no_change(&self) -> Change {
        let n = self.plan().data.len();
        let holes =
            self.rod.robot.paths().iter().map(|path| vec![Vector3::zeros(); path.end() + 1]);
        Change {
            displacements: vec![0.0; self.at.displacements.len()],
            rest: vec![Vector3::zeros(); n],
            holes: holes.collect(),
            lengths: vec![0.0; n],
            poisson_ratio: 0.0,
            stiffness: vec![0.0; self.at.displacements.len()],
        }
    }
}

/// Tendon between two disks.
struct Line {
    point: Vector3<f64>,
    direction: Vector3<f64>,
    length: f64,
}

impl Line {
    fn new(local: &Local, piece: &Piece) -> Self {
        let point = local.end().transform(&piece.to);
        let line = point - piece.from;
        let length = line.norm();
        Self { point, direction: line / length, length }
    }
}
