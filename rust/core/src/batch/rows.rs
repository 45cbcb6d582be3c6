//! Rows of displacements through any model, into one flat column per wanted field.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use rayon::ThreadPool;
use rayon::prelude::*;

use crate::error::InvalidInput;
use crate::model::{Model, Report, State};
use crate::robot::Robot;
use crate::status::Status;

/// Stop flag and progress of a long call, shared with the thread that waits for it.
#[derive(Debug, Default)]
pub struct Control {
    /// Set to end the call after the rows in work.
    pub stop: AtomicBool,
    /// Rows finished so far.
    pub done: AtomicUsize,
}

/// Which fields are computed. Status, residual and iterations always are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(clippy::struct_excessive_bools)] // A set of names, each wanted or not.
pub struct Fields {
    /// Frame of the tip disk.
    pub tip: bool,
    /// Frame of every disk.
    pub frames: bool,
    /// Centre of every disk.
    pub positions: bool,
    /// Rotation vector of every element.
    pub strains: bool,
    /// Holes of every tendon.
    pub tendon_points: bool,
    /// Length of every tendon.
    pub tendon_lengths: bool,
    /// Tension of every tendon.
    pub tensions: bool,
    /// Strain energy.
    pub energy: bool,
}

/// One field of all rows, row-major; empty when it was not wanted.
#[derive(Debug, Default)]
struct Column {
    width: usize,
    values: Vec<f64>,
}

impl Column {
    fn new(wanted: bool, rows: usize, width: usize) -> Result<Self, InvalidInput> {
        let width = if wanted { width } else { 0 };
        let mut values = Vec::new();
        let size = rows.saturating_mul(width);
        values.try_reserve_exact(size).map_err(|_| too_large(rows, width))?;
        values.resize(size, 0.0);
        Ok(Self { width, values })
    }

    /// Mutable pieces of `rows` rows each; empty pieces forever when the field is not wanted.
    fn pieces(&mut self, rows: usize) -> Pieces<'_> {
        Pieces { rest: &mut self.values, size: rows * self.width }
    }
}

fn too_large(rows: usize, width: usize) -> InvalidInput {
    let got = format!("{rows} rows of {width} numbers for one field");
    InvalidInput::new("displacements", "rows whose fields fit into memory", got)
}

struct Pieces<'a> {
    rest: &'a mut [f64],
    size: usize,
}

impl<'a> Pieces<'a> {
    fn next(&mut self) -> &'a mut [f64] {
        let size = self.size.min(self.rest.len());
        let (piece, rest) = std::mem::take(&mut self.rest).split_at_mut(size);
        self.rest = rest;
        piece
    }
}

/// The answer of a batch: row i of every column belongs to row i of the displacements.
#[derive(Debug, Default)]
pub struct Columns {
    /// (B, 4, 4).
    pub tip: Vec<f64>,
    /// (B, n + 1, 4, 4).
    pub frames: Vec<f64>,
    /// (B, n + 1, 3) \[m\].
    pub positions: Vec<f64>,
    /// (B, elements, 3 or 4) \[rad, and relative elongation\].
    pub strains: Vec<f64>,
    /// Per tendon (B, end + 1, 3) \[m\].
    pub tendon_points: Vec<Vec<f64>>,
    /// (B, K) \[m\].
    pub tendon_lengths: Vec<f64>,
    /// (B, K).
    pub tensions: Vec<f64>,
    /// (B,).
    pub energy: Vec<f64>,
    /// How each row ended.
    pub reports: Vec<Report>,
}

/// The part of every column that one job fills.
struct Job<'a> {
    first: usize,
    reports: &'a mut [Report],
    /// Columns in the order of [`write_row`].
    columns: Vec<&'a mut [f64]>,
}

/// Rows of one job: enough to pay for its bookkeeping, few enough to stop and to share well.
const ROWS_PER_JOB: usize = 32;

