//! Every routing of one tendon, where there are few: all valleys over the tension.

use std::collections::BTreeMap;

use super::beam::{Window, search};
use super::search::Search;
use super::table::Field;
use super::task::Holes;

/// Tensions go on by so much of what a bend asks for where all of it pulls on one side \[rad\], and later by this share,
/// to a load (tension times length² over bending stiffness) far beyond what bends a subsegment as far as it can.
const STRIDE: f64 = 0.05;
const SHARE: f64 = 0.03;
const LOAD: f64 = 100.0;
/// Valleys that are polished whether or not they can hold the nearest.
const POLISHED: usize = 20;

/// A routing under a tension: sum of squared distances, and half its slope.
#[derive(Clone, Copy)]
struct At {
    tension: f64,
    value: f64,
    slope: f64,
}

/// Where a routing has a least sum of squared distances.
struct Valley {
    holes: Holes,
    tension: f64,
    /// What that is not expected to fall below.
    least: f64,
}

impl Valley {
    /// Between two tensions of a row; none if it does not fall from the first and rise to the second. Where a
    /// function is convex it lies above its tangents: half as much again is allowed for.
    fn between(holes: &Holes, from: At, to: At) -> Option<Self> {
        if from.slope >= 0.0 || to.slope < 0.0 {
            return None;
        }
        let (down, up, wide) = (2.0 * from.slope, 2.0 * to.slope, to.tension - from.tension);
        let cut = ((to.value - from.value - up * wide) / (down - up)).clamp(0.0, wide);
        let under = from.value.min(to.value);
        let least = under - 1.5 * (under - (from.value + down * cut)).max(0.0);
        let tension = from.tension + wide * from.slope / (from.slope - to.slope);
        Some(Self { holes: holes.clone(), tension, least })
    }

    /// Beyond the last tension of a row, if it still falls there.
    fn beyond(holes: &Holes, last: At, wide: f64) -> Option<Self> {
        let least = last.value + 3.0 * last.slope * wide;
        let own = Self { holes: holes.clone(), tension: last.tension, least };
        (last.slope < 0.0).then_some(own)
    }
}

impl Search<'_, '_> {
    /// Whether one tendon has no more routings than a beam is wide.
    pub(super) fn few(&self) -> bool {
        let task = self.task;
        let jumps = task.settings.max_jump.map_or(self.count, |jump| self.count.min(2 * jump + 1));
        let all = (0..task.end(0)).fold(self.count, |all, _| all.saturating_mul(jumps));
        task.tendons() == 1 && all <= task.settings.beam_width
    }

    /// Polishes every routing in all its valleys that may hold the nearest.
    pub(super) fn every(&mut self) {
        let Some(mut valleys) = self.valleys() else { return };
        valleys.sort_by(|a, b| a.least.total_cmp(&b.least).then_with(|| a.holes.cmp(&b.holes)));
        for (i, valley) in valleys.iter().enumerate() {
            if self.task.stopped() {
                return;
            }
            let best = self.best().map_or(f64::INFINITY, |best| best.value);
            if i >= POLISHED && valley.least > best {
                self.left_out = Some(valley.least);
                return;
            }
            self.try_holes(&valley.holes, &[valley.tension]);
        }
        self.left_out = Some(f64::INFINITY);
    }

    /// Nothing when it was stopped.
    fn valleys(&mut self) -> Option<Vec<Valley>> {
        let task = self.task;
        let asked = (0..task.end(0)).map(|i| task.tension_for(i, STRIDE));
        let stride = asked.fold(f64::INFINITY, f64::min);
        let last = LOAD / task.plan.slenderness;
        let mut field =
            Field::new(task, self.choices(|_, _| (0..self.count).collect()), self.count);
        let mut tensions = vec![0.0];
        let mut valleys = Vec::new();
        let mut ends: BTreeMap<Holes, At> = BTreeMap::new();
        while tensions[0] < last {
            let leaves = field
                .fill(task, &tensions)
                .then(|| search(task, &field, &Window { tensions: &tensions, width: &[0.0] }));
            self.rounds += 1;
            let mut now = BTreeMap::new();
            for leaf in leaves.flatten()? {
                let at = At { tension: tensions[0], value: leaf.value, slope: leaf.slope[0] };
                let before = ends.remove(&leaf.holes);
                valleys.extend(before.and_then(|last| Valley::between(&leaf.holes, last, at)));
                now.insert(leaf.holes, at);
            }
            let wide = stride.max(SHARE * tensions[0]);
            valleys.extend(ends.iter().filter_map(|(holes, at)| Valley::beyond(holes, *at, wide)));
            ends = now;
            tensions[0] += wide;
        }
        let wide = SHARE * last;
        valleys.extend(ends.iter().filter_map(|(holes, at)| Valley::beyond(holes, *at, wide)));
        self.solved += field.solved();
        Some(valleys)
    }
}
