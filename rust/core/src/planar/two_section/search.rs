//! Every root of the scalar equation, by bisection that a bound on the second derivative ends.
//!
//! Lengths are in units of the trunk's, so that tolerances are pure numbers.

use std::f64::consts::{PI, TAU};

use super::equation::{Bounds, Equation, EquationValue, RootCount, count_roots};
use super::polish::Tip;
use super::table::{FIRST, Node, ROOTS, level_start, nodes};
use crate::planar::chord::{Point, cross};

/// Miss of the target that counts as none, in trunk lengths: what is closer than this to the edge of
/// the workspace is on it.
pub(super) const EDGE: f64 = 1e-13;

/// Reach of the joint's stretch, in trunk lengths, below which it is halved no more where the second
/// section is all but a closed circle.
const NARROW: f64 = 1e-12;

/// Targets nearer to the base than this are searched at the corners of the square of turns too.
pub(super) const CORNER: f64 = 1e-3;

/// Values of the equation that are rounding, in trunk lengths.
const ROUNDING: f64 = 2e-15;

/// Miss of a simple root: rounding.
const SHARP: f64 = 2e-15;

/// Solutions whose turns differ by less are one \[rad\].
pub(super) const SAME: f64 = 1e-8;

/// Steps of a safeguarded Newton iteration; halving alone would end it.
const STEPS: usize = 60;

/// Intervals examined before halving stops: a guard, far above what any target of the
/// tests takes.
const MOST: usize = 100_000;

/// Deepest halving: `FIRST / 2^DEPTH` is near the spacing of the numbers.
const DEPTH: usize = 48;

/// A monotone stretch: where it is, and the angle on it.
struct MonotoneInterval {
    middle: f64,
    half: f64,
    /// Angle in the middle, its rate, and how far it goes from there at most.
    angle: f64,
    rate: f64,
    sweep: f64,
}

/// Turns within `half` of `turn`: interval `index` of a level of halving.
#[derive(Clone, Copy)]
struct Interval {
    level: usize,
    index: usize,
    turn: f64,
    half: f64,
}

/// One target of a trunk of two sections, lengths and target in units of the trunk's length.
pub(super) struct Search<'a> {
    pub(super) tip: Tip,
    pub(super) target: Point,
    /// The turns found, in the order of the first.
    pub(super) found: &'a mut Vec<[f64; 2]>,
    /// Intervals examined so far.
    pub(super) interval_count: usize,
}

