//! Distance of a bent trunk from circles: exact, arc by arc.

use std::f64::consts::TAU;

use nalgebra::Vector2;

use super::chord::{Chord, Point};
use super::trunk::Trunk;
use crate::error::{InvalidInput, finite, positive};

/// A disk that the axis of the trunk has to stay out of.
///
/// ```
/// use tdcr::planar::{Circle, Trunk};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let trunk = Trunk::new(vec![0.14], 0.06)?;
/// let circle = Circle::new(0.07, 0.05, 0.02)?;
/// assert!((trunk.clearance(&[0.0], &[circle]) - 0.03).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// Its middle \[m\].
    pub center: Vector2<f64>,
    /// Its radius \[m\]: the obstacle's and whatever the trunk's thickness and caution add.
    pub radius: f64,
}

impl Circle {
    /// From its middle and radius \[m\].
    ///
    /// # Errors
    /// `InvalidInput` for a middle that is not finite or a radius that is not positive.
    pub fn new(x: f64, y: f64, radius: f64) -> Result<Self, InvalidInput> {
        let center = Vector2::new(finite("x", "m", x)?, finite("y", "m", y)?);
        Ok(Self { center, radius: positive("radius", "m", radius)? })
    }
}

impl Trunk {
    /// Smallest distance of the axis from the edges of the circles \[m\]: negative where it enters one,
    /// infinite without circles.
    #[must_use]
    pub fn clearance(&self, turns: &[f64], circles: &[Circle]) -> f64 {
        clearance(self.lengths(), turns, circles)
    }
}

pub(super) fn clearance(lengths: &[f64], turns: &[f64], circles: &[Circle]) -> f64 {
    let (mut at, mut frame) = (Point::new(0.0, 0.0), Point::new(1.0, 0.0));
    let mut least = f64::INFINITY;
    if circles.is_empty() {
        return least;
    }
    for (turn, length) in turns.iter().zip(lengths) {
        let chord = Chord::new(*turn);
        for circle in circles {
            let to = Point::new(circle.center.x, circle.center.y) - at;
            let local = frame.conj() * to / *length;
            let distance = length * from_arc(*turn, local, chord.value);
            least = least.min(distance - circle.radius);
        }
        at += frame * chord.value * *length;
        frame *= chord.heading;
    }
    least
}

/// Distance of a point from the arc of unit length that starts at the origin along x and turns by
/// `turn`, at most a whole turn either way; `end` is the arc's.
///
/// The circle of the arc has its middle at (0, 1/turn), so the distance of (u, v) from it,
/// `| |p - o| - 1/|turn| |`, is `|turn (u^2 + v^2) - 2 v| / (|turn (p - o)| + 1)`: nothing cancels when
/// the arc is straight. Its foot lies where the arc has turned by `atan2(turn u, 1 - turn v)`.
fn from_arc(turn: f64, point: Point, end: Point) -> f64 {
    let (u, v) = (point.re, point.im);
    let foot = (turn * u).atan2(1.0 - turn * v);
    // Turns that underflow leave a straight line.
    let share = if turn.abs() < 1e-150 {
        u
    } else {
        let share = foot / turn;
        if share < 0.0 { share + TAU / turn.abs() } else { share }
    };
    if (0.0..=1.0).contains(&share) {
        return (turn * point.norm_sqr() - 2.0 * v).abs()
            / ((turn * u).hypot(turn * v - 1.0) + 1.0);
    }
    point.norm().min((point - end).norm())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against points along the arc, for every turn and for points near, far, and in its middle.
    #[test]
    fn distances_from_arcs() {
        let n = 4000;
        for i in -63..=63 {
            let turn = if i == 0 { 1e-12 } else { f64::from(i) * TAU / 63.0 };
            let arc: Vec<Point> = (0..=n)
                .map(|k| f64::from(k) / f64::from(n))
                .map(|s| Chord::new(turn * s).value * s)
                .collect();
            let end = Chord::new(turn).value;
            for k in 0..400 {
                let (radius, angle) = (0.005 * f64::from(k % 97) * 3.0, f64::from(k) * 0.7);
                let point = Point::new(radius * angle.cos(), radius * angle.sin());
                let least = arc.iter().map(|p| (p - point).norm()).fold(f64::INFINITY, f64::min);
                let got = from_arc(turn, point, end);
                assert!(got <= least + 1e-12 && got > least - 2e-4, "{turn} {point} {got} {least}");
            }
        }
        // Straight, nearly straight and by the closed form.
        for turn in [0.0, 1e-300, 1e-160, 1e-9, -1e-9] {
            let end = Chord::new(turn).value;
            assert!((from_arc(turn, Point::new(0.5, 0.3), end) - 0.3).abs() < 1e-9);
            assert!((from_arc(turn, Point::new(-0.3, 0.4), end) - 0.5).abs() < 1e-12);
            assert!((from_arc(turn, Point::new(1.3, 0.4), end) - 0.5).abs() < 1e-8);
        }
        let middle = Point::new(0.0, 1.0 / TAU);
        assert!((from_arc(TAU, middle, Chord::new(TAU).value) - 1.0 / TAU).abs() < 1e-15);
    }
}
