//! Newton/SQP for small equality-constrained minima, all of it on the stack.
//!
//! `min f(x) subject to c(x) = 0` over a manifold with `N` local coordinates and `M < N`
//! constraints, both known at compile time. Every iteration solves the quadratic model exactly in
//! the null space of the constraint Jacobian (Nocedal & Wright, *Numerical Optimization*, 2nd ed.,
//! algorithms 18.1 and 16.2) with least-squares multipliers (eq. 18.21) and second derivatives of
//! the Lagrangian, and is globalised by an augmented-Lagrangian merit function: at a good
//! multiplier estimate it has no Maratos effect, so the fast end phase is never damped.

mod null_space;
mod problem;

use nalgebra::{SMatrix, SVector};

use null_space::{Frame, Step};
pub use problem::{Linearization, Problem};

/// Settings of the iteration: tolerances, bounds, budget.
///
/// ```
/// use tdcr::linkage::LinkageSettings;
///
/// let settings = LinkageSettings::default().sqp();
/// assert!(settings.constraint_tolerance < settings.step_tolerance);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The iteration ends with the first full Newton step below this; that step is still taken, so
    /// the remaining error is about its square.
    pub step_tolerance: f64,
    /// No step is longer: trial points stay where the quadratic model means something.
    pub step_bound: f64,
    /// The constraint violation that counts as met (infinity norm, the problem's own scale).
    pub constraint_tolerance: f64,
    /// Newton steps at most.
    pub max_iterations: usize,
}

/// Why the iteration ended.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::linkage::seven_bar::Hole;
/// use tdcr::linkage::{LinkageSettings, solve_four_bar};
/// use tdcr::solve::sqp::Ending;
///
/// let hole = Vector3::new(0.5, 0.0, 0.0);
/// let settings = LinkageSettings::default().sqp();
/// assert_eq!(solve_four_bar(&Hole::new(hole, hole, 0.1), &settings).ending, Ending::Converged);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The Newton step fell below the tolerance with the constraints met.
    Converged,
    /// The constraint violation has a nonzero local minimum, which is the last point.
    Infeasible,
    /// Out of iterations, or no further decrease.
    IterationLimit,
    /// A value was not finite.
    NumericalError,
}

/// The last point and how it was reached.
///
/// ```
/// use tdcr::solve::sqp::{Ending, Solution};
///
/// let solution = Solution::<f64, 1>::without_iterations(0.5);
/// assert_eq!((solution.ending, solution.iterations), (Ending::Converged, 0));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Solution<P, const M: usize> {
    /// The last point, solution or not.
    pub point: P,
    /// Multipliers of the constraints: `grad f + sum_j multipliers_j grad c_j = 0`.
    pub multipliers: SVector<f64, M>,
    /// Why the iteration ended.
    pub ending: Ending,
    /// Newton steps taken.
    pub iterations: usize,
    /// Constraint violation at the last point (infinity norm).
    pub violation: f64,
    /// Gradient of the Lagrangian in the null space at the last point (infinity norm).
    pub stationarity: f64,
}

impl<P, const M: usize> Solution<P, M> {
    /// An answer that needed no iteration.
    #[must_use]
    pub fn without_iterations(point: P) -> Self {
        Self {
            point,
            multipliers: SVector::zeros(),
            ending: Ending::Converged,
            iterations: 0,
            violation: 0.0,
            stationarity: 0.0,
        }
    }
}

/// Shrinks of one line search: 2^-24 of a step is no step.
const BACKTRACKS: usize = 24;

/// Fraction of the predicted decrease that a step must deliver.
const ARMIJO: f64 = 1e-4;

/// Weight of the squared constraints in the merit, raised where it has to be.
const INITIAL_PENALTY: f64 = 10.0;

/// A point and its derivatives; two of them take turns, so that nothing is copied.
struct Iterate<P, const N: usize, const M: usize> {
    point: P,
    at: Linearization<N, M>,
}

impl<P: Copy, const N: usize, const M: usize> Iterate<P, N, M> {
    fn new(point: P) -> Self {
        let at = Linearization {
            objective: 0.0,
            gradient: SVector::zeros(),
            constraints: SVector::zeros(),
            jacobian_transposed: SMatrix::zeros(),
        };
        Self { point, at }
    }

    /// Moves here from `from` by a share of a step.
    fn move_to<Q: Problem<N, M, Point = P>>(
        &mut self,
        problem: &Q,
        from: &Self,
        step: &SVector<f64, N>,
        factor: f64,
    ) -> bool {
        problem.retract(&from.point, step, factor, &mut self.point);
        let admissible = problem.admissible(&self.point);
        problem.linearize(&self.point, &mut self.at);
        admissible
    }
}

/// Minimises `problem` from `start`. Where the iteration fails with the constraints unmet, it searches
/// for a feasible point, and starts again from there or says that there is none nearby.
pub fn minimize<const N: usize, const M: usize, P: Problem<N, M>>(
    problem: &P,
    start: P::Point,
    settings: &Settings,
) -> Solution<P::Point, M> {
    let found = descend(problem, start, settings);
    if found.ending != Ending::IterationLimit || found.violation <= settings.constraint_tolerance {
        return found;
    }
    let (point, violation) = restore(problem, found.point, settings);
    if violation > settings.constraint_tolerance {
        // No settling between the tolerances: a stationary violation is well above rounding.
        let infeasible = violation > settings.constraint_tolerance.sqrt();
        let ending = if infeasible { Ending::Infeasible } else { Ending::IterationLimit };
        return Solution { point, ending, violation, ..found };
    }
    if !problem.admissible(&point) {
        return found;
    }
    let again = descend(problem, point, settings);
    Solution { iterations: found.iterations + again.iterations, ..again }
}

