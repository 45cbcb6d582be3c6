//! The answer in the robot's own frame and order, and in words.

use super::answer::Answer;
use super::canonical_task::CanonicalTask;
use super::task::Task;
use super::{Optimality, Routed};
use crate::design::feasibility::infeasible_chord;
use crate::error::InvalidInput;
use crate::model::Model;
use crate::rod::{Plan, Rod};
use crate::status::Status;

/// Share of a subsegment by which its chord may be off before it is blamed: twisted arcs are a little shorter.
const OFF: f64 = 0.01;

/// An answer to a canonical task, as one to the task itself.
pub(super) fn in_robot_frame(
    task: &Task<'_>,
    canonical: &CanonicalTask,
    answer: &Answer,
    (steps, solved): (usize, usize),
) -> Result<Routed, InvalidInput> {
    // Holes and pulls in the robot's own frame and order.
    let best = &answer.best;
    let holes = match (&best.holes, task.settings.holes) {
        (Some(holes), Some(count)) => Some((canonical.holes(holes, count), count)),
        _ => None,
    };
    let robot = match &holes {
        Some((holes, count)) => task.with_holes(holes, *count)?,
        None => task.with_azimuths(
            &canonical.azimuths(&best.point.azimuths),
            &canonical.per_tendon(&best.point.radii),
        )?,
    };
    let displacements = canonical.per_tendon(&best.point.displacements);
    // Judgement: the rod is solved from rest under the displacements.
    let plan = Plan::new(&robot, task.settings.rod)?;
    let shape = Rod::new(&robot, &plan).shape(&displacements)?;
    let errors = task.errors(&shape.state);
    let rms = |value: f64| (value / task.targets.len() as f64).sqrt();
    let own = rms(task.value(&shape.state));
    let far = task.settings.tolerance * task.length();
    let follows = shape.report.status == Status::Converged;
    let met = follows && errors.iter().all(|e| *e <= far);
    // Knowledge about a nearer routing.
    let optimality = if met {
        Optimality::Reached
    } else if answer.whole && !task.is_stopped() {
        Optimality::Exhaustive
    } else {
        Optimality::Searched
    };
    // Outcome of the design.
    let status = if !follows {
        shape.report.status
    } else if met {
        Status::Converged
    } else if task.is_stopped() {
        Status::IterationLimit
    } else {
        Status::Unreachable
    };
    // Numbers of holes, where there are any, and what any azimuth would leave.
    let numbers = |(holes, _)| (0..task.tendons()).map(|k| task.indices(&holes, k)).collect();
    let relaxed_rms =
        if task.settings.holes.is_some() { rms(answer.relaxed).min(own) } else { own };
    let mut out = Routed {
        robot,
        shape,
        displacements,
        holes: holes.map(numbers),
        errors,
        rms: own,
        relaxed_rms,
        optimality,
        iterations: steps,
        evaluations: solved,
        status,
        message: String::new(),
    };
    out.message = message(task, &out);
    Ok(out)
}

/// Message about what stood in the way.
fn message(task: &Task<'_>, out: &Routed) -> String {
    let why = || infeasible_chord(task.robot, task.targets, task.settings.rod.subsegment, OFF);
    let off = || {
        let worst = out.errors.iter().copied().fold(0.0_f64, f64::max);
        let disk = out.errors.iter().position(|e| *e == worst).unwrap_or(0);
        let left = format!("any azimuth would leave {:.3e} m", out.relaxed_rms);
        let known = match (task.settings.holes, out.optimality) {
            (None, _) => "the nearest that descents led to".to_owned(),
            (_, Optimality::Exhaustive) => {
                format!("every routing was looked at over a row of tensions; {left}")
            }
            _ => format!("the nearest that the search met; {left}"),
        };
        format!(
            "disk {disk} stays {worst:.3e} m from its place, {:.3e} m root mean square: {known}{}",
            out.rms,
            why()
        )
    };
    match out.status {
        Status::Converged => String::new(),
        Status::Unreachable => off(),
        Status::IterationLimit if task.is_stopped() => "the design was stopped".to_owned(),
        _ => {
            let reason = &out.shape.message;
            let wanted = why();
            let wanted = wanted.trim_start_matches(": ");
            let of = if wanted.is_empty() { "" } else { "; of the wanted places, " };
            format!(
                "no routing was met that follows displacements within their bounds: {reason}{of}{wanted}"
            )
        }
    }
}
