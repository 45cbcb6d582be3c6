//! Result of a search by swarm.

use super::super::newton_inverse::Inverse;

/// Turns found by a swarm, and counters of the search.
///
/// ```
/// use nalgebra::Vector2;
/// use tdcr::planar::{Goal, SwarmSettings, SwarmSolver, Trunk, WatchDecision};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let trunk = Trunk::new(vec![0.14, 0.12], 0.06)?;
/// let mut solver = SwarmSolver::new(&trunk, &[], &SwarmSettings::default())?;
/// let goal = Goal { point: Vector2::new(0.2, 0.06), heading: None, limits: vec![3.0] };
/// if let Some(found) = solver.solve(&goal, 0, &mut |_| WatchDecision::GoOn)? {
///     assert!(found.clearance == f64::INFINITY && found.swarms == 1);
///     assert_eq!(found.history.len(), found.moves + 1);
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SwarmInverse {
    /// The turns, how well they do, and the Newton steps and starts of the polish. `Infeasible`: the
    /// tip is on the target, but no way there was found that stays out of the circles.
    pub inverse: Inverse,
    /// Smallest distance of the trunk from the circles \[m\], negative inside; infinite without any.
    pub clearance: f64,
    /// The lowest value the swarms saw, as in `history`.
    pub value: f64,
    /// The lowest value so far after every move, the starts included: the miss \[m\]; with circles and
    /// polish, the bending energy \[1/m\] of what was brought onto the target, and more for what misses it
    /// or enters a circle.
    pub history: Vec<f64>,
    /// Moves of all swarms.
    pub moves: usize,
    /// Evaluations of all swarms.
    pub evaluations: usize,
    /// Swarms, the restarts included.
    pub swarms: usize,
    /// Seed of the first.
    pub seed: u64,
}
