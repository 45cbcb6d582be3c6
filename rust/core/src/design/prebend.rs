//! Pre-bent design: the rest shape that takes a wanted shape when the tendons are pulled (Mahapatra & Ghosal
//! 2024, section 4).

use std::cmp::Ordering;
use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering as Memory};

use nalgebra::{DMatrix, DVector, Vector3};

use super::bend_descent::{BendProblem, clamp_bend, descend};
use super::check_targets;
use super::feasibility::infeasible_chord;
use super::nearest_rod::NearestRodProblem;
use super::settings::PrebendSettings;
use super::stepwise_tensions::solve_tensions;
use crate::error::InvalidInput;
use crate::model::Model;
use crate::model::Shape;
use crate::robot::{Backbone, Robot};
use crate::rod::{Plan, Rod, RodSettings, Scratch, TendonLaw};
use crate::status::Status;

/// Share by which a sum of squares may be above the least before more is sought.
const ENOUGH: f64 = 1e-6;
/// Starts that go on by a descent.
const REFINED: usize = 8;

/// A designed robot.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::design::{PrebendSettings, prebend};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// // The disks on an arc of 1 rad without any pull.
/// let targets: Vec<_> = (1..=10)
///     .map(|i| 0.1 * f64::from(i))
///     .map(|angle| Vector3::new(0.2 * (1.0 - angle.cos()), 0.0, 0.2 * angle.sin()))
///     .collect();
/// let found = prebend(&robot, &targets, &[f64::INFINITY; 3], &PrebendSettings::default())?;
/// assert!(!found.robot.backbone().is_straight());
/// assert!(found.errors.iter().all(|error| *error < 1e-3));
/// # Ok(())
/// # }
/// ```
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
    /// Message about what stood in the way, or empty.
    pub message: String,
}

/// The rest shape that takes `targets` (places of disks 1 to n in the world \[m\]) under displacements.
///
/// Where every subsegment can be inverted by itself (one element, sliding tendons, no bounds met) the answer is
/// exact and its rest shape has the twists of `robot`'s; elsewhere the bends of the rest shape are found by
/// Levenberg-Marquardt steps on the rod's derivatives, from there or from `robot`'s own, and, if that does not meet
/// the places, from where rods of these lengths come nearest to them.
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

