//! Tensions under which a march keeps the tendons' lengths.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::lie::Pose;
use crate::rod::Plan;
use crate::rod::stepwise_inverse::StepwiseInverse;

/// Newton steps at most, and when lengths are met, in shares of them.
const STEPS: usize = 50;
const MET: f64 = 1e-14;

/// The rest shape whose march through `targets` has the tendons at their displacements.
pub(super) struct Answer {
    pub(super) march: StepwiseInverse,
    /// In the plan's unit.
    pub(super) tensions: Vec<f64>,
    pub(super) iterations: usize,
}

/// Inverts step by step with the tensions that the displacements ask for; none when it finds none. Tendons that would
/// have to push are slack.
pub(super) fn solve_tensions(
    plan: &Plan,
    base: &Pose,
    targets: &[Vector3<f64>],
    twists: &[f64],
    displacements: &[f64],
) -> Option<Answer> {
    let count = displacements.len();
    let mut taut: Vec<usize> = (0..count).filter(|k| displacements[*k] < 0.0).collect();
    let mut answer =
        Answer { march: StepwiseInverse::default(), tensions: vec![0.0; count], iterations: 0 };
    for _ in 0..2 * count + 2 {
        meet_displacements(plan, base, targets, twists, displacements, &taut, &mut answer)?;
        let pushing = taut.iter().copied().find(|k| answer.tensions[*k] < 0.0);
        if let Some(slack) = pushing {
            taut.retain(|k| *k != slack);
            answer.tensions[slack] = 0.0;
            continue;
        }
        let long = (0..count).find(|k| {
            let over = answer.march.elongations[*k] - displacements[*k];
            !taut.contains(k) && over > 1e-12 * plan.total_length()
        });
        let Some(long) = long else { return Some(answer) };
        taut.push(long);
    }
    None
}

/// Newton's method for the tensions of the taut tendons, with differences for derivatives: a march is cheap.
fn meet_displacements(
    plan: &Plan,
    base: &Pose,
    targets: &[Vector3<f64>],
    twists: &[f64],
    displacements: &[f64],
    taut: &[usize],
    answer: &mut Answer,
) -> Option<()> {
    // Excess Σ L(ω) − Σ L(ω_rest) − C T − displacement of every taut tendon.
    let length = plan.total_length();
    let excess = |march: &StepwiseInverse, tensions: &[f64]| {
        DVector::from_iterator(
            taut.len(),
            taut.iter().map(|&k| {
                march.elongations[k] - displacements[k] - plan.compliance[k] * tensions[k]
            }),
        )
    };
    let invert = |answer: &mut Answer, tensions: &[f64]| {
        answer.iterations += 1;
        answer.march.solve(plan, base, targets, twists, tensions)
    };
    // From the tensions at hand.
    let start = answer.tensions.clone();
    if !invert(answer, &start) {
        return None;
    }
    let mut off = excess(&answer.march, &answer.tensions);
    // Step of the differences, in the plan's unit of tensions.
    let step = 1e-6 / plan.slenderness;
    for _ in 0..STEPS {
        if off.amax() <= MET * length {
            return Some(());
        }
        // Slopes by one tension after the other.
        let mut slopes = DMatrix::zeros(taut.len(), taut.len());
        for (column, &k) in taut.iter().enumerate() {
            let mut moved = answer.tensions.clone();
            moved[k] += step;
            if !invert(answer, &moved) {
                return None;
            }
            slopes.set_column(column, &((excess(&answer.march, &moved) - &off) / step));
        }
        // Newton's step, halved until the largest excess falls.
        let change = slopes.lu().solve(&off)?;
        let (mut share, before) = (1.0, off.amax());
        loop {
            let mut moved = answer.tensions.clone();
            for (row, &k) in taut.iter().enumerate() {
                moved[k] -= share * change[row];
            }
            if invert(answer, &moved) {
                off = excess(&answer.march, &moved);
                if off.amax() < before {
                    answer.tensions = moved;
                    break;
                }
            }
            share *= 0.5;
            if share < 1e-6 {
                // Rounding, or no way down.
                let tensions = answer.tensions.clone();
                invert(answer, &tensions);
                return (before <= 1e-12 * length).then_some(());
            }
        }
    }
    None
}
