//! The angle function along a curve and the curve that it makes (Mahfoudi et al. 2014, eqs. 10-11).

use nalgebra::Vector2;

use crate::error::{InvalidInput, finite};

/// A natural cubic spline through nodal angles: twice continuously differentiable, second derivative
/// zero at both ends.
///
/// ```
/// use tdcr::planar::AngleFunction;
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let function = AngleFunction::new(vec![0.0, 0.1, 0.2], &[0.0, 0.5, 0.0])?;
/// assert_eq!(function.at(0.1), 0.5);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct AngleFunction {
    nodes: Vec<f64>,
    /// Per piece (a, b, c, d) of `a u^3 + b u^2 + c u + d` with `u = (s - s_i)/h_i` in \[0, 1\].
    pieces: Vec<[f64; 4]>,
}

/// A curve of unit speed at the ends of Simpson's double intervals.
///
/// ```
/// use tdcr::planar::AngleFunction;
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// // A straight line at 0.3 rad.
/// let curve = AngleFunction::new(vec![0.0, 0.2], &[0.3, 0.3])?.curve(10)?;
/// let tip = curve.points[curve.points.len() - 1];
/// assert!((tip.y - 0.2 * 0.3_f64.sin()).abs() < 1e-15 && curve.error < 1e-15);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Arc lengths \[m\].
    pub s: Vec<f64>,
    /// Points \[m\]; the first is the origin.
    pub points: Vec<Vector2<f64>>,
    /// Headings \[rad\].
    pub headings: Vec<f64>,
    /// Bound of the distance of any point from the exact integral, rounding apart \[m\].
    pub error: f64,
}

impl AngleFunction {
    /// Through angles \[rad\] at arc lengths s \[m\].
    ///
    /// # Errors
    /// `InvalidInput` for fewer than two nodes, arc lengths that do not rise, other numbers of angles
    /// than nodes, values that are not finite, or a spline that overflows.
    pub fn new(s: Vec<f64>, angles: &[f64]) -> Result<Self, InvalidInput> {
        // Nodes: at least two, finite, rising.
        if s.len() < 2 {
            return Err(InvalidInput::new("s", "at least 2 nodes", s.len()));
        }
        if angles.len() != s.len() {
            let expected = format!("{} values, one per node", s.len());
            return Err(InvalidInput::new("angles", expected, angles.len()));
        }
        for (i, (&node, &angle)) in s.iter().zip(angles).enumerate() {
            finite(&format!("s[{i}]"), "m", node)?;
            finite(&format!("angles[{i}]"), "rad", angle)?;
            if i > 0 && node <= s[i - 1] {
                let got = format!("{node} after {}", s[i - 1]);
                return Err(InvalidInput::new(format!("s[{i}]"), "arc lengths that rise [m]", got));
            }
        }
        let span = s[s.len() - 1] - s[0];
        // Four times: sums of the elimination.
        if !(4.0 * span).is_finite() {
            let got = format!("{:?} to {:?}", s[0], s[s.len() - 1]);
            return Err(InvalidInput::new("s", "a span that does not overflow [m]", got));
        }
        // Coefficients a, b, c, d of every piece (eq. 10).
        let curvature = second_derivatives(&s, angles);
        let piece = |i: usize| {
            let h = s[i + 1] - s[i];
            let (m, n) = (curvature[i] * h * h / 6.0, curvature[i + 1] * h * h / 6.0);
            [n - m, 3.0 * m, angles[i + 1] - angles[i] - 2.0 * m - n, angles[i]]
        };
        let pieces: Vec<_> = (0..s.len() - 1).map(piece).collect();
        let function = Self { nodes: s, pieces };
        // The bound of Simpson's error for one interval per piece: less for any other number.
        let bound = |i: usize| (function.nodes[i + 1] - function.nodes[i]) * function.fourth(i);
        let whole: f64 = (0..function.pieces.len()).map(bound).sum();
        if whole.is_finite() && function.pieces.iter().flatten().all(|c| c.is_finite()) {
            return Ok(function);
        }
        let expected = "nodes at distances that keep the spline from overflowing";
        let nearest = function.nodes.windows(2).map(|ends| ends[1] - ends[0]).reduce(f64::min);
        let got = format!("{:?} m at least", nearest.unwrap_or(span));
        Err(InvalidInput::new("s", expected, got))
    }

    /// The nodes \[m\].
    #[must_use]
    pub fn nodes(&self) -> &[f64] {
        &self.nodes
    }

    /// Coefficients (a, b, c, d) of every piece \[rad\] (eq. 10).
    #[must_use]
    pub fn coefficients(&self) -> &[[f64; 4]] {
        &self.pieces
    }

