//! Rest shapes from curves: a spline through points, frames that do not twist along it.

use nalgebra::{Matrix3, Vector3};

use crate::error::InvalidInput;
use crate::lie::so3;

/// Steps of the frame transport within one subsegment; its error falls with their fourth power.
const TRANSPORT_STEPS: usize = 16;

/// Nodes and weights of the five-point Gauss rule on [0, 1].
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_5, 0.239_314_335_249_683_2),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_2),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

/// Length of a curve and the rest rotation vectors that bend `subsegments` equal pieces along it.
///
/// The curve is a cubic spline through `points` \[m\], parametrised by their chords, with the end
/// slopes of the cubics through the four outer points: order 4 in their spacing. The frames are
/// rotation-minimising (double reflection: Wang, Jüttler, Zheng & Liu, *Computation of rotation
/// minimizing frames*, ACM TOG 27(1), 2008); the first one is the identity turned by the shortest way
/// so that its z axis is the curve's first tangent.
///
/// # Errors
/// `InvalidInput` for fewer than two points, points that are not finite or that repeat, or no
/// subsegment.
pub(super) fn rest_from_curve(
    points: &[Vector3<f64>],
    subsegments: usize,
) -> Result<(f64, Vec<Vector3<f64>>), InvalidInput> {
    if subsegments == 0 {
        return Err(InvalidInput::new("subsegments", "at least 1", 0));
    }
    let spline = Spline::through(points)?;
    let length = spline.length();
    let steps = subsegments * TRANSPORT_STEPS;
    let mut place = spline.at_arc_length(0.0);
    let mut frame = first_frame(&place.1);
    let mut station = frame;
    let mut rest = Vec::with_capacity(subsegments);
    for step in 1..=steps {
        let next = spline.at_arc_length(length * (step as f64 / steps as f64));
        frame = transport(&frame, &place, &next);
        place = next;
        if step % TRANSPORT_STEPS == 0 {
            rest.push(so3::log(&(station.transpose() * frame)));
            station = frame;
        }
    }
    Ok((length, rest))
}

/// The identity turned by the shortest way so that z becomes `tangent`.
fn first_frame(tangent: &Vector3<f64>) -> Matrix3<f64> {
    let axis = Vector3::z().cross(tangent);
    let sine = axis.norm();
    let angle = sine.atan2(tangent.z);
    if sine > 0.0 {
        so3::exp(&(axis * (angle / sine)))
    } else if tangent.z > 0.0 {
        Matrix3::identity()
    } else {
        // Straight down: half a turn about x.
        Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0))
    }
}

/// One step of the double reflection from `(point, tangent)` to the next.
fn transport(
    frame: &Matrix3<f64>,
    (from, tangent): &(Vector3<f64>, Vector3<f64>),
    (to, next_tangent): &(Vector3<f64>, Vector3<f64>),
) -> Matrix3<f64> {
    let chord = to - from;
    let reflect = |v: &Vector3<f64>, normal: &Vector3<f64>| {
        let square = normal.norm_squared();
        if square > 0.0 { v - normal * (2.0 * normal.dot(v) / square) } else { *v }
    };
    let x = reflect(&frame.column(0).into_owned(), &chord);
    let second = next_tangent - reflect(tangent, &chord);
    let x = reflect(&x, &second);
    // Rounding leaves x a little oblique to the tangent.
    let x = (x - next_tangent * x.dot(next_tangent)).normalize();
    Matrix3::from_columns(&[x, next_tangent.cross(&x), *next_tangent])
}

/// A cubic spline through points, with the arc length at each of them.
pub(crate) struct Spline<'p> {
    points: &'p [Vector3<f64>],
    /// Parameter at each point: sum of the chords.
    knots: Vec<f64>,
    /// Derivative by the parameter at each point.
    slopes: Vec<Vector3<f64>>,
    arc_lengths: Vec<f64>,
}

impl<'p> Spline<'p> {
    /// Through points that are finite and do not repeat, at least two.
    pub(crate) fn through(points: &'p [Vector3<f64>]) -> Result<Self, InvalidInput> {
        if points.len() < 2 {
            return Err(InvalidInput::new("points", "at least 2 points", points.len()));
        }
        if let Some(point) = points.iter().find(|point| !point.iter().all(|x| x.is_finite())) {
            let got = format!("({}, {}, {})", point.x, point.y, point.z);
            return Err(InvalidInput::new("points", "finite coordinates [m]", got));
        }
        if let Some(i) = points.windows(2).position(|pair| pair[0] == pair[1]) {
            let got = format!("point {i} twice");
            return Err(InvalidInput::new("points", "neighbours that differ", got));
        }
        Ok(Self::new(points))
    }

    pub(crate) fn length(&self) -> f64 {
        self.arc_lengths[self.points.len() - 1]
    }

