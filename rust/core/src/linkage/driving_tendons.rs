//! Which tendons form the linkage of each run of subsegments.

use super::seven_bar::Hole;
use crate::error::InvalidInput;
use crate::robot::Robot;

/// The tendons of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DrivingTendons {
    /// None is pulled.
    None,
    /// One: a four-bar linkage.
    One(usize),
    /// Two: a seven-bar linkage.
    Two(usize, usize),
}

impl DrivingTendons {
    /// True when a tendon is part of the linkage.
    pub(super) fn contains(self, tendon: usize) -> bool {
        match self {
            Self::None => false,
            Self::One(a) => a == tendon,
            Self::Two(a, b) => a == tendon || b == tendon,
        }
    }
}

/// Subsegments `first..last` that the same tendons pass.
#[derive(Clone, Debug)]
pub(super) struct Run {
    pub(super) first: usize,
    pub(super) last: usize,
    /// Relative azimuth of each pair of tendons, tendon by tendon.
    pairs: Vec<RelativeAzimuth>,
}

/// Relative azimuth of the holes of two tendons on the disks of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RelativeAzimuth {
    /// On different lines through the centre on every disk: they can form a seven-bar.
    Apart,
    /// On (nearly) the same azimuth on some disk.
    Same,
    /// On one line through the centre, on opposite sides, on some disk.
    Opposite,
}

/// Sine of the angle between two holes below which they are on one line: closer ones would need
/// bends that no displacement is given precisely enough for.
const ON_ONE_LINE: f64 = 1e-4;

/// Share of the run's length by which a bound must be missed to count.
pub(super) const BOUND_TOLERANCE: f64 = 1e-9;

/// The runs of a robot, base first; behind the last tendon's end there is a run without tendons.
pub(super) fn runs(robot: &Robot) -> Vec<Run> {
    let n = robot.backbone().subsegments();
    let mut ends: Vec<usize> = robot.paths().iter().map(crate::robot::Path::end).collect();
    ends.push(n);
    ends.sort_unstable();
    ends.dedup();
    let mut first = 0;
    let mut runs = Vec::with_capacity(ends.len());
    for last in ends {
        runs.push(Run { first, last, pairs: relative_azimuths(robot, first, last) });
        first = last;
    }
    runs
}

fn relative_azimuths(robot: &Robot, first: usize, last: usize) -> Vec<RelativeAzimuth> {
    let paths = robot.paths();
    let mut relative_azimuths = Vec::with_capacity(paths.len() * paths.len());
    for a in paths {
        for b in paths {
            let mut azimuths = RelativeAzimuth::Apart;
            if a.end() >= last && b.end() >= last {
                for disk in first..=last {
                    let (sin, cos) = (b.azimuths[disk] - a.azimuths[disk]).sin_cos();
                    if sin.abs() < ON_ONE_LINE {
                        azimuths = if cos > 0.0 {
                            RelativeAzimuth::Same
                        } else {
                            RelativeAzimuth::Opposite
                        };
                        break;
                    }
                }
            }
            relative_azimuths.push(azimuths);
        }
    }
    relative_azimuths
}

/// By how much a bend breaks a tendon's bound; negative where it leaves slack.
#[derive(Clone, Copy, Debug)]
pub(super) struct Overstretch {
    /// Overstretch as a share of the tendon's length in the run.
    pub(super) share: f64,
    /// Bend across the plane of the pulled tendon that would take it up.
    sideways: f64,
}

/// Choice of the driving tendons at given displacements.
pub(super) struct TendonChoice<'a> {
    pub(super) robot: &'a Robot,
    /// Pieces of every tendon, scaled to unit subsegments.
    pub(super) pieces: &'a [Vec<Hole>],
    pub(super) displacements: &'a [f64],
}

