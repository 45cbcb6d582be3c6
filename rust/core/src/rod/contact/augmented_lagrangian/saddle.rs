//! Saddles of M: their test, and the step off them.

use super::{Minimizer, Problem};
use crate::obstacle::Fault;
use crate::rod::plan::Plan;
use crate::solve::dense::dot;

/// Step off a saddle \[rad, all subsegments together\], and its halvings where it would lead through an obstacle.
const STEP: f64 = 1e-1;
const HALVINGS: usize = 10;
/// A gradient with a smaller part than this along the way out does not lead there \[rad\].
const SYMMETRIC: f64 = 1e-9;

impl Minimizer {
    /// Symmetry of an unstable shape: its gradient has no part along the way out, so it stays unstable on the way down.
    pub(super) fn is_symmetric(&self, plan: &Plan) -> bool {
        let (width, data) = (plan.width(), &plan.data);
        let mut size = 0.0;
        for (k, escape) in self.escape.iter().enumerate() {
            let elasticity = &data[k / width].elasticity;
            size += escape * escape * elasticity.stiffness(k % width % plan.unknowns());
        }
        dot(&self.gradient, &self.escape).abs() <= SYMMETRIC * size
    }

    /// Leaves a saddle along the direction of negative curvature, as far as no point goes through an obstacle, under
    /// the compliances of the start.
    pub(super) fn leave_saddle(&mut self, problem: &Problem<'_>) -> Result<(), Fault> {
        self.unstable_steps = 0;
        self.estimates.scale_compliance(self.estimates.stiffness);
        self.evaluate_current(problem)?;
        let sum: f64 = self.escape.iter().map(|escape| escape.abs()).sum();
        let mut size = STEP / sum;
        for _ in 0..HALVINGS {
            self.trial.strains.clear();
            let ends = self.current.strains.iter().zip(&self.escape);
            self.trial.strains.extend(ends.map(|(own, escape)| own + size * escape));
            self.evaluate_trial(problem)?;
            if self.is_free_path(problem)? {
                break;
            }
            size *= 0.5;
        }
        std::mem::swap(&mut self.current, &mut self.trial);
        Ok(())
    }
}
