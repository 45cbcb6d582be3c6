//! What stood in the way of a solve, in a sentence.

use super::dual_newton::Ending;
use super::model::{Rod, Scratch};
use super::plan::Plan;

/// The message for displacements (or none, where tensions were given); empty when the solve converged.
pub(super) fn message(rod: &Rod<'_>, displacements: &[f64], work: &Scratch) -> String {
    let (plan, state) = (rod.plan, &work.state);
    if work.ending == Ending::Converged {
        return String::new();
    }
    if work.ending == Ending::Stopped {
        return "stopped before the end".to_owned();
    }
    if displacements.is_empty() {
        let text = match work.ending {
            Ending::Spent => "max_iterations did not suffice to reach the tensions",
            _ => "rest leads to no stable shape under these tensions: the backbone buckles before",
        };
        return text.to_owned();
    }
    if let Some(text) = nothing_left(rod, displacements) {
        return text;
    }
    let over = |k: usize| {
        let stretch = plan.compliance[k] * state.tensions[k] / plan.unit;
        state.tendon_lengths[k] - stretch - plan.rest_lengths[k] - displacements[k]
    };
    let off = |k: usize| plan.settings.tendons.reported_excess(over(k), state.tensions[k]);
    let worst = (0..displacements.len())
        .filter(|k| displacements[*k].is_finite())
        .max_by(|a, b| off(*a).total_cmp(&off(*b)))
        .unwrap_or(0);
    let opening = match work.ending {
        Ending::Spent => "max_iterations did not suffice to reach the displacements",
        Ending::Broken => "the arithmetic broke down",
        _ => "no shape near rest has these tendon lengths",
    };
    let name = |k: usize| format!("'{}'", rod.robot.tendon_names()[k]);
    let side = if over(worst) > 0.0 { "long" } else { "short" };
    let mut text = format!("{opening}: {} stays {:.3e} m too {side}", name(worst), off(worst));
    let held: Vec<String> = (0..displacements.len())
        .filter(|k| displacements[*k] == 0.0 && state.tensions[*k] != 0.0)
        .map(name)
        .collect();
    if !held.is_empty() {
        text += "; held at their rest length: ";
        text += &held.join(", ");
        text += "; free them (inf), release them";
    }
    let several = displacements.iter().filter(|d| d.is_finite()).count() > 1;
    if several && plan.compliance.iter().all(|give| *give == 0.0) {
        text += if held.is_empty() { "; " } else { ", or " };
        text += "give the tendons a stiffness if they are elastic";
    }
    text
}

/// A tendon that cannot stretch and is pulled by its path in the robot or more: often millimetres for metres.
fn nothing_left(rod: &Rod<'_>, displacements: &[f64]) -> Option<String> {
    let Plan { rest_lengths, compliance, .. } = rod.plan;
    let (k, pull) = (displacements.iter().map(|d| -d).enumerate())
        .find(|(k, pull)| compliance[*k] == 0.0 && *pull >= rest_lengths[*k])?;
    let (name, path) = (&rod.robot.tendon_names()[k], rest_lengths[k]);
    Some(format!("tendon '{name}' is pulled by {pull:.3e} m, its path of {path:.3e} m or more"))
}
