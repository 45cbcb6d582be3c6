//! Every pair of turns that puts the tip of two sections on a point.

mod equation;
mod nearest;
mod polish;
mod search;
mod table;

use std::f64::consts::TAU;

use nalgebra::Vector2;

use super::chord::Point;
use crate::error::{InvalidInput, length};
use polish::Tip;
use search::{CORNER, EDGE, SAME, Search};

/// Two sections of given lengths, ready for any number of targets.
///
/// ```
/// use tdcr::planar::TwoSections;
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let two = TwoSections::new(0.14, 0.12, std::f64::consts::TAU)?;
/// let mut found = Vec::new();
/// two.solutions(0.2, 0.06, &mut found);
/// assert!(found.iter().all(|turns| (two.tip(*turns).y - 0.06).abs() < 1e-12));
/// assert!(found.len() >= 2 && two.energy(found[0]) <= two.energy(found[1]));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoSections {
    lengths: [f64; 2],
    limit: f64,
}

impl TwoSections {
    /// From the lengths of the sections \[m\] and the largest |turn| \[rad\], up to 2 pi.
    ///
    /// # Errors
    /// `InvalidInput` for a length that is not positive or a limit outside (0, 2 pi].
    pub fn new(l1: f64, l2: f64, limit: f64) -> Result<Self, InvalidInput> {
        length("l1", l1)?;
        length("l2", l2)?;
        if !(limit > 0.0 && limit <= TAU) {
            let expected = "a turn above 0 and up to 2 pi [rad]";
            return Err(InvalidInput::new("limit", expected, format!("{limit:?}")));
        }
        Ok(Self { lengths: [l1, l2], limit })
    }

    /// Lengths of the sections \[m\].
    #[must_use]
    pub fn lengths(&self) -> [f64; 2] {
        self.lengths
    }

    /// Largest |turn| \[rad\].
    #[must_use]
    pub fn limit(&self) -> f64 {
        self.limit
    }

    /// All turns (turn1, turn2) \[rad\] with |turn| up to the limit that put the tip on (x, y) \[m\],
    /// by bending energy `turn1^2/(2 l1) + turn2^2/(2 l2)`, least first. What `found` held is
    /// dropped; its memory is reused.
    pub fn solutions(&self, x: f64, y: f64, found: &mut Vec<[f64; 2]>) {
        found.clear();
        self.search(x, y, found);
    }

    /// Solutions as in [`TwoSections::solutions`]; returns the number of intervals examined.
    #[doc(hidden)]
    pub fn search(&self, x: f64, y: f64, found: &mut Vec<[f64; 2]>) -> usize {
        found.clear();
        let whole = self.lengths[0] + self.lengths[1];
        let tip = Tip { l1: self.lengths[0] / whole, l2: self.lengths[1] / whole };
        let target = Point::new(x / whole, y / whole);
        if target.norm().is_nan() || target.norm() > 1.0 + EDGE {
            return 0;
        }
        let mut search = Search { tip, target, found, interval_count: 0 };
        search.run();
        if target.norm() < CORNER {
            search.corners();
        }
        let interval_count = search.interval_count;
        self.select_solutions(tip, target, found);
        interval_count
    }

    /// Clamps to the limit, drops what then misses the target and what is there twice, and sorts.
    fn select_solutions(&self, tip: Tip, target: Point, found: &mut Vec<[f64; 2]>) {
        if target.norm() <= EDGE {
            // Both sections closed circles: every corner of the square of turns.
            found.extend([[TAU, TAU], [TAU, -TAU], [-TAU, TAU], [-TAU, -TAU]]);
        }
        let limit = self.limit;
        found.retain_mut(|turns| {
            if turns.iter().all(|turn| turn.abs() <= limit) {
                return true;
            }
            *turns = tip.clamp_to_limit(*turns, limit, target);
            (tip.at(*turns).0 - target).norm() <= 5.0 * EDGE
        });
        let mut kept = 0;
        for i in 0..found.len() {
            let turns = found[i];
            let known = found[..kept]
                .iter()
                .any(|k| (k[0] - turns[0]).abs() < SAME && (k[1] - turns[1]).abs() < SAME);
            if !known {
                found[kept] = turns;
                kept += 1;
            }
        }
        found.truncate(kept);
        found.sort_unstable_by(|a, b| {
            let [a, b] = [a, b].map(|turns| self.energy(*turns));
            a.total_cmp(&b)
        });
    }

    /// Bending energy of a pair of turns for EI = 1 \[1/m\].
    #[must_use]
    pub fn energy(&self, turns: [f64; 2]) -> f64 {
        0.5 * (turns[0] * turns[0] / self.lengths[0] + turns[1] * turns[1] / self.lengths[1])
    }

    /// Position of the tip at a pair of turns \[m\].
    #[must_use]
    pub fn tip(&self, turns: [f64; 2]) -> Vector2<f64> {
        let tip = Tip { l1: self.lengths[0], l2: self.lengths[1] }.at(turns).0;
        Vector2::new(tip.re, tip.im)
    }
}
