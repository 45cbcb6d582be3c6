//! The rod as a forward model: load steps around Newton's method, and its results.

use nalgebra::Vector3;

use super::chain::{Chain, Left};
use super::plan::Plan;
use crate::error::InvalidInput;
use crate::model::{Model, Report, State};
use crate::robot::Robot;
use crate::status::Status;

/// Buffers of a solve.
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    state: State,
    chain: Chain,
    /// Strains and tensions at the last load that was reached.
    reached: (Vec<f64>, Vec<f64>),
    bounds: Vec<f64>,
    left: Left,
    /// Share of the displacements that was reached.
    load: f64,
}

/// The rod model of a robot, ready to solve.
#[derive(Clone, Debug)]
pub struct Rod<'r> {
    robot: &'r Robot,
    plan: &'r Plan,
}

/// No strain moves further in one Newton step \[rad\].
const STEP: f64 = 0.5;
/// Newton steps per load step.
const PATIENCE: usize = 20;
/// Load steps are not made shorter.
const SHORTEST: f64 = 1e-4;

impl<'r> Rod<'r> {
    /// Solves with a plan that was made of this robot.
    #[must_use]
    pub fn new(robot: &'r Robot, plan: &'r Plan) -> Self {
        Self { robot, plan }
    }

    /// The shape under given tensions, in the unit of the results: displacements are then what it has. A
    /// minimum that rest leads to as the tensions grow together; infeasible beyond where it ends.
    ///
    /// # Errors
    /// `InvalidInput` for another number of tensions, or one that is negative or not finite.
    pub fn solve_tensions(
        &self,
        tensions: &[f64],
        work: &mut Workspace,
    ) -> Result<Report, InvalidInput> {
        if tensions.len() != self.plan.rest_lengths.len() {
            let expected = format!("{} values, one per tendon", self.plan.rest_lengths.len());
            return Err(InvalidInput::new("tensions", expected, tensions.len()));
        }
        if let Some(bad) = tensions.iter().find(|t| !(t.is_finite() && **t >= 0.0)) {
            let expected = "finite tensions of 0 or more";
            return Err(InvalidInput::new("tensions", expected, format!("{bad:?}")));
        }
        let mut budget = self.plan.settings.max_iterations;
        work.chain.rest(self.plan);
        // All free: the lengths are what the tensions make them.
        work.bounds.clear();
        work.bounds.resize(tensions.len(), f64::INFINITY);
        work.reached.0.clone_from(&work.chain.strains);
        let (mut load, mut stride) = (0.0, 1.0_f64);
        let mut status = Status::Converged;
        while load < 1.0 {
            let next = (load + stride).min(1.0);
            for (own, wanted) in work.chain.tensions.iter_mut().zip(tensions) {
                *own = next * wanted / self.plan.unit;
            }
            if self.newton(work, &mut budget) {
                load = next;
                stride *= 2.0;
                work.reached.0.clone_from(&work.chain.strains);
            } else {
                work.chain.strains.clone_from(&work.reached.0);
                stride = 0.5 * (next - load);
                if budget == 0 || stride < SHORTEST {
                    status = if budget == 0 { Status::IterationLimit } else { Status::Infeasible };
                    work.left = work.chain.assemble(self.plan, &work.bounds);
                    break;
                }
            }
        }
        work.load = load;
        self.report(work);
        let iterations = self.plan.settings.max_iterations - budget;
        Ok(Report { status, residual: work.left.worst(), iterations })
    }

    /// Solves for displacements from the strains and tensions of an earlier shape of this robot with as many
    /// elements; a start that does not help is dropped.
    ///
    /// # Errors
    /// `InvalidInput` for a start with another number of strains or tensions.
    pub fn solve_from(
        &self,
        start: &State,
        displacements: &[f64],
        work: &mut Workspace,
    ) -> Result<Report, InvalidInput> {
        let elements = self.plan.data.len() * self.plan.settings.elements;
        if start.strains.len() != elements {
            let expected = format!("{elements} strains, one per element");
            return Err(InvalidInput::new("start", expected, start.strains.len()));
        }
        work.chain.rest(self.plan);
        for (own, strain) in work.chain.strains.chunks_exact_mut(3).zip(&start.strains) {
            own.copy_from_slice(strain.as_slice());
        }
        for (own, tension) in work.chain.tensions.iter_mut().zip(&start.tensions) {
            *own = if tension.is_finite() { tension / self.plan.unit } else { 0.0 };
        }
        self.resume(displacements, work)
    }

