//! Rows of displacements through any model, into one flat column per requested field.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use nalgebra::Vector3;
use rayon::ThreadPool;
use rayon::prelude::*;

use super::field::{Field, Key};
use crate::error::InvalidInput;
use crate::model::{Contact, Shape};
use crate::model::{Model, Report, State};
use crate::robot::Robot;
use crate::status::Status;

/// Stop flag and progress of a long call, shared with the thread that waits for it.
///
/// ```
/// use std::sync::atomic::Ordering;
/// use tdcr::batch::Control;
///
/// // Another thread sets the flag; a batch then returns no rows.
/// let control = Control::default();
/// control.stop.store(true, Ordering::Relaxed);
/// assert_eq!(control.done.load(Ordering::Relaxed), 0);
/// ```
#[derive(Debug, Default)]
pub struct Control {
    /// Set to end the call after the current rows, or in their midst where the model reads it too.
    pub stop: Arc<AtomicBool>,
    /// Rows finished so far.
    pub done: AtomicUsize,
}

/// One field of all rows.
///
/// ```
/// use tdcr::batch::{Control, Field, Key, pool, solve_rows};
/// use tdcr::constant_curvature::{ConstantCurvature, ConstantCurvatureSettings, Plan};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, ConstantCurvatureSettings::default())?;
/// let model = ConstantCurvature::new(&robot, &plan);
/// let (threads, control) = (pool(Some(1))?, Control::default());
/// let solved = solve_rows(&model, &[0.0; 6], 2, &[Field::Positions], &threads, &control)?;
/// let column = &solved.unwrap_or_default().columns[0];
/// assert_eq!((column.key, &column.shape[..]), (Key::Positions, &[11, 3][..]));
/// assert_eq!(column.values.len(), 2 * 11 * 3);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Column {
    /// Which field.
    pub key: Key,
    /// Shape of one row.
    pub shape: Vec<usize>,
    /// Rows one after the other, each in C order.
    pub values: Vec<f64>,
}

impl Column {
    fn new<M: Model>(model: &M, key: Key, rows: usize) -> Result<Self, InvalidInput> {
        let shape = key.shape(model);
        let width: usize = shape.iter().product();
        let size = rows.saturating_mul(width);
        // Asked for in earnest only when it can be had; then as zero pages, which the threads that
        // fill them touch first.
        Vec::<f64>::new().try_reserve_exact(size).map_err(|_| too_large(rows, width))?;
        Ok(Self { key, shape, values: vec![0.0; size] })
    }
}

fn too_large(rows: usize, width: usize) -> InvalidInput {
    let got = format!("{rows} rows of {width} numbers for one field");
    InvalidInput::new("displacements", "rows whose fields fit into memory", got)
}

/// The answer of a batch: row i of every column belongs to row i of the displacements.
///
/// ```
/// use tdcr::batch::{Control, Field, Key, pool, solve_rows};
/// use tdcr::constant_curvature::{ConstantCurvature, ConstantCurvatureSettings, Plan};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, ConstantCurvatureSettings::default())?;
/// let model = ConstantCurvature::new(&robot, &plan);
/// let rows = [0.0, 0.0, 0.0, -0.004, 0.002, 0.002];
/// let (threads, control) = (pool(Some(1))?, Control::default());
/// let solved = solve_rows(&model, &rows, 2, &[Field::Tip], &threads, &control)?.unwrap_or_default();
/// assert_eq!(solved.reports.len(), 2);
/// assert_eq!(solved.values(Key::Tip).map(<[f64]>::len), Some(2 * 16));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Default)]
pub struct Solved {
    /// Columns of the requested fields; the points of tendons are a column each.
    pub columns: Vec<Column>,
    /// Outcome of every row.
    pub reports: Vec<Report>,
    /// Contacts of the rows, each with its row, in order; empty if they were not wanted.
    pub contacts: Vec<(usize, Contact)>,
}

impl Solved {
    /// Values of a field, if it was requested.
    #[must_use]
    pub fn values(&self, key: Key) -> Option<&[f64]> {
        self.columns.iter().find(|column| column.key == key).map(|column| &column.values[..])
    }
}

