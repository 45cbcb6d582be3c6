//! Descents in the bends of subsegments.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector, Vector3};

use crate::error::InvalidInput;

/// Damping that a descent starts with, and the largest before it gives up.
const DAMPING: f64 = 1e-6;
const STIFF: f64 = 1e9;

/// Least squares in the bends of subsegments.
pub(super) trait BendProblem {
    /// Share of the sum of squares that a step must take off to be followed by another.
    const HEADWAY: f64;
    /// Bends and all that was found out at them.
    type Point;
    /// Rotation vectors \[rad\], whose z the descent keeps.
    fn bends<'a>(&self, point: &'a Self::Point) -> &'a [Vector3<f64>];
    fn residual<'a>(&self, point: &'a Self::Point) -> &'a DVector<f64>;
    /// Derivatives of the residual by bends about x and y, subsegment by subsegment.
    fn jacobian(&self, point: &Self::Point) -> Result<DMatrix<f64>, InvalidInput>;
    /// Point at other bends, near another; none where there is no answer.
    fn at(
        &self,
        bends: Vec<Vector3<f64>>,
        near: &Self::Point,
    ) -> Result<Option<Self::Point>, InvalidInput>;
    /// Decision that a point is good enough.
    fn is_met(&self, point: &Self::Point) -> bool;
    fn is_stopped(&self) -> bool;
}

/// A rotation vector whose bend is within a bound.
pub(super) fn clamp_bend(bend: &Vector3<f64>, most: f64) -> Vector3<f64> {
    let size = bend.xy().norm();
    let share = if size > most { most / size } else { 1.0 };
    // A rest strain of more than half a turn does not exist.
    let out = Vector3::new(bend.x * share, bend.y * share, bend.z);
    // Less a rounding, which the backbone's own check must not see.
    out * ((1.0 - 1e-15) * PI / out.norm()).min(1.0)
}

/// End of Levenberg-Marquardt steps with bends of at most `most`, and their number.
pub(super) fn descend<P: BendProblem>(
    problem: &P,
    start: P::Point,
    most: f64,
    steps: usize,
) -> Result<(P::Point, usize), InvalidInput> {
    let mut best = start;
    let mut damping = DAMPING;
    for step in 0..steps {
        if problem.is_stopped() || problem.is_met(&best) {
            return Ok((best, step));
        }
        let value = problem.residual(&best).norm_squared();
        let Some(next) = descent_step(problem, &best, most, &mut damping)? else {
            return Ok((best, step));
        };
        let headway = 1.0 - problem.residual(&next).norm_squared() / value;
        best = next;
        damping = (0.1 * damping).max(1e-12);
        if headway < P::HEADWAY {
            return Ok((best, step + 1));
        }
    }
    Ok((best, steps))
}

/// Levenberg-Marquardt step to a lower point: less damped ones first.
fn descent_step<P: BendProblem>(
    problem: &P,
    from: &P::Point,
    most: f64,
    damping: &mut f64,
) -> Result<Option<P::Point>, InvalidInput> {
    let residual = problem.residual(from);
    let value = residual.norm_squared();
    let mut jacobian = problem.jacobian(from)?;
    let mut gradient = jacobian.tr_mul(residual);
    project_at_bound(problem.bends(from), most, &mut jacobian, &mut gradient);
    let gram = jacobian.tr_mul(&jacobian);
    while *damping < STIFF && !problem.is_stopped() {
        let mut damped = gram.clone();
        for k in 0..damped.nrows() {
            damped[(k, k)] += *damping * (1e-12 + value);
        }
        let Some(factor) = damped.cholesky() else {
            *damping = (10.0 * *damping).max(1e-9);
            continue;
        };
        let step = factor.solve(&gradient);
        let bends = problem.bends(from).iter().enumerate().map(|(i, bend)| {
            clamp_bend(&(bend - Vector3::new(step[2 * i], step[2 * i + 1], 0.0)), most)
        });
        let next = problem.at(bends.collect(), from)?;
        if let Some(next) = next.filter(|p| problem.residual(p).norm_squared() < value) {
            return Ok(Some(next));
        }
        *damping *= 10.0;
    }
    Ok(None)
}

/// Projection of gradient and Jacobian onto the bound of bends, for subsegments that are at it and would leave it:
/// they can still turn.
fn project_at_bound(
    bends: &[Vector3<f64>],
    most: f64,
    jacobian: &mut DMatrix<f64>,
    gradient: &mut DVector<f64>,
) {
    for (i, bend) in bends.iter().enumerate() {
        let size = bend.xy().norm();
        let outward = bend.xy() / size;
        let slope = gradient[2 * i] * outward.x + gradient[2 * i + 1] * outward.y;
        if size < most.min(PI) * (1.0 - 1e-9) || slope >= 0.0 {
            continue;
        }
        gradient[2 * i] -= slope * outward.x;
        gradient[2 * i + 1] -= slope * outward.y;
        for mut row in jacobian.row_iter_mut() {
            let along = row[2 * i] * outward.x + row[2 * i + 1] * outward.y;
            row[2 * i] -= along * outward.x;
            row[2 * i + 1] -= along * outward.y;
        }
    }
}
