//! Between tendon displacements and the arc of one segment (opencontinuumrobotics.com).
//!
//! A tendon at radius `d_j`, azimuth `psi_j` runs parallel to the arc and is longer than its rest length
//! by `e - d_j kappa ell cos(psi_j - phi)`, where `e` is the elongation of the backbone: linear in the
//! bending vector and `e`. Least squares over all tendons; for evenly spaced ones this is the Clarke
//! transform.

use nalgebra::{DMatrix, Vector2};

use super::arc::Arc;
use crate::error::{InvalidInput, finite, positive};
use crate::solve::pseudo_inverse::PseudoInverse;

/// Source of the segment's length.
///
/// ```
/// use tdcr::constant_curvature::{Length, Mapping};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let mapping = Mapping::new(vec![0.0, 2.1, 4.2], vec![0.008], 0.1)?;
/// // All tendons are 2 mm longer: the segment is too, if its length is free.
/// let fit = mapping.fit(&[0.002; 3], Length::Free)?;
/// assert!((fit.arc.length - 0.102).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// It is known \[m\]: the rest length, or that of an extended backbone.
    Known(f64),
    /// The mean elongation is a third unknown; at least three tendons.
    Free,
}

/// Tendons that end at the tip of one segment, each straight.
///
/// ```
/// use tdcr::constant_curvature::{Arc, Length, Mapping};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let mapping = Mapping::new(vec![0.0, 2.1, 4.2], vec![0.008], 0.1)?;
/// let arc = Arc::new(5.0, 1.0, 0.1);
/// let fit = mapping.fit(&mapping.displacements(&arc), Length::Known(0.1))?;
/// assert!((fit.arc.kappa() - 5.0).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Mapping {
    /// Cosine and sine of every azimuth.
    directions: Vec<Vector2<f64>>,
    radii: Vec<f64>,
    rest_length: f64,
    /// Mean radius: the scale that makes bending and elongation comparable.
    scale: f64,
}