impl TendonChoice<'_> {
    /// The two most-pulled tendons of a run that are not on one line through the centre; with one
    /// pulled tendon, the one whose bound its bend would break, if there is one.
    ///
    /// # Errors
    /// `InvalidInput` when the pulled tendons share one azimuth: a linkage needs two directions.
    pub(super) fn of(&self, run: &Run) -> Result<DrivingTendons, InvalidInput> {
        let tendons = self.displacements.len();
        let Some(first) = self.most_pulled(run, |_| true) else { return Ok(DrivingTendons::None) };
        let azimuths = |k: usize| run.pairs[first * tendons + k];
        if let Some(second) =
            self.most_pulled(run, |k| k != first && azimuths(k) == RelativeAzimuth::Apart)
        {
            return Ok(DrivingTendons::Two(first, second));
        }
        if let Some(twin) =
            self.most_pulled(run, |k| k != first && azimuths(k) == RelativeAzimuth::Same)
        {
            return Err(self.same_azimuth(run, first, twin));
        }
        // The pulled tendon leaves the bend across its own plane open; of those that would be
        // stretched, the one that asks for most of it decides.
        let stretched = (0..tendons)
            .filter(|&k| k != first && azimuths(k) == RelativeAzimuth::Apart)
            .map(|k| (k, self.overstretch(run, first, k)))
            .filter(|(_, asked)| asked.share > BOUND_TOLERANCE)
            .max_by(|a, b| a.1.sideways.total_cmp(&b.1.sideways));
        Ok(stretched
            .map_or(DrivingTendons::One(first), |(second, _)| DrivingTendons::Two(first, second)))
    }

    /// The tendon with the largest shortening in proportion to its length.
    fn most_pulled(&self, run: &Run, wanted: impl Fn(usize) -> bool) -> Option<usize> {
        let paths = self.robot.paths();
        let pull = |k: usize| -self.displacements[k] / paths[k].rest_length;
        (0..paths.len())
            .filter(|&k| paths[k].end() >= run.last && self.displacements[k] < 0.0 && wanted(k))
            // Of equals the first: max_by would take the last.
            .reduce(|best, k| if pull(k) > pull(best) { k } else { best })
    }

    /// Overstretch of tendon `k` beyond its bound by the bend of tendon `pulled` alone, to first order. Free
    /// tendons have no bound.
    pub(super) fn overstretch(&self, run: &Run, pulled: usize, k: usize) -> Overstretch {
        let path = &self.robot.paths()[k];
        if path.end() < run.last || self.displacements[k].is_infinite() {
            return Overstretch { share: f64::NEG_INFINITY, sideways: f64::NEG_INFINITY };
        }
        let lengths = self.robot.backbone().lengths();
        let ratio = -self.displacements[pulled] / self.robot.paths()[pulled].rest_length;
        let (mut stretch, mut rest, mut lever) = (0.0, 0.0, 0.0);
        for i in run.first..run.last {
            let (a, b) = (&self.pieces[pulled][i], &self.pieces[k][i]);
            let (arm, other) = (a.lower + a.upper, b.lower + b.upper);
            let bend = ratio * a.rest / arm.norm_squared().max(f64::MIN_POSITIVE);
            stretch -= lengths[i] * bend * arm.dot(&other);
            rest += lengths[i] * b.rest;
            lever += 0.5 * lengths[i] * arm.cross(&other).norm() / arm.norm();
        }
        let share = stretch / rest - self.displacements[k] / path.rest_length;
        Overstretch { share, sideways: share * rest / lever.max(f64::MIN_POSITIVE) }
    }

    fn same_azimuth(&self, run: &Run, first: usize, second: usize) -> InvalidInput {
        let names = self.robot.tendon_names();
        let (a, b) = (&names[first], &names[second]);
        InvalidInput::new(
            "displacements",
            "linkage tendons on different azimuths (1e-4 rad or more apart; free one with inf, or use \
             another model)",
            format!(
                "'{a}' and '{b}' pulled on one azimuth between disks {} and {}",
                run.first, run.last
            ),
        )
    }
}