    /// The angle at s \[rad\]; outside of the nodes the outer pieces go on.
    #[must_use]
    pub fn at(&self, s: f64) -> f64 {
        let behind = self.nodes.partition_point(|node| *node <= s);
        let i = behind.clamp(1, self.pieces.len()) - 1;
        self.in_piece(i, (s - self.nodes[i]) / (self.nodes[i + 1] - self.nodes[i]))
    }

    fn in_piece(&self, i: usize, u: f64) -> f64 {
        let [a, b, c, d] = self.pieces[i];
        ((a * u + b) * u + c) * u + d
    }

    /// The curve by Simpson's rule (eq. 11) with at least `intervals` intervals, an even number on
    /// every piece, so that the rule never straddles a node and its error bound holds:
    /// `h^4 l/180` times the largest fourth derivative of `exp(i alpha)` on the piece.
    ///
    /// # Errors
    /// `InvalidInput` for fewer than two intervals or more than fit into memory.
    pub fn curve(&self, intervals: usize) -> Result<Curve, InvalidInput> {
        const MOST: usize = 100_000_000;
        if !(2..=MOST).contains(&intervals) {
            let expected = format!("2 to {MOST} intervals");
            return Err(InvalidInput::new("intervals", expected, intervals));
        }
        // The curve starts at the origin with the first heading.
        let whole = self.nodes[self.nodes.len() - 1] - self.nodes[0];
        let start = self.nodes[0];
        let mut curve = Curve {
            s: vec![start],
            points: vec![Vector2::zeros()],
            headings: vec![self.in_piece(0, 0.0)],
            error: 0.0,
        };
        let mut at = Vector2::zeros();
        let direction = |angle: f64| Vector2::new(angle.cos(), angle.sin());
        for (i, ends) in self.nodes.windows(2).enumerate() {
            let length = ends[1] - ends[0];
            let share = 0.5 * intervals as f64 * (length / whole);
            // Rounding must not add a pair where the share is whole.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Within MOST.
            let pairs = (share - 1e-9 * share).ceil().max(1.0) as usize;
            // Simpson's rule (eq. 11), two intervals of length h at a time.
            let h = 0.5 * length / pairs as f64;
            let mut before = direction(self.in_piece(i, 0.0));
            for k in 0..pairs {
                let u = |half: usize| half as f64 / (2 * pairs) as f64;
                let heading = self.in_piece(i, u(2 * k + 2));
                let after = direction(heading);
                at +=
                    (before + direction(self.in_piece(i, u(2 * k + 1))) * 4.0 + after) * (h / 3.0);
                before = after;
                curve.s.push(ends[0] + length * u(2 * k + 2));
                curve.points.push(at);
                curve.headings.push(heading);
            }
            // Error bound of the piece, h^4 l/180 max |(exp(i alpha))''''|.
            let share = 0.5 / pairs as f64;
            curve.error += share.powi(4) / 180.0 * (length * self.fourth(i));
        }
        Ok(curve)
    }

    /// Bound of the fourth derivative of `exp(i alpha)` by `u = (s - s_i)/h` on a piece:
    /// `|-3 a2^2 - 4 a1 a3 + i 6 a1^2 a2 + a1^4|` with the derivatives a1, a2, a3 of alpha.
    fn fourth(&self, i: usize) -> f64 {
        let [a, b, c, _] = self.pieces[i];
        let slope = |u: f64| ((3.0 * a * u + 2.0 * b) * u + c).abs();
        // The slope is largest at an end or where it turns.
        let turning = if a == 0.0 { 0.0 } else { (-b / (3.0 * a)).clamp(0.0, 1.0) };
        let a1 = slope(0.0).max(slope(1.0)).max(slope(turning));
        let a2 = (2.0 * b).abs().max((6.0 * a + 2.0 * b).abs());
        let a3 = (6.0 * a).abs();
        let real = 3.0 * a2 * a2 + 4.0 * a1 * a3 + a1.powi(4);
        real.hypot(6.0 * a1 * a1 * a2)
    }
}

/// Second derivatives at the nodes: the tridiagonal system of the natural spline.
fn second_derivatives(s: &[f64], angles: &[f64]) -> Vec<f64> {
    let n = s.len();
    let mut second = vec![0.0; n];
    // Elimination forward: row i is second[i] + above[i] second[i + 1] = right.
    let mut above = vec![0.0; n];
    for i in 1..n - 1 {
        let (before, after) = (s[i] - s[i - 1], s[i + 1] - s[i]);
        let bend = (angles[i + 1] - angles[i]) / after - (angles[i] - angles[i - 1]) / before;
        let pivot = 2.0 * (before + after) - before * above[i - 1];
        above[i] = after / pivot;
        second[i] = (6.0 * bend - before * second[i - 1]) / pivot;
    }
    for i in (1..n - 1).rev() {
        second[i] -= above[i] * second[i + 1];
    }
    second
}
