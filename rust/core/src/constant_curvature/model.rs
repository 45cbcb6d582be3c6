//! Robots of several constant-curvature segments: the forward model.

use nalgebra::{Matrix6xX, Vector2, Vector3};

use super::arc::Arc;
use super::kinematics::tip_derivative;
use super::plan::{Coupling, MaskedInverse, Plan};
use crate::error::InvalidInput;
use crate::lie::Pose;
use crate::model::{Model, Report, State, rod_only};
use crate::robot::Robot;
use crate::status::Status;

/// Buffers of a solve.
///
/// ```
/// use tdcr::constant_curvature::{ConstantCurvature, ConstantCurvatureSettings, Plan, Scratch};
/// use tdcr::model::Model;
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, ConstantCurvatureSettings::default())?;
/// let mut scratch = Scratch::default();
/// ConstantCurvature::new(&robot, &plan).solve(&[-0.01, f64::INFINITY, f64::INFINITY], &mut scratch)?;
/// assert!((scratch.arcs()[0].kappa() - 5.0).abs() < 1e-9);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    state: State,
    /// The arc of every segment.
    pub(super) arcs: Vec<Arc>,
    /// Displacement given minus displacement of the arcs, per tendon; 0 where it does not count.
    misfit: Vec<f64>,
    pub(super) active: Vec<bool>,
    /// The inverse for the last pattern of counted tendons that was not "all".
    pub(super) masked: Option<MaskedInverse>,
}

impl Scratch {
    /// The arc of every segment, base first.
    #[must_use]
    pub fn arcs(&self) -> &[Arc] {
        &self.arcs
    }
}

/// The constant-curvature model of a robot, ready to solve.
///
/// ```
/// use tdcr::constant_curvature::{ConstantCurvature, ConstantCurvatureSettings, Plan};
/// use tdcr::model::Model;
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, ConstantCurvatureSettings::default())?;
/// let model = ConstantCurvature::new(&robot, &plan);
/// let shape = model.shape(&[-0.01, f64::INFINITY, f64::INFINITY])?;
/// // Bent by 1 rad towards +x.
/// assert!(shape.state.frames[10].translation.x > 0.0);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct ConstantCurvature<'r> {
    pub(super) robot: &'r Robot,
    pub(super) plan: &'r Plan,
}

/// Share of a tendon's length by which displacements may miss the arcs without being called
/// inconsistent.
const CONSISTENT: f64 = 1e-9;

impl<'r> ConstantCurvature<'r> {
    /// Solves with a plan that was made of this robot.
    #[must_use]
    pub fn new(robot: &'r Robot, plan: &'r Plan) -> Self {
        Self { robot, plan }
    }

    /// Fits the arcs: infeasible when a segment keeps no length, a numerical error when one overflows.
    fn fit(&self, displacements: &[f64], work: &mut Scratch) -> Status {
        let plan = self.plan;
        let width = plan.width();
        plan.mark_active_tendons(displacements, &mut work.active);
        plan.cache_inverse(&work.active, &mut work.masked);
        let inverse = plan.inverse_for(&work.active, work.masked.as_ref());
        work.arcs.clear();
        for (i, segment) in plan.segments.iter().enumerate() {
            let unknown = |row: usize| {
                let active = work.active.iter().zip(displacements).enumerate();
                active.fold(0.0, |sum, (k, (counts, displacement))| {
                    if *counts { sum + inverse[(width * i + row, k)] * displacement } else { sum }
                })
            };
            let bend = Vector2::new(unknown(0), unknown(1)) / plan.scale;
            let elongation = if plan.settings.extensible { unknown(2) } else { 0.0 };
            let length = segment.rest_length + elongation;
            work.arcs.push(Arc { bend, length });
        }
        if !work.arcs.iter().all(Arc::is_finite) {
            Status::NumericalError
        } else if work.arcs.iter().any(|arc| arc.length <= 0.0) {
            Status::Infeasible
        } else {
            Status::Converged
        }
    }

    /// Places the disks.
    fn write_frames(&self, work: &mut Scratch) {
        let Scratch { state, arcs, .. } = work;
        state.clear();
        let mut base = *self.robot.base();
        state.frames.push(base);
        let lengths = self.robot.backbone().lengths();
        for (segment, arc) in self.plan.segments.iter().zip(arcs.iter()) {
            let mut frame = base;
            let mut last: Option<(f64, Pose, Vector3<f64>)> = None;
            for length in &lengths[segment.first..segment.last] {
                let share = length / segment.rest_length;
                // Steps of equal length along one arc are one motion.
                let (step, turn) = match last {
                    Some((same, step, turn)) if same == share => (step, turn),
                    _ => (arc.frame(share), arc.rotation(share)),
                };
                last = Some((share, step, turn));
                frame = frame.compose(&step);
                state.frames.push(frame);
                state.strains.push(turn);
                if self.plan.settings.extensible {
                    state.elongations.push(arc.length / segment.rest_length - 1.0);
                }
            }
            base = base.compose(&arc.frame(1.0));
            // The segment ends at s = ell exactly, whatever the steps round to.
            if let Some(last) = state.frames.last_mut() {
                *last = base;
            }
        }
        let backbone = self.robot.backbone();
        state.energy =
            state.strains.iter().enumerate().map(|(i, w)| backbone.strain_energy(i, w)).sum();
    }

