//! The point that two sections reach nearest to a target.

use super::TwoSections;
use crate::planar::chord::Point;
use crate::planar::tip_equations::{Scratch, TipEquations};

/// Turns per section of the grid that the search starts from.
const GRID: usize = 41;

/// Distance of a target, in lengths of the trunk, beyond which the search takes one in its direction at
/// this distance: of longer ones the tip's part is lost in rounding.
const FAR: f64 = 1e3;

impl TwoSections {
    /// The turns (turn1, turn2) \[rad\] within the limit whose tip is nearest to (x, y) \[m\], and the
    /// distance \[m\]: the solution of least bending energy where there is one, else the best of the
    /// local minima of the distance that a grid of 41 x 41 turns leads to.
    #[must_use]
    pub fn nearest(&self, x: f64, y: f64) -> ([f64; 2], f64) {
        // A target within reach: its solution of least bending energy.
        let mut found = Vec::new();
        self.solutions(x, y, &mut found);
        if let Some(&turns) = found.first() {
            let tip = self.tip(turns);
            return (turns, (tip.x - x).hypot(tip.y - y));
        }
        let ([l1, l2], limit) = (self.lengths(), self.limit());
        let whole = l1 + l2;
        let distance = x.hypot(y);
        // A far target: another one in its direction. Halves, since the distance itself may overflow.
        if distance > FAR * whole {
            let half = (0.5 * x).hypot(0.5 * y);
            let part = |c: f64| 0.5 * c / half * FAR * whole;
            let (turns, _) = self.nearest(part(x) * (1.0 - 1e-9), part(y) * (1.0 - 1e-9));
            let tip = self.tip(turns);
            return (turns, (tip.x - x).hypot(tip.y - y));
        }
        // Else Newton's method from the local minima of the distance on the grid.
        let problem = TipEquations {
            lengths: vec![l1 / whole, l2 / whole],
            limits: vec![limit; 2],
            target: Point::new(x / whole, y / whole),
            heading: None,
        };
        let turn = |i: usize| limit * (2.0 * i as f64 / (GRID - 1) as f64 - 1.0);
        let mut distances = Vec::with_capacity(GRID * GRID);
        for i in 0..GRID * GRID {
            let tip = self.tip([turn(i / GRID), turn(i % GRID)]);
            distances.push((tip.x - x).hypot(tip.y - y));
        }
        // The best of the minima that these lead to.
        let mut best = ([0.0; 2], f64::INFINITY);
        let mut work = Scratch::default();
        for start in minima(&distances) {
            let mut turns = vec![turn(start / GRID), turn(start % GRID)];
            let (miss, _) = problem.minimize_miss(&mut turns, &mut work);
            if miss * whole < best.1 {
                best = ([turns[0], turns[1]], miss * whole);
            }
        }
        best
    }
}

/// Places on the grid that no neighbour undercuts.
fn minima(values: &[f64]) -> impl Iterator<Item = usize> {
    (0..GRID * GRID).filter(|place| {
        let (i, k) = (place / GRID, place % GRID);
        let around = |i: usize| i.saturating_sub(1)..=(i + 1).min(GRID - 1);
        around(i).all(|i| around(k).all(|k| values[GRID * i + k] >= values[*place]))
    })
}