/// Solves every row of `displacements` (`rows` x K, row-major) on `pool`. Returns `None` when it was
/// stopped.
///
/// # Errors
/// `InvalidInput` naming the first row that is not usable (the numbers are checked before any row is
/// solved), or when the wanted fields do not fit into memory.
pub fn solve_rows<M: Model>(
    model: &M,
    displacements: &[f64],
    rows: usize,
    fields: Fields,
    pool: &ThreadPool,
    control: &Control,
) -> Result<Option<Columns>, InvalidInput> {
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
    let mut columns = allocate(model, fields, rows)?;
    let failed = {
        let mut pieces: Vec<Pieces<'_>> =
            columns.iter_mut().map(|column| column.pieces(ROWS_PER_JOB)).collect();
        let jobs: Vec<Job<'_>> = (reports.chunks_mut(ROWS_PER_JOB).enumerate())
            .map(|(index, reports)| Job {
                first: index * ROWS_PER_JOB,
                reports,
                columns: pieces.iter_mut().map(Pieces::next).collect(),
            })
            .collect();
        pool.install(|| {
            jobs.into_par_iter()
                .map_init(M::Workspace::default, |work, job| {
                    run(model, displacements, work, job, control)
                })
                .filter_map(Result::err)
                .min_by_key(|(row, _)| *row)
        })
    };
    if let Some((row, error)) = failed {
        return Err(in_row(error, row));
    }
    if control.stop.load(Ordering::Relaxed) {
        return Ok(None);
    }
    Ok(Some(collect(columns, reports)))
}

fn run<M: Model>(
    model: &M,
    displacements: &[f64],
    work: &mut M::Workspace,
    mut job: Job<'_>,
    control: &Control,
) -> Result<(), (usize, InvalidInput)> {
    let tendons = model.robot().tendons().len();
    let rows = job.reports.len();
    for (i, report) in job.reports.iter_mut().enumerate() {
        if control.stop.load(Ordering::Relaxed) {
            return Ok(());
        }
        let row = job.first + i;
        *report = model
            .solve(&displacements[row * tendons..(row + 1) * tendons], work)
            .map_err(|error| (row, error))?;
        for (kind, column) in job.columns.iter_mut().enumerate() {
            let width = column.len() / rows;
            if width > 0 {
                let place = &mut column[i * width..(i + 1) * width];
                write_row(kind, place, model.robot(), model.state(work));
            }
        }
        control.done.fetch_add(1, Ordering::Relaxed);
    }
    Ok(())
}

/// Columns in the order of [`write_row`]: seven fields, then the points of each tendon.
fn allocate<M: Model>(model: &M, wanted: Fields, rows: usize) -> Result<Vec<Column>, InvalidInput> {
    let robot = model.robot();
    let n = robot.backbone().subsegments();
    let tendons = robot.tendons().len();
    let widths = [
        (wanted.tip, 16),
        (wanted.frames, 16 * (n + 1)),
        (wanted.positions, 3 * (n + 1)),
        (wanted.strains, model.strain_width() * n),
        (wanted.tendon_lengths, tendons),
        (wanted.tensions, tendons),
        (wanted.energy, 1),
    ];
    let points = robot.paths().iter().map(|path| (wanted.tendon_points, 3 * (path.end() + 1)));
    widths
        .into_iter()
        .chain(points)
        .map(|(wanted, width)| Column::new(wanted, rows, width))
        .collect()
}

fn write_row(kind: usize, place: &mut [f64], robot: &Robot, state: &State) {
    match kind {
        0 => {
            if let Some(tip) = state.frames.last() {
                place.copy_from_slice(&tip.to_row_major());
            }
        }
        1 => {
            for (chunk, frame) in place.chunks_exact_mut(16).zip(&state.frames) {
                chunk.copy_from_slice(&frame.to_row_major());
            }
        }
        2 => write_points(place, state.frames.iter().map(|frame| frame.translation)),
        3 => state.write_strains(place),
        4 => place.copy_from_slice(&state.tendon_lengths),
        5 => place.copy_from_slice(&state.tensions),
        6 => place.fill(state.energy),
        _ => write_points(place, robot.paths()[kind - 7].points(&state.frames)),
    }
}

fn write_points(place: &mut [f64], points: impl Iterator<Item = nalgebra::Vector3<f64>>) {
    for (chunk, point) in place.chunks_exact_mut(3).zip(points) {
        chunk.copy_from_slice(point.as_slice());
    }
}

fn collect(columns: Vec<Column>, reports: Vec<Report>) -> Columns {
    let mut values = columns.into_iter().map(|column| column.values);
    let mut next = || values.next().unwrap_or_default();
    let (tip, frames, positions, strains) = (next(), next(), next(), next());
    let (tendon_lengths, tensions, energy) = (next(), next(), next());
    Columns {
        tip,
        frames,
        positions,
        strains,
        tendon_lengths,
        tensions,
        energy,
        tendon_points: values.collect(),
        reports,
    }
}

/// The same error, saying in which row.
fn in_row(error: InvalidInput, row: usize) -> InvalidInput {
    InvalidInput { got: format!("{} in row {row}", error.got), ..error }
}
