//! Plan of the rod: what is known of a robot before any displacement, laid out for the loop.

use super::elasticity::Elasticity;
use super::settings::RodSettings;
use super::subsegment::{Data, Local, Piece};
use super::tendon_law::{Equations, TendonLaw};
use crate::error::InvalidInput;
use crate::robot::{Robot, Tendon};

/// A robot prepared for the rod model.
///
/// ```
/// use tdcr::rod::{Plan, Rod, RodSettings};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// // One plan serves any number of solves.
/// let plan = Plan::new(&robot, RodSettings::default())?;
/// let rod = Rod::new(&robot, &plan);
/// assert!((rod.rest_lengths()[0] - 0.2).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Plan {
    pub(crate) settings: RodSettings,
    pub(super) data: Vec<Data>,
    /// Pieces of all subsegments, base first.
    pub(super) pieces: Vec<Piece>,
    /// First piece of every subsegment, and the end.
    pub(super) starts: Vec<usize>,
    /// Length of every tendon at rest through these elements \[m\].
    pub(super) rest_lengths: Vec<f64>,
    /// Length of every piece at rest through these elements \[m\].
    pub(super) piece_lengths: Vec<f64>,
    /// Compliance c of every tendon: elongation under one unit of tension \[m\], 0 for a rigid one.
    pub(crate) compliance: Vec<f64>,
    /// Largest length² over bending stiffness: a tension times this is a load of order 1 for a subsegment.
    pub(crate) slenderness: f64,
    /// Multipliers may push, and lengths are equations.
    pub(super) signed: bool,
    /// One plan per subsegment, whose tendons are its pieces, where displacements are proportional.
    pub(super) parts: Vec<Plan>,
    /// Tension \[N, or 1/m²·EI\] of one unit here.
    pub(crate) unit: f64,
}

impl Plan {
    /// Prepares a robot.
    ///
    /// # Errors
    /// `InvalidInput` for settings out of range, and for stretching elements or elastic tendons of a backbone
    /// without Young's modulus: their stiffness would have nothing to be compared with.
    pub fn new(robot: &Robot, settings: RodSettings) -> Result<Self, InvalidInput> {
        settings.validate()?;
        let backbone = robot.backbone();
        // Elasticity of elements and tendons is relative to the backbone's.
        if !backbone.has_stiffness() {
            if settings.axial {
                let expected =
                    "Young's modulus and diameter of the backbone (axial strain needs EA)";
                return Err(InvalidInput::new("youngs_modulus", expected, "none"));
            }
            if let Some(tendon) = robot.tendons().iter().position(|t| t.stiffness().is_some()) {
                let name = &robot.tendon_names()[tendon];
                let expected = format!(
                    "Young's modulus and diameter of the backbone, as tendon '{name}' has a stiffness [N]"
                );
                return Err(InvalidInput::new("youngs_modulus", expected, "none"));
            }
        }
        // Subsegments and their pieces, in a unit in which a uniform backbone's stiffness is its length.
        let (n, elements) = (backbone.subsegments(), settings.elements as f64);
        let unit = backbone.bending_stiffness(0) / backbone.total_length();
        let mut data = Vec::with_capacity(n);
        let mut pieces = Vec::new();
        let mut starts = Vec::with_capacity(n + 1);
        let mut slenderness = 0.0_f64;
        for i in 0..n {
            let length = backbone.lengths()[i] / elements;
            // K and the rest strain of an element.
            let elasticity = Elasticity::new(backbone, i, length, elements, unit);
            data.push(Data { length, elasticity });
            slenderness = slenderness.max(elements * elements * length / elasticity.bending());
            starts.push(pieces.len());
            // Tendons that run through it, from hole to hole.
            for (tendon, path) in robot.paths().iter().enumerate() {
                if path.end() > i {
                    pieces.push(Piece { tendon, from: path.holes[i], to: path.holes[i + 1] });
                }
            }
        }
        starts.push(pieces.len());
        let count = robot.tendons().len();
        let mut plan = Self {
            settings,
            data,
            pieces,
            starts,
            rest_lengths: Vec::new(),
            piece_lengths: Vec::new(),
            compliance: Vec::new(),
            slenderness,
            signed: false,
            parts: Vec::new(),
            unit,
        };
        // Lengths at rest, and the compliances c = L_rest / EA.
        plan.piece_lengths = plan.lengths_at_rest();
        plan.rest_lengths = vec![0.0; count];
        for (piece, length) in plan.pieces.iter().zip(&plan.piece_lengths) {
            plan.rest_lengths[piece.tendon] += length;
        }
        let compliance = |(tendon, length): (&Tendon, &f64)| {
            tendon.stiffness().map_or(0.0, |stiffness| length * unit / stiffness)
        };
        plan.compliance = robot.tendons().iter().zip(&plan.rest_lengths).map(compliance).collect();
        // Where subsegments share nothing, each is a plan of its own.
        plan.parts = match settings.tendons.equations() {
            Equations::PerTendon => Vec::new(),
            Equations::PerPiece => (0..n).map(|i| plan.part(i)).collect(),
        };
        Ok(plan)
    }

