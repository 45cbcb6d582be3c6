//! Parameters of a measured robot from positions under many pulls. The mathematics is in `docs/design.md`.

mod derivatives;
mod least_squares;
mod measured;
mod parameters;
mod prediction;
mod standard_errors;

use std::ops::Range;
use std::sync::atomic::Ordering;

use nalgebra::{DVector, Vector3};
use rayon::ThreadPool;

use self::least_squares::{Iterate, Loss};
use self::parameters::Parameters;
use self::prediction::{Predictor, Row};
use self::standard_errors::standard_errors;
use crate::batch::Control;
use crate::error::InvalidInput;
use crate::forward::ModelSettings;
use crate::robot::Robot;

pub use measured::Measured;
pub use parameters::Parameter;

/// Choices of a fit.
///
/// ```
/// assert!(tdcr::design::FitSettings::default().robust);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct FitSettings {
    /// Forward model that measurements are compared with: the rod, or constant curvature.
    pub model: ModelSettings,
    /// A round under the soft-L1 loss after that of least squares.
    pub robust: bool,
    /// Levenberg-Marquardt steps at most, of both rounds.
    pub max_iterations: usize,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self { model: ModelSettings::default(), robust: true, max_iterations: 50 }
    }
}

/// Parameters fitted to measurements; see [`fit`].
#[derive(Clone, Debug)]
pub struct Fit {
    /// The robot with its fitted holes, stiffness, rest shape, Poisson's ratio and base.
    pub robot: Robot,
    /// Values of each kind.
    pub parameters: Vec<(Parameter, Vec<f64>)>,
    /// Standard error of each value; infinite where the data do not tell it.
    pub standard_errors: Vec<Vec<f64>>,
    /// Measured minus predicted points of all rows \[m\].
    pub residuals: Vec<Vector3<f64>>,
    /// Measured minus predicted points of the robot as it was given \[m\].
    pub residuals_before: Vec<Vector3<f64>>,
    /// Rows whose forward solve did not converge.
    pub failed: usize,
    /// Kinds with a value as small or as great as a robot can have.
    pub at_bounds: Vec<Parameter>,
    /// Levenberg-Marquardt steps.
    pub iterations: usize,
    /// Convergence: steps no longer fall.
    pub converged: bool,
}

/// Scale of the soft-L1 loss in median distances, and at least in lengths of the robot: data without noise have no
/// outliers either.
const MEDIANS: f64 = 2.0;
const LEAST_SCALE: f64 = 1e-9;

