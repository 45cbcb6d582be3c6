//! The seven-bar linkage: one subsegment in space with one or two tendons.
//!
//! Ashwin & Ghosal (eqs. 9-14) state it in nine coordinates, the points `x0, xa, xb` of the upper
//! disk, under six equalities: the crank `|x0 - X0|`, the couplers `|x0 - xa|` and `|x0 - xb|`, the
//! angle between them, and the tendon pieces `|xa - Xa|`, `|xb - Xb|`. The first four say that the
//! crank is a direction `d` and the couplers are turned by one rotation `R`; writing the points as
//! `x0 = l0 d`, `xj = l0 d + R h'_j` meets them identically, and five coordinates under two
//! equalities remain (`docs/linkage.md`). All lengths here are divided by the rest length `l0`.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::angle::SquaredAngle;
use super::pose::Pose;
use crate::solve::sqp::{Linearization, Problem};

/// A tendon hole on the lower and the upper disk of a subsegment, and the pull on its piece.
/// Lengths in units of the rest length of the subsegment.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::linkage::seven_bar::Hole;
///
/// let hole = Hole::new(Vector3::x() * 0.5, Vector3::x() * 0.4, 0.1);
/// assert!(!hole.is_alike() && hole.rest > 1.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hole {
    /// Place in the lower disk's frame.
    pub lower: Vector3<f64>,
    /// Place in the upper disk's frame.
    pub upper: Vector3<f64>,
    /// Shortening of the tendon piece from its rest length, positive when pulled.
    pub pull: f64,
    /// Length of the tendon piece in a straight subsegment.
    pub rest: f64,
}

impl Hole {
    /// From its places on both disks and the pull.
    #[must_use]
    pub fn new(lower: Vector3<f64>, mut upper: Vector3<f64>, pull: f64) -> Self {
        // Azimuths a full turn apart and the like: one hole but for rounding.
        if (upper - lower).norm() <= 1e-12 * upper.norm() {
            upper = lower;
        }
        let rest = (1.0 + (upper - lower).norm_squared()).sqrt();
        Self { lower, upper, pull, rest }
    }

    /// True when it has the same position on both disks.
    #[must_use]
    pub fn is_alike(&self) -> bool {
        self.lower == self.upper
    }
}

/// Constants of one hole, computed once per subsegment.
#[derive(Clone, Copy, Debug)]
struct Coupler {
    lower: Vector3<f64>,
    upper: Vector3<f64>,
    offset: Vector3<f64>,
    direction: Vector3<f64>,
    /// `(rest^2 - wanted^2) / 2` without cancellation.
    shortfall: f64,
    scale: f64,
    pull: f64,
}

impl Coupler {
    fn new(hole: &Hole) -> Self {
        let scale = 1.0 / hole.upper.norm();
        Self {
            lower: hole.lower,
            upper: hole.upper,
            offset: hole.upper - hole.lower,
            direction: hole.upper * scale,
            shortfall: hole.pull * (hole.rest - 0.5 * hole.pull),
            scale,
            pull: hole.pull,
        }
    }
}

/// Bends below this are solved by the linear theory \[rad\].
pub(super) const TINY_BEND: f64 = 1e-100;

/// Minimum of the squared coupler angles of two holes, of which the first `M` carry a tendon.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::linkage::seven_bar::{Hole, SevenBar};
///
/// let (a, b) = (Vector3::x() * 0.5, Vector3::y() * 0.5);
/// let problem = SevenBar::<2>::new(&[Hole::new(a, a, 0.1), Hole::new(b, b, 0.1)]);
/// assert!(!problem.is_tiny());
/// assert!(problem.start().link.z > 0.9);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct SevenBar<const M: usize> {
    couplers: [Coupler; 2],
    /// Weight of the squared angles between crank and disk axes.
    bisection: f64,
    /// Length of a unit of the crank's local coordinates.
    crank_unit: f64,
}