    fn new(points: &'p [Vector3<f64>]) -> Self {
        let mut knots = vec![0.0];
        let mut last = 0.0;
        for pair in points.windows(2) {
            last += (pair[1] - pair[0]).norm();
            knots.push(last);
        }
        let slopes = slopes(points, &knots);
        let mut spline = Self { points, knots, slopes, arc_lengths: vec![0.0] };
        let mut length = 0.0;
        for i in 0..points.len() - 1 {
            length += spline.length_within(i, 1.0);
            spline.arc_lengths.push(length);
        }
        spline
    }

    /// Point and derivative by the parameter, at a share of interval `i`.
    fn at(&self, i: usize, share: f64) -> (Vector3<f64>, Vector3<f64>) {
        let step = self.knots[i + 1] - self.knots[i];
        let (a, b) = (self.points[i], self.points[i + 1]);
        let (da, db) = (self.slopes[i] * step, self.slopes[i + 1] * step);
        let chord = b - a;
        // Cubic Hermite form: a + t da + t^2 second + t^3 third.
        let second = chord * 3.0 - da * 2.0 - db;
        let third = da + db - chord * 2.0;
        let t = share;
        (
            a + (da + (second + third * t) * t) * t,
            (da + (second * 2.0 + third * (3.0 * t)) * t) / step,
        )
    }

    /// Arc length from the start of interval `i` to a share of it.
    fn length_within(&self, i: usize, share: f64) -> f64 {
        let step = (self.knots[i + 1] - self.knots[i]) * share;
        GAUSS.iter().map(|(node, weight)| weight * self.at(i, node * share).1.norm()).sum::<f64>()
            * step
    }

    /// Point and unit tangent at an arc length.
    pub(crate) fn at_arc_length(&self, s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let last = self.points.len() - 2;
        let i = self.arc_lengths.partition_point(|at| *at <= s).saturating_sub(1).min(last);
        let step = self.knots[i + 1] - self.knots[i];
        let wanted = s - self.arc_lengths[i];
        let whole = self.arc_lengths[i + 1] - self.arc_lengths[i];
        let mut share = (wanted / whole).clamp(0.0, 1.0);
        // Newton on a monotone function that is nearly linear: a few steps, the budget is for cusps.
        for _ in 0..20 {
            let slope = self.at(i, share).1.norm() * step;
            let change = (wanted - self.length_within(i, share)) / slope.max(f64::MIN_POSITIVE);
            let next = (share + change).clamp(0.0, 1.0);
            let done = (next - share).abs() < 1e-15;
            share = next;
            if done {
                break;
            }
        }
        let (point, derivative) = self.at(i, share);
        (point, derivative.try_normalize(0.0).unwrap_or_else(Vector3::z))
    }
}

/// Slopes at the knots of the twice differentiable cubic spline; end slopes from the cubics through the
/// four outer points (fewer where there are fewer).
fn slopes(points: &[Vector3<f64>], knots: &[f64]) -> Vec<Vector3<f64>> {
    let n = points.len();
    let near = n.min(4);
    let mut slopes = vec![Vector3::zeros(); n];
    slopes[0] = slope_of_polynomial(&points[..near], &knots[..near], 0);
    slopes[n - 1] = slope_of_polynomial(&points[n - near..], &knots[n - near..], near - 1);
    // Thomas algorithm for the inner slopes: continuity of the second derivative.
    let mut upper = vec![0.0; n];
    for i in 1..n - 1 {
        let (before, after) = (knots[i] - knots[i - 1], knots[i + 1] - knots[i]);
        let right = (points[i] - points[i - 1]) * (3.0 * after / before)
            + (points[i + 1] - points[i]) * (3.0 * before / after);
        // after m_{i-1} + 2 (before + after) m_i + before m_{i+1} = right.
        let pivot = 2.0 * (before + after) - after * upper[i - 1];
        upper[i] = before / pivot;
        slopes[i] = (right - slopes[i - 1] * after) / pivot;
    }
    for i in (1..n - 1).rev() {
        let next = slopes[i + 1];
        slopes[i] -= next * upper[i];
    }
    slopes
}

/// Derivative, at one of the knots, of the polynomial through the points (Lagrange's form).
fn slope_of_polynomial(points: &[Vector3<f64>], knots: &[f64], at: usize) -> Vector3<f64> {
    let mut slope = Vector3::zeros();
    for (i, point) in points.iter().enumerate() {
        let others = || (0..knots.len()).filter(move |k| *k != i);
        let scale: f64 = others().map(|k| knots[i] - knots[k]).product();
        // d/dt of the product over k != i of (t - t_k), at knot `at`.
        let derivative: f64 = others()
            .map(|left| {
                others().filter(|k| *k != left).map(|k| knots[at] - knots[k]).product::<f64>()
            })
            .sum();
        slope += point * (derivative / scale);
    }
    slope
}