/// Fit of some parameters of a robot to measured rows, on `pool`; nothing when it was stopped.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::batch::{Control, Field, Key, pool, solve_rows};
/// use tdcr::design::{FitSettings, Measured, Parameter, fit};
/// use tdcr::rod::{Plan, Rod, RodSettings};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let robot = |radius| {
/// #     let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// #     Robot::new(backbone, vec![Tendon::straight(0.0, radius)?], None, None, None)
/// # };
/// let (real, given, pool) = (robot(0.0104)?, robot(0.01)?, pool(None)?);
/// let displacements = vec![-0.002, -0.004, -0.006];
/// let plan = Plan::new(&real, RodSettings::default())?;
/// let fields = [Field::Positions];
/// let control = Control::default();
/// let seen = solve_rows(&Rod::new(&real, &plan), &displacements, 3, &fields, &pool, &control)?;
/// let seen = seen.unwrap_or_default();
/// let points = seen.values(Key::Positions).unwrap_or_default().chunks_exact(3);
/// let points = points.map(Vector3::from_column_slice).collect();
/// let measured = Measured { displacements, points, held_out: vec![false; 3] };
/// let settings = FitSettings::default();
/// let found = fit(&given, &measured, &[Parameter::Radius], &settings, &pool, &control)?;
/// assert!(found.is_some_and(|fit| (fit.parameters[0].1[0] - 0.0104).abs() < 1e-9));
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// `InvalidInput` for rows of other sizes or fewer numbers than unknowns, tendons that do not have what is fitted,
/// displacements that are NaN or `-inf`, and settings or values that the model does not take.
pub fn fit(
    robot: &Robot,
    measured: &Measured,
    parameters: &[Parameter],
    settings: &FitSettings,
    pool: &ThreadPool,
    control: &Control,
) -> Result<Option<Fit>, InvalidInput> {
    let parameters = Parameters::new(robot, parameters)?;
    measured.check(robot, parameters.len())?;
    let predictor = Predictor { parameters, measured, model: settings.model, pool, control };
    let start = predictor.parameters.start.clone();
    let (held, fitted): (Vec<_>, Vec<_>) =
        (0..measured.held_out.len()).partition(|row| measured.held_out[*row]);
    // Before: the rows of the first step, and those that are held out.
    let rows = predictor.rows(&start, &fitted, true)?;
    let held_before = predictor.rows(&start, &held, false)?;
    let residuals_before = residuals(measured, [(&fitted, &rows), (&held, &held_before)]);
    // Least squares, then the soft-L1 loss with a scale by the distances that are left.
    let mut at = Iterate { values: start, rows, iterations: 0, converged: false };
    let mut loss = Loss::Squares;
    predictor.descend(&mut at, &fitted, loss, settings.max_iterations)?;
    if settings.robust && at.converged {
        let least = LEAST_SCALE * robot.backbone().total_length();
        loss = Loss::SoftL1((MEDIANS * median(&at.rows)).max(least));
        predictor.descend(&mut at, &fitted, loss, settings.max_iterations)?;
    }
    // After: the rows of the last step are at its values.
    let held_after = predictor.rows(&at.values, &held, false)?;
    if control.stop.load(Ordering::Relaxed) {
        return Ok(None);
    }
    // Estimates and their standard errors, in their units.
    let Predictor { parameters, .. } = predictor;
    let errors = standard_errors(&at.rows, parameters.len(), loss, pool);
    let errors = errors.component_mul(&parameters.units);
    let blocks = parameters.blocks.iter();
    let of_kind = |all: &DVector<f64>, range: &Range<usize>| all.as_slice()[range.clone()].to_vec();
    Ok(Some(Fit {
        robot: parameters.robot(&at.values)?,
        standard_errors: blocks.clone().map(|(_, range)| of_kind(&errors, range)).collect(),
        parameters: blocks.map(|(kind, range)| (*kind, of_kind(&at.values, range))).collect(),
        residuals: residuals(measured, [(&fitted, &at.rows), (&held, &held_after)]),
        residuals_before,
        failed: at.rows.iter().chain(&held_after).filter(|row| !row.solved).count(),
        at_bounds: parameters.at_bounds(&at.values),
        iterations: at.iterations,
        converged: at.converged,
    }))
}

/// Residuals of all rows in their order, from those of disjoint parts.
fn residuals(measured: &Measured, parts: [(&Vec<usize>, &Vec<Row>); 2]) -> Vec<Vector3<f64>> {
    let mut out = vec![Vector3::zeros(); measured.points.len()];
    let points = measured.points.len() / measured.held_out.len();
    for (row, own) in parts.iter().flat_map(|(indices, rows)| indices.iter().zip(rows.iter())) {
        let points = out[row * points..].iter_mut().zip(own.residual.as_slice().chunks_exact(3));
        points.for_each(|(out, residual)| out.copy_from_slice(residual));
    }
    out
}

/// Median distance of predicted from measured points.
fn median(rows: &[Row]) -> f64 {
    let mut squares: Vec<f64> = rows.iter().flat_map(Row::squares).collect();
    squares.sort_unstable_by(f64::total_cmp);
    let middle = squares.len() / 2;
    let upper = squares[middle].sqrt();
    if squares.len() % 2 == 1 { upper } else { 0.5 * (squares[middle - 1].sqrt() + upper) }
}