/// The part of every column that one job fills.
struct Job<'a> {
    first: usize,
    reports: &'a mut [Report],
    columns: Vec<(Key, &'a mut [f64])>,
}

/// Rows of one job: enough to pay for its bookkeeping, few enough to stop and to share well.
const ROWS_PER_JOB: usize = 32;
/// Rows of one chain: enough to make its cold start cheap. Fixed, so that answers are the same on any
/// number of threads.
const ROWS_PER_CHAIN: usize = 64;

/// Start of the solves of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Start {
    /// Each from rest.
    Cold,
    /// Each from the answer of the row before, in chains of fixed length.
    Warm,
}

impl Start {
    const fn rows_per_job(self) -> usize {
        match self {
            Self::Cold => ROWS_PER_JOB,
            Self::Warm => ROWS_PER_CHAIN,
        }
    }
}

/// Solves every row of `displacements` (`rows` x K, row-major) on `pool`. Returns `None` when it was
/// stopped.
///
/// # Errors
/// `InvalidInput` naming the first row that is not usable (the numbers are checked before any row is
/// solved), or when the requested fields do not fit into memory.
pub fn solve_rows<M: Model>(
    model: &M,
    displacements: &[f64],
    rows: usize,
    fields: &[Field],
    pool: &ThreadPool,
    control: &Control,
) -> Result<Option<Solved>, InvalidInput> {
    solve_all(model, displacements, rows, fields, pool, control, Start::Cold)
}

/// Batch whose rows start from the answer of the row before ([`Model::resume`]) where that
/// converged. The first of every 64 rows starts from rest, which makes the answers independent of the number
/// of threads.
///
/// # Errors
/// As [`solve_rows`].
pub fn chain_rows<M: Model>(
    model: &M,
    displacements: &[f64],
    rows: usize,
    fields: &[Field],
    pool: &ThreadPool,
    control: &Control,
) -> Result<Option<Solved>, InvalidInput> {
    solve_all(model, displacements, rows, fields, pool, control, Start::Warm)
}

/// One row of [`chain_rows`], the same to the bit, with all that belongs to it: its chain is solved up
/// to there.
///
/// # Errors
/// As [`solve_rows`], for the rows of the chain.
pub fn chained_shape<M: Model>(
    model: &M,
    displacements: &[f64],
    row: usize,
) -> Result<Shape, InvalidInput> {
    let tendons = model.robot().tendons().len();
    let mut work = M::Scratch::default();
    let first = row - row % ROWS_PER_CHAIN;
    let mut report = solve_row(model, displacements, first, None, &mut work)?;
    for next in first + 1..=row {
        report = solve_row(model, displacements, next, Some(report.status), &mut work)?;
    }
    Ok(model.result(&displacements[row * tendons..(row + 1) * tendons], report, work))
}

fn solve_all<M: Model>(
    model: &M,
    displacements: &[f64],
    rows: usize,
    fields: &[Field],
    pool: &ThreadPool,
    control: &Control,
    start: Start,
) -> Result<Option<Solved>, InvalidInput> {
    let robot = model.robot();
    let tendons = robot.tendons().len();
    let mut reports = Vec::new();
    reports.try_reserve_exact(rows).map_err(|_| too_large(rows, 1))?;
    for row in 0..rows {
        robot
            .check_displacements(&displacements[row * tendons..(row + 1) * tendons])
            .map_err(|error| in_row(error, row))?;
    }
    let blank = Report { status: Status::NumericalError, residual: f64::NAN, iterations: 0 };
    reports.resize(rows, blank);
    let touching = fields.contains(&Field::Contacts);
    let keys = Key::of(fields, robot);
    let columns = keys.into_iter().map(|key| Column::new(model, key, rows));
    let mut columns = columns.collect::<Result<Vec<_>, _>>()?;
    let jobs = jobs(&mut columns, &mut reports, start);
    let done: Vec<_> = pool.install(|| {
        jobs.into_par_iter()
            .map_init(M::Scratch::default, |work, job| {
                run(model, displacements, work, job, control, start, touching)
            })
            .collect()
    });
    // Jobs are in order: the first that failed has the first row that did.
    let contacts = done.into_iter().collect::<Result<Vec<_>, _>>()?.concat();
    let stopped = control.stop.load(Ordering::Relaxed);
    Ok((!stopped).then_some(Solved { columns, reports, contacts }))
}

