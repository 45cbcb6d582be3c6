//! A path of the tool through waypoints.

use super::Target;
use crate::error::{InvalidInput, positive};
use crate::lie::so3;

/// Rows that a path has at most.
const ROWS: f64 = 1e7;

/// The waypoints, and between any two of them as many targets as it takes for neighbours to be at most a step
/// \[m\] and a turn \[rad\] apart: positions evenly along the straight line, axes evenly about one axis. Where
/// one of two waypoints has no axes, neither has what is between them.
///
/// # Errors
/// `InvalidInput` for a step or turn that is not positive and finite, or that makes more than ten million
/// targets.
pub fn cartesian_path(
    waypoints: &[Target],
    step: f64,
    turn: f64,
) -> Result<Vec<Target>, InvalidInput> {
    positive("step", "m", step)?;
    positive("turn", "rad", turn)?;
    let mut counts = Vec::with_capacity(waypoints.len());
    let (mut rows, mut by_steps, mut by_turns) = (1.0, 0.0, 0.0);
    for pair in waypoints.windows(2) {
        let (steps, turns) = parts(&pair[0], &pair[1], step, turn);
        let count = steps.max(turns).max(1.0);
        rows += count;
        by_steps += steps;
        by_turns += turns;
        if rows > ROWS {
            let (name, value, unit) =
                if by_turns > by_steps { ("turn", turn, "rad") } else { ("step", step, "m") };
            let expected = format!("a {name} that makes at most {ROWS} rows");
            return Err(InvalidInput::new(name, expected, format!("{value:?} {unit}")));
        }
        counts.push(count);
    }
    let mut path: Vec<Target> = waypoints.first().copied().into_iter().collect();
    for (pair, count) in waypoints.windows(2).zip(counts) {
        let mut part = 1.0;
        while part < count {
            path.push(between(&pair[0], &pair[1], part / count));
            part += 1.0;
        }
        path.push(pair[1]);
    }
    Ok(path)
}

/// Into how many parts steps and turns divide the way between two targets. Rounding makes no part more.
fn parts(from: &Target, to: &Target, step: f64, turn: f64) -> (f64, f64) {
    let whole = |ratio: f64| (ratio * (1.0 - 1e-12)).ceil();
    let angle = match (from.rotation(), to.rotation()) {
        (Some(from), Some(to)) => so3::log(&from.tr_mul(to)).norm(),
        _ => 0.0,
    };
    (whole((to.position() - from.position()).norm() / step), whole(angle / turn))
}

fn between(from: &Target, to: &Target, share: f64) -> Target {
    match (from, to) {
        (Target::Pose(from), Target::Pose(to)) => Target::Pose(from.toward(to, share)),
        _ => Target::Position(from.position().lerp(&to.position(), share)),
    }
}
