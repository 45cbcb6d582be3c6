//! Routings that descents and searches begin with.

use std::f64::consts::TAU;

use super::task::{PerHole, Task};

/// Sums of the tensions that are begun with, over the least that the wanted bends ask for.
const SCALES: [f64; 3] = [1.05, 1.6, 2.5];

/// Routings of several tendons from which a descent may begin, with their tensions in the unit of the results:
/// pulling alike, spread about the direction in which the wanted places bend.
pub(super) fn starts(task: &Task<'_>) -> Vec<(PerHole, Vec<f64>)> {
    let bends = task.bends();
    let asked: Vec<f64> =
        bends.iter().enumerate().map(|(i, (_, angle))| task.tension_for(i, *angle)).collect();
    let largest = asked.iter().fold(0.0_f64, |most, t| most.max(*t));
    let tendons = task.tendons();
    let mut out = Vec::new();
    for scale in SCALES {
        let whole = scale * largest;
        let azimuths = (0..tendons).map(|k| {
            let side = if tendons > 1 { 2.0 * k as f64 / (tendons - 1) as f64 - 1.0 } else { 0.0 };
            let middle: Vec<f64> = bends
                .iter()
                .zip(&asked)
                .map(|((azimuth, _), asked)| azimuth + side * (asked / whole).min(1.0).acos())
                .collect();
            between(&middle, task.end(k))
        });
        out.push((azimuths.collect(), vec![whole * task.plan.unit / tendons as f64; tendons]));
    }
    out
}

/// Azimuths on disks 0 to `end` of a tendon with azimuths given in the middle of its subsegments.
fn between(middle: &[f64], end: usize) -> Vec<f64> {
    let at = |i: usize| middle[i.min(end - 1)];
    let mut last = f64::NAN;
    let disks = (0..=end).map(|i| {
        let (a, b) = (at(i.saturating_sub(1)), at(i));
        let mut own = (a.sin() + b.sin()).atan2(a.cos() + b.cos());
        if last.is_finite() {
            own += TAU * ((last - own) / TAU).round();
        }
        last = own;
        own
    });
    disks.collect()
}
