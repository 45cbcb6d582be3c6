//! Decisions of the watcher of a search.

/// Decision of the watcher of a search.
///
/// ```
/// use nalgebra::Vector2;
/// use tdcr::planar::{Goal, SwarmSettings, SwarmSolver, Trunk, WatchDecision};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let trunk = Trunk::new(vec![0.14, 0.12], 0.06)?;
/// let mut solver = SwarmSolver::new(&trunk, &[], &SwarmSettings::default())?;
/// let goal = Goal { point: Vector2::new(0.2, 0.06), heading: None, limits: vec![3.0] };
/// // An abandoned search has no answer.
/// assert!(solver.solve(&goal, 0, &mut |_| WatchDecision::Abandon)?.is_none());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WatchDecision {
    /// To go on.
    GoOn,
    /// The best that there is by now.
    Finish,
    /// Nothing any more.
    Abandon,
}
