//! Routing design: the holes and pulls that bring a given backbone nearest to a wanted shape. The mathematics is
//! in `docs/design.md`.

mod answer;
mod beam_search;
mod best_tensions;
mod canonical_task;
mod continuous_holes;
mod evaluation;
mod exhaustive;
mod fewer_tendons;
mod hole_descent;
mod hole_search;
mod quadratic_cost;
mod result;
mod settings;
mod solver;
mod starts;
mod subsegment_table;
mod task;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::Vector3;
use rayon::ThreadPool;
use rayon::prelude::*;

use self::canonical_task::{CanonicalTask, radii};
use self::fewer_tendons::TendonSubsets;
use self::result::in_robot_frame;
use self::task::Task;
use crate::batch::Control;
use crate::error::InvalidInput;
use crate::inverse::Range;
use crate::robot::{Path, Robot};
use crate::rod::Plan;

pub use result::{Optimality, Routed};
pub use settings::RoutingSettings;

/// The holes and displacements under which the disks 1 to n of a robot are nearest to `targets` (in the world
/// \[m\]): least sum of squared distances. Backbone, ends, stiffness and names of the tendons are the robot's, and
/// their radii unless the settings bound them; displacements stay within `bounds` \[m\]. A routed robot and its
/// tensions may be looked at first.
///
/// # Errors
/// `InvalidInput` for another number of targets than subsegments, places that are not finite, a robot without
/// tendons or holes in a disk's centre, a start with other tendons, and bounds or settings that do not fit the robot.
pub fn routing(
    robot: &Robot,
    targets: &[Vector3<f64>],
    bounds: Option<&Range>,
    start: Option<(&Robot, &[f64])>,
    settings: &RoutingSettings,
) -> Result<Routed, InvalidInput> {
    routing_stopped_by(robot, targets, bounds, start, settings, &Arc::default())
}

/// [`routing`] that ends soon after the flag is set, with the status of an iteration limit.
///
/// # Errors
/// As [`routing`].
pub fn routing_stopped_by(
    robot: &Robot,
    targets: &[Vector3<f64>],
    bounds: Option<&Range>,
    start: Option<(&Robot, &[f64])>,
    settings: &RoutingSettings,
    stop: &Arc<AtomicBool>,
) -> Result<Routed, InvalidInput> {
    settings.validate()?;
    check(robot, targets, bounds, start)?;
    let plan = Plan::new(robot, settings.rod)?;
    let radii = (0..robot.tendons().len()).map(|k| radii(robot, k)).collect();
    let task = Task { robot, targets, bounds, settings, stop, plan, radii };
    let canonical = CanonicalTask::new(robot, targets, bounds, start, settings)?;
    let (answer, counted) = TendonSubsets::new(&canonical, stop).run()?;
    in_robot_frame(&task, &canonical, &answer, counted)
}

fn check(
    robot: &Robot,
    targets: &[Vector3<f64>],
    bounds: Option<&Range>,
    start: Option<(&Robot, &[f64])>,
) -> Result<(), InvalidInput> {
    let (n, tendons) = (robot.backbone().subsegments(), robot.tendons().len());
    if tendons == 0 {
        return Err(InvalidInput::new("robot", "at least one tendon to route", "none"));
    }
    super::check_targets(robot, targets)?;
    if let Some(bounds) = bounds {
        let (lower, upper) = bounds.values();
        for count in [lower.len(), upper.len()] {
            if count != 1 && count != tendons {
                let expected = format!("one bound for all or {tendons}, one per tendon");
                return Err(InvalidInput::new("bounds", expected, count));
            }
        }
    }
    if let Some((routed, tensions)) = start {
        let ends = |robot: &Robot| robot.paths().iter().map(Path::end).collect::<Vec<_>>();
        if routed.backbone().subsegments() != n || ends(routed) != ends(robot) {
            let expected =
                format!("a routing of {n} subsegments with tendons that end at {:?}", ends(robot));
            let got = format!("{} and {:?}", routed.backbone().subsegments(), ends(routed));
            return Err(InvalidInput::new("start", expected, got));
        }
        if tensions.len() != tendons || !tensions.iter().all(|t| t.is_finite() && *t >= 0.0) {
            let expected = format!("{tendons} tensions of 0 or more");
            return Err(InvalidInput::new("start", expected, format!("{tensions:?}")));
        }
    }
    Ok(())
}

/// Rows of wanted places, each as alone, on a pool; nothing when it was stopped.
///
/// # Errors
/// As [`routing`], of the first row that has one, before any is solved and naming the row.
pub fn routing_rows(
    robot: &Robot,
    rows: &[Vec<Vector3<f64>>],
    bounds: Option<&Range>,
    settings: &RoutingSettings,
    pool: &ThreadPool,
    control: &Control,
) -> Result<Option<Vec<Routed>>, InvalidInput> {
    let stop = &control.stop;
    for (i, targets) in rows.iter().enumerate() {
        check(robot, targets, bounds, None)
            .map_err(|error| InvalidInput { got: format!("{} in row {i}", error.got), ..error })?;
    }
    let row = |targets: &Vec<Vector3<f64>>| {
        let answer = routing_stopped_by(robot, targets, bounds, None, settings, stop);
        control.done.fetch_add(1, Ordering::Relaxed);
        answer
    };
    let answers: Vec<_> = pool.install(|| rows.par_iter().map(row).collect());
    let answers = answers.into_iter().collect::<Result<_, _>>()?;
    Ok((!stop.load(Ordering::Relaxed)).then_some(answers))
}
