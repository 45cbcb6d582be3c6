//! Convex regions of unknowns: linear equations and bounds, and discs whose radius may grow with one of
//! the unknowns.

use super::dense::dot;
use super::quadratic_program::{Outcome, QuadraticProgram, Rows};

/// `|(z_first, z_first+1)| <= radius`, or `<= radius * z_scale`.
///
/// ```
/// use tdcr::solve::convex_region::{Disc, Region};
///
/// let mut region = Region::new(3);
/// // A disc in the first two unknowns whose radius is half the third one.
/// region.add_disc(Disc { first: 0, radius: 0.5, scale: Some(2) });
/// assert!(region.contains(&[0.9, 0.0, 2.0]) && !region.contains(&[0.9, 0.0, 1.0]));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Index of the first of the two unknowns.
    pub first: usize,
    /// The radius, or what it is per unit of the unknown that scales it.
    pub radius: f64,
    /// The unknown that scales it.
    pub scale: Option<usize>,
}

impl Disc {
    /// Distance by which a point is outside; negative inside.
    fn excess(&self, z: &[f64]) -> f64 {
        let reach = self.scale.map_or(self.radius, |k| self.radius * z[k]);
        length(z, self.first) - reach
    }

    /// Length of the gradient of the excess: normals of rows are of length 1.
    fn gradient_norm(&self) -> f64 {
        if self.scale.is_some() { 1.0_f64.hypot(self.radius) } else { 1.0 }
    }
}

/// Length of two unknowns; squares of what counts here neither overflow nor vanish.
fn length(z: &[f64], first: usize) -> f64 {
    (z[first] * z[first] + z[first + 1] * z[first + 1]).sqrt()
}

/// A convex region.
///
/// ```
/// use tdcr::solve::convex_region::Region;
///
/// let mut region = Region::new(2);
/// region.add_equation(&[1.0, 1.0], 1.0);
/// region.add_bound(&[1.0, 0.0], 0.25);
/// assert!(region.contains(&[0.25, 0.75]) && !region.contains(&[0.5, 0.5]));
/// ```
#[derive(Clone, Debug, Default)]
pub struct Region {
    size: usize,
    /// Linear rows on the unknowns themselves, equations first.
    linear: Rows,
    discs: Vec<Disc>,
}

/// Points are brought back to within this of the region.
const INSIDE: f64 = 1e-13;

impl Region {
    /// The whole space.
    #[must_use]
    pub fn new(size: usize) -> Self {
        Self { size, ..Self::default() }
    }

    /// Number of unknowns.
    #[must_use]
    pub fn size(&self) -> usize {
        self.size
    }

    /// Number of equations.
    #[must_use]
    pub fn equations(&self) -> usize {
        self.linear.equalities
    }

    /// Adds `normal . z = value`; equations come before everything else. A normal of zeros is left out.
    pub fn add_equation(&mut self, normal: &[f64], value: f64) {
        if self.push_row(normal, value) {
            self.linear.equalities += 1;
        }
    }

    /// Adds `normal . z <= bound`, unless the bound is infinite or the normal zero; returns whether.
    pub fn add_bound(&mut self, normal: &[f64], bound: f64) -> bool {
        bound < f64::INFINITY && self.push_row(normal, bound)
    }

    fn push_row(&mut self, normal: &[f64], value: f64) -> bool {
        let norm = dot(normal, normal).sqrt();
        if norm > 0.0 {
            let row = self.linear.push(self.size, value / norm);
            row.iter_mut().zip(normal).for_each(|(to, from)| *to = from / norm);
        }
        norm > 0.0
    }

    /// Adds a disc.
    pub fn add_disc(&mut self, disc: Disc) {
        self.discs.push(disc);
    }

    /// Bounds, in the order they were added, and discs, in theirs, on whose edge a point lies to `within`.
    #[must_use]
    pub fn active_at(&self, z: &[f64], within: f64) -> (Vec<usize>, Vec<usize>) {
        let first = self.linear.equalities;
        let bounds = (first..self.linear.offsets.len())
            .filter(|k| {
                dot(self.linear.normal(self.size, *k), z) >= self.linear.offsets[*k] - within
            })
            .map(|k| k - first);
        let discs = self.discs.iter().enumerate();
        let discs = discs.filter(|(_, disc)| disc.excess(z) >= -within).map(|(k, _)| k);
        (bounds.collect(), discs.collect())
    }

