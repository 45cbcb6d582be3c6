//! Levenberg-Marquardt steps on the holes and pulls of a routing, within bounds.

use nalgebra::{DMatrix, DVector};

use super::continuous_holes::{Freedom, Point, Pulls};
use super::task::Task;
use crate::error::InvalidInput;

/// Damping: where it begins, its least and its largest.
const DAMPING: (f64, f64, f64) = (1e-4, 1e-12, 1e9);
/// A descent ends when a step lowers the value by less than this share, or every disk is this much nearer than it
/// has to be.
const HEADWAY: f64 = 1e-9;
const SPARE: f64 = 0.01;
/// Tensions change by no more than this share in one step, and angles by this much \[rad\].
const SHARE: f64 = 0.5;
const TURN: f64 = 0.5;

impl Point {
    /// Steps until it is no nearer, and how many.
    pub(super) fn descend(
        self,
        task: &Task<'_>,
        freedom: &Freedom,
        steps: &mut usize,
    ) -> Result<Self, InvalidInput> {
        // Levenberg-Marquardt steps.
        let mut here = self;
        let mut damping = DAMPING.0;
        for _ in 0..task.settings.max_iterations {
            if task.is_stopped() || here.is_met(task, SPARE) {
                break;
            }
            // JᵀJ and Jᵀr of the places by the unknowns.
            let jacobian = here.jacobian(task, freedom)?;
            let off = task.residual(&here.state);
            let [x, lower, upper] = here.unknowns(task, freedom);
            let units = freedom.units(task, x.len());
            let (gram, gradient) = (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&off));
            // Damping grows until a step brings the disks nearer.
            let mut lowered = None;
            while damping < DAMPING.2 && !task.is_stopped() {
                *steps += 1;
                let next = bounded_step(&gram, &gradient, (damping, &units), &x, [&lower, &upper]);
                let Some(next) = next else { break };
                let next = Self::limit_step(task, freedom, &x, next);
                if let Some(point) = here.with_unknowns(task, freedom, &next)?
                    && point.value < here.value
                {
                    lowered = Some(point);
                    break;
                }
                damping *= 10.0;
            }
            // From there with less damping, while it is worth the step.
            let Some(point) = lowered else { break };
            let headway = 1.0 - point.value / here.value;
            here = point;
            damping = (0.1 * damping).max(DAMPING.1);
            if headway < HEADWAY {
                break;
            }
        }
        Ok(here)
    }

    /// A step of which no angle and no tension goes too far.
    fn limit_step(task: &Task<'_>, freedom: &Freedom, x: &[f64], next: Vec<f64>) -> Vec<f64> {
        let pulls = x.len() - task.tendons();
        let mut share = 1.0_f64;
        for (i, (from, to)) in x.iter().zip(&next).enumerate() {
            let most = match (i >= pulls, freedom.pulls) {
                (true, Pulls::Tensions) => SHARE * from.max(1e-3 * x[pulls..].iter().sum::<f64>()),
                (true, Pulls::Displacements) => f64::INFINITY,
                (false, _) => TURN,
            };
            let far = (to - from).abs();
            if far > most {
                share = share.min(most / far);
            }
        }
        x.iter().zip(next).map(|(from, to)| from + share * (to - from)).collect()
    }
}

/// A damped step within bounds: unknowns that would leave them are held there. `units` are what they are measured in,
/// so that what keeps a step finite where an unknown does nothing is the same in metres and in millimetres.
fn bounded_step(
    gram: &DMatrix<f64>,
    gradient: &DVector<f64>,
    (damping, units): (f64, &[f64]),
    x: &[f64],
    [lower, upper]: [&[f64]; 2],
) -> Option<Vec<f64>> {
    let mut out = x.to_vec();
    let outwards = |i: usize| {
        (x[i] <= lower[i] && gradient[i] > 0.0) || (x[i] >= upper[i] && gradient[i] < 0.0)
    };
    let mut free: Vec<usize> = (0..x.len()).filter(|i| !outwards(*i)).collect();
    let floor =
        1e-12 * (0..x.len()).fold(0.0_f64, |most, i| most.max(gram[(i, i)] * units[i].powi(2)));
    loop {
        let damped = DMatrix::from_fn(free.len(), free.len(), |a, b| {
            let own = gram[(free[a], free[b])];
            if a == b { own * (1.0 + damping) + floor / units[free[a]].powi(2) } else { own }
        });
        // What is held at a bound moves there, and the others with it.
        let held: Vec<usize> = (0..x.len()).filter(|i| !free.contains(i)).collect();
        let right = DVector::from_fn(free.len(), |a, _| {
            let moved = held.iter().map(|i| gram[(free[a], *i)] * (out[*i] - x[*i]));
            -gradient[free[a]] - moved.sum::<f64>()
        });
        let step = damped.cholesky()?.solve(&right);
        let count = free.len();
        for (i, step) in free.iter().zip(step.iter()) {
            out[*i] = x[*i] + step;
        }
        free.retain(|i| out[*i] >= lower[*i] && out[*i] <= upper[*i]);
        for i in 0..x.len() {
            out[i] = out[i].clamp(lower[i], upper[i]);
        }
        if free.len() == count {
            return out.iter().all(|v| v.is_finite()).then_some(out);
        }
    }
}