    /// Measures tendons along their arcs.
    fn measure_tendons(&self, displacements: &[f64], work: &mut Scratch) {
        let Scratch { state, arcs, misfit, active, .. } = work;
        misfit.clear();
        for (k, path) in self.robot.paths().iter().enumerate() {
            let (mut whole, mut own) = (0.0, 0.0);
            for (segment, arc) in self.plan.segments.iter().zip(arcs.iter()) {
                if path.end() >= segment.last {
                    let bend = arc.bend.x * path.holes[0].x + arc.bend.y * path.holes[0].y;
                    own = (arc.length - segment.rest_length) - bend;
                    whole += own;
                }
            }
            state.tendon_lengths.push(path.rest_length + whole);
            let fitted = match self.plan.settings.coupling {
                Coupling::Coupled => whole,
                Coupling::PerSegment => own,
            };
            misfit.push(if active[k] { displacements[k] - fitted } else { 0.0 });
        }
        state.tensions.resize(displacements.len(), f64::NAN);
    }

    /// Velocity of the tool (translation, then rotation, world axes) per metre of displacement, (6, K),
    /// at checked displacements. Tendons that do not count have zero columns.
    ///
    /// # Errors
    /// `InvalidInput` for displacements that leave a segment no length, or overflow.
    pub fn jacobian(
        &self,
        displacements: &[f64],
        work: &mut Scratch,
    ) -> Result<Matrix6xX<f64>, InvalidInput> {
        if self.fit(displacements, work) != Status::Converged {
            let expected = "displacements that the segments can take";
            let got = arc_fault(&work.arcs).unwrap_or_default();
            return Err(InvalidInput::new("displacements", expected, format!("some that {got}")));
        }
        let width = self.plan.width();
        let by_arcs = tip_derivative(self.robot.base(), self.robot.tool(), &work.arcs);
        let mut by_unknowns = Matrix6xX::zeros(width * work.arcs.len());
        for i in 0..work.arcs.len() {
            for j in 0..width {
                let scale = if j < 2 { 1.0 / self.plan.scale } else { 1.0 };
                by_unknowns
                    .column_mut(width * i + j)
                    .copy_from(&(by_arcs.column(3 * i + j) * scale));
            }
        }
        Ok(by_unknowns * self.plan.inverse_for(&work.active, work.masked.as_ref()))
    }
}

/// Fault of displacements whose arcs no robot can take.
fn arc_fault(arcs: &[Arc]) -> Option<String> {
    if let Some(i) = arcs.iter().position(|arc| !arc.is_finite()) {
        return Some(format!("make the arc of segment {i} overflow"));
    }
    let i = arcs.iter().position(|arc| arc.length <= 0.0)?;
    Some(format!("leave segment {i} no length"))
}

impl Model for ConstantCurvature<'_> {
    const NAME: &'static str = "constant_curvature";

    type Scratch = Scratch;

    fn robot(&self) -> &Robot {
        self.robot
    }

    fn strain_width(&self) -> usize {
        if self.plan.settings.extensible { 4 } else { 3 }
    }

    fn solve(&self, displacements: &[f64], work: &mut Scratch) -> Result<Report, InvalidInput> {
        let status = self.fit(displacements, work);
        self.write_frames(work);
        self.measure_tendons(displacements, work);
        let paths = self.robot.paths().iter();
        let residual = if status == Status::NumericalError {
            f64::INFINITY
        } else {
            (work.misfit.iter().zip(paths))
                .fold(0.0_f64, |largest, (off, path)| largest.max(off.abs() / path.rest_length))
        };
        Ok(Report { status, residual, iterations: 0 })
    }

    fn jacobian(
        &self,
        displacements: &[f64],
        start: Option<&State>,
        work: &mut Scratch,
    ) -> Result<Result<Matrix6xX<f64>, Report>, InvalidInput> {
        if start.is_some() {
            return Err(rod_only("start", Self::NAME));
        }
        ConstantCurvature::jacobian(self, displacements, work).map(Ok)
    }

    fn state<'w>(&self, work: &'w Scratch) -> &'w State {
        &work.state
    }

    fn take_state(&self, work: Scratch) -> State {
        work.state
    }

    fn message(&self, _: &[f64], work: &Scratch) -> String {
        if let Some(fault) = arc_fault(&work.arcs) {
            return format!("the displacements {fault}");
        }
        let names = self.robot.tendon_names();
        let off: Vec<String> = (work.misfit.iter().zip(self.robot.paths()).zip(names))
            .filter(|((off, path), _)| off.abs() > CONSISTENT * path.rest_length)
            .map(|((off, _), name)| format!("'{name}' by {off:+.3e} m"))
            .collect();
        if off.is_empty() {
            return String::new();
        }
        format!("no arcs have these displacements; off the least-squares ones: {}", off.join(", "))
    }
}