impl<const M: usize> SevenBar<M> {
    /// From the two holes that span the upper disk; the first `M` carry tendons.
    ///
    /// Where the holes of both disks are alike the objective is the paper's. Where they differ, the
    /// coupler angles alone have no useful minimum (a sheared subsegment takes up the pull at angle
    /// zero), and the angles between crank and disk axes are added; at equal holes both have the same
    /// minimiser.
    #[must_use]
    pub fn new(holes: &[Hole; 2]) -> Self {
        let couplers = [Coupler::new(&holes[0]), Coupler::new(&holes[1])];
        let alike = couplers[..M].iter().all(|c| c.offset == Vector3::zeros());
        let bend = couplers[..M].iter().fold(0.0, |b, c| (c.shortfall * c.scale).abs().max(b));
        // The coupler angles do not see the crank at rest; its curvature grows with the square of the
        // bend. In units of 1/bend the problem is well scaled down to the smallest pull.
        let crank_unit = if alike { 1.0 / bend.clamp(TINY_BEND, 1.0) } else { 1.0 };
        Self { couplers, bisection: if alike { 0.0 } else { 1.0 }, crank_unit }
    }

    /// True when the pull is so small that its square underflows: the start, which is off by a share of
    /// bend^2 / 24, then is the answer to the last digit.
    #[must_use]
    pub fn is_tiny(&self) -> bool {
        self.crank_unit >= 1.0 / TINY_BEND
    }

    /// Bent as the theory of tendons has it to third order, link at half the bend: on the right side
    /// of the mirror, and not the answer.
    #[must_use]
    pub fn start(&self) -> Pose {
        let rows = self.couplers.each_ref().map(|c| (0.5 * (c.lower + c.upper), c.pull));
        let (c, s) = linear_bend(&rows[..M]);
        let bend = (c * c + s * s).sqrt();
        // Too small for squares: the direction from the larger component.
        if bend < 1e-140 {
            return Pose::from_bend(c.hypot(s), s.atan2(c));
        }
        Pose::from_bend_towards(third_order(bend), c / bend, s / bend)
    }
}

/// `2 asin(x/2) = x + x^3/24 + 3 x^5/640 + ...`, cut after its second term: the bend from its linear
/// value, at most 2.3 rad \[rad\].
pub(super) fn third_order(x: f64) -> f64 {
    let x = x.min(2.0);
    x + x * x * x / 24.0
}

/// `(bend cos, bend sin)` to first order, from one or two holes and their pulls: `hole . (c, s) =
/// pull`, the shortest answer for one.
pub(super) fn linear_bend(rows: &[(Vector3<f64>, f64)]) -> (f64, f64) {
    match rows {
        [(a, pull)] => {
            let factor = pull / (a.x * a.x + a.y * a.y).max(f64::MIN_POSITIVE);
            (factor * a.x, factor * a.y)
        }
        [(a, pull_a), (b, pull_b), ..] => {
            let determinant = a.x * b.y - a.y * b.x;
            (
                (pull_a * b.y - pull_b * a.y) / determinant,
                (a.x * pull_b - b.x * pull_a) / determinant,
            )
        }
        [] => (0.0, 0.0),
    }
}

/// A pose with what the value, the gradient and the second derivatives share.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::linkage::seven_bar::Hole;
/// use tdcr::linkage::{LinkageSettings, solve_seven_bar};
///
/// let (a, b) = (Vector3::x() * 0.5, Vector3::y() * 0.5);
/// let holes = [Hole::new(a, a, 0.1), Hole::new(b, b, 0.1)];
/// let found = solve_seven_bar::<2>(&holes, &LinkageSettings::default().sqp(), None);
/// let piece = found.point.pose.link + found.point.pose.rotation() * a - a;
/// assert!((piece.norm() - 0.9).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// The pose itself.
    pub pose: Pose,
    /// `(R - I) h'` of both holes.
    moved: [Vector3<f64>; 2],
    couplers: [SquaredAngle; 2],
    /// Upper disk axis.
    upper: Vector3<f64>,
    /// Angles of the crank with the lower and the upper disk axis; only where they count.
    axes: Option<[SquaredAngle; 2]>,
}

