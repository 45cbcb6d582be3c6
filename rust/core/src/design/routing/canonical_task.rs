//! A task as the search sees it: in a frame of its own, so that where the robot stands, how it is turned and in which
//! order its tendons are named change nothing but the last bits of the answer, and no choice of holes.

use std::cmp::Ordering;
use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::settings::RoutingSettings;
use super::task::{FINE, Holes, PerHole};
use crate::error::InvalidInput;
use crate::inverse::Range;
use crate::lie::so3;
use crate::robot::{Backbone, PerDisk, Robot, Routing, Tendon};

/// Wanted places are rounded to this share of the length, and to this share of the tolerance.
const GRID: f64 = 1.0 / (1_u64 << 36) as f64;
const FINER: f64 = 1.0 / 64.0;
/// Wanted places no further than this share of the length from the base's axis, on the whole, have no direction.
const ASIDE: f64 = 1e-6;
/// Directions are rounded to a hole above this share of the way to it: not half of it, which planes of symmetry have.
const UPWARDS: f64 = 0.75;

/// A routing design in the base's frame, turned about its axis so that the wanted places lean towards azimuth 0, with
/// tendons in an order of their own.
pub(super) struct CanonicalTask {
    pub(super) robot: Robot,
    pub(super) targets: Vec<Vector3<f64>>,
    pub(super) bounds: Option<Range>,
    pub(super) settings: RoutingSettings,
    /// Azimuths of the holes to look at first, and tensions.
    pub(super) start: Option<(PerHole, Vec<f64>)>,
    /// Number that each tendon has in the robot.
    order: Vec<usize>,
    /// Tendons that are alike have the same number.
    pub(super) classes: Vec<usize>,
    /// Holes, and azimuth \[rad\], that it is turned by.
    shift: usize,
    turn: f64,
}

impl CanonicalTask {
    /// Canonical form of checked arguments.
    pub(super) fn new(
        robot: &Robot,
        targets: &[Vector3<f64>],
        bounds: Option<&Range>,
        start: Option<(&Robot, &[f64])>,
        settings: &RoutingSettings,
    ) -> Result<Self, InvalidInput> {
        // Order of the tendons, and turn of the base's frame to where the places lean.
        let (order, classes) = sort_tendons(robot, bounds);
        let base = robot.base();
        let local = targets.iter().map(|t| base.rotation.tr_mul(&(t - base.translation)));
        let local: Vec<_> = local.collect();
        let length = robot.backbone().total_length();
        let (shift, turn) = turn_to_lean(&local, length, settings);
        let back = so3::exp(&Vector3::new(0.0, 0.0, -turn));
        // Wanted places on a grid, so that a rounding elsewhere does not count.
        let finest = length * GRID.min(FINER * settings.tolerance);
        let grid = finest.log2().floor().exp2();
        let rounded = |target: Vector3<f64>| (back * target).map(|x| (x / grid).round() * grid);

        // Rest shape in the turned frame.
        let mut spec = robot.backbone().spec().clone();
        if turn != 0.0 {
            spec.rest = spec.rest.map(|rest| rest.iter().map(|own| back * own).collect());
        }
        // Without names, by place, and without holes of their own: neither may count.
        let tendons = order.iter().map(|k| {
            let own = &robot.tendons()[*k];
            let radius = PerDisk::Each(radii(robot, *k));
            let routing = Routing::Angles { azimuth: PerDisk::Same(0.0), radius };
            Tendon::new(routing, Some(robot.paths()[*k].end()), own.stiffness(), None)
        });
        let tendons = tendons.collect::<Result<_, _>>()?;
        // Bounds and start in the order of the tendons; bounds that bound nothing are none.
        let finite = |range: &&Range| {
            let (lower, upper) = range.values();
            lower.iter().chain(upper).any(|bound| bound.is_finite())
        };
        let bounds = bounds.filter(finite).map(|range| {
            let (lower, upper) = order.iter().map(|k| range.at(*k)).unzip();
            Range::new("bounds", lower, upper)
        });
        let start = start.map(|(robot, tensions)| {
            let azimuths = |k: &usize| {
                let own = &robot.paths()[*k].azimuths;
                own.iter().map(|azimuth| azimuth - turn).collect()
            };
            (order.iter().map(azimuths).collect(), order.iter().map(|k| tensions[*k]).collect())
        });
        Ok(Self {
            robot: Robot::new(Backbone::new(spec)?, tendons, None, None, None)?,
            targets: local.into_iter().map(rounded).collect(),
            bounds: bounds.transpose()?,
            settings: RoutingSettings { azimuth: 0.0, ..*settings },
            start,
            order,
            classes,
            shift,
            turn,
        })
    }

