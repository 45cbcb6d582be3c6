//! Every routing of one tendon, where there are few: all valleys over the tension.

use std::collections::BTreeMap;

use super::beam_search::{Window, beam_search};
use super::hole_search::HoleSearch;
use super::subsegment_table::SubsegmentTables;
use super::task::Holes;

/// Tensions go on by so much of what a bend asks for where all of it pulls on one side \[rad\], and later by this
/// share, to a load (tension times length² over bending stiffness) far beyond what bends a subsegment as far as it can.
const STRIDE: f64 = 0.05;
const SHARE: f64 = 0.03;
const LOAD: f64 = 100.0;
/// Factor by which valleys may fall more steeply than at their beginning.
const MARGIN: f64 = 1.5;
/// Valleys that are polished whether or not they can hold the nearest.
const REFINED: usize = 20;

/// A routing under a tension: sum of squared distances, and half its slope.
#[derive(Clone, Copy)]
struct TensionSample {
    tension: f64,
    value: f64,
    slope: f64,
}

/// Stretch of tensions in which a routing has a least sum of squared distances.
struct Valley {
    holes: Holes,
    from: f64,
    to: f64,
    /// Value that the sum is not expected to fall below.
    least: f64,
}

impl Valley {
    /// From a tension of a row to the next, where it no longer falls or the routing has no shape; none if it does not
    /// fall from the first on. It may end in an edge: where a tendon that crosses sides goes aside, at the latest.
    fn new(holes: &Holes, from: TensionSample, to: f64, rises: bool) -> Option<Self> {
        let least = from.value + MARGIN * 2.0 * from.slope * (to - from.tension);
        let own = Self { holes: holes.clone(), from: from.tension, to, least };
        (from.slope < 0.0 && rises).then_some(own)
    }
}

impl HoleSearch<'_, '_> {
    /// Decision that one tendon has no more routings than a beam is wide.
    pub(super) fn has_few_routings(&self) -> bool {
        let task = self.task;
        let jumps = task.settings.max_jump.map_or(self.count, |jump| self.count.min(2 * jump + 1));
        let all = (0..task.end(0)).fold(self.count, |all, _| all.saturating_mul(jumps));
        task.tendons() == 1 && all <= task.settings.beam_width
    }

    /// Polishes every routing in all its valleys that may hold the nearest.
    pub(super) fn try_all(&mut self) {
        let Some(mut valleys) = self.valleys() else { return };
        valleys.sort_by(|a, b| a.least.total_cmp(&b.least).then_with(|| a.holes.cmp(&b.holes)));
        for (i, valley) in valleys.iter().enumerate() {
            if self.task.is_stopped() {
                return;
            }
            let best = self.best().map_or(f64::INFINITY, |best| best.value);
            if i >= REFINED && valley.least > best {
                self.left_out = Some(valley.least);
                return;
            }
            let within = (valley.from, valley.to);
            let bottom =
                self.tension_solver.valley_bottom(self.task, &valley.holes, self.count, within);
            // A valley with edges may have more than one bottom.
            for tension in [bottom, valley.from, 0.5 * (valley.from + valley.to), valley.to] {
                self.try_holes(&valley.holes, &[tension]);
            }
        }
        self.left_out = Some(f64::INFINITY);
    }

    /// Nothing when it was stopped.
    fn valleys(&mut self) -> Option<Vec<Valley>> {
        let task = self.task;
        let asked = (0..task.end(0)).map(|i| task.tension_for(i, STRIDE));
        let stride = asked.fold(f64::INFINITY, f64::min);
        let last = LOAD / task.plan.slenderness;
        let mut tables =
            SubsegmentTables::new(task, self.choices(|_, _| (0..self.count).collect()), self.count);
        let mut tensions = vec![0.0];
        let mut valleys = Vec::new();
        let mut ends: BTreeMap<Holes, TensionSample> = BTreeMap::new();
        while tensions[0] < last {
            let leaves = tables.fill(task, &tensions).then(|| {
                beam_search(task, &tables, &Window { tensions: &tensions, width: &[0.0] })
            });
            self.rounds += 1;
            let mut now = BTreeMap::new();
            for leaf in leaves.flatten()? {
                let at =
                    TensionSample { tension: tensions[0], value: leaf.value, slope: leaf.slope[0] };
                let rises = at.slope >= 0.0;
                let before = ends.remove(&leaf.holes);
                valleys.extend(
                    before.and_then(|last| Valley::new(&leaf.holes, last, tensions[0], rises)),
                );
                now.insert(leaf.holes, at);
            }
            let ended =
                |(holes, at): (&Holes, &TensionSample)| Valley::new(holes, *at, tensions[0], true);
            valleys.extend(ends.iter().filter_map(ended));
            ends = now;
            tensions[0] += stride.max(SHARE * tensions[0]);
        }
        let ended =
            |(holes, at): (&Holes, &TensionSample)| Valley::new(holes, *at, tensions[0], true);
        valleys.extend(ends.iter().filter_map(ended));
        self.solved += tables.equilibria();
        Some(valleys)
    }
}
