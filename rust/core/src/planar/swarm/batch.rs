//! Batches of goals, on all cores.

use std::sync::atomic::Ordering;

use rayon::ThreadPool;
use rayon::prelude::*;

use super::super::newton_inverse::Goal;
use super::{SwarmInverse, SwarmSolver, WatchDecision};
use crate::batch::Control;
use crate::error::InvalidInput;

/// A goal and the seed of its first swarm.
///
/// ```
/// use nalgebra::Vector2;
/// use tdcr::batch::{Control, pool};
/// use tdcr::planar::{Goal, Row, SwarmSettings, SwarmSolver, Trunk, solve_rows};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let trunk = Trunk::new(vec![0.14, 0.12], 0.06)?;
/// let solver = SwarmSolver::new(&trunk, &[], &SwarmSettings::default())?;
/// let goal = Goal { point: Vector2::new(0.2, 0.06), heading: None, limits: vec![3.0] };
/// let rows = [0, 1].map(|seed| Row { goal: goal.clone(), seed });
/// let threads = pool(Some(1))?;
/// let found = solve_rows(&solver, &rows, &threads, &Control::default())?;
/// assert_eq!(found.map(|found| found.len()), Some(2));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Goal of the tip.
    pub goal: Goal,
    /// Seed.
    pub seed: u64,
}

/// Answers in the order of the rows; none when the call was stopped.
///
/// ```
/// use tdcr::planar::Rows;
///
/// let stopped: Rows = None;
/// assert!(stopped.is_none());
/// ```
pub type Rows = Option<Vec<SwarmInverse>>;

/// Rows of one job: enough to pay for its swarm's memory, few enough to stop and to share well.
const ROWS_PER_JOB: usize = 16;

/// Solves every row, each as alone and so the same on any number of threads, without histories.
///
/// # Errors
/// `InvalidInput` for the first row whose goal is out of range.
pub fn solve_rows(
    solver: &SwarmSolver<'_>,
    rows: &[Row],
    pool: &ThreadPool,
    control: &Control,
) -> Result<Rows, InvalidInput> {
    let stopped = || control.stop.load(Ordering::Relaxed);
    let job = |rows: &[Row]| {
        // The remaining jobs cost nothing, not even a swarm's memory.
        if stopped() {
            return Ok(Vec::new());
        }
        let mut solver = solver.clone();
        let mut answers = Vec::with_capacity(rows.len());
        for row in rows {
            let mut watch =
                |_: &_| if stopped() { WatchDecision::Abandon } else { WatchDecision::GoOn };
            let Some(mut answer) = solver.solve(&row.goal, row.seed, &mut watch)? else { break };
            answer.history = Vec::new();
            answers.push(answer);
            control.done.fetch_add(1, Ordering::Relaxed);
        }
        Ok(answers)
    };
    let parts: Result<Vec<_>, _> =
        pool.install(|| rows.par_chunks(ROWS_PER_JOB).map(job).collect());
    let answers = parts?.into_iter().flatten().collect();
    Ok(if stopped() { None } else { Some(answers) })
}