    /// Values per tendon, in the robot's order.
    pub(super) fn per_tendon<T: Clone>(&self, values: &[T]) -> Vec<T> {
        let mut places: Vec<usize> = (0..values.len()).collect();
        places.sort_by_key(|k| self.order[*k]);
        places.into_iter().map(|k| values[k].clone()).collect()
    }

    /// Numbers of holes as the robot has them.
    pub(super) fn holes(&self, holes: &Holes, count: usize) -> Holes {
        let own = |hole: &usize| (hole + self.shift) % count;
        holes.iter().map(|row| self.per_tendon(row).iter().map(own).collect()).collect()
    }

    /// Azimuths as the robot has them.
    pub(super) fn azimuths(&self, azimuths: &PerHole) -> PerHole {
        let own = |row: Vec<f64>| row.into_iter().map(|azimuth| azimuth + self.turn).collect();
        self.per_tendon(azimuths).into_iter().map(own).collect()
    }
}

/// Radii of a tendon's holes as they were given, disk 0 to its end.
pub(super) fn radii(robot: &Robot, tendon: usize) -> Vec<f64> {
    let radius = |disk| match robot.tendons()[tendon].routing() {
        Routing::Angles { radius, .. } | Routing::Holes { radius, .. } => radius.at(disk),
        Routing::Helical { radius, .. } => *radius,
    };
    (0..=robot.paths()[tendon].end()).map(radius).collect()
}

/// Order of the tendons by what tells them apart, and the class of each.
fn sort_tendons(robot: &Robot, bounds: Option<&Range>) -> (Vec<usize>, Vec<usize>) {
    let key = |k: usize| -> Vec<f64> {
        let tendon = &robot.tendons()[k];
        let (low, high) = bounds.map_or((f64::NEG_INFINITY, f64::INFINITY), |bounds| bounds.at(k));
        let end = robot.paths()[k].end() as f64;
        let first = [end, tendon.stiffness().unwrap_or(f64::INFINITY), low + 0.0, high + 0.0];
        first.into_iter().chain(radii(robot, k)).collect()
    };
    let all: Vec<Vec<f64>> = (0..robot.tendons().len()).map(key).collect();
    let compare = |a: &[f64], b: &[f64]| {
        let differ = a.iter().zip(b).map(|(a, b)| a.total_cmp(b));
        differ.fold(Ordering::Equal, Ordering::then)
    };
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by(|a, b| compare(&all[*a], &all[*b]));
    let mut classes: Vec<usize> = Vec::with_capacity(order.len());
    for (k, own) in order.iter().enumerate() {
        let last = classes.last().copied();
        let same = k > 0 && compare(&all[order[k - 1]], &all[*own]) == Ordering::Equal;
        classes.push(last.map_or(0, |last| if same { last } else { last + 1 }));
    }
    (order, classes)
}

/// Holes, and azimuth in all, from the base's x axis to where the wanted places lean.
fn turn_to_lean(local: &[Vector3<f64>], length: f64, settings: &RoutingSettings) -> (usize, f64) {
    let aside: Vector3<f64> = local.iter().sum();
    let leans = aside.xy().norm() > ASIDE * length;
    let azimuth = if leans { aside.y.atan2(aside.x) } else { settings.azimuth };
    let count = settings.holes.unwrap_or(FINE);
    let pitch = TAU / count as f64;
    let holes = ((azimuth - settings.azimuth) / pitch + 1.0 - UPWARDS).floor();
    let holes = holes.rem_euclid(count as f64);
    let shift = (0..count).find(|shift| *shift as f64 >= holes).unwrap_or(0);
    (shift, settings.azimuth + pitch * shift as f64)
}