    /// Newton's method from the point at hand; whether it converged to a minimum.
    fn newton(&self, work: &mut Workspace, budget: &mut usize) -> bool {
        let mut before = f64::INFINITY;
        for round in 0..PATIENCE {
            work.left = work.chain.assemble(self.plan, &work.bounds);
            let worst = work.left.worst();
            if worst <= self.plan.settings.tolerance {
                return work.left.stable;
            }
            if *budget == 0 || !worst.is_finite() || (round > 8 && worst > 0.5 * before) {
                return false;
            }
            before = worst;
            *budget -= 1;
            if !work.chain.solve(self.plan, &work.bounds) {
                return false;
            }
            let longest = work.chain.longest();
            work.chain.take(if longest > STEP { STEP / longest } else { 1.0 });
        }
        false
    }

    /// Goes from rest to the whole displacements, in one go if that works.
    fn climb(&self, displacements: &[f64], work: &mut Workspace) -> (Status, usize) {
        let mut budget = self.plan.settings.max_iterations;
        work.chain.rest(self.plan);
        work.load = 0.0;
        let mut stride = 1.0_f64;
        work.reached.0.clone_from(&work.chain.strains);
        work.reached.1.clone_from(&work.chain.tensions);
        while work.load < 1.0 {
            let load = (work.load + stride).min(1.0);
            work.bounds.clear();
            let rest = self.plan.rest_lengths.iter();
            work.bounds.extend(rest.zip(displacements).map(|(length, d)| length + load * d));
            if self.newton(work, &mut budget) {
                work.load = load;
                stride = (2.0 * stride).min(1.0);
                work.reached.0.clone_from(&work.chain.strains);
                work.reached.1.clone_from(&work.chain.tensions);
            } else {
                work.chain.strains.clone_from(&work.reached.0);
                work.chain.tensions.clone_from(&work.reached.1);
                stride = 0.5 * (load - work.load);
                if budget == 0 {
                    return (Status::IterationLimit, self.plan.settings.max_iterations);
                }
                if stride < SHORTEST {
                    work.left = work.chain.assemble(self.plan, &work.bounds);
                    return (Status::Infeasible, self.plan.settings.max_iterations - budget);
                }
            }
        }
        (Status::Converged, self.plan.settings.max_iterations - budget)
    }

    /// Disk frames and everything else that is reported.
    fn report(&self, work: &mut Workspace) {
        let Workspace { state, chain, .. } = work;
        let plan = self.plan;
        state.clear();
        let mut frame = *self.robot.base();
        state.frames.push(frame);
        for (data, strains) in plan.data.iter().zip(chain.strains.chunks_exact(plan.width())) {
            chain.local.place(plan.settings.subsegment, data, strains);
            frame = frame.compose(chain.local.end());
            state.frames.push(frame);
            for strain in strains.chunks_exact(3) {
                let strain = Vector3::from_column_slice(strain);
                state.strains.push(strain);
                let off = strain - data.rest;
                state.energy += 0.5 * off.component_mul(&off).dot(&data.stiffness) * plan.unit;
            }
        }
        state.tendon_lengths.extend_from_slice(&chain.lengths);
        state.tensions.extend(chain.tensions.iter().map(|t| t * plan.unit));
    }
}

impl Model for Rod<'_> {
    type Workspace = Workspace;

    fn robot(&self) -> &Robot {
        self.robot
    }

    fn elements(&self) -> usize {
        self.plan.settings.elements
    }

    fn solve(&self, displacements: &[f64], work: &mut Workspace) -> Result<Report, InvalidInput> {
        let (status, iterations) = self.climb(displacements, work);
        self.report(work);
        Ok(Report { status, residual: work.left.worst(), iterations })
    }

    fn resume(&self, displacements: &[f64], work: &mut Workspace) -> Result<Report, InvalidInput> {
        let mut budget = self.plan.settings.max_iterations;
        work.bounds.clear();
        let rest = self.plan.rest_lengths.iter();
        work.bounds.extend(rest.zip(displacements).map(|(length, d)| length + d));
        if work.chain.tensions.len() != displacements.len() || !self.newton(work, &mut budget) {
            return self.solve(displacements, work);
        }
        work.load = 1.0;
        self.report(work);
        let iterations = self.plan.settings.max_iterations - budget;
        Ok(Report { status: Status::Converged, residual: work.left.worst(), iterations })
    }

    fn state<'w>(&self, work: &'w Workspace) -> &'w State {
        &work.state
    }

    fn take_state(&self, work: Workspace) -> State {
        work.state
    }

    fn message(&self, _: &[f64], work: &Workspace) -> String {
        if work.load >= 1.0 {
            return String::new();
        }
        let off = work.chain.lengths.iter().zip(&work.bounds).map(|(length, bound)| length - bound);
        let worst = off.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(k, _)| k);
        let name = &self.robot.tendon_names()[worst];
        format!(
            "followed to {:.1} % of the displacements; then '{name}' finds no shape",
            1e2 * work.load
        )
    }
}
