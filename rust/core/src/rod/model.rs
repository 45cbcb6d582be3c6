//! The rod as a forward model: from displacements or tensions to results.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use nalgebra::Vector3;

use super::degenerate_rest;
use super::dual_newton::{DualNewton, EASY, Ending};
use super::message::message;
use super::newton_system::{Chain, JUMP, Left};
use super::plan::Plan;
use super::tendon_law::Equations;
use crate::error::InvalidInput;
use crate::lie::Pose;
use crate::model::{Model, Report, State};
use crate::robot::Robot;
use crate::status::Status;

/// Buffers of a solve.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    pub(super) state: State,
    pub(super) chain: Chain,
    /// One subsegment, where displacements are proportional.
    pub(super) part: Chain,
    /// Tension of every piece, and the tendons that drive.
    pub(super) pulls: Vec<f64>,
    pub(super) drives: Vec<bool>,
    pub(super) ascent: DualNewton,
    pub(super) left: Left,
    pub(super) ending: Ending,
    /// Strains at the last load that was reached, where tensions are given.
    reached: Vec<f64>,
}

/// The rod model of a robot, ready to solve.
#[derive(Clone, Debug)]
pub struct Rod<'r> {
    pub(super) robot: &'r Robot,
    pub(super) plan: &'r Plan,
    pub(super) stop: Option<Arc<AtomicBool>>,
}

/// Newton steps per load step, where tensions are given.
const PATIENCE: usize = 20;
/// Load steps are not made shorter.
const SHORTEST: f64 = 1e-4;

impl<'r> Rod<'r> {
    /// Solves with a plan that was made of this robot.
    #[must_use]
    pub fn new(robot: &'r Robot, plan: &'r Plan) -> Self {
        Self { robot, plan, stop: None }
    }

    /// The same, whose solves end soon after the flag is set, with the status of an iteration limit. It is
    /// looked at once per subsegment.
    #[must_use]
    pub fn stopped_by(self, stop: Arc<AtomicBool>) -> Self {
        Self { stop: Some(stop), ..self }
    }

    /// Hands the flag to the solve that begins.
    fn listen(&self, work: &mut Scratch) {
        work.chain.stop.clone_from(&self.stop);
        work.part.stop.clone_from(&self.stop);
    }

    /// Length of every tendon at rest through this model's elements, which displacements count from \[m\].
    #[must_use]
    pub fn rest_lengths(&self) -> &[f64] {
        &self.plan.rest_lengths
    }

    /// Displacements under which a shape has the lengths and tensions that it has: what its tendons are
    /// longer than at rest, without what tension stretches them \[m\].
    #[must_use]
    pub fn displacements(&self, state: &State) -> Vec<f64> {
        let plan = self.plan;
        let rows = state.tendon_lengths.iter().zip(&state.tensions);
        let plans = plan.rest_lengths.iter().zip(&plan.compliance);
        let change = |((own, tension), (rest, give)): ((&f64, &f64), (&f64, &f64))| {
            own - give * tension / plan.unit - rest
        };
        rows.zip(plans).map(change).collect()
    }

