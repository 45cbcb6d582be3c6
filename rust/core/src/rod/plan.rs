//! What the rod model knows of a robot before any displacement, laid out for the loop.

use nalgebra::Vector3;

use super::settings::RodSettings;
use super::subsegment::{Data, Local, Piece};
use crate::error::InvalidInput;
use crate::robot::Robot;

/// A robot prepared for the rod model.
#[derive(Clone, Debug)]
pub struct Plan {
    pub(super) settings: RodSettings,
    pub(super) data: Vec<Data>,
    /// Pieces of all subsegments, base first.
    pub(super) pieces: Vec<Piece>,
    /// Where the pieces of each subsegment begin, and the end.
    pub(super) starts: Vec<usize>,
    /// Length of every tendon at rest through these elements \[m\].
    pub(super) rest_lengths: Vec<f64>,
    /// Tension \[N, or 1/m²·EI\] of one unit here.
    pub(super) unit: f64,
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
        let (n, elements) = (backbone.subsegments(), settings.elements as f64);
        let poisson = backbone.spec().poisson_ratio;
        let unit = backbone.bending_stiffness(0) / backbone.total_length();
        let mut data = Vec::with_capacity(n);
        let mut pieces = Vec::new();
        let mut starts = Vec::with_capacity(n + 1);
        for i in 0..n {
            let length = backbone.lengths()[i] / elements;
            let bending = backbone.bending_stiffness(i) / (length * unit);
            let stiffness = Vector3::new(bending, bending, bending / (1.0 + poisson));
            data.push(Data { length, stiffness, rest: backbone.rest(i) / elements });
            starts.push(pieces.len());
            for (tendon, path) in robot.paths().iter().enumerate() {
                if path.end() > i {
                    pieces.push(Piece { tendon, from: path.holes[i], to: path.holes[i + 1] });
                }
            }
        }
        starts.push(pieces.len());
        let mut plan = Self { settings, data, pieces, starts, rest_lengths: Vec::new(), unit };
        plan.rest_lengths = plan.lengths_at_rest(robot.paths().len());
        Ok(plan)
    }

    /// Lengths through these elements: links cut corners that arcs round.
    fn lengths_at_rest(&self, tendons: usize) -> Vec<f64> {
        let mut lengths = vec![0.0; tendons];
        let mut local = Local::default();
        for (i, data) in self.data.iter().enumerate() {
            let rest = data.rest.as_slice().repeat(self.settings.elements);
            local.place(self.settings.subsegment, data, &rest);
            for piece in &self.pieces[self.starts[i]..self.starts[i + 1]] {
                lengths[piece.tendon] += (local.end().transform(&piece.to) - piece.from).norm();
            }
        }
        lengths
    }

    /// Unknowns of a subsegment.
    pub(super) fn width(&self) -> usize {
        3 * self.settings.elements
    }
}
