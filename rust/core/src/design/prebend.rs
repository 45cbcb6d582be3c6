//! Pre-bent design: the rest shape that takes a wanted shape when the tendons are pulled (Mahapatra & Ghosal
//! 2024, section 4).

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::{DMatrix, DVector, Vector3};

use super::check_targets;
use super::hindrance::hindrance;
use super::march::march;
use crate::error::InvalidInput;
use crate::model::Model;
use crate::robot::{Backbone, Robot};
use crate::rod::{Plan, Rod, RodSettings, TendonRule, Workspace};
use crate::shape::Shape;
use crate::status::Status;

/// What a chord may be off, in shares of its subsegment, before it is blamed.
const OFF: f64 = 1e-9;

/// Choices of a pre-bent design.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrebendSettings {
    /// Of the rod model that the design is for.
    pub rod: RodSettings,
    /// Largest bend of a subsegment at rest \[rad\].
    pub max_bend: f64,
    /// Weight of the differences between neighbouring rest strains, against distances over the robot's
    /// length: 0 for none.
    pub smoothness: f64,
    /// Distance of every disk that counts as reached, in shares of the robot's length.
    pub tolerance: f64,
    /// Gauss-Newton steps at most.
    pub max_iterations: usize,
}

impl Default for PrebendSettings {
    fn default() -> Self {
        Self {
            rod: RodSettings::default(),
            max_bend: std::f64::consts::PI,
            smoothness: 0.0,
            tolerance: 1e-10,
            max_iterations: 100,
        }
    }
}

impl PrebendSettings {
    /// Checks the values.
    ///
    /// # Errors
    /// `InvalidInput` for a value out of range.
    pub fn validate(&self) -> Result<(), InvalidInput> {
        self.rod.validate()?;
        let limits = [
            (
                "max_bend",
                self.max_bend,
                self.max_bend > 0.0 && self.max_bend <= std::f64::consts::PI,
            ),
            ("smoothness", self.smoothness, self.smoothness >= 0.0 && self.smoothness.is_finite()),
            ("tolerance", self.tolerance, self.tolerance > 0.0 && self.tolerance <= 1e-2),
        ];
        for (name, value, fits) in limits {
            if !fits {
                let expected = match name {
                    "max_bend" => "an angle in (0, pi] rad",
                    "smoothness" => "0 or more",
                    _ => "a share in (0, 1e-2]",
                };
                return Err(InvalidInput::new(name, expected, format!("{value:?}")));
            }
        }
        if self.max_iterations == 0 {
            return Err(InvalidInput::new("max_iterations", "at least 1", 0));
        }
        Ok(())
    }
}

/// A designed robot.
#[derive(Clone, Debug)]
pub struct Prebend {
    /// The robot with its new rest shape.
    pub robot: Robot,
    /// Its shape under the displacements, from rest.
    pub shape: Shape,
    /// Distance of each disk from its wanted place, disk 0 first \[m\].
    pub errors: Vec<f64>,
    /// Marches, or Gauss-Newton steps.
    pub iterations: usize,
    /// Converged, or unreachable: then the robot is the nearest found.
    pub status: Status,
    /// What stood in the way, or empty.
    pub message: String,
}

/// The rest shape that takes `targets` (places of disks 1 to n in the world \[m\]) under displacements.
///
/// Where every subsegment can be inverted by itself (one element, sliding tendons, no bounds met) the answer is
/// exact and its rest shape has the twists of `robot`'s; elsewhere the bends of the rest shape are found by
/// Gauss-Newton steps on the rod's derivatives, from there or from `robot`'s own.
///
/// # Errors
/// `InvalidInput` for another number of targets than subsegments, places that are not finite, and
/// displacements or settings that do not fit the robot.
pub fn prebend(
    robot: &Robot,
    targets: &[Vector3<f64>],
    displacements: &[f64],
    settings: &PrebendSettings,
) -> Result<Prebend, InvalidInput> {
    prebend_stopped_by(robot, targets, displacements, settings, &Arc::default())
}

/// The same, which ends soon after the flag is set, with the status of an iteration limit.
///
/// # Errors
/// As [`prebend`].
pub fn prebend_stopped_by(
    robot: &Robot,
    targets: &[Vector3<f64>],
    displacements: &[f64],
    settings: &PrebendSettings,
    stop: &Arc<AtomicBool>,
) -> Result<Prebend, InvalidInput> {
    settings.validate()?;
    robot.check_displacements(displacements)?;
    check_targets(robot, targets)?;
    let design = Design { robot, targets, displacements, settings, stop };
    let start = match design.marched()? {
        Some(candidate) if design.met(&candidate) && settings.smoothness == 0.0 => {
            return design.told(candidate);
        }
        Some(candidate) => candidate,
        None => design.solved(design.own_rest(), None, 0)?,
    };
    let refined = design.refine(start)?;
    design.told(refined)
}