fn jobs<'a>(columns: &'a mut [Column], reports: &'a mut [Report], start: Start) -> Vec<Job<'a>> {
    let (rows, per_job) = (reports.len(), start.rows_per_job());
    let mut rest: Vec<(Key, usize, &mut [f64])> = columns
        .iter_mut()
        .map(|column| {
            let width = column.values.len().checked_div(rows).unwrap_or(0);
            (column.key, per_job * width, &mut column.values[..])
        })
        .collect();
    (reports.chunks_mut(per_job).enumerate())
        .map(|(index, reports)| {
            let columns = rest.iter_mut().map(|(key, size, values)| {
                let size = (*size).min(values.len());
                let (piece, behind) = std::mem::take(values).split_at_mut(size);
                *values = behind;
                (*key, piece)
            });
            Job { first: index * per_job, columns: columns.collect(), reports }
        })
        .collect()
}

fn run<M: Model>(
    model: &M,
    displacements: &[f64],
    work: &mut M::Scratch,
    mut job: Job<'_>,
    control: &Control,
    start: Start,
    touching: bool,
) -> Result<Vec<(usize, Contact)>, InvalidInput> {
    let mut contacts = Vec::new();
    let rows = job.reports.len();
    let mut before = None;
    for (i, report) in job.reports.iter_mut().enumerate() {
        if control.stop.load(Ordering::Relaxed) {
            break;
        }
        let row = job.first + i;
        *report = solve_row(model, displacements, row, before, work)?;
        before = (start == Start::Warm).then_some(report.status);
        for (key, column) in &mut job.columns {
            let width = column.len() / rows;
            let place = &mut column[i * width..(i + 1) * width];
            write_row(*key, place, model.robot(), model.state(work));
        }
        if touching {
            contacts.extend(model.state(work).contacts.iter().map(|contact| (row, *contact)));
        }
        control.done.fetch_add(1, Ordering::Relaxed);
    }
    Ok(contacts)
}

/// Solves a row; from the answer of the row before if that is in `work` and of use. `before` is how that
/// row ended, none at the start of a chain.
fn solve_row<M: Model>(
    model: &M,
    displacements: &[f64],
    row: usize,
    before: Option<Status>,
    work: &mut M::Scratch,
) -> Result<Report, InvalidInput> {
    let tendons = model.robot().tendons().len();
    let own = &displacements[row * tendons..(row + 1) * tendons];
    let solved = match before {
        Some(Status::Converged) => model.resume(own, work),
        _ => model.solve(own, work),
    };
    solved.map_err(|error| in_row(error, row))
}

fn write_row(key: Key, place: &mut [f64], robot: &Robot, state: &State) {
    match key {
        Key::Tip => {
            if let Some(tip) = state.frames.last() {
                place.copy_from_slice(&tip.to_row_major());
            }
        }
        Key::Frames => {
            for (chunk, frame) in place.chunks_exact_mut(16).zip(&state.frames) {
                chunk.copy_from_slice(&frame.to_row_major());
            }
        }
        Key::Positions => write_points(place, state.frames.iter().map(|frame| frame.translation)),
        Key::Strains => state.write_strains(place),
        Key::TendonPoints(k) => write_points(place, robot.paths()[k].points(&state.frames)),
        Key::TendonLengths => place.copy_from_slice(&state.tendon_lengths),
        Key::Tensions => place.copy_from_slice(&state.tensions),
        Key::Energy => place.fill(state.energy),
    }
}

fn write_points(place: &mut [f64], points: impl Iterator<Item = Vector3<f64>>) {
    for (chunk, point) in place.chunks_exact_mut(3).zip(points) {
        chunk.copy_from_slice(point.as_slice());
    }
}

/// Error with its row.
pub(crate) fn in_row(error: InvalidInput, row: usize) -> InvalidInput {
    InvalidInput { got: format!("{} in row {row}", error.got), ..error }
}
