//! The answer in the robot's own frame and order, and in words.

use super::answer::Answer;
use super::canonical_task::CanonicalTask;
use super::task::Task;
use crate::design::feasibility::infeasible_chord;
use crate::error::InvalidInput;
use crate::model::{Model, Shape};
use crate::robot::Robot;
use crate::rod::{Plan, Rod};
use crate::status::Status;

/// Knowledge about the nearest routing.
///
/// ```
/// use tdcr::design::Optimality;
///
/// assert_eq!(Optimality::Exhaustive.as_str(), "exhaustive");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Optimality {
    /// Every disk is in its place: nothing is nearer.
    Reached,
    /// Every routing was looked at over a row of tensions.
    Exhaustive,
    /// The best that a search met.
    Searched,
}

impl Optimality {
    /// The name used in Python.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Reached => "reached",
            Self::Exhaustive => "exhaustive",
            Self::Searched => "searched",
        }
    }
}

/// A robot whose tendons were routed for a shape.
///
/// ```
/// use tdcr::design::{RoutingSettings, routing};
/// use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let backbone = Backbone::new(BackboneSpec::straight(0.1, 2))?;
/// let robot = Robot::new(backbone, vec![Tendon::straight(0.0, 0.01)?], None, None, None)?;
/// // The rest shape is reached without any pull.
/// let targets: Vec<_> = robot.rest_frames().iter().skip(1).map(|disk| disk.translation).collect();
/// let settings = RoutingSettings { holes: Some(4), ..RoutingSettings::default() };
/// let found = routing(&robot, &targets, None, None, &settings)?;
/// assert!(found.rms < 1e-9);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Routed {
    /// The robot with its new tendons.
    pub robot: Robot,
    /// Its shape under the displacements, from rest.
    pub shape: Shape,
    /// Displacements \[m\].
    pub displacements: Vec<f64>,
    /// Numbers of each tendon's holes, disk 0 to its end; none where any azimuth was allowed.
    pub holes: Option<Vec<Vec<usize>>>,
    /// Distance of each disk from its wanted place, disk 0 first \[m\].
    pub errors: Vec<f64>,
    /// Root mean square distance of disks 1 to n \[m\].
    pub rms: f64,
    /// Root mean square distance of the nearest routing with any azimuth that a descent from this one led to \[m\].
    pub relaxed_rms: f64,
    /// Knowledge about there being a nearer one.
    pub optimality: Optimality,
    /// Steps of descents and rounds of the search.
    pub iterations: usize,
    /// Equilibria of subsegments that the search solved.
    pub evaluations: usize,
    /// Converged: every disk is in its place; unreachable: the nearest routing that was found.
    pub status: Status,
    /// Message about what stood in the way, or empty.
    pub message: String,
}

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
    // Distances |r| of the disks, their root mean square, and whether all are small enough.
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