impl Search<'_> {
    /// Finds every solution with turns within 2 pi.
    pub(super) fn run(&mut self) {
        let table = nodes();
        let mut stack = [Interval { level: 0, index: 0, turn: 0.0, half: FIRST }; DEPTH + 2];
        for index in 0..ROOTS {
            (stack[0].index, stack[0].level, stack[0].half) = (index, 0, FIRST);
            stack[0].turn = (index as f64 + 0.5) * 2.0 * FIRST - TAU;
            let mut top = 1;
            while top > 0 {
                top -= 1;
                let Interval { level, index, turn, half } = stack[top];
                let decided = match level_start(level) {
                    Some(start) => self.examine(&table[start + index], half),
                    None => self.examine(&Node::new(turn), half),
                };
                if !decided && level < DEPTH && self.interval_count < MOST {
                    let (level, half) = (level + 1, 0.5 * half);
                    // The left half on top: roots come in order.
                    stack[top] = Interval { level, index: 2 * index + 1, turn: turn + half, half };
                    stack[top + 1] = Interval { level, index: 2 * index, turn: turn - half, half };
                    top += 2;
                }
            }
        }
    }

    /// Notes the roots in the interval of half-width `half` about a node; false if it must be halved.
    fn examine(&mut self, node: &Node, half: f64) -> bool {
        self.interval_count += 1;
        let (l1, l2) = (self.tip.l1, self.tip.l2);
        let to = self.target * node.back - node.chord * l1;
        let distance = to.norm_sqr().sqrt();
        // |e''| <= 1/3 and |e'''| <= 1/4 over the interval.
        let second = l1 * (node.second_norm + 0.25 * half).min(1.0 / 3.0);
        let moves = half * (l1 * node.first_norm + 0.5 * half * second);
        if distance - moves > l2 + EDGE {
            return true;
        }
        let least = distance - moves;
        if least < 0.5 * distance {
            // The joint may reach the target, where the angle has no meaning.
            return self.closed_circle(node, distance + moves, half);
        }
        let equation = Equation::new(l1, node, to, distance);
        let bounds = Bounds::new(&equation, [l1, l2], [l1 * node.first_norm, second], least, half);
        let (bend, sweep) = (|value: &EquationValue| bounds.bend(value, half), bounds.sweep);
        if sweep > 1.5 {
            return false;
        }
        // Past pi the angle goes on from -pi: both sheets, each smooth, and neither with a root
        // beyond its own end, where sinc is negative.
        let over = TAU.copysign(-equation.angle) + equation.angle;
        let both = equation.angle.abs() + sweep >= PI;
        let margin = self.margin(distance);
        let mut kinds = [(equation.angle, RootCount::None), (over, RootCount::None)];
        let mut values = [equation.value(l2, equation.angle); 2];
        for (k, (angle, count)) in kinds.iter_mut().enumerate().take(1 + usize::from(both)) {
            values[k] = equation.value(l2, *angle);
            *count = count_roots(&values[k], bend(&values[k]), half, margin);
            if *count == RootCount::Unknown {
                return false;
            }
        }
        let rate = equation.angle_rate[0];
        for ((angle, count), value) in kinds.into_iter().zip(values) {
            let interval = MonotoneInterval { middle: node.turn, half, angle, rate, sweep };
            match count {
                RootCount::One => self.descend(&interval, &value),
                RootCount::Touch => self.tangent(&interval),
                RootCount::None | RootCount::Unknown => {}
            }
        }
        true
    }

    /// Equation at any turn, and its angle on the sheet of a reference less than pi away.
    fn equation_at(&self, turn: f64, reference: f64) -> (Equation, f64) {
        let node = Node::new(turn);
        let to = self.target * node.back - node.chord * self.tip.l1;
        let equation = Equation::new(self.tip.l1, &node, to, to.norm_sqr().sqrt());
        let angle = equation.angle + TAU * ((reference - equation.angle) / TAU).round();
        (equation, angle)
    }

    /// The one root of a monotone stretch, if it has one.
    fn descend(&mut self, interval: &MonotoneInterval, value: &EquationValue) {
        let &MonotoneInterval { middle, half, angle, rate, sweep } = interval;
        let step = (-value.value / value.slope).clamp(-half, half);
        // The whole system from the step of the scalar equation: whatever it finds in the stretch is
        // the root.
        let guess = [middle + step, 2.0 * (angle + rate * step)];
        let (turns, miss) = self.tip.newton(guess, self.target);
        let inside = (turns[0] - middle).abs() <= half + SAME
            && (0.5 * turns[1] - angle).abs() <= sweep * (1.0 + 1e-9) + 1e-12;
        if miss <= SHARP && inside {
            self.found.push(turns);
        } else {
            self.bracket(middle, half, angle, value);
        }
    }

    /// Root of a monotone interval by Newton's method between brackets.
    fn bracket(&mut self, middle: f64, half: f64, reference: f64, value: &EquationValue) {
        let (mut low, mut high) = (middle - half, middle + half);
        let mut turn = (middle - value.value / value.slope).clamp(low, high);
        for _ in 0..STEPS {
            let (equation, angle) = self.equation_at(turn, reference);
            let at = equation.value(self.tip.l2, angle);
            let next = turn - at.value / at.slope;
            let near = (next - turn).abs() < 1e-7;
            if near && (low..=high).contains(&next) {
                self.keep_polished([
                    next,
                    2.0 * angle + 2.0 * equation.angle_rate[0] * (next - turn),
                ]);
                return;
            }
            if (at.value < 0.0) == (at.slope < 0.0) {
                high = turn;
            } else {
                low = turn;
            }
            if high - low < 1e-9 * half {
                // The root is beyond the end, unless it is on it.
                if near {
                    self.keep_polished([turn, 2.0 * angle]);
                }
                return;
            }
            turn = next.clamp(middle - half, middle + half);
            if turn < low || turn > high {
                turn = 0.5 * (low + high);
            }
        }
    }

    /// A stretch on which the joint comes within `reach` of the target: the second section is all but
    /// a closed circle, turned by nearly 2 pi to the one side or the other. When the derivative of
    /// the tip varies little over all such turns, each side holds one solution at most.
    fn closed_circle(&mut self, node: &Node, reach: f64, half: f64) -> bool {
        let Tip { l1, l2 } = self.tip;
        // |e(b)| >= (2 pi - |b|)/(2 pi).
        let short = TAU * reach / l2;
        let (c1, c2) = (l1 * node.first_norm, l2 / TAU);
        let area = l1 * l2 / TAU * cross(node.first, Point::new(1.0, 0.0)).abs();
        // A box of these half-widths holds the solutions and Newton's way to them.
        let wide = 2.0 * half.max(short * c2 / c1);
        let long = 2.0 * short.max(half * c1 / c2);
        let rate = 1.0 / TAU + long / 3.0;
        let v1 = l1 * wide / 3.0 + l2 * long * rate;
        let v2 = l2 * (wide * rate + long / 3.0);
        if c2 * v1 + c1 * v2 > 0.25 * area {
            if reach > NARROW && half > NARROW {
                return false;
            }
            self.keep_polished([node.turn, TAU]);
            self.keep_polished([node.turn, -TAU]);
            return true;
        }
        for side in [TAU, -TAU] {
            let (turns, miss) = self.tip.plain_newton([node.turn, side], self.target);
            if miss <= EDGE && (turns[0] - node.turn).abs() <= half * (1.0 + 1e-9) {
                self.found.push(turns);
            }
        }
        true
    }

    /// A stretch on which the equation is within rounding of touching zero: to the extremum, and from
    /// there to both roots, or to the one double one.
    fn tangent(&mut self, interval: &MonotoneInterval) {
        let mut turn = interval.middle;
        for _ in 0..4 {
            let (equation, angle) = self.equation_at(turn, interval.angle);
            let at = equation.value(self.tip.l2, angle);
            if at.slope.abs() >= at.second.abs() * 16.0 * interval.half {
                return self.keep_polished([turn, 2.0 * angle]);
            }
            turn -= at.slope / at.second;
        }
        let (equation, angle) = self.equation_at(turn, interval.angle);
        let at = equation.value(self.tip.l2, angle);
        let rounding = ROUNDING.max(self.margin(equation.distance) - EDGE);
        if -at.value * at.second.signum() < rounding {
            self.keep_polished([turn, 2.0 * angle]);
            if rounding <= ROUNDING {
                return;
            }
        }
        // Where the equation is coarse, the tip itself tells from either side whether there are two.
        let apart = (2.0 * at.value.abs().max(rounding) / at.second.abs()).sqrt();
        for step in [-apart, apart] {
            self.keep_polished([turn + step, 2.0 * (angle + equation.angle_rate[0] * step)]);
        }
    }

    /// Values of the equation that may be zero: the edge of the workspace, and the rounding of an angle
    /// taken at a short distance.
    fn margin(&self, distance: f64) -> f64 {
        EDGE + 1e-15 * self.tip.l2 / distance
    }

    /// Targets all but at the base, where both sections may be all but closed circles and the equation
    /// is lost in rounding: from the solutions of the tip's expansion to second order in the turns
    /// short of 2 pi, `-(l1 u + l2 v) = 2 pi x` and
    /// `s1 l1 u^2 + 2 s1 l2 u v + s2 l2 v^2 = 4 pi y` with the signs s of the turns, and from pairs
    /// between them that meet the first equation.
    pub(super) fn corners(&mut self) {
        let Tip { l1, l2 } = self.tip;
        let short = -TAU * self.target.re;
        for (s1, s2) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let (whole, lead) = (short / l1, l1 * (s2 * l1 / l2 - s1));
            let rest = s2 * short * short / l2 - 2.0 * TAU * self.target.im;
            let apart = (whole * whole - rest / lead).max(0.0).sqrt().min(1.0);
            let even = [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| share * whole);
            for u in even.into_iter().chain([whole - apart, whole + apart]) {
                let v = (short - l1 * u) / l2;
                let guess = [s1 * (TAU - u), s2 * (TAU - v)];
                self.keep_polished(guess);
                let (turns, miss) = self.tip.plain_newton(guess, self.target);
                if miss <= EDGE {
                    self.found.push(turns);
                }
            }
        }
    }

    /// Polishes and keeps what hits the target.
    fn keep_polished(&mut self, guess: [f64; 2]) {
        let (turns, miss) = self.tip.newton(guess, self.target);
        if miss <= EDGE {
            self.found.push(turns);
        }
    }
}
