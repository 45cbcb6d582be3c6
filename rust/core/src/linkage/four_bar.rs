//! The four-bar linkage: one subsegment in the plane of its one tendon.
//!
//! Ashwin & Ghosal (eq. 7) minimise the coupler angle over `x0, xa` (four coordinates) under three
//! fixed lengths. The crank `|x0 - X0|` and the coupler `|x0 - xa|` leave two angles, the link's and
//! the disk's; the tendon piece `|xa - Xa|` is the remaining equality.

use nalgebra::{SMatrix, SVector};

use super::seven_bar::{Hole, TINY_BEND, third_order};
use crate::solve::sqp::{Linearization, Problem};

/// Minimum of the squared coupler angle of a planar subsegment. Lengths in units of the rest length
/// of the subsegment; the tendon lies at `+x`.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::linkage::four_bar::FourBar;
/// use tdcr::linkage::seven_bar::Hole;
///
/// let hole = Vector3::new(0.5, 0.0, 0.0);
/// let problem = FourBar::new(&Hole::new(hole, hole, 0.1));
/// // The exact answer is 2 asin(0.1); the start is its third order.
/// assert!((problem.start().disk - 2.0 * 0.1_f64.asin()).abs() < 1e-5);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct FourBar {
    lower: f64,
    upper: f64,
    shortfall: f64,
    pull: f64,
    /// Weight of the squared angles between crank and disk axes; see
    /// [`SevenBar::new`](super::seven_bar::SevenBar::new).
    bisection: f64,
    crank_unit: f64,
}

/// Angles of a planar subsegment, positive towards the tendon.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::linkage::seven_bar::Hole;
/// use tdcr::linkage::{LinkageSettings, solve_four_bar};
///
/// let hole = Vector3::new(0.5, 0.0, 0.0);
/// let found = solve_four_bar(&Hole::new(hole, hole, 0.1), &LinkageSettings::default().sqp());
/// assert!((found.point.disk - 2.0 * 0.1_f64.asin()).abs() < 1e-12);
/// assert!((found.point.link - 0.5 * found.point.disk).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// Turn of the upper disk against the lower one \[rad\].
    pub disk: f64,
    /// Direction of the link against the lower disk's axis \[rad\].
    pub link: f64,
}

impl FourBar {
    /// From a hole whose azimuth is the same on both disks.
    #[must_use]
    pub fn new(hole: &Hole) -> Self {
        let (lower, upper) = (hole.lower.norm(), hole.upper.norm());
        let shortfall = hole.pull * (hole.rest - 0.5 * hole.pull);
        let alike = hole.is_alike();
        let bend = (shortfall / upper).abs();
        let crank_unit = if alike { 1.0 / bend.clamp(TINY_BEND, 1.0) } else { 1.0 };
        Self {
            lower,
            upper,
            shortfall,
            pull: hole.pull,
            bisection: if alike { 0.0 } else { 1.0 },
            crank_unit,
        }
    }

    /// True when the pull is so small that the start is the answer; see
    /// [`SevenBar::is_tiny`](super::seven_bar::SevenBar::is_tiny).
    #[must_use]
    pub fn is_tiny(&self) -> bool {
        self.crank_unit >= 1.0 / TINY_BEND
    }

    /// Bent as the theory of tendons has it to third order.
    #[must_use]
    pub fn start(&self) -> Bend {
        let disk = third_order(2.0 * self.pull / (self.lower + self.upper));
        Bend { disk, link: 0.5 * disk }
    }
}

impl Problem<2, 1> for FourBar {
    type Point = Bend;

    fn linearize(&self, b: &Bend, out: &mut Linearization<2, 1>) {
        let (sin, cos) = b.disk.sin_cos();
        let (link_sin, link_cos) = b.link.sin_cos();
        let (half_sin, half_cos) = (0.5 * b.disk).sin_cos();
        let offset = self.upper - self.lower;
        // (R - I) h' without cancellation.
        let moved =
            [-2.0 * self.upper * half_sin * half_sin, -2.0 * self.upper * half_sin * half_cos];
        let shift = [moved[0] + offset, moved[1]];
        let along = link_sin * shift[0] + link_cos * shift[1];
        let across = link_cos * shift[0] - link_sin * shift[1];
        let squares = 0.5 * (moved[0] * moved[0] + moved[1] * moved[1]) + moved[0] * offset;
        // d(R h')/d(disk) = -upper (sin, cos), dotted with link - lower hole.
        let turn = -self.upper * (sin * (link_sin - self.lower) + cos * link_cos);
        let (tilt, w) = (b.disk - b.link, self.bisection);
        *out = Linearization {
            objective: b.disk * b.disk + w * (b.link * b.link + tilt * tilt),
            gradient: SVector::from([
                2.0 * b.disk + 2.0 * w * tilt,
                2.0 * w * (b.link - tilt) * self.crank_unit,
            ]),
            constraints: SVector::from([(along + squares + self.shortfall) / self.upper]),
            jacobian_transposed: SMatrix::from([[
                turn / self.upper,
                across * self.crank_unit / self.upper,
            ]]),
        };
    }

    fn hessian(&self, b: &Bend, multipliers: &SVector<f64, 1>) -> SMatrix<f64, 2, 2> {
        let (sin, cos) = b.disk.sin_cos();
        let (link_sin, link_cos) = b.link.sin_cos();
        let half_sin = (0.5 * b.disk).sin();
        let shift =
            [self.upper - self.lower - 2.0 * self.upper * half_sin * half_sin, -self.upper * sin];
        let (w, unit) = (self.bisection, self.crank_unit);
        let lambda = multipliers[0] / self.upper;
        let disk = lambda * self.upper * (sin * link_cos - cos * (link_sin - self.lower));
        let mixed = lambda * self.upper * (cos * link_sin - sin * link_cos);
        let link = -lambda * (link_sin * shift[0] + link_cos * shift[1]);
        let cross = (mixed - 2.0 * w) * unit;
        SMatrix::from([[2.0 + 2.0 * w + disk, cross], [cross, (4.0 * w + link) * unit * unit]])
    }

    fn retract(&self, b: &Bend, step: &SVector<f64, 2>, factor: f64, out: &mut Bend) {
        *out = Bend {
            disk: b.disk + factor * step[0],
            link: b.link + factor * step[1] * self.crank_unit,
        };
    }

    fn admissible(&self, b: &Bend) -> bool {
        b.link.cos() + (b.disk - b.link).cos() > 0.0
    }

    fn step_size(&self, step: &SVector<f64, 2>) -> f64 {
        step[0].abs().max((step[1] * self.crank_unit).abs())
    }
}