    /// The shape under given tensions, in the unit of the results: displacements are then what it has. A
    /// minimum that rest leads to as the tensions grow together; infeasible beyond where it ends.
    ///
    /// # Errors
    /// `InvalidInput` for another number of tensions, or one that is negative or not finite.
    pub fn solve_tensions(
        &self,
        tensions: &[f64],
        work: &mut Scratch,
    ) -> Result<Report, InvalidInput> {
        let expected = "sliding tendons where tensions are given";
        self.plan.settings.tendons.require_tensions("tendons", expected)?;
        self.plan.check_tensions(tensions)?;
        let mut budget = self.plan.settings.max_iterations;
        self.listen(work);
        let chain = &mut work.chain;
        chain.rest(self.plan);
        chain.unbound(self.plan);
        chain.taut.clear();
        chain.taut.extend(tensions.iter().map(|tension| *tension > 0.0));
        work.reached.clone_from(&chain.strains);
        let (mut load, mut stride) = (0.0, 1.0_f64);
        work.ending = Ending::Converged;
        while load < 1.0 {
            let next = (load + stride).min(1.0);
            for (own, wanted) in work.chain.tensions.iter_mut().zip(tensions) {
                *own = next * wanted / self.plan.unit;
            }
            if self.settle(work, &mut budget) {
                load = next;
                stride *= 2.0;
                work.reached.clone_from(&work.chain.strains);
            } else {
                work.chain.strains.clone_from(&work.reached);
                stride = 0.5 * (next - load);
                if budget == 0 || stride < SHORTEST {
                    for (own, wanted) in work.chain.tensions.iter_mut().zip(tensions) {
                        *own = load * wanted / self.plan.unit;
                    }
                    work.ending = if budget == 0 { Ending::Spent } else { Ending::Lost };
                    work.left = work.chain.assemble(self.plan, EASY);
                    break;
                }
            }
        }
        Ok(self.report(work, self.plan.settings.max_iterations - budget))
    }

    /// Newton's method under given tensions from the point at hand; whether it converged to a minimum.
    fn settle(&self, work: &mut Scratch, budget: &mut usize) -> bool {
        let mut moved = 0.0;
        for _ in 0..PATIENCE {
            work.left = work.chain.assemble(self.plan, EASY);
            *budget = budget.saturating_sub(work.left.rounds);
            moved += work.left.moved;
            if work.left.worst() <= self.plan.settings.tolerance {
                return work.left.stable;
            }
            if *budget == 0
                || moved > JUMP
                || !work.left.worst().is_finite()
                || !work.chain.solve(self.plan, 0.0)
            {
                return false;
            }
            for (strain, step) in work.chain.strains.iter_mut().zip(&work.chain.step) {
                *strain += step;
            }
        }
        false
    }

    /// Solves for displacements from the strains and tensions of an earlier shape of this robot with as many
    /// elements; a start that does not help is dropped.
    ///
    /// # Errors
    /// `InvalidInput` for a start with another number of strains.
    pub fn solve_from(
        &self,
        start: &State,
        displacements: &[f64],
        work: &mut Scratch,
    ) -> Result<Report, InvalidInput> {
        work.chain.rest(self.plan);
        let Chain { strains, tensions, .. } = &mut work.chain;
        read_state(start, self.plan, strains, tensions)?;
        work.ending = Ending::Converged;
        self.resume(displacements, work)
    }

    /// From the strains and tensions at hand to the displacements; evaluations that took.
    fn ascend(&self, displacements: &[f64], work: &mut Scratch) -> usize {
        let plan = self.plan;
        work.chain.bound(plan, displacements);
        self.listen(work);
        match plan.settings.tendons.equations() {
            Equations::PerTendon => {
                let mut budget = plan.settings.max_iterations;
                let Scratch { ascent, chain, .. } = work;
                (work.ending, work.left) = degenerate_rest::climb(ascent, plan, chain, &mut budget);
                plan.settings.max_iterations - budget
            }
            Equations::PerPiece => self.solve_pieces(displacements, work),
        }
    }

    /// The solved quantities, and how the solve ended.
    fn report(&self, work: &mut Scratch, evaluations: usize) -> Report {
        if work.ending != Ending::Converged && work.chain.stopped() {
            work.ending = Ending::Stopped;
        }
        let Scratch { state, chain, .. } = work;
        write_state(state, self, &chain.strains, &chain.ends, &chain.tensions);
        told(work.ending, work.left.worst(), evaluations)
    }
}

