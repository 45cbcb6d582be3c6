//! The tip of two sections as a function of both turns, and Newton's method on it.

use crate::planar::chord::{Chord, Point, cross};

/// Two sections by their lengths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tip {
    pub(super) l1: f64,
    pub(super) l2: f64,
}

/// Newton steps at most; from a fold they halve the distance only.
const STEPS: usize = 40;

/// Newton steps where convergence is certain.
const CERTAIN: usize = 12;

impl Tip {
    /// Position of the tip, and its derivatives by both turns.
    pub(super) fn at(&self, turns: [f64; 2]) -> (Point, Point, Point) {
        let (first, second) = (Chord::new(turns[0]), Chord::new(turns[1]));
        let beyond = first.heading * second.value * self.l2;
        let by_first = first.first * self.l1 + Point::new(-beyond.im, beyond.re);
        (first.value * self.l1 + beyond, by_first, first.heading * second.first * self.l2)
    }

    /// Plain Newton steps, for where their convergence is certain although the miss may grow at first.
    pub(super) fn plain_newton(&self, mut turns: [f64; 2], target: Point) -> ([f64; 2], f64) {
        for _ in 0..CERTAIN {
            let (tip, by_first, by_second) = self.at(turns);
            let step = least_step(by_first, by_second, tip - target);
            turns = [turns[0] - step[0], turns[1] - step[1]];
            if step[0].abs() + step[1].abs() < 1e-9 {
                break;
            }
        }
        self.newton(turns, target)
    }

    /// Turns beyond the limit brought to it, and the other one, if it is not, to where that costs
    /// least.
    pub(super) fn clamp_to_limit(&self, turns: [f64; 2], limit: f64, target: Point) -> [f64; 2] {
        let mut held = turns.map(|turn| turn.clamp(-limit, limit));
        for _ in 0..2 {
            let (tip, by_first, by_second) = self.at(held);
            let share = |by: Point| dot(tip - target, by) / by.norm_sqr();
            if held[0] == turns[0] {
                held[0] = (held[0] - share(by_first)).clamp(-limit, limit);
            } else if held[1] == turns[1] {
                held[1] = (held[1] - share(by_second)).clamp(-limit, limit);
            }
        }
        held
    }

    /// Goes on as long as every step brings the tip nearer. Returns the turns and the miss.
    pub(super) fn newton(&self, mut turns: [f64; 2], target: Point) -> ([f64; 2], f64) {
        let (tip, mut by_first, mut by_second) = self.at(turns);
        let mut off = tip - target;
        let mut miss = off.norm_sqr();
        for _ in 0..STEPS {
            let step = least_step(by_first, by_second, off);
            let next = [turns[0] - step[0], turns[1] - step[1]];
            let (tip, first, second) = self.at(next);
            let (ahead, shorter) = (tip - target, (tip - target).norm_sqr());
            if shorter.is_nan() || shorter >= miss {
                break;
            }
            (turns, off, miss, by_first, by_second) = (next, ahead, shorter, first, second);
            if miss < 1e-34 {
                break;
            }
        }
        (turns, miss.sqrt())
    }
}

/// The least step whose linear effect is `off`; where the derivatives are parallel to rounding, the
/// least one whose effect comes nearest.
fn least_step(a: Point, b: Point, off: Point) -> [f64; 2] {
    let area = cross(a, b);
    let size = a.norm_sqr() + b.norm_sqr();
    if area.abs() > 1e-9 * size {
        return [cross(off, b) / area, cross(a, off) / area];
    }
    // Rank one: both along the longer of the two.
    let along = if a.norm_sqr() > b.norm_sqr() { a } else { b };
    let share = (off.conj() * along).re / (along.norm_sqr() * size);
    [share * dot(a, along), share * dot(b, along)]
}

fn dot(a: Point, b: Point) -> f64 {
    a.re * b.re + a.im * b.im
}