/// [`prebend`] that ends soon after the flag is set, with the status of an iteration limit.
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
    let own = design.own_rest();
    let start = match design.invert_stepwise(targets)? {
        Some(candidate) => candidate,
        None => design.solve(own.clone(), None, 0)?,
    };
    let there = design.reaches(&start);
    if there && settings.smoothness == 0.0 {
        return Ok(design.outcome(start, None));
    }
    let first = design.solve_from_rest(design.refine(start)?)?;
    if there || design.reaches(&first) || design.is_stopped() {
        return Ok(design.outcome(first, None));
    }
    let (best, reach) = design.search(first, &own)?;
    Ok(design.outcome(best, Some(reach)))
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
    /// Distances over the length, and weighted differences of neighbours.
    residual: DVector<f64>,
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
    fn solve(
        &self,
        rest: Vec<Vector3<f64>>,
        near: Option<&Shape>,
        iterations: usize,
    ) -> Result<Candidate, InvalidInput> {
        let robot = self.with_rest(&rest)?;
        let plan = Plan::new(&robot, self.settings.rod)?;
        let rod = Rod::new(&robot, &plan).stopped_by(Arc::clone(self.stop));
        let mut work = Scratch::default();
        let report = match near {
            Some(shape) => rod.solve_from(&shape.state, self.displacements, &mut work)?,
            None => rod.solve(self.displacements, &mut work)?,
        };
        let shape = rod.result(self.displacements, report, work);
        let residual = self.residual_of(&shape, &rest);
        Ok(Candidate { robot, rest, shape, residual, iterations, cold: near.is_none() })
    }

    /// Rest shape by inversion of one subsegment after the other along places.
    fn invert_stepwise(&self, places: &[Vector3<f64>]) -> Result<Option<Candidate>, InvalidInput> {
        let rod = RodSettings {
            elements: 1,
            axial: false,
            tendons: TendonLaw::Sliding,
            ..self.settings.rod
        };
        let plan = Plan::new(self.robot, rod)?;
        let twists: Vec<f64> = self.own_rest().iter().map(|rest| rest.z).collect();
        let found = solve_tensions(&plan, self.robot.base(), places, &twists, self.displacements);
        let Some(answer) = found else { return Ok(None) };
        let most = self.settings.max_bend;
        let rest = answer.march.rest.iter().map(|rest| clamp_bend(rest, most)).collect();
        self.solve(rest, None, answer.iterations).map(Some)
    }

    fn errors(&self, shape: &Shape) -> Vec<f64> {
        let frames = shape.state.frames.iter().skip(1).zip(self.targets);
        let off = frames.map(|(frame, target)| (frame.translation - target).norm());
        std::iter::once(0.0).chain(off).collect()
    }

    fn length(&self) -> f64 {
        self.robot.backbone().total_length()
    }

    /// Decision that every disk is in its place.
    fn reaches(&self, candidate: &Candidate) -> bool {
        let worst = self.errors(&candidate.shape).into_iter().fold(0.0_f64, f64::max);
        let converged = candidate.shape.report.status == Status::Converged;
        converged && worst <= self.settings.tolerance * self.length()
    }

    fn residual_of(&self, shape: &Shape, rest: &[Vector3<f64>]) -> DVector<f64> {
        let frames = shape.state.frames.iter().skip(1).zip(self.targets);
        let off = frames.flat_map(|(frame, target)| {
            let off = (frame.translation - target) / self.length();
            [off.x, off.y, off.z]
        });
        let smooth = rest.windows(2).flat_map(|pair| {
            let change = (pair[1] - pair[0]) * self.settings.smoothness;
            [change.x, change.y]
        });
        DVector::from_vec(off.chain(smooth).collect())
    }

    /// Descent from a rest shape that follows the displacements.
    fn refine(&self, start: Candidate) -> Result<Candidate, InvalidInput> {
        if start.shape.report.status != Status::Converged {
            return Ok(start);
        }
        let left = self.settings.max_iterations.saturating_sub(start.iterations);
        Ok(descend(self, start, self.settings.max_bend, left)?.0)
    }

    /// The shape of a rest shape when it is pulled from there.
    fn solve_from_rest(&self, candidate: Candidate) -> Result<Candidate, InvalidInput> {
        if candidate.cold {
            return Ok(candidate);
        }
        self.solve(candidate.rest, None, candidate.iterations)
    }

    /// Best descent from the nearest rods of these lengths, whatever bends them, and root mean square of the distances
    /// that these leave \[m\].
    fn search(
        &self,
        first: Candidate,
        own: &[Vector3<f64>],
    ) -> Result<(Candidate, f64), InvalidInput> {
        // Nearest rods of these lengths, with any bends, then with those that are allowed.
        let twists: Vec<f64> = own.iter().map(|rest| rest.z).collect();
        let (robot, targets, kind) = (self.robot, self.targets, self.settings.rod.subsegment);
        let problem =
            NearestRodProblem { robot, targets, kind, twists: &twists, most: PI, stop: self.stop };
        let mut rods = problem.minima(own)?;
        let least = rods.first().map_or(0.0, |rod| rod.cost);
        if self.settings.max_bend < PI {
            rods.extend(NearestRodProblem { most: self.settings.max_bend, ..problem }.minima(own)?);
        }
        // What follows and is as near as lengths allow ends the search.
        let enough = least * (1.0 + ENOUGH);
        let done = |candidate: &Candidate| Self::rank(candidate) <= (false, enough);
        // Starts: rest shapes whose places under tension are those of the nearest rods.
        let mut starts: Vec<Candidate> = Vec::new();
        for rod in rods {
            if self.is_stopped() || starts.last().is_some_and(done) {
                break;
            }
            starts.push(match self.invert_stepwise(&rod.places)? {
                Some(candidate) if candidate.shape.report.status == Status::Converged => candidate,
                _ => self.solve(rod.bends, None, 0)?,
            });
        }
        // These follow where bends that fight the tendons do not.
        let straight: Vec<_> = own.iter().map(|rest| Vector3::new(0.0, 0.0, rest.z)).collect();
        for rest in [straight, own.to_vec()] {
            starts.push(self.solve(rest, None, 0)?);
        }
        starts.sort_by(|a, b| Self::rank(a).partial_cmp(&Self::rank(b)).unwrap_or(Ordering::Equal));
        starts.truncate(REFINED);
        // Descents from the best of them, pulled from rest again.
        let mut best = first;
        for start in starts {
            if self.is_stopped() || self.is_met(&best) || done(&best) {
                break;
            }
            let next = self.solve_from_rest(self.refine(start)?)?;
            let iterations = best.iterations + next.iterations;
            if Self::rank(&next) < Self::rank(&best) {
                best = next;
            }
            best.iterations = iterations;
        }
        let rms = self.length() * (least / targets.len() as f64).sqrt();
        Ok((best, rms))
    }

    /// Order of candidates: those that follow the displacements first, then by distance.
    fn rank(candidate: &Candidate) -> (bool, f64) {
        let status = candidate.shape.report.status;
        (status != Status::Converged, candidate.residual.norm_squared())
    }

    /// The outcome; `reach` is the root mean square of the distances that lengths alone leave \[m\], if known.
    fn outcome(&self, done: Candidate, reach: Option<f64>) -> Prebend {
        let errors = self.errors(&done.shape);
        let worst = errors.iter().copied().fold(0.0_f64, f64::max);
        let (status, message) = if done.shape.report.status != Status::Converged {
            let text = format!("the rod does not follow the displacements: {}", done.shape.message);
            (done.shape.report.status, text)
        } else if self.reaches(&done) {
            (Status::Converged, String::new())
        } else if self.settings.smoothness > 0.0 {
            let disk = errors.iter().position(|e| *e == worst).unwrap_or(0);
            let what = "with smoothness: the least sum of both";
            (Status::Converged, format!("disk {disk} stays {worst:.3e} m from its place, {what}"))
        } else if self.is_stopped() {
            (Status::IterationLimit, "stopped before the end".to_owned())
        } else {
            let disk = errors.iter().position(|e| *e == worst).unwrap_or(0);
            let why = self.reason(&done, &errors, reach);
            let text = format!("disk {disk} stays {worst:.3e} m from its place{why}");
            (Status::Unreachable, text)
        };
        let Candidate { robot, shape, iterations, .. } = done;
        Prebend { robot, shape, errors, iterations, status, message }
    }

    /// Reason why the disks stay off their places, as the end of a message: lengths, where they explain at least half
    /// of the distances, or the bound of bends.
    fn reason(&self, done: &Candidate, errors: &[f64], reach: Option<f64>) -> String {
        let mean = errors.iter().map(|e| e * e).sum::<f64>() / self.targets.len() as f64;
        if reach.is_some_and(|reach| reach >= 0.5 * mean.sqrt()) {
            let worst = errors.iter().copied().fold(0.0_f64, f64::max);
            // Lengths that are off by less would explain less than a tenth of it, all together.
            let off = 0.1 * worst / self.length();
            return infeasible_chord(self.robot, self.targets, self.settings.rod.subsegment, off);
        }
        let most = self.settings.max_bend;
        let bound = |rest: &Vector3<f64>| rest.xy().norm() >= most * (1.0 - 1e-9);
        let Some(first) = done.rest.iter().position(bound) else { return String::new() };
        let count = done.rest.iter().filter(|rest| bound(rest)).count();
        format!(": {count} rest bends, from disk {first} the first, are at max_bend, {most:.6} rad")
    }
}

