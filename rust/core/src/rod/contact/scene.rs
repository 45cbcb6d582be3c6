//! What surrounds a robot, prepared: obstacles and loads in its base frame, and its points that may touch.

use nalgebra::Vector3;

use super::lagrangian::Clearance;
use super::loads::Loads;
use crate::error::InvalidInput;
use crate::lie::Pose;
use crate::model::PointKind;
use crate::obstacle::{Fault, Obstacle, Volume};
use crate::robot::Robot;
use crate::rod::plan::Plan;

/// A point of a disk that may touch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) at: Vector3<f64>,
    pub(super) kind: PointKind,
    pub(super) tendon: Option<usize>,
    /// Of the body around it \[m\].
    pub(super) radius: f64,
}

/// Points of one disk nearer to each other than this share of the disk's size are one.
const SAME: f64 = 1e-9;
/// Ways out with a smaller cosine between them are those of two sides of a wall.
const OPPOSED: f64 = -0.5;

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
    pub(super) points: Vec<Vec<Point>>,
    /// Force on every disk's centre and moment on the tip, base frame's axes, in the plan's unit.
    pub(super) forces: Vec<Vector3<f64>>,
    pub(in crate::rod) moment: Vector3<f64>,
    /// Whether the moment or any force is not zero.
    pub(super) loaded: bool,
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
        let points =
            (0..=n).map(|disk| if disk == 0 { vec![] } else { points(robot, disk, body_radius) });
        let (mut forces, mut moment) = (vec![Vector3::zeros(); n + 1], Vector3::zeros());
        if let Some(loads) = loads {
            (forces, moment) = loads.forces(robot)?;
            for force in &mut forces {
                *force = base.rotation * *force / plan.unit;
            }
            moment = base.rotation * moment / plan.unit;
        }
        let loaded = moment != Vector3::zeros() || forces.iter().any(|f| *f != Vector3::zeros());
        Ok(Self {
            obstacles: obstacles.iter().map(|obstacle| obstacle.transformed(&base)).collect(),
            points: points.collect(),
            forces,
            moment,
            loaded,
        })
    }

    /// Whether any obstacle is a function of the caller's.
    #[must_use]
    pub fn calls_functions(&self) -> bool {
        self.obstacles.iter().any(|o| matches!(o.volume(), Volume::SignedDistance(_)))
    }

    /// Whether a point may go straight from a place to another: through the free space around them, or along a
    /// surface, no deeper than `slip` \[m\] into it and, where obstacles have `sides`, not to its other one.
    pub(super) fn leads(
        &self,
        radius: f64,
        from: &Clearance,
        to: &Clearance,
        slip: f64,
        sides: bool,
        cuts: usize,
    ) -> Result<bool, Fault> {
        let free = from.clear.max(0.0) + to.clear.max(0.0);
        let way = (to.at - from.at).norm();
        let same_side = !sides || from.away.dot(&to.away) > OPPOSED;
        if way <= free || (way <= free + slip && same_side) {
            return Ok(true);
        }
        if cuts == 0 {
            return Ok(false);
        }
        let mut middle = Clearance::new((from.at + to.at) * 0.5);
        for obstacle in &self.obstacles {
            middle.count(&obstacle.nearest(&middle.at)?, radius);
        }
        if middle.clear < from.clear.min(to.clear).min(0.0) - slip {
            return Ok(false);
        }
        Ok(self.leads(radius, from, &middle, slip, sides, cuts - 1)?
            && self.leads(radius, &middle, to, slip, sides, cuts - 1)?)
    }
}

fn points(robot: &Robot, disk: usize, body_radius: f64) -> Vec<Point> {
    let center =
        Point { at: Vector3::zeros(), kind: PointKind::Center, tendon: None, radius: body_radius };
    let mut all = vec![center];
    for (k, path) in robot.paths().iter().enumerate().filter(|(_, path)| path.end() >= disk) {
        let hole = path.holes[disk];
        let near = SAME * hole.norm();
        for (kind, at) in [(PointKind::Hole, hole), (PointKind::Mirror, -hole)] {
            if !all.iter().any(|other| (other.at - at).norm() <= near) {
                all.push(Point { at, kind, tendon: Some(k), radius: 0.0 });
            }
        }
    }
    all
}
