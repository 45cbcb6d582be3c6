//! Cost of a particle, in units of the trunk's length.

use std::f64::consts::TAU;

use super::super::chord::Point;
use super::super::clearance::{Circle, clearance};
use super::super::newton_inverse::Solver;
use super::super::tip_equations::HEADING_WEIGHT;

/// Half-turns below this \[rad\] have a chord of the arc's length to rounding.
const STRAIGHT: f64 = 1e-8;

/// Direction in \[-pi, pi\] of an angle.
fn wrap_angle(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

/// Error of a heading, as a length.
fn heading_miss(heading: Option<f64>, sum: f64) -> f64 {
    heading.map_or(0.0, |heading| HEADING_WEIGHT * wrap_angle(sum - heading))
}

/// Turns: the distance of the tip from the target and the heading's miss, as one length.
pub(super) fn tip_error(solver: &Solver<'_>, turns: &[f64]) -> f64 {
    let (mut at, mut frame, mut sum) = (Point::new(0.0, 0.0), Point::new(1.0, 0.0), 0.0);
    for (turn, length) in turns.iter().zip(&solver.problem.lengths) {
        let half = 0.5 * turn;
        let (sin, cos) = half.sin_cos();
        let chord = if half.abs() < STRAIGHT { *length } else { length * sin / half };
        // A chord lies at half the turn.
        let across = frame * Point::new(cos, sin);
        at += across * chord;
        frame = across * Point::new(cos, sin);
        sum += turn;
    }
    let off = at - solver.problem.target;
    off.norm_sqr().sqrt().hypot(heading_miss(solver.heading, sum))
}

/// Margin to the circles, so that turns that are clear here are clear in metres, whatever the rounding.
const SKIN: f64 = 1e-14;

/// Depth by which the trunk enters the circles.
pub(super) fn depth(solver: &Solver<'_>, turns: &[f64], circles: &[Circle]) -> f64 {
    (SKIN - clearance(&solver.problem.lengths, turns, circles)).max(0.0)
}

/// Platforms (x, y) between the base and the target: `sum |c_i h_i/sin(h_i) - l_i|`, the length of the
/// arc from platform to platform (chord c, half-turn h, the direction of the chord in the frame of the
/// platform before) against the section's. Limits and a heading count as lengths too. Fills the turns.
pub(super) fn length_error(solver: &Solver<'_>, places: &[f64], turns: &mut Vec<f64>) -> f64 {
    let problem = &solver.problem;
    let (mut at, mut frame, mut sum) = (Point::new(0.0, 0.0), Point::new(1.0, 0.0), 0.0);
    let mut value = 0.0;
    turns.clear();
    for (i, (length, limit)) in problem.lengths.iter().zip(&problem.limits).enumerate() {
        let next = match places.get(2 * i..2 * i + 2) {
            Some(place) => Point::new(place[0], place[1]),
            None => problem.target,
        };
        let local = frame.conj() * (next - at);
        let chord = local.norm_sqr().sqrt();
        let half = local.im.atan2(local.re);
        let arc = if half.abs() < STRAIGHT { chord } else { chord * half / (local.im / chord) };
        value += (arc - length).abs() + length * (2.0 * half.abs() - limit).max(0.0);
        if chord > 0.0 {
            let across = local / chord;
            frame *= across * across;
        }
        at = next;
        sum += 2.0 * half;
        turns.push(2.0 * half);
    }
    value + heading_miss(solver.heading, sum).abs()
}

/// Turns on the target, the nearest to given ones in energy: what is kept of a particle where circles
/// choose among the answers.
pub(super) struct Projection {
    /// Energy of a clear answer; above that of any, by the miss and the depth, for what is none. So
    /// every answer comes before what is none, without weights (Deb 2000,
    /// [10.1016/S0045-7825(99)00389-8](https://doi.org/10.1016/S0045-7825(99)00389-8)).
    pub(super) value: f64,
    pub(super) clear: bool,
}

/// Brings turns onto the target, in place, and evaluates them.
pub(super) fn project_onto_target(
    solver: &mut Solver<'_>,
    turns: &mut Vec<f64>,
    circles: &[Circle],
) -> Projection {
    solver.unwind(turns);
    solver.work.fixed.clear();
    let miss = solver.problem.move_onto_target(turns, &mut solver.work);
    let depth = depth(solver, turns, circles);
    if miss * solver.total_length <= solver.settings.tolerance && depth == 0.0 {
        return Projection { value: solver.problem.energy(turns), clear: true };
    }
    let most = solver.problem.energy(&solver.problem.limits);
    Projection { value: most + miss + depth, clear: false }
}