impl BendProblem for Design<'_> {
    const HEADWAY: f64 = 1e-9;

    type Point = Candidate;

    fn bends<'a>(&self, point: &'a Candidate) -> &'a [Vector3<f64>] {
        &point.rest
    }

    fn residual<'a>(&self, point: &'a Candidate) -> &'a DVector<f64> {
        &point.residual
    }

    fn at(
        &self,
        bends: Vec<Vector3<f64>>,
        near: &Candidate,
    ) -> Result<Option<Candidate>, InvalidInput> {
        let next = self.solve(bends, Some(&near.shape), near.iterations + 1)?;
        Ok((next.shape.report.status == Status::Converged).then_some(next))
    }

    fn is_met(&self, candidate: &Candidate) -> bool {
        self.settings.smoothness == 0.0 && self.reaches(candidate)
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Memory::Relaxed)
    }

    fn jacobian(&self, candidate: &Candidate) -> Result<DMatrix<f64>, InvalidInput> {
        let n = self.targets.len();
        let plan = Plan::new(&candidate.robot, self.settings.rod)?;
        let rod = Rod::new(&candidate.robot, &plan);
        let mut work = Scratch::default();
        rod.solve_from(&candidate.shape.state, self.displacements, &mut work)?;
        let sensitivity = rod.sensitivity(self.displacements, &work);
        let mut out = DMatrix::zeros(3 * n + 2 * (n - 1), 2 * n);
        let mut change = sensitivity.no_change();
        for i in 0..n {
            for c in 0..2 {
                change.rest[i][c] = 1.0;
                let variation = sensitivity.forward(&change);
                change.rest[i][c] = 0.0;
                for (j, velocity) in variation.velocities.iter().skip(1).enumerate() {
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
}
