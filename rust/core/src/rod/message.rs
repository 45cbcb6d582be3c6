//! Messages: a sentence on what a solve failed at.

use super::dual_newton::Ending;
use super::plan::Plan;
use crate::model::State;

/// Solve that a message is about.
pub(super) struct Failure<'a> {
    pub(super) plan: &'a Plan,
    pub(super) tendon_names: &'a [String],
    pub(super) ending: Ending,
    pub(super) state: &'a State,
}

/// Message for displacements (or none, where tensions were given); empty when the solve converged.
pub(super) fn message(failure: &Failure<'_>, displacements: &[f64]) -> String {
    let Failure { plan, tendon_names, ending, state } = failure;
    if *ending == Ending::Converged {
        return String::new();
    }
    if *ending == Ending::Stopped {
        return "stopped before the end".to_owned();
    }
    // Given tensions.
    if displacements.is_empty() {
        let text = match ending {
            Ending::Spent => "max_iterations did not suffice to reach the tensions",
            _ => "rest leads to no stable shape under these tensions: the backbone buckles before",
        };
        return text.to_owned();
    }
    if let Some(text) = pulled_by_its_path(failure, displacements) {
        return text;
    }
    // L − c T − b of every tendon, and the worst one.
    let excess = |k: usize| {
        let stretch = plan.compliance[k] * state.tensions[k] / plan.unit;
        state.tendon_lengths[k] - stretch - plan.rest_lengths[k] - displacements[k]
    };
    let violation = |k: usize| plan.settings.tendons.reported_excess(excess(k), state.tensions[k]);
    let worst = (0..displacements.len())
        .filter(|k| displacements[*k].is_finite())
        .max_by(|a, b| violation(*a).total_cmp(&violation(*b)))
        .unwrap_or(0);
    // The sentence: what ended the solve, and by how much the worst tendon misses its length.
    let opening = match ending {
        Ending::Spent => "max_iterations did not suffice to reach the displacements",
        Ending::Broken => "the arithmetic broke down",
        _ => "no shape near rest has these tendon lengths",
    };
    let name = |k: usize| format!("'{}'", tendon_names[k]);
    let side = if excess(worst) > 0.0 { "long" } else { "short" };
    let mut text =
        format!("{opening}: {} stays {:.3e} m too {side}", name(worst), violation(worst));
    // Ways out: tendons held at rest may be freed, rigid ones may be elastic.
    let held: Vec<String> = (0..displacements.len())
        .filter(|k| displacements[*k] == 0.0 && state.tensions[*k] != 0.0)
        .map(name)
        .collect();
    if !held.is_empty() {
        text += "; held at their rest length: ";
        text += &held.join(", ");
        text += "; free them (inf), release them";
    }
    // Rigid tendons may depend on each other.
    let several = displacements.iter().filter(|d| d.is_finite()).count() > 1;
    if several && plan.compliance.iter().all(|compliance| *compliance == 0.0) {
        text += if held.is_empty() { "; " } else { ", or " };
        text += "give the tendons a stiffness if they are elastic";
    }
    text
}

/// Rigid tendon that is pulled by its path in the robot or more: often millimetres for metres.
fn pulled_by_its_path(failure: &Failure<'_>, displacements: &[f64]) -> Option<String> {
    let Plan { rest_lengths, compliance, .. } = failure.plan;
    let (k, pull) = (displacements.iter().map(|d| -d).enumerate())
        .find(|(k, pull)| compliance[*k] == 0.0 && *pull >= rest_lengths[*k])?;
    let (name, path) = (&failure.tendon_names[k], rest_lengths[k]);
    Some(format!("tendon '{name}' is pulled by {pull:.3e} m, its path of {path:.3e} m or more"))
}
