//! The scalar equation at one turn of the first section, and bounds of it around there.

use super::table::Node;
use crate::planar::chord::{Point, sinc};

/// Bound of the derivative of sin(x)/x for any x.
const SINC_SLOPE: f64 = 0.436_182;

/// Scalar equation F at one turn of the first section.
pub(super) struct Equation {
    /// Distance from the joint to the target.
    pub(super) distance: f64,
    /// Angle of the chord to the target against the heading at the joint, in (-pi, pi].
    pub(super) angle: f64,
    pub(super) sin: f64,
    pub(super) cos: f64,
    /// Derivatives of distance and angle by the turn.
    pub(super) distance_rate: [f64; 2],
    pub(super) angle_rate: [f64; 2],
}

/// Value and derivatives of the equation on one sheet of the angle.
#[derive(Clone, Copy)]
pub(super) struct EquationValue {
    pub(super) value: f64,
    pub(super) slope: f64,
    pub(super) second: f64,
    pub(super) sinc_slope: f64,
}

/// Number of roots that an interval may have on one sheet of the angle.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum RootCount {
    /// No root.
    None,
    /// One at most: the equation is monotone.
    One,
    /// Nothing is known yet.
    Unknown,
    /// The equation is within rounding of touching zero all over the interval.
    Touch,
}

impl Equation {
    /// From the vector `to` the target, seen from the joint, and its length.
    pub(super) fn new(l1: f64, node: &Node, to: Point, distance: f64) -> Self {
        let inverse = 1.0 / distance;
        let over = to.conj() * (inverse * inverse * l1);
        let (k1, k2) = (node.first * over, node.second * over);
        Self {
            distance,
            angle: to.im.atan2(to.re),
            sin: to.im * inverse,
            cos: to.re * inverse,
            distance_rate: [-distance * k1.re, distance * (k1.im * k1.im - k2.re)],
            angle_rate: [-k1.im - 1.0, -k2.im - 2.0 * k1.re * k1.im],
        }
    }

    /// Distance minus chord of the second section, turned by twice `angle`.
    pub(super) fn value(&self, l2: f64, angle: f64) -> EquationValue {
        let (value, slope) = sinc(angle, self.sin, self.cos);
        let (d, a) = (self.distance_rate, self.angle_rate);
        // sinc'' = -sinc - 2 sinc'/x.
        let curved = if angle.abs() < 1e-3 { -1.0 / 3.0 } else { -value - 2.0 * slope / angle };
        EquationValue {
            value: self.distance - l2 * value,
            slope: d[0] - l2 * slope * a[0],
            second: d[1] - l2 * (curved * a[0] * a[0] + slope * a[1]),
            sinc_slope: slope,
        }
    }
}

/// Bounds over an interval of the derivatives that make up the equation's.
pub(super) struct Bounds {
    l2: f64,
    /// Second and third derivative of the distance.
    distance: [f64; 2],
    /// First, second and third derivative of the angle.
    angle: [f64; 3],
    /// Largest change of the angle from its middle value.
    pub(super) sweep: f64,
}

impl Bounds {
    /// From the middle of the interval; `rates` are the first derivative of the joint there and a
    /// bound of the second. With `d` the vector from the joint to the target and
    /// `k_n = l1 e^(n)/d`, the derivatives of log d are `-k1`, `-(k2 + k1^2)` and
    /// `-(k3 + 3 k1 k2 + 2 k1^3)`; its parts are the logarithm of the distance and the angle.
    pub(super) fn new(
        at: &Equation,
        [l1, l2]: [f64; 2],
        rates: [f64; 2],
        least: f64,
        half: f64,
    ) -> Self {
        let near = 1.0 / least;
        let k1 = (rates[0] + half * rates[1]) * near;
        let (k2, k3) = (rates[1] * near, 0.25 * l1 * near);
        let most = 2.0 * at.distance - least;
        let (angle2, angle3) = (k2 + k1 * k1, k3 + k1 * (3.0 * k2 + 2.0 * k1 * k1));
        let middle = [at.angle_rate[0].abs(), at.angle_rate[1].abs()];
        let angle2 = angle2.min(middle[1] + half * angle3);
        Self {
            l2,
            distance: [most * (k2 + k1 * k1), most * (k3 + k1 * (4.0 * k2 + 3.0 * k1 * k1))],
            angle: [middle[0] + half * angle2, angle2, angle3],
            sweep: half * (middle[0] + 0.5 * half * angle2),
        }
    }

    /// A bound of the second derivative of the equation, over the interval and directly or from its
    /// value in the middle. The n-th derivative of sin(x)/x is at most 1/(n + 1).
    pub(super) fn bend(&self, at: &EquationValue, half: f64) -> f64 {
        let [a1, a2, a3] = self.angle;
        let slope = (at.sinc_slope.abs() + self.sweep / 3.0).min(SINC_SLOPE);
        let direct = self.distance[0] + self.l2 * (a1 * a1 / 3.0 + slope * a2);
        let third = self.distance[1] + self.l2 * (a1 * (0.25 * a1 * a1 + a2) + slope * a3);
        direct.min(at.second.abs() + half * third)
    }
}

/// Root count of an interval by a bound on the second derivative; values within `margin` of zero may be
/// zero.
pub(super) fn count_roots(at: &EquationValue, bend: f64, half: f64, margin: f64) -> RootCount {
    let curved = 0.5 * bend * half * half;
    if at.value.abs() > at.slope.abs() * half + curved + margin {
        RootCount::None
    } else if at.slope.abs() > bend * half {
        RootCount::One
    } else if curved < margin {
        RootCount::Touch
    } else {
        RootCount::Unknown
    }
}
