//! A search: swarms until Newton's method can take over.

use super::super::clearance::Circle;
use super::super::newton_inverse::{Goal, InverseSettings, Solver};
use super::super::trunk::Trunk;
use super::objective::{Handover, SwarmObjective};
use super::result::SwarmInverse;
use super::watch::WatchDecision;
use super::{SwarmSettings, Unknowns};
use crate::error::InvalidInput;
use crate::solve::pso::{Progress, PsoSettings, Swarm};

/// The inverse of a trunk among circles by swarm, with its memory for any number of goals.
///
/// ```
/// use nalgebra::Vector2;
/// use tdcr::planar::{Circle, Goal, SwarmSettings, SwarmSolver, Trunk, WatchDecision};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let trunk = Trunk::new(vec![0.14, 0.12], 0.03)?;
/// let circles = [Circle::new(0.12, 0.08, 0.02)?];
/// let mut solver = SwarmSolver::new(&trunk, &circles, &SwarmSettings::default())?;
/// let goal = Goal { point: Vector2::new(0.2, 0.06), heading: None, limits: vec![3.0] };
/// let found = solver.solve(&goal, 0, &mut |_| WatchDecision::GoOn)?;
/// assert!(found.is_some_and(|found| found.inverse.error < 1e-12 && found.clearance >= 0.0));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct SwarmSolver<'a> {
    trunk: &'a Trunk,
    circles: &'a [Circle],
    settings: SwarmSettings,
    newton: InverseSettings,
    swarm: Swarm,
    /// The circles in units of the trunk's length.
    scaled: Vec<Circle>,
}

impl<'a> SwarmSolver<'a> {
    /// For a trunk, the circles that it stays out of, and settings.
    ///
    /// # Errors
    /// `InvalidInput` for settings out of range; circles or a single section with unknown points.
    pub fn new(
        trunk: &'a Trunk,
        circles: &'a [Circle],
        settings: &SwarmSettings,
    ) -> Result<Self, InvalidInput> {
        settings.validate()?;
        if settings.unknowns == Unknowns::Points {
            let bends = "objective \"bends\"";
            if !circles.is_empty() {
                return Err(InvalidInput::new("obstacles", bends, "\"points\""));
            }
            if trunk.lengths().len() == 1 {
                let expected = "\"bends\" for one section, which has no platform to look for";
                return Err(InvalidInput::new("objective", expected, "\"points\""));
            }
        }
        let total_length: f64 = trunk.lengths().iter().sum();
        let scale = |c: &Circle| Circle {
            center: c.center / total_length,
            radius: c.radius / total_length,
        };
        Ok(Self {
            trunk,
            circles,
            settings: *settings,
            newton: settings.newton(),
            swarm: Swarm::new(settings.swarm, &[0.0], &[0.0])?,
            scaled: circles.iter().map(scale).collect(),
        })
    }

    /// Looks for turns with the tip on the goal, from a seed. The watcher sees every move; an
    /// abandoned search has no answer.
    ///
    /// # Errors
    /// `InvalidInput` for a goal out of range.
    pub fn solve(
        &mut self,
        goal: &Goal,
        seed: u64,
        watch: &mut dyn FnMut(&Progress) -> WatchDecision,
    ) -> Result<Option<SwarmInverse>, InvalidInput> {
        let solver = Solver::new(self.trunk, goal, &self.newton)?;
        let SwarmSettings { swarm, unknowns, polish, tolerance, restarts, .. } = self.settings;
        let handover = match (polish, self.circles.is_empty()) {
            (false, _) => Handover::None,
            (true, true) => Handover::Polish,
            (true, false) => Handover::Constrain,
        };
        let target = swarm.target.or((handover == Handover::None).then_some(tolerance));
        let half = half_box(&solver, unknowns);
        let lower: Vec<f64> = half.iter().map(|h| -h).collect();
        self.swarm.reset(PsoSettings { target, ..swarm }, &lower, &half)?;
        if handover == Handover::Constrain {
            let most = swarm.particles / 2;
            self.swarm.start_from(&exact_starts(&solver, most))?;
        }
        // Beyond the trunk's length there is nothing to find but the nearest point.
        let far =
            solver.problem.target.norm() * solver.total_length > solver.total_length + tolerance;
        let mut objective = SwarmObjective::new(solver, unknowns, handover, &self.scaled, watch);
        for restart in 0..=if far { 0 } else { restarts as u64 } {
            self.swarm.reseed(seed.wrapping_add(restart));
            objective.begin();
            let Ok(report) = self.swarm.run(&mut objective) else { return Ok(None) };
            if objective.end(&report, self.swarm.history()) {
                break;
            }
        }
        if objective.last_resort().is_err() {
            return Ok(None);
        }
        let enough = target.unwrap_or(tolerance).max(tolerance);
        Ok(Some(objective.into_result(seed, enough, self.trunk, self.circles)))
    }
}

/// Ways to the target that know no circles: exact solutions of the sections in two groups. Each lies in
/// another valley of the energy, and half of the swarm at most starts there.
fn exact_starts(solver: &Solver<'_>, most: usize) -> Vec<f64> {
    let mut starts = solver.exact_starts();
    starts.truncate(most);
    for turns in &mut starts {
        solver.problem.clamp(turns);
    }
    starts.concat()
}

/// The box of the unknowns, to either side of zero: the limits, or what the sections up to a platform
/// reach.
fn half_box(solver: &Solver<'_>, unknowns: Unknowns) -> Vec<f64> {
    if unknowns == Unknowns::Bends {
        return solver.problem.limits.clone();
    }
    let mut reach = 0.0;
    let lengths = &solver.problem.lengths;
    let platforms = lengths[..lengths.len() - 1].iter().flat_map(|length| {
        reach += length;
        [reach; 2]
    });
    platforms.collect()
}