/// Puts the strains and tensions of a state, in the plan's unit, in place of those at rest.
pub(super) fn read_state(
    start: &State,
    plan: &Plan,
    strains: &mut [f64],
    tensions: &mut [f64],
) -> Result<(), InvalidInput> {
    let elements = plan.data.len() * plan.settings.elements;
    if start.strains.len() != elements {
        let expected = format!("{elements} strains, one per element");
        return Err(InvalidInput::new("start", expected, start.strains.len()));
    }
    let width = plan.unknowns();
    for (e, (own, strain)) in strains.chunks_exact_mut(width).zip(&start.strains).enumerate() {
        own[..3].copy_from_slice(strain.as_slice());
        if let (4, Some(elongation)) = (width, start.elongations.get(e)) {
            own[3] = *elongation;
        }
    }
    for (own, tension) in tensions.iter_mut().zip(&start.tensions) {
        *own = if tension.is_finite() { tension.max(0.0) / plan.unit } else { 0.0 };
    }
    Ok(())
}

/// Disk frames and everything else that follows from strains, the frames of the subsegments' ends in their base
/// disks' and tensions.
pub(super) fn write_state(
    state: &mut State,
    rod: &Rod<'_>,
    strains: &[f64],
    ends: &[Pose],
    tensions: &[f64],
) {
    let plan = rod.plan;
    state.clear();
    let mut frame = *rod.robot.base();
    state.frames.push(frame);
    state.tendon_lengths.resize(plan.rest_lengths.len(), 0.0);
    let rows = strains.chunks_exact(plan.width());
    for (i, ((data, strains), end)) in plan.data.iter().zip(rows).zip(ends).enumerate() {
        frame = frame.compose(end);
        state.frames.push(frame);
        for strain in strains.chunks_exact(plan.unknowns()) {
            state.strains.push(Vector3::new(strain[0], strain[1], strain[2]));
            state.elongations.extend(strain.get(3));
            data.elasticity.add_energy(strain, &mut state.energy);
        }
        for piece in &plan.pieces[plan.starts[i]..plan.starts[i + 1]] {
            let length = (end.transform(&piece.to) - piece.from).norm();
            state.tendon_lengths[piece.tendon] += length;
        }
    }
    state.energy *= plan.unit;
    state.tensions.extend(tensions.iter().map(|t| t * plan.unit));
}

/// The outcome of so many evaluations, the last of which finds that there is no step to take.
pub(super) fn told(ending: Ending, residual: f64, evaluations: usize) -> Report {
    let status = match ending {
        Ending::Converged => Status::Converged,
        Ending::Lost => Status::Infeasible,
        Ending::Spent | Ending::Stopped => Status::IterationLimit,
        Ending::Broken => Status::NumericalError,
    };
    Report { status, residual, iterations: evaluations.saturating_sub(1) }
}

impl Model for Rod<'_> {
    type Scratch = Scratch;

    fn robot(&self) -> &Robot {
        self.robot
    }

    fn strain_width(&self) -> usize {
        self.plan.unknowns()
    }

    fn elements(&self) -> usize {
        self.plan.settings.elements
    }

    fn solve(&self, displacements: &[f64], work: &mut Scratch) -> Result<Report, InvalidInput> {
        work.chain.rest(self.plan);
        let rounds = self.ascend(displacements, work);
        Ok(self.report(work, rounds))
    }

    fn resume(&self, displacements: &[f64], work: &mut Scratch) -> Result<Report, InvalidInput> {
        let starts = work.chain.tensions.len() == displacements.len();
        if starts && work.ending == Ending::Converged {
            let rounds = self.ascend(displacements, work);
            if work.ending == Ending::Converged {
                return Ok(self.report(work, rounds));
            }
        }
        self.solve(displacements, work)
    }

    fn state<'w>(&self, work: &'w Scratch) -> &'w State {
        &work.state
    }

    fn take_state(&self, work: Scratch) -> State {
        work.state
    }

    fn message(&self, displacements: &[f64], work: &Scratch) -> String {
        message(self, displacements, work)
    }
}