    /// Length of every piece at rest through these elements: links cut corners that arcs round.
    pub(super) fn lengths_at_rest(&self) -> Vec<f64> {
        let mut lengths = Vec::with_capacity(self.pieces.len());
        let mut local = Local::default();
        for (i, data) in self.data.iter().enumerate() {
            let rest = data.elasticity.rest()[..3].repeat(self.settings.elements);
            local.place::<3>(self.settings.subsegment, data, &rest);
            let end = local.end();
            let pieces = &self.pieces[self.starts[i]..self.starts[i + 1]];
            lengths.extend(pieces.iter().map(|p| (end.transform(&p.to) - p.from).norm()));
        }
        lengths
    }

    /// One subsegment with its pieces as tendons of their own.
    pub(super) fn part(&self, i: usize) -> Self {
        let range = self.starts[i]..self.starts[i + 1];
        let pieces = &self.pieces[range.clone()];
        let rest_lengths = self.piece_lengths[range].to_vec();
        let shares = pieces.iter().zip(&rest_lengths);
        let compliance =
            shares.map(|(p, l)| self.compliance[p.tendon] * l / self.rest_lengths[p.tendon]);
        let data = self.data[i];
        let length = data.length * self.settings.elements as f64;
        Self {
            settings: self.settings,
            data: vec![data],
            pieces: pieces.iter().enumerate().map(|(k, p)| Piece { tendon: k, ..*p }).collect(),
            starts: vec![0, pieces.len()],
            compliance: compliance.collect(),
            piece_lengths: rest_lengths.clone(),
            rest_lengths,
            slenderness: length * self.settings.elements as f64 / data.elasticity.bending(),
            signed: true,
            parts: Vec::new(),
            unit: self.unit,
        }
    }

    /// Settings that it was made with.
    #[must_use]
    pub fn settings(&self) -> &RodSettings {
        &self.settings
    }

    /// Law by which displacements are imposed.
    pub(crate) fn tendon_law(&self) -> TendonLaw {
        self.settings.tendons
    }

    /// Rest length of a subsegment \[m\].
    pub(super) fn length(&self, i: usize) -> f64 {
        self.data[i].length * self.settings.elements as f64
    }

    /// Moment that bends a subsegment by 1 rad, in this plan's unit \[m per unit of tension\].
    pub(crate) fn stiffness(&self, i: usize) -> f64 {
        self.data[i].elasticity.bending() / self.settings.elements as f64
    }

    /// Bend of a subsegment under one unit of moment \[rad\].
    pub(super) fn bending_compliance(&self, i: usize) -> f64 {
        self.settings.elements as f64 / self.data[i].elasticity.bending()
    }

    /// Rest length from base to tip \[m\].
    pub(crate) fn total_length(&self) -> f64 {
        (0..self.data.len()).map(|i| self.length(i)).sum()
    }

    /// Checks tensions that are given.
    pub(super) fn check_tensions(&self, tensions: &[f64]) -> Result<(), InvalidInput> {
        if tensions.len() != self.rest_lengths.len() {
            let expected = format!("{} values, one per tendon", self.rest_lengths.len());
            return Err(InvalidInput::new("tensions", expected, tensions.len()));
        }
        if let Some(bad) = tensions.iter().find(|t| !(t.is_finite() && **t >= 0.0)) {
            let expected = "finite tensions of 0 or more";
            return Err(InvalidInput::new("tensions", expected, format!("{bad:?}")));
        }
        Ok(())
    }

    /// Unknowns of an element.
    pub(super) fn unknowns(&self) -> usize {
        if self.settings.axial { 4 } else { 3 }
    }

    /// Second derivatives that an evaluation computes: what it costs, and the memory that it takes.
    #[must_use]
    pub fn second_derivatives(&self) -> usize {
        self.data.len() * self.width() * self.width()
    }

    /// Unknowns of a subsegment.
    pub(super) fn width(&self) -> usize {
        self.unknowns() * self.settings.elements
    }
}
