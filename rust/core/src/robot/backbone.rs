//! The flexible spine: stretches of subsegments, rest shape, material.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::curve::rest_from_curve;
use crate::error::{InvalidInput, finite, positive};
use crate::hashing::{Bits, hash_by_bits};

/// Description of a backbone, before it is checked. See [`Backbone::new`].
///
/// ```
/// use tdcr::robot::{Backbone, BackboneSpec};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// // Spring steel of 1 mm.
/// let spec = BackboneSpec {
///     youngs_modulus: Some(200e9),
///     diameter: Some(vec![1e-3]),
///     ..BackboneSpec::straight(0.2, 20)
/// };
/// assert!(Backbone::new(spec)?.has_stiffness());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BackboneSpec {
    /// Length of each stretch \[m\].
    pub length: Vec<f64>,
    /// Number of subsegments of each stretch.
    pub subsegments: Vec<usize>,
    /// Poisson's ratio of the material.
    pub poisson_ratio: f64,
    /// Rest rotation vector of each subsegment, in the frame of its base disk \[rad\]; none = straight.
    pub rest: Option<Vec<Vector3<f64>>>,
    /// Young's modulus \[Pa\].
    pub youngs_modulus: Option<f64>,
    /// Diameter of the round backbone, one or one per subsegment \[m\].
    pub diameter: Option<Vec<f64>>,
    /// Outer radius of the disks \[m\].
    pub disk_radius: Option<f64>,
}

impl BackboneSpec {
    /// One straight stretch of unknown material.
    #[must_use]
    pub fn straight(length: f64, subsegments: usize) -> Self {
        Self {
            length: vec![length],
            subsegments: vec![subsegments],
            poisson_ratio: 0.35,
            rest: None,
            youngs_modulus: None,
            diameter: None,
            disk_radius: None,
        }
    }
}

/// Subsegments of a backbone at most: far beyond any robot, within any memory, and a solve stays
/// within 0.1 s, which is how long Ctrl-C may wait.
const MOST_SUBSEGMENTS: usize = 100_000;

/// A checked backbone. Disks are numbered 0 (base) to n (tip); subsegment i joins disks i and i + 1.
///
/// ```
/// use tdcr::robot::{Backbone, BackboneSpec};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// assert_eq!(backbone.subsegments(), 10);
/// assert!(backbone.is_straight() && (backbone.total_length() - 0.2).abs() < 1e-15);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Backbone {
    spec: BackboneSpec,
    lengths: Vec<f64>,
    arc_lengths: Vec<f64>,
}

impl Backbone {
    /// Checks a description.
    ///
    /// # Errors
    /// `InvalidInput` naming the field: no stretch, a length that is not positive, a stretch without
    /// subsegments, more than 100,000 of them, Poisson's ratio outside (-1, 0.5], a rest shape of
    /// another length than the backbone or bent by more than pi per subsegment, Young's modulus without
    /// diameter, a modulus, diameter or disk radius that is not positive.
    pub fn new(mut spec: BackboneSpec) -> Result<Self, InvalidInput> {
        let stretches = spec.length.len();
        if stretches == 0 {
            return Err(InvalidInput::new("length", "at least one stretch", "none"));
        }
        if spec.subsegments.len() != stretches {
            let expected = format!("{stretches} counts, one per stretch of length");
            return Err(InvalidInput::new("subsegments", expected, spec.subsegments.len()));
        }
        for &length in &spec.length {
            crate::error::length("length", length)?;
        }
        if let Some(count) = spec.subsegments.iter().find(|&&count| count < 1) {
            return Err(InvalidInput::new("subsegments", "at least 1 per stretch", count));
        }
        let n = (spec.subsegments.iter()).fold(0_usize, |sum, count| sum.saturating_add(*count));
        if n > MOST_SUBSEGMENTS {
            let expected = format!("at most {MOST_SUBSEGMENTS} in all");
            return Err(InvalidInput::new("subsegments", expected, n));
        }
        spec.poisson_ratio = finite("poisson_ratio", "1", spec.poisson_ratio)?;
        if spec.poisson_ratio <= -1.0 || spec.poisson_ratio > 0.5 {
            let got = spec.poisson_ratio;
            return Err(InvalidInput::new("poisson_ratio", "a number in (-1, 0.5]", got));
        }
        if let Some(rest) = &mut spec.rest {
            check_rest(rest, n)?;
        }
        check_material(&spec, n)?;
        let lengths: Vec<f64> = (spec.length.iter().zip(&spec.subsegments))
            .flat_map(|(&length, &count)| std::iter::repeat_n(length / count as f64, count))
            .collect();
        let arc_lengths = arc_lengths(&spec.length, &spec.subsegments);
        Ok(Self { spec, lengths, arc_lengths })
    }

