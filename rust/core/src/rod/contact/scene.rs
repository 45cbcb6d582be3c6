//! Surroundings of a robot, prepared: obstacles and loads in its base frame, and its points that may touch.

use nalgebra::Vector3;

use super::loads::Loads;
use crate::error::InvalidInput;
use crate::lie::Pose;
use crate::model::PointKind;
use crate::obstacle::{Fault, Near, Obstacle, Volume};
use crate::robot::Robot;
use crate::rod::plan::Plan;

/// A point of a disk that may touch.
#[derive(Clone, Copy, Debug)]
pub(super) struct DiskPoint {
    /// In the disk's frame \[m\].
    pub(super) position: Vector3<f64>,
    pub(super) kind: PointKind,
    pub(super) tendon: Option<usize>,
    /// Radius r of the body around it \[m\].
    pub(super) radius: f64,
}

/// Clearance of a point at some place: distance to the nearest obstacle and its normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clearance {
    /// In the base's frame \[m\].
    pub(super) position: Vector3<f64>,
    /// Distance to the nearest obstacle, the body's radius taken off \[m\].
    pub(super) distance: f64,
    /// Gradient of that distance: the way out.
    pub(super) normal: Vector3<f64>,
}

impl Clearance {
    pub(super) fn new(position: Vector3<f64>) -> Self {
        Self { position, distance: f64::INFINITY, normal: Vector3::zeros() }
    }

    /// Includes a part of an obstacle, for a point with a body of a radius.
    pub(super) fn include(&mut self, near: &Near, radius: f64) {
        if near.distance - radius < self.distance {
            (self.distance, self.normal) = (near.distance - radius, near.gradient);
        }
    }
}

/// Points of one disk nearer to each other than this share of the disk's size are one.
const COINCIDENT: f64 = 1e-9;
/// Normals with a smaller cosine between them are those of two sides of a wall.
const OPPOSITE_SIDES: f64 = -0.5;

/// Obstacles and loads around a robot.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::obstacle::{HalfSpace, Obstacle};
/// use tdcr::rod::contact::Scene;
/// use tdcr::rod::{Plan, RodSettings};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, RodSettings::default())?;
/// let wall = HalfSpace::new(&Vector3::new(0.03, 0.0, 0.0), &-Vector3::x())?;
/// // One wall, no loads, a body of 5 mm radius around the backbone.
/// let scene = Scene::new(&robot, &plan, &[Obstacle::new(wall, false)], None, 0.005)?;
/// # drop(scene);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Scene {
    pub(super) obstacles: Vec<Obstacle>,
    /// Points of each disk, disk 0 without any: it does not move.
    pub(super) points: Vec<Vec<DiskPoint>>,
    /// Force on every disk's centre and moment on the tip, base frame's axes, in the plan's unit.
    pub(super) forces: Vec<Vector3<f64>>,
    pub(in crate::rod) moment: Vector3<f64>,
    /// Presence of a moment or a force that is not zero.
    pub(super) has_loads: bool,
}

impl Scene {
    /// Prepares obstacles, loads and a body of a radius around the backbone \[m\], 0 for none, for a robot
    /// and its plan.
    ///
    /// # Errors
    /// As [`Loads::forces`], and for a radius that is negative or not finite.
    pub fn new(
        robot: &Robot,
        plan: &Plan,
        obstacles: &[Obstacle],
        loads: Option<&Loads>,
        body_radius: f64,
    ) -> Result<Self, InvalidInput> {
        if !(body_radius.is_finite() && body_radius >= 0.0) {
            let got = format!("{body_radius:?}");
            return Err(InvalidInput::new("body_radius", "0 m or more", got));
        }
        let base: Pose = robot.base().inverse();
        let n = robot.backbone().subsegments();
        let points = (0..=n)
            .map(|disk| if disk == 0 { vec![] } else { disk_points(robot, disk, body_radius) });
        let (mut forces, mut moment) = (vec![Vector3::zeros(); n + 1], Vector3::zeros());
        if let Some(loads) = loads {
            (forces, moment) = loads.forces(robot)?;
            for force in &mut forces {
                *force = base.rotation * *force / plan.unit;
            }
            moment = base.rotation * moment / plan.unit;
        }
        let has_loads = moment != Vector3::zeros() || forces.iter().any(|f| *f != Vector3::zeros());
        Ok(Self {
            obstacles: obstacles.iter().map(|obstacle| obstacle.transform(&base)).collect(),
            points: points.collect(),
            forces,
            moment,
            has_loads,
        })
    }

    /// Presence of an obstacle that is a function of the caller's.
    #[must_use]
    pub fn calls_functions(&self) -> bool {
        self.obstacles.iter().any(|o| matches!(o.volume(), Volume::SignedDistance(_)))
    }

    /// Freedom of the straight path of a point: it leads through the free space around its ends, or along a surface,
    /// no deeper than `allowed_slip` \[m\] into it and, with `keeps_side`, not to its other side. Where these do not
    /// tell, the path is cut in halves, at most `bisections` times in a row.
    pub(super) fn is_free_path(
        &self,
        radius: f64,
        from: &Clearance,
        to: &Clearance,
        allowed_slip: f64,
        keeps_side: bool,
        bisections: usize,
    ) -> Result<bool, Fault> {
        let free = from.distance.max(0.0) + to.distance.max(0.0);
        let length = (to.position - from.position).norm();
        let same_side = !keeps_side || from.normal.dot(&to.normal) > OPPOSITE_SIDES;
        if length <= free || (length <= free + allowed_slip && same_side) {
            return Ok(true);
        }
        if bisections == 0 {
            return Ok(false);
        }
        let mut middle = Clearance::new((from.position + to.position) * 0.5);
        for obstacle in &self.obstacles {
            middle.include(&obstacle.nearest(&middle.position)?, radius);
        }
        if middle.distance < from.distance.min(to.distance).min(0.0) - allowed_slip {
            return Ok(false);
        }
        let half = |from: &Clearance, to: &Clearance| {
            self.is_free_path(radius, from, to, allowed_slip, keeps_side, bisections - 1)
        };
        Ok(half(from, &middle)? && half(&middle, to)?)
    }
}

/// Points of a disk: its centre, the holes of the tendons that pass it, and their mirror images.
fn disk_points(robot: &Robot, disk: usize, body_radius: f64) -> Vec<DiskPoint> {
    let mut all = vec![DiskPoint {
        position: Vector3::zeros(),
        kind: PointKind::Center,
        tendon: None,
        radius: body_radius,
    }];
    for (k, path) in robot.paths().iter().enumerate().filter(|(_, path)| path.end() >= disk) {
        let hole = path.holes[disk];
        let near = COINCIDENT * hole.norm();
        for (kind, position) in [(PointKind::Hole, hole), (PointKind::Mirror, -hole)] {
            if !all.iter().any(|other| (other.position - position).norm() <= near) {
                all.push(DiskPoint { position, kind, tendon: Some(k), radius: 0.0 });
            }
        }
    }
    all
}