struct Design<'a> {
    robot: &'a Robot,
    targets: &'a [Vector3<f64>],
    displacements: &'a [f64],
    settings: &'a PrebendSettings,
    stop: &'a Arc<AtomicBool>,
}

/// A rest shape and what became of it.
#[derive(Clone)]
struct Candidate {
    robot: Robot,
    rest: Vec<Vector3<f64>>,
    shape: Shape,
    iterations: usize,
    /// The shape is what comes of pulling it from rest.
    cold: bool,
}

impl Design<'_> {
    fn own_rest(&self) -> Vec<Vector3<f64>> {
        let backbone = self.robot.backbone();
        (0..backbone.subsegments()).map(|i| backbone.rest(i)).collect()
    }

    fn with_rest(&self, rest: &[Vector3<f64>]) -> Result<Robot, InvalidInput> {
        let mut spec = self.robot.backbone().spec().clone();
        spec.rest = Some(rest.to_vec());
        self.robot.with_backbone(Backbone::new(spec)?)
    }

    /// The forward solve of a rest shape: near an earlier one, or from rest.
    fn solved(
        &self,
        rest: Vec<Vector3<f64>>,
        near: Option<&Shape>,
        iterations: usize,
    ) -> Result<Candidate, InvalidInput> {
        let robot = self.with_rest(&rest)?;
        let plan = Plan::new(&robot, self.settings.rod)?;
        let rod = Rod::new(&robot, &plan).stopped_by(Arc::clone(self.stop));
        let mut work = Workspace::default();
        let report = match near {
            Some(shape) => rod.solve_from(&shape.state, self.displacements, &mut work)?,
            None => rod.solve(self.displacements, &mut work)?,
        };
        let shape = rod.result(self.displacements, report, work);
        Ok(Candidate { robot, rest, shape, iterations, cold: near.is_none() })
    }

    /// By marching along the wanted places.
    fn marched(&self) -> Result<Option<Candidate>, InvalidInput> {
        let rod = RodSettings {
            elements: 1,
            axial: false,
            tendons: TendonRule::Sliding,
            ..self.settings.rod
        };
        let plan = Plan::new(self.robot, rod)?;
        let twists: Vec<f64> = self.own_rest().iter().map(|rest| rest.z).collect();
        let found = march(&plan, self.robot.base(), self.targets, &twists, self.displacements);
        let Some(answer) = found else { return Ok(None) };
        let rest: Vec<Vector3<f64>> = answer.march.rest.iter().map(|r| self.bounded(r)).collect();
        self.solved(rest, None, answer.iterations).map(Some)
    }

    /// A rest strain within the bound of bends.
    fn bounded(&self, rest: &Vector3<f64>) -> Vector3<f64> {
        let bend = rest.xy().norm();
        let share = if bend > self.settings.max_bend { self.settings.max_bend / bend } else { 1.0 };
        // A rest strain of more than half a turn does not exist.
        let out = Vector3::new(rest.x * share, rest.y * share, rest.z);
        // Less a rounding, which the backbone's own check must not see.
        out * ((1.0 - 1e-15) * std::f64::consts::PI / out.norm()).min(1.0)
    }

    fn errors(&self, shape: &Shape) -> Vec<f64> {
        let frames = shape.state.frames.iter().skip(1).zip(self.targets);
        let off = frames.map(|(frame, target)| (frame.translation - target).norm());
        std::iter::once(0.0).chain(off).collect()
    }

    fn length(&self) -> f64 {
        self.robot.backbone().total_length()
    }

    fn met(&self, candidate: &Candidate) -> bool {
        let worst = self.errors(&candidate.shape).into_iter().fold(0.0_f64, f64::max);
        let converged = candidate.shape.report.status == Status::Converged;
        converged && worst <= self.settings.tolerance * self.length()
    }

    /// Distances over the length, and weighted differences of neighbours.
    fn residual(&self, candidate: &Candidate) -> DVector<f64> {
        let frames = candidate.shape.state.frames.iter().skip(1).zip(self.targets);
        let off = frames.flat_map(|(frame, target)| {
            let off = (frame.translation - target) / self.length();
            [off.x, off.y, off.z]
        });
        let smooth = candidate.rest.windows(2).flat_map(|pair| {
            let change = (pair[1] - pair[0]) * self.settings.smoothness;
            [change.x, change.y]
        });
        DVector::from_vec(off.chain(smooth).collect())
    }

    fn jacobian(&self, candidate: &Candidate) -> Result<DMatrix<f64>, InvalidInput> {
        let n = self.targets.len();
        let plan = Plan::new(&candidate.robot, self.settings.rod)?;
        let rod = Rod::new(&candidate.robot, &plan);
        let mut work = Workspace::default();
        rod.solve_from(&candidate.shape.state, self.displacements, &mut work)?;
        let sensitivity = rod.sensitivity(self.displacements, &work);
        let mut out = DMatrix::zeros(3 * n + 2 * (n - 1), 2 * n);
        let mut change = sensitivity.no_change();
        for i in 0..n {
            for c in 0..2 {
                change.rest[i][c] = 1.0;
                let told = sensitivity.forward(&change);
                change.rest[i][c] = 0.0;
                for (j, velocity) in told.velocities.iter().skip(1).enumerate() {
                    for k in 0..3 {
                        out[(3 * j + k, 2 * i + c)] = velocity[k] / self.length();
                    }
                }
                if i > 0 {
                    out[(3 * n + 2 * (i - 1) + c, 2 * i + c)] += self.settings.smoothness;
                }
                if i + 1 < n {
                    out[(3 * n + 2 * i + c, 2 * i + c)] -= self.settings.smoothness;
                }
            }
        }
        Ok(out)
    }

    /// Levenberg-Marquardt steps on the bends of the rest shape.
    fn refine(&self, start: Candidate) -> Result<Candidate, InvalidInput> {
        let mut best = start;
        let mut damping = 1e-6;
        let mut residual = self.residual(&best);
        while best.iterations < self.settings.max_iterations {
            if self.stop.load(Ordering::Relaxed)
                || best.shape.report.status != Status::Converged
                || (self.met(&best) && self.settings.smoothness == 0.0)
            {
                break;
            }
            let jacobian = self.jacobian(&best)?;
            let gradient = jacobian.tr_mul(&residual);
            let gram = jacobian.tr_mul(&jacobian);
            let value = residual.norm_squared();
            let mut lower = None;
            while damping < 1e9 && !self.stop.load(Ordering::Relaxed) {
                let mut damped = gram.clone();
                for k in 0..damped.nrows() {
                    damped[(k, k)] += damping * (1e-12 + value);
                }
                let Some(factor) = damped.cholesky() else {
                    damping = (10.0 * damping).max(1e-9);
                    continue;
                };
                let step = factor.solve(&gradient);
                let rest = best.rest.iter().enumerate().map(|(i, rest)| {
                    self.bounded(&(rest - Vector3::new(step[2 * i], step[2 * i + 1], 0.0)))
                });
                let next = self.solved(rest.collect(), Some(&best.shape), best.iterations + 1)?;
                let next_residual = self.residual(&next);
                let fits = next.shape.report.status == Status::Converged;
                if fits && next_residual.norm_squared() < value {
                    lower = Some((next, next_residual));
                    break;
                }
                damping *= 10.0;
            }
            let Some((next, next_residual)) = lower else { break };
            let headway = 1.0 - next_residual.norm_squared() / value;
            (best, residual) = (next, next_residual);
            damping = (0.1 * damping).max(1e-12);
            if headway < 1e-9 {
                break;
            }
        }
        Ok(best)
    }

    fn told(&self, candidate: Candidate) -> Result<Prebend, InvalidInput> {
        // What it does when it is pulled from rest.
        let done = if candidate.cold {
            candidate
        } else {
            self.solved(candidate.rest, None, candidate.iterations)?
        };
        let errors = self.errors(&done.shape);
        let worst = errors.iter().copied().fold(0.0_f64, f64::max);
        let (status, message) = if done.shape.report.status != Status::Converged {
            let text = format!("the rod does not follow the displacements: {}", done.shape.message);
            (done.shape.report.status, text)
        } else if self.met(&done) || self.settings.smoothness > 0.0 {
            (Status::Converged, String::new())
        } else {
            let disk = errors.iter().position(|e| *e == worst).unwrap_or(0);
            let why = hindrance(self.robot, self.targets, self.settings.rod.subsegment, OFF);
            let text = format!("disk {disk} stays {worst:.3e} m from its place{why}");
            (Status::Unreachable, text)
        };
        let Candidate { robot, shape, iterations, .. } = done;
        Ok(Prebend { robot, shape, errors, iterations, status, message })
    }
}