    /// Largest violation at a point; 0 inside.
    #[must_use]
    pub fn violation(&self, z: &[f64]) -> f64 {
        let linear = (self.linear.offsets.iter().enumerate()).map(|(k, offset)| {
            let off = dot(self.linear.normal(self.size, k), z) - offset;
            if k < self.linear.equalities { off.abs() } else { off }
        });
        let discs = self.discs.iter().map(|disc| disc.excess(z) / disc.gradient_norm());
        linear.chain(discs).fold(0.0, f64::max)
    }

    /// Adds the constraints on a step from `z` to rows that are all equations; the discs by their
    /// tangents, which contain them.
    pub fn linearize(&self, z: &[f64], rows: &mut Rows) {
        rows.normals.extend_from_slice(&self.linear.normals);
        rows.equalities += self.linear.equalities;
        for (k, offset) in self.linear.offsets.iter().enumerate() {
            rows.offsets.push(offset - dot(self.linear.normal(self.size, k), z));
        }
        for disc in &self.discs {
            let norm = length(z, disc.first);
            // At the centre every direction is a tangent's; a step from there is brought back later.
            let (x, y) = if norm > 0.0 {
                (z[disc.first] / norm, z[disc.first + 1] / norm)
            } else {
                (0.0, 0.0)
            };
            let gradient_norm = disc.gradient_norm();
            let row = rows.push(self.size, -disc.excess(z) / gradient_norm);
            row[disc.first] = x / gradient_norm;
            row[disc.first + 1] = y / gradient_norm;
            if let Some(scale) = disc.scale {
                row[scale] = -disc.radius / gradient_norm;
            }
        }
    }

    /// Adds the curvature of the discs that are active in `solved` to the lower triangle of a Hessian at
    /// `z`: the second derivatives of `sum multiplier * excess / gradient_norm`. Its program had `before` rows
    /// before those of this region.
    pub fn add_curvature(
        &self,
        z: &[f64],
        solved: &QuadraticProgram,
        before: usize,
        hessian: &mut [f64],
    ) {
        let linear = before + self.linear.offsets.len();
        for (&row, multiplier) in solved.active.iter().zip(&solved.multipliers) {
            let Some(disc) = row.checked_sub(linear).and_then(|k| self.discs.get(k)) else {
                continue;
            };
            let (i, j) = (disc.first, disc.first + 1);
            let norm = length(z, i);
            if norm > 0.0 {
                let (x, y) = (z[i] / norm, z[j] / norm);
                let weight = multiplier / (norm * disc.gradient_norm());
                hessian[i * self.size + i] += weight * y * y;
                hessian[j * self.size + i] -= weight * x * y;
                hessian[j * self.size + j] += weight * x * x;
            }
        }
    }

    /// True when a point is inside, to rounding.
    #[must_use]
    pub fn contains(&self, z: &[f64]) -> bool {
        self.violation(z) <= INSIDE
    }

    /// Brings a point back into the region by steps of least length; false when the region is empty as
    /// far as this can tell. A point inside stays as it is, bit by bit.
    pub fn restore(&self, z: &mut [f64], work: &mut RestoreScratch) -> bool {
        // Tangents to discs converge like Newton's method.
        for _ in 0..30 {
            if self.contains(z) {
                return true;
            }
            if !self.restoring_step(z, work, |_| {}) {
                return false;
            }
        }
        false
    }

    /// One such step, under further rows; false when no step meets them all.
    pub fn restoring_step(
        &self,
        z: &mut [f64],
        work: &mut RestoreScratch,
        further: impl FnOnce(&mut Rows),
    ) -> bool {
        let RestoreScratch { program, rows } = work;
        rows.clear();
        self.linearize(z, rows);
        further(rows);
        program.factor_identity(self.size);
        program.gradient.clear();
        program.gradient.resize(self.size, 0.0);
        if program.solve(rows) != Outcome::Solved {
            return false;
        }
        z.iter_mut().zip(&program.step).for_each(|(z, p)| *z += p);
        true
    }
}

/// Buffers of [`Region::restore`].
///
/// ```
/// use tdcr::solve::convex_region::{Region, RestoreScratch};
///
/// let mut region = Region::new(2);
/// region.add_bound(&[1.0, 0.0], 1.0);
/// let (mut scratch, mut point) = (RestoreScratch::default(), [3.0, 4.0]);
/// assert!(region.restore(&mut point, &mut scratch));
/// assert!((point[0] - 1.0).abs() < 1e-12 && point[1] == 4.0);
/// ```
#[derive(Clone, Debug, Default)]
pub struct RestoreScratch {
    program: QuadraticProgram,
    rows: Rows,
}
