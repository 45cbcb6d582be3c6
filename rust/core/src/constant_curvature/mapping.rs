//! Between tendon displacements and the arc of one segment (opencontinuumrobotics.com).
//!
//! A tendon at radius `d_j`, azimuth `psi_j` runs parallel to the arc and is longer than its rest length
//! by `e - d_j kappa ell cos(psi_j - phi)`, where `e` is the elongation of the backbone: linear in the
//! bending vector and `e`. Least squares over all tendons; for evenly spaced ones this is the Clarke
//! transform.

use nalgebra::{DMatrix, DVector, Vector2};

use super::arc::Arc;
use crate::error::{InvalidInput, finite, positive};
use crate::solve::least_squares::PseudoInverse;

/// How the length of the segment is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// It is known \[m\]: the rest length, or that of an extended backbone.
    Known(f64),
    /// The mean elongation is a third unknown; at least three tendons.
    Free,
}

/// Tendons that end at the tip of one segment, each straight.
#[derive(Clone, Debug)]
pub struct Mapping {
    azimuths: Vec<f64>,
    radii: Vec<f64>,
    rest_length: f64,
    /// Mean radius: the scale that makes bending and elongation comparable.
    scale: f64,
}

/// The arc that fits the displacements best, and what it leaves.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The arc.
    pub arc: Arc,
    /// Displacement given minus displacement of the arc, per tendon \[m\]; 0 for tendons that do not
    /// count.
    pub residual: Vec<f64>,
    /// Condition of the least-squares problem.
    pub condition: f64,
}

impl Mapping {
    /// From azimuths \[rad\], radii \[m\] (one for all or one each) and the rest length \[m\].
    ///
    /// # Errors
    /// `InvalidInput` for no tendon, an azimuth that is not finite, a radius or length that is not
    /// positive, or another number of radii than azimuths.
    pub fn new(
        azimuths: Vec<f64>,
        mut radii: Vec<f64>,
        rest_length: f64,
    ) -> Result<Self, InvalidInput> {
        if azimuths.is_empty() {
            return Err(InvalidInput::new("azimuth", "at least one tendon", "none"));
        }
        if radii.len() == 1 {
            radii = vec![radii[0]; azimuths.len()];
        }
        if radii.len() != azimuths.len() {
            let expected = format!("one value or {}, one per azimuth", azimuths.len());
            return Err(InvalidInput::new("radius", expected, radii.len()));
        }
        for &azimuth in &azimuths {
            finite("azimuth", "rad", azimuth)?;
        }
        for &radius in &radii {
            positive("radius", "m", radius)?;
        }
        positive("length", "m", rest_length)?;
        let scale = radii.iter().sum::<f64>() / radii.len() as f64;
        Ok(Self { azimuths, radii, rest_length, scale })
    }

    /// Number of tendons.
    #[must_use]
    pub fn tendons(&self) -> usize {
        self.azimuths.len()
    }

    /// Displacements of the tendons on an arc \[m\]: `(ell - rest) - d_j kappa ell cos(psi_j - phi)`.
    #[must_use]
    pub fn displacements(&self, arc: &Arc) -> Vec<f64> {
        (self.azimuths.iter().zip(&self.radii))
            .map(|(azimuth, radius)| {
                let towards = arc.bend.x * azimuth.cos() + arc.bend.y * azimuth.sin();
                (arc.length - self.rest_length) - radius * towards
            })
            .collect()
    }

    /// The arc of the given displacements \[m\]; `inf` frees a tendon, and a single one that is released
    /// leaves the segment straight. Minimum bend where the tendons span one direction only.
    ///
    /// # Errors
    /// `InvalidInput` for another number of displacements than tendons, NaN or -inf, a free length with
    /// fewer than three tendons that count, or displacements that leave no length.
    pub fn fit(&self, displacements: &[f64], length: Length) -> Result<Fit, InvalidInput> {
        if displacements.len() != self.tendons() {
            let expected = format!("{} values, one per tendon", self.tendons());
            return Err(InvalidInput::new("displacements", expected, displacements.len()));
        }
        if let Some(bad) = displacements.iter().find(|d| d.is_nan() || **d == f64::NEG_INFINITY) {
            let expected = "finite numbers [m], or inf for a free tendon";
            return Err(InvalidInput::new("displacements", expected, bad));
        }
        let mut counted: Vec<usize> =
            (0..self.tendons()).filter(|k| displacements[*k].is_finite()).collect();
        if let [only] = counted[..]
            && displacements[only] > 0.0
        {
            counted.clear();
        }
        let known = match length {
            Length::Known(length) => Some(positive("ell", "m", length)?),
            Length::Free if counted.len() < 3 => {
                let expected = "a length, or at least three tendons that count";
                let got = format!("{} tendons", counted.len());
                return Err(InvalidInput::new("ell", expected, got));
            }
            Length::Free => None,
        };
        let elongation = known.map_or(0.0, |length| length - self.rest_length);
        let inverse = PseudoInverse::new(&self.matrix(&counted, known.is_none()));
        let right = counted.iter().map(|k| displacements[*k] - elongation);
        let right = DVector::from_iterator(counted.len(), right);
        let unknowns = inverse.solve(&right);
        let bend = Vector2::new(unknowns[0], unknowns[1]) / self.scale;
        let length = known.unwrap_or_else(|| self.rest_length + unknowns[2]);
        if length <= 0.0 || !bend.iter().all(|x| x.is_finite()) {
            let expected = "displacements that leave the segment a length";
            return Err(InvalidInput::new("displacements", expected, format!("{length} m")));
        }
        let arc = Arc { bend, length };
        let mut residual = vec![0.0; self.tendons()];
        let fitted = self.displacements(&arc);
        for k in counted {
            residual[k] = displacements[k] - fitted[k];
        }
        Ok(Fit { arc, residual, condition: inverse.condition })
    }

    /// Rows of the counted tendons; unknowns are the bend times the mean radius, and the elongation.
    fn matrix(&self, counted: &[usize], extensible: bool) -> DMatrix<f64> {
        DMatrix::from_fn(counted.len(), if extensible { 3 } else { 2 }, |row, column| {
            let k = counted[row];
            let arm = self.radii[k] / self.scale;
            match column {
                0 => -arm * self.azimuths[k].cos(),
                1 => -arm * self.azimuths[k].sin(),
                _ => 1.0,
            }
        })
    }
}