    /// A pre-bent backbone along a curve: `spec` with its length and rest shape taken from a spline
    /// through `points` \[m\], cut into its (one) number of subsegments.
    ///
    /// Rest rotation vectors are those of frames that do not twist about the curve. The rest shape
    /// starts at the base frame, so it lies on the curve where the curve starts along the base's z
    /// axis; elsewhere it is the curve moved there. Arcs of constant strain meet the curve's tangents
    /// exactly and its points to order 2 in the number of subsegments.
    ///
    /// # Errors
    /// As [`Backbone::new`], and for fewer than two points, points that are not finite or that repeat,
    /// or more than one stretch.
    pub fn from_curve(
        points: &[Vector3<f64>],
        mut spec: BackboneSpec,
    ) -> Result<Self, InvalidInput> {
        let &[count] = spec.subsegments.as_slice() else {
            let expected = "one count for the whole curve";
            return Err(InvalidInput::new("subsegments", expected, spec.subsegments.len()));
        };
        if count > MOST_SUBSEGMENTS {
            let expected = format!("at most {MOST_SUBSEGMENTS} in all");
            return Err(InvalidInput::new("subsegments", expected, count));
        }
        let (length, rest) = rest_from_curve(points, count)?;
        spec.length = vec![length];
        spec.rest = Some(rest);
        Self::new(spec)
    }

    /// The description it was made from.
    #[must_use]
    pub fn spec(&self) -> &BackboneSpec {
        &self.spec
    }

    /// Number of subsegments n; there are n + 1 disks.
    #[must_use]
    pub fn subsegments(&self) -> usize {
        self.lengths.len()
    }

    /// Rest length of each subsegment \[m\].
    #[must_use]
    pub fn lengths(&self) -> &[f64] {
        &self.lengths
    }

    /// Arc length from the base to each disk, disk 0 included \[m\].
    #[must_use]
    pub fn arc_lengths(&self) -> &[f64] {
        &self.arc_lengths
    }

    /// Rest length from base to tip \[m\].
    #[must_use]
    pub fn total_length(&self) -> f64 {
        self.arc_lengths[self.subsegments()]
    }

    /// Rest rotation vector of a subsegment \[rad\].
    #[must_use]
    pub fn rest(&self, subsegment: usize) -> Vector3<f64> {
        self.spec.rest.as_ref().map_or_else(Vector3::zeros, |rest| rest[subsegment])
    }

    /// True when every subsegment is straight at rest.
    #[must_use]
    pub fn is_straight(&self) -> bool {
        (self.spec.rest.iter().flatten()).all(|rest| *rest == Vector3::zeros())
    }

    /// True when forces come out in newtons: Young's modulus (and so the diameter) is known.
    #[must_use]
    pub fn has_stiffness(&self) -> bool {
        self.spec.youngs_modulus.is_some()
    }

    /// Bending stiffness EI of a subsegment \[N m^2\] (I = pi d^4 / 64). Without Young's modulus it is
    /// in units of the base subsegment's.
    #[must_use]
    pub fn bending_stiffness(&self, subsegment: usize) -> f64 {
        match (self.spec.youngs_modulus, self.diameter(subsegment), self.diameter(0)) {
            (Some(modulus), Some(d), _) => modulus * PI * d.powi(4) / 64.0,
            (None, Some(d), Some(base)) => (d / base).powi(4),
            _ => 1.0,
        }
    }