impl<const M: usize> SevenBar<M> {
    /// Readies a pose for the solver.
    #[must_use]
    #[inline(always)]
    pub fn point(&self, pose: Pose) -> Point {
        let moved = [0, 1].map(|j| {
            let hole = &self.couplers[j].upper;
            pose.turn.column(0) * hole.x + pose.turn.column(1) * hole.y
        });
        let couplers = [0, 1].map(|j| {
            let scale = self.couplers[j].scale;
            SquaredAngle::from_squared_distance(moved[j].norm_squared() * scale * scale)
        });
        let upper = Vector3::z() + pose.turn.column(2);
        let axes = (self.bisection > 0.0).then(|| {
            [Vector3::z(), upper]
                .map(|n| SquaredAngle::from_squared_distance((pose.link - n).norm_squared()))
        });
        Point { pose, moved, couplers, upper, axes }
    }
}

/// Quadratic form of the second derivative of `R(w) q . m` by the rotation vector `w`.
#[inline]
fn rotation_hessian(q: &Vector3<f64>, m: &Vector3<f64>) -> Matrix3<f64> {
    let outer = m * q.transpose();
    (outer + outer.transpose()) * 0.5 - Matrix3::from_diagonal_element(q.dot(m))
}

impl<const M: usize> Problem<5, M> for SevenBar<M> {
    type Point = Point;

    #[inline(always)]
    fn linearize(&self, p: &Point, out: &mut Linearization<5, M>) {
        let Pose { link, basis, .. } = &p.pose;
        out.objective = 0.0;
        let mut by_rotation = Vector3::zeros();
        for (j, c) in self.couplers.iter().enumerate() {
            let (moved, angle) = (p.moved[j], &p.couplers[j]);
            out.objective += angle.value;
            // moved x u, not turned x u: parallel vectors would leave only their rounding.
            by_rotation -= moved.cross(&c.direction) * (2.0 * angle.first * c.scale);
            if j < M {
                let shift = moved + c.offset;
                out.constraints[j] = c.scale
                    * (link.dot(&shift) + moved.dot(&(moved * 0.5 + c.offset)) + c.shortfall);
                let turn = (c.upper + moved).cross(&(link - c.lower)) * c.scale;
                let unit = c.scale * self.crank_unit;
                for i in 0..3 {
                    out.jacobian_transposed[(i, j)] = turn[i];
                }
                for k in 0..2 {
                    out.jacobian_transposed[(3 + k, j)] = basis[k].dot(&shift) * unit;
                }
            }
        }
        let mut by_crank = [0.0; 2];
        if let Some([lower, upper]) = &p.axes {
            let weight = self.bisection;
            out.objective += weight * (lower.value + upper.value);
            by_rotation -= p.upper.cross(link) * (2.0 * weight * upper.first);
            let pull = Vector3::z() * lower.first + p.upper * upper.first;
            by_crank = basis.map(|b| -2.0 * weight * self.crank_unit * pull.dot(&b));
        }
        let [x, y, z] = by_rotation.into();
        out.gradient = SVector::from([x, y, z, by_crank[0], by_crank[1]]);
    }