fn descend<const N: usize, const M: usize, P: Problem<N, M>>(
    problem: &P,
    start: P::Point,
    settings: &Settings,
) -> Solution<P::Point, M> {
    let (mut one, mut other) = (Iterate::new(start), Iterate::new(start));
    // References, so that taking turns moves no data.
    let (mut here, mut there) = (&mut one, &mut other);
    // f, c and their gradients at the start; null-space basis and least-squares multipliers (eq. 18.21).
    problem.linearize(&here.point, &mut here.at);
    let mut penalty = INITIAL_PENALTY;
    let mut ending = Ending::IterationLimit;
    let mut iterations = 0;
    let mut frame = Frame::new();
    frame.adapt(&here.at);
    while iterations < settings.max_iterations {
        // Step of the quadratic model (algorithm 16.2).
        let hessian = problem.hessian(&here.point, &frame.multipliers);
        let Some(step) = frame.newton_step(&here.at, hessian) else {
            ending = Ending::NumericalError;
            break;
        };
        iterations += 1;
        let size = problem.step_size(&step.full);
        // A full Newton step below the tolerance is the last; others are searched along.
        let last = step.exact && size <= settings.step_tolerance;
        let moved = if last {
            there.move_to(problem, here, &step.full, 1.0);
            true
        } else {
            let limit = (settings.step_bound / size.max(f64::MIN_POSITIVE)).min(1.0);
            line_search(problem, here, there, &step, limit, &mut penalty)
        };
        if !moved {
            break;
        }
        // The new point, with its own basis and multipliers.
        std::mem::swap(&mut here, &mut there);
        frame.adapt(&here.at);
        if last && here.at.constraints.amax() <= settings.constraint_tolerance {
            ending = Ending::Converged;
            break;
        }
    }
    if ending == Ending::IterationLimit && !here.at.objective.is_finite() {
        ending = Ending::NumericalError;
    }
    Solution {
        point: here.point,
        multipliers: frame.multipliers,
        ending,
        iterations,
        violation: here.at.constraints.amax(),
        stationarity: frame.stationarity(),
    }
}

/// Steps of the search for a feasible point.
const RESTORATION_STEPS: usize = 100;

/// Levenberg-Marquardt on the constraints alone: the point where the violation ends, and its size.
fn restore<const N: usize, const M: usize, P: Problem<N, M>>(
    problem: &P,
    start: P::Point,
    settings: &Settings,
) -> (P::Point, f64) {
    let (mut one, mut other) = (Iterate::new(start), Iterate::new(start));
    let (mut here, mut there) = (&mut one, &mut other);
    problem.linearize(&here.point, &mut here.at);
    let mut damping = 1e-3;
    for _ in 0..RESTORATION_STEPS {
        let (constraints, columns) = (&here.at.constraints, &here.at.jacobian_transposed);
        if constraints.amax() <= settings.constraint_tolerance || damping > 1e12 {
            break;
        }
        let gram = columns.transpose() * columns;
        let shift = SMatrix::<f64, M, M>::from_diagonal_element(damping * gram.trace());
        let Some(inverse) = (gram + shift).try_inverse() else { break };
        let step = columns * (inverse * constraints) * -1.0;
        let size = problem.step_size(&step).max(f64::MIN_POSITIVE);
        there.move_to(problem, here, &step, (settings.step_bound / size).min(1.0));
        if there.at.constraints.norm_squared() < here.at.constraints.norm_squared() {
            std::mem::swap(&mut here, &mut there);
            damping = (0.2 * damping).max(1e-15);
        } else {
            damping *= 4.0;
        }
    }
    (here.point, here.at.constraints.amax())
}

/// Backtracks along the step until the augmented Lagrangian falls enough; the accepted point is in
/// `there`.
fn line_search<const N: usize, const M: usize, P: Problem<N, M>>(
    problem: &P,
    here: &Iterate<P::Point, N, M>,
    there: &mut Iterate<P::Point, N, M>,
    step: &Step<N, M>,
    limit: f64,
    penalty: &mut f64,
) -> bool {
    let squared = here.at.constraints.norm_squared();
    // Derivative of the merit along the step: -curvature - penalty |c|^2. The penalty makes it a
    // descent direction even where the range-space part of the model has negative curvature.
    if step.curvature < 0.0 && squared > 0.0 {
        *penalty = penalty.max(-2.0 * step.curvature / squared);
    }
    let slope = (-step.curvature - *penalty * squared).min(0.0);
    let merit = |l: &Linearization<N, M>| {
        l.objective
            + step.multipliers.dot(&l.constraints)
            + 0.5 * *penalty * l.constraints.norm_squared()
    };
    let before = merit(&here.at);
    // Below this the difference of two merits is rounding.
    let noise = 1e-14 * before.abs() + 1e-300;
    let mut factor = limit;
    for _ in 0..BACKTRACKS {
        let admissible = there.move_to(problem, here, &step.full, factor);
        if admissible && merit(&there.at) <= before + ARMIJO * factor * slope + noise {
            return true;
        }
        factor *= 0.5;
    }
    false
}