    /// Axial stiffness EA of a subsegment \[N\], where Young's modulus is known.
    #[must_use]
    pub fn axial_stiffness(&self, subsegment: usize) -> Option<f64> {
        Some(self.spec.youngs_modulus? * self.area(subsegment)?)
    }

    /// Area of the cross-section of a subsegment \[m²\], where its diameter is known.
    #[must_use]
    pub fn area(&self, subsegment: usize) -> Option<f64> {
        self.diameter(subsegment).map(|diameter| PI * diameter * diameter / 4.0)
    }

    fn diameter(&self, subsegment: usize) -> Option<f64> {
        let diameter = self.spec.diameter.as_ref()?;
        Some(if diameter.len() == 1 { diameter[0] } else { diameter[subsegment] })
    }

    /// Strain energy of a rotation vector in a subsegment \[J, or 1/m in units of EI\]:
    /// `[EI (dx^2 + dy^2) + GJ dz^2] / (2 l)` against rest, GJ = EI / (1 + nu) for a round rod
    /// (Mahapatra & Ghosal, eqs. 1-3).
    #[must_use]
    pub fn strain_energy(&self, subsegment: usize, rotation: &Vector3<f64>) -> f64 {
        let strain = rotation - self.rest(subsegment);
        let torsion = strain.z * strain.z / (1.0 + self.spec.poisson_ratio);
        let bending = strain.x * strain.x + strain.y * strain.y;
        0.5 * self.bending_stiffness(subsegment) * (bending + torsion) / self.lengths[subsegment]
    }
}

hash_by_bits!(Backbone, |backbone, bits| {
    let spec = &backbone.spec;
    bits.floats(&spec.length);
    bits.counts(&spec.subsegments);
    bits.float(spec.poisson_ratio);
    bits.vectors(spec.rest.as_deref().unwrap_or_default());
    bits.option(spec.youngs_modulus);
    bits.floats(spec.diameter.as_deref().unwrap_or_default());
    bits.option(spec.disk_radius);
});

/// Positions of the disks along the backbone; the ends of stretches carry no rounding of the steps.
fn arc_lengths(stretches: &[f64], counts: &[usize]) -> Vec<f64> {
    let mut start = 0.0;
    let mut positions = vec![0.0];
    for (&length, &count) in stretches.iter().zip(counts) {
        for i in 1..=count {
            positions.push(start + length * (i as f64 / count as f64));
        }
        start += length;
    }
    positions
}

fn check_rest(rest: &mut [Vector3<f64>], n: usize) -> Result<(), InvalidInput> {
    if rest.len() != n {
        let expected = format!("{n} rotation vectors, one per subsegment");
        return Err(InvalidInput::new("rest", expected, rest.len()));
    }
    for vector in rest {
        for component in vector.iter_mut() {
            *component = finite("rest", "rad", *component)?;
        }
        if vector.norm() > PI {
            let expected = "rotation vectors of at most pi rad per subsegment";
            return Err(InvalidInput::new("rest", expected, vector.norm()));
        }
    }
    Ok(())
}

fn check_material(spec: &BackboneSpec, n: usize) -> Result<(), InvalidInput> {
    if let Some(modulus) = spec.youngs_modulus {
        positive("youngs_modulus", "Pa", modulus)?;
        if spec.diameter.is_none() {
            let expected = "a diameter [m] beside Young's modulus (forces need both)";
            return Err(InvalidInput::new("diameter", expected, "none"));
        }
    }
    if let Some(diameter) = &spec.diameter {
        if diameter.len() != 1 && diameter.len() != n {
            let expected = format!("one diameter or {n}, one per subsegment");
            return Err(InvalidInput::new("diameter", expected, diameter.len()));
        }
        for &value in diameter {
            crate::error::length("diameter", value)?;
        }
    }
    if let Some(radius) = spec.disk_radius {
        crate::error::length("disk_radius", radius)?;
    }
    Ok(())
}