    #[inline]
    fn hessian(&self, p: &Point, multipliers: &SVector<f64, M>) -> SMatrix<f64, 5, 5> {
        let Pose { link, basis, .. } = &p.pose;
        let mut rotation = Matrix3::zeros();
        let mut mixed = Vector3::zeros();
        let mut crank = 0.0;
        for (j, c) in self.couplers.iter().enumerate() {
            let (moved, angle) = (p.moved[j], &p.couplers[j]);
            let turned = c.upper + moved;
            let slope = moved.cross(&c.direction) * c.scale;
            let mut against = c.direction * (-2.0 * angle.first * c.scale);
            if j < M {
                let weight = multipliers[j] * c.scale;
                against += (link - c.lower) * weight;
                mixed += turned * weight;
                crank -= weight * link.dot(&(moved + c.offset));
            }
            rotation += slope * slope.transpose() * (4.0 * angle.second)
                + rotation_hessian(&turned, &against);
        }
        let unit = self.crank_unit;
        let mut h = SMatrix::<f64, 5, 5>::zeros();
        for k in 0..2 {
            let column = mixed.cross(&basis[k]) * unit;
            for i in 0..3 {
                h[(i, 3 + k)] = column[i];
                h[(3 + k, i)] = column[i];
            }
            h[(3 + k, 3 + k)] = crank * unit * unit;
        }
        if let Some(axes) = &p.axes {
            self.add_axes_hessian(p, axes, &mut rotation, &mut h);
        }
        for k in 0..3 {
            for i in 0..3 {
                h[(i, k)] = rotation[(i, k)];
            }
        }
        h
    }

    #[inline]
    fn retract(&self, p: &Point, step: &SVector<f64, 5>, factor: f64, out: &mut Point) {
        let Pose { link, quaternion: [w, x, y, z], basis, .. } = p.pose;
        let unit = factor * self.crank_unit;
        let link = link + basis[0] * (step[3] * unit) + basis[1] * (step[4] * unit);
        let half = 0.5 * factor;
        let (a, b, c) = (half * step[0], half * step[1], half * step[2]);
        // (1, step/2) normalised agrees with Exp(step) to second order.
        let q = [
            w - a * x - b * y - c * z,
            x + a * w + b * z - c * y,
            y + b * w + c * x - a * z,
            z + c * w + a * y - b * x,
        ];
        let scale = 1.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
        *out = self.point(Pose::from_parts(link * (1.0 / link.norm()), q.map(|e| e * scale)));
    }

    #[inline]
    fn admissible(&self, p: &Point) -> bool {
        // The mirror branch has its link on the far side of the bend: behind both disk axes.
        p.pose.link.z + p.pose.link.dot(&p.upper) > 0.0
    }

    #[inline]
    fn step_size(&self, step: &SVector<f64, 5>) -> f64 {
        let turn = step[0].abs().max(step[1].abs()).max(step[2].abs());
        turn.max(step[3].abs().max(step[4].abs()) * self.crank_unit)
    }
}

impl<const M: usize> SevenBar<M> {
    /// Second derivatives of the squared angles between crank and disk axes.
    #[inline]
    fn add_axes_hessian(
        &self,
        p: &Point,
        [f0, f1]: &[SquaredAngle; 2],
        rotation: &mut Matrix3<f64>,
        h: &mut SMatrix<f64, 5, 5>,
    ) {
        let Pose { link, basis, .. } = &p.pose;
        let (upper, weight, unit) = (&p.upper, self.bisection, self.crank_unit);
        let slope = upper.cross(link);
        *rotation += (slope * slope.transpose() * (4.0 * f1.second)
            - rotation_hessian(upper, link) * (2.0 * f1.first))
            * weight;
        let curvature = 2.0 * (f0.first * link.z + f1.first * upper.dot(link));
        let along = basis.map(|b| upper.dot(&b));
        for k in 0..2 {
            let column = (slope * (4.0 * f1.second * along[k])
                - upper.cross(&basis[k]) * (2.0 * f1.first))
                * (weight * unit);
            for i in 0..3 {
                h[(i, 3 + k)] += column[i];
                h[(3 + k, i)] += column[i];
            }
            for l in 0..2 {
                let other =
                    4.0 * (f0.second * basis[k].z * basis[l].z + f1.second * along[k] * along[l]);
                h[(3 + k, 3 + l)] += weight * unit * unit * other;
            }
            h[(3 + k, 3 + k)] += weight * unit * unit * curvature;
        }
    }
}