/// The arc that fits the displacements best, and what it leaves.
///
/// ```
/// use tdcr::constant_curvature::{Length, Mapping};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let mapping = Mapping::new(vec![0.0, 2.1, 4.2], vec![0.008], 0.1)?;
/// // No arc of known length has these displacements.
/// let fit = mapping.fit(&[0.001; 3], Length::Known(0.1))?;
/// assert!(fit.residual.iter().any(|off| off.abs() > 1e-4));
/// # Ok(())
/// # }
/// ```
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
        let directions =
            azimuths.into_iter().map(|azimuth: f64| Vector2::new(azimuth.cos(), azimuth.sin()));
        Ok(Self { directions: directions.collect(), radii, rest_length, scale })
    }

    /// Number of tendons.
    #[must_use]
    pub fn tendons(&self) -> usize {
        self.directions.len()
    }

    /// Displacements of the tendons on an arc \[m\]: `(ell - rest) - d_j kappa ell cos(psi_j - phi)`.
    #[must_use]
    pub fn displacements(&self, arc: &Arc) -> Vec<f64> {
        (0..self.tendons()).map(|k| self.displacement(k, arc, self.rest_length)).collect()
    }

    /// Displacement of one tendon on an arc \[m\], from any rest length \[m\].
    #[must_use]
    pub fn displacement(&self, tendon: usize, arc: &Arc, rest_length: f64) -> f64 {
        (arc.length - rest_length) - self.radii[tendon] * arc.bend.dot(&self.directions[tendon])
    }

    /// The arc of the given displacements \[m\]; `inf` frees a tendon, and a single one that is released
    /// leaves the segment straight. Minimum bend where the tendons span one direction only.
    ///
    /// # Errors
    /// `InvalidInput` for another number of displacements than tendons, NaN or -inf, a free length with
    /// fewer than three tendons that count, or displacements that leave no length or overflow.
    pub fn fit(&self, displacements: &[f64], length: Length) -> Result<Fit, InvalidInput> {
        let (mut pattern, mut residual) = (Pattern::default(), Vec::new());
        let arc = self.fit_row(displacements, length, &mut pattern, &mut residual)?;
        let condition = pattern.cached.map_or(1.0, |cached| cached.inverse.condition);
        Ok(Fit { arc, residual, condition })
    }

    /// [`Mapping::fit`] for one row of many: keeps the inverse of the last pattern of tendons (of this
    /// mapping only), and appends the residual.
    ///
    /// # Errors
    /// As [`Mapping::fit`].
    pub fn fit_row(
        &self,
        displacements: &[f64],
        length: Length,
        pattern: &mut Pattern,
        residual: &mut Vec<f64>,
    ) -> Result<Arc, InvalidInput> {
        self.list_active_tendons(displacements, &mut pattern.active)?;
        let known = match length {
            Length::Known(length) => Some(positive("ell", "m", length)?),
            Length::Free if pattern.active.len() < 3 => {
                let expected = "a length, or at least three tendons that count";
                let got = format!("{} tendons", pattern.active.len());
                return Err(InvalidInput::new("ell", expected, got));
            }
            Length::Free => None,
        };
        let elongation = known.map_or(0.0, |length| length - self.rest_length);
        let unknowns = pattern.solve(self, known.is_none(), |k| displacements[k] - elongation);
        let bend = Vector2::new(unknowns[0], unknowns[1]) / self.scale;
        let arc = Arc { bend, length: known.unwrap_or(self.rest_length + unknowns[2]) };
        if arc.is_finite() && arc.length <= 0.0 {
            let expected = "displacements that leave the segment a length";
            return Err(InvalidInput::new("displacements", expected, format!("{} m", arc.length)));
        }
        if !(arc.is_finite() && arc.kappa().is_finite()) {
            let expected = "displacements small enough to compute an arc";
            return Err(InvalidInput::new("displacements", expected, "an overflow"));
        }
        let first = residual.len();
        residual.resize(first + self.tendons(), 0.0);
        for &k in &pattern.active {
            residual[first + k] = displacements[k] - self.displacement(k, &arc, self.rest_length);
        }
        Ok(arc)
    }

    /// Tendons that count: not free, and not the only, released one.
    fn list_active_tendons(
        &self,
        displacements: &[f64],
        active: &mut Vec<usize>,
    ) -> Result<(), InvalidInput> {
        if displacements.len() != self.tendons() {
            let expected = format!("{} values, one per tendon", self.tendons());
            return Err(InvalidInput::new("displacements", expected, displacements.len()));
        }
        if let Some(bad) = displacements.iter().find(|d| d.is_nan() || **d == f64::NEG_INFINITY) {
            let expected = "finite numbers [m], or inf for a free tendon";
            return Err(InvalidInput::new("displacements", expected, bad));
        }
        active.clear();
        active.extend((0..self.tendons()).filter(|k| displacements[*k].is_finite()));
        if let [only] = active[..]
            && displacements[only] > 0.0
        {
            active.clear();
        }
        Ok(())
    }

    /// Rows of the counted tendons; unknowns are the bend times the mean radius, and the elongation.
    fn matrix(&self, active: &[usize], extensible: bool) -> DMatrix<f64> {
        DMatrix::from_fn(active.len(), if extensible { 3 } else { 2 }, |row, column| {
            let k = active[row];
            let arm = self.radii[k] / self.scale;
            match column {
                0 => -arm * self.directions[k].x,
                1 => -arm * self.directions[k].y,
                _ => 1.0,
            }
        })
    }
}

/// Which tendons of a row count, and the inverse over them, kept for rows with the same ones.
///
/// ```
/// use tdcr::constant_curvature::{Length, Mapping, Pattern};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let mapping = Mapping::new(vec![0.0, 2.1, 4.2], vec![0.008], 0.1)?;
/// // Rows with the same free tendons share one inverse.
/// let (mut pattern, mut residual) = (Pattern::default(), Vec::new());
/// for row in [[-0.002, 0.001, 0.001], [0.0, -0.001, 0.001]] {
///     mapping.fit_row(&row, Length::Known(0.1), &mut pattern, &mut residual)?;
/// }
/// assert_eq!(residual.len(), 6);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default)]
pub struct Pattern {
    active: Vec<usize>,
    cached: Option<CachedInverse>,
}

#[derive(Clone, Debug)]
struct CachedInverse {
    active: Vec<usize>,
    extensible: bool,
    inverse: PseudoInverse,
}

impl Pattern {
    /// Two bends times the scale, and the elongation when it is extensible.
    fn solve(
        &mut self,
        mapping: &Mapping,
        extensible: bool,
        right: impl Fn(usize) -> f64,
    ) -> [f64; 3] {
        let same = |cached: &CachedInverse| {
            cached.extensible == extensible && cached.active == self.active
        };
        let cached = match self.cached.take().filter(same) {
            Some(cached) => cached,
            None => CachedInverse {
                active: self.active.clone(),
                extensible,
                inverse: PseudoInverse::new(&mapping.matrix(&self.active, extensible)),
            },
        };
        let mut unknowns = [0.0; 3];
        for (column, k) in cached.inverse.matrix.column_iter().zip(&self.active) {
            let value = right(*k);
            for (unknown, share) in unknowns.iter_mut().zip(column.iter()) {
                *unknown += share * value;
            }
        }
        self.cached = Some(cached);
        unknowns
    }
}
