//! The rod among obstacles and under loads as a function of its tensions.
//!
//! In equilibrium the contacts that push are held as equations: with G the slopes of their gaps, `G dx = 0`. The
//! factors at hand are those of the augmented Lagrangian, which holds them by springs; forces that are found by
//! a few solves with the same factors make up for their compliance.

use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::{Vector3, Vector6};

use super::memory::{distance, farthest, nearest};
use super::{Equilibrium, Motion, Twist};
use crate::lie::{Pose, so3};
use crate::model::{Model, State};
use crate::obstacle::Fault;
use crate::rod::contact::{Checkpoint, LoadedRod, Scratch, TendonTarget};
use crate::rod::dual_newton::Ending;
use crate::rod::model::read_state;

/// Newton steps from one set of tensions to the next.
const PATIENCE: usize = 400;
/// Equilibria that are remembered: what steps that did not help come back to is one of them.
const POINTS: usize = 8;

/// An equilibrium under tensions.
#[derive(Clone, Debug, Default)]
struct Point {
    checkpoint: Checkpoint,
    tensions: Vec<f64>,
    converged: bool,
}

/// A rod among obstacles under tensions, near points where it was in equilibrium before.
#[derive(Debug)]
pub(crate) struct ContactRod<'r> {
    rod: LoadedRod<'r>,
    stop: Option<&'r AtomicBool>,
    work: Scratch,
    /// Without tensions.
    rest: Point,
    /// The last ones; steps start from the nearest.
    points: [Point; POINTS],
    at: usize,
    kept: [Point; 3],
    /// True while the minimiser's shape is that of the point at hand.
    is_current: bool,
    /// The Newton step that is left at the point at hand: displacements of the disks, twists about the base's origin,
    /// and changes of the tendons' lengths.
    last_step: (Vec<Vector6<f64>>, Vec<f64>),
    motion: Motion,
    /// Slopes of all tendons' lengths by every tension, one row per tension \[m\].
    length_slopes: Vec<Vec<f64>>,
}

impl<'r> ContactRod<'r> {
    /// At rest, as far as obstacles and loads allow.
    pub(crate) fn new(rod: LoadedRod<'r>, stop: Option<&'r AtomicBool>) -> Self {
        let count = rod.plan().rest_lengths.len();
        let mut new = Self {
            rod,
            stop,
            work: Scratch::default(),
            rest: Point::default(),
            points: Default::default(),
            at: 0,
            kept: Default::default(),
            is_current: false,
            last_step: (Vec::new(), vec![0.0; count]),
            motion: Motion::new(),
            length_slopes: vec![Vec::new(); count],
        };
        new.rest = new.solve_from_rest(&vec![0.0; count]);
        new.reset();
        new
    }

    /// Steps the load from the undeformed robot without loads.
    fn solve_from_rest(&mut self, tensions: &[f64]) -> Point {
        let Self { rod, work, .. } = self;
        rod.set_rest(work);
        let mut budget = rod.plan().settings.max_iterations;
        let target = TendonTarget::Tensions(tensions.to_vec());
        let depth = rod.measure_penetration(work);
        let solved =
            depth.and_then(|()| rod.step_load(&target, None, work, &mut budget, self.stop));
        self.point_of(solved, tensions.to_vec())
    }

    /// Steps the load from the point at hand.
    fn solve_from_point(&mut self, tensions: &[f64]) -> Point {
        let (rod, work) = (&self.rod, &mut self.work);
        let from = &self.points[self.at];
        rod.restore(&from.checkpoint, work);
        let target = TendonTarget::Tensions(tensions.to_vec());
        let start = TendonTarget::Tensions(from.tensions.clone());
        let mut budget = PATIENCE.min(rod.plan().settings.max_iterations);
        let solved = rod.step_load(&target, Some(&start), work, &mut budget, self.stop);
        self.point_of(solved, tensions.to_vec())
    }

    /// The point that load steps led to.
    fn point_of(&mut self, solved: Result<(), Fault>, tensions: Vec<f64>) -> Point {
        if let Err(fault) = solved {
            self.work.fault = Some(fault);
            self.rod.report_fault(&mut self.work);
            return Point::default();
        }
        let converged = self.work.ending == Ending::Converged;
        if converged {
            let (disks, lengths) = &mut self.last_step;
            self.work.minimizer.write_last_step(self.rod.plan(), disks, lengths);
        }
        Point { checkpoint: self.work.checkpoint.clone(), tensions, converged }
    }

    fn frame(&self) -> Pose {
        let frames = &self.work.minimizer.current.frames;
        frames.last().copied().unwrap_or_else(Pose::identity)
    }
}

impl Equilibrium for ContactRod<'_> {
    fn reset(&mut self) {
        for point in &mut self.points {
            point.converged = false;
        }
        self.points[0].clone_from(&self.rest);
        (self.at, self.is_current) = (0, false);
    }

    fn start_from(&mut self, start: &State) -> bool {
        self.reset();
        let (rod, work) = (&self.rod, &mut self.work);
        rod.set_rest(work);
        let (strains, mut tensions) =
            (&mut work.minimizer.current.strains, vec![0.0; start.tensions.len()]);
        if read_state(start, rod.plan(), strains, &mut tensions).is_err() {
            return false;
        }
        rod.recall_contacts(start, work);
        let target = TendonTarget::Tensions(tensions.clone());
        let mut budget = PATIENCE;
        let solved = rod.step_load(&target, Some(&target), work, &mut budget, self.stop);
        let point = self.point_of(solved, tensions);
        if point.converged {
            self.points[0] = point;
            self.is_current = true;
        }
        self.is_current
    }

    fn tensions(&self) -> &[f64] {
        &self.points[self.at].tensions
    }

    fn solve_at(&mut self, tensions: &[f64]) -> bool {
        let distances = self.points.each_ref();
        let distances = distances.map(|p| distance(p.converged, &p.tensions, tensions));
        let nearest = nearest(&distances);
        if distances[nearest] == 0.0 && nearest == self.at && self.is_current {
            return true;
        }
        if self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
            return false;
        }
        // Without tensions there may be no shape, where the robot rests in an obstacle or under loads.
        self.at = nearest;
        let is_known = self.points[nearest].converged;
        let point =
            if is_known { self.solve_from_point(tensions) } else { self.solve_from_rest(tensions) };
        self.is_current = point.converged;
        if !point.converged {
            return false;
        }
        // The new point takes the place of the farthest one.
        if is_known && distances[nearest] > 0.0 {
            self.at = farthest(&distances, nearest);
        }
        self.points[self.at] = point;
        true
    }

    fn differentiate(&mut self) {
        let plan = self.rod.plan();
        let tip = self.frame();
        let mut tool = tip.compose(self.rod.robot().tool());
        let last = self.last_step.0.last().copied().unwrap_or_default();
        let (spin, velocity) = (part(&last, 0), part(&last, 3));
        tool.translation += velocity + spin.cross(&tool.translation);
        tool.rotation = so3::exp(&spin) * tool.rotation;
        let count = self.length_slopes.len();
        let moment = self.rod.scene().moment;
        self.motion.begin(tool, count);
        let shares = self.last_step.0.windows(2).map(|w| about(&(w[1] - w[0]), &tool.translation));
        self.motion.place(&self.work.minimizer.current.frames, shares);
        let mut all: Vec<Vec<Vector6<f64>>> = Vec::with_capacity(count);
        for (k, slopes) in self.length_slopes.iter_mut().enumerate() {
            all.push(self.work.minimizer.tension_response(plan, &moment, k).to_vec());
            self.work.minimizer.write_length_response(plan, slopes);
        }
        for i in 1..=plan.data.len() {
            for (k, disks) in all.iter().enumerate() {
                let twist = disks[i] - disks[i - 1];
                self.motion.add(k, about(&twist, &tool.translation));
            }
            self.motion.next();
        }
    }

    fn motion(&self) -> &Motion {
        &self.motion
    }

    fn motion_mut(&mut self) -> &mut Motion {
        &mut self.motion
    }

    fn displacement(&self, k: usize) -> f64 {
        // Under given tensions the excess counts from rest.
        let current = &self.work.minimizer.current;
        // Where an obstacle's function fails before the first equilibrium there is none.
        let (Some(excess), Some(tension)) = (current.excess.get(k), current.tensions.get(k)) else {
            return 0.0;
        };
        excess + self.last_step.1[k] - self.rod.plan().compliance[k] * tension
    }

    fn displacement_slope(&self, k: usize, by: usize) -> f64 {
        let compliance = if k == by { self.rod.plan().compliance[k] } else { 0.0 };
        self.length_slopes[by][k] - compliance
    }

    fn save(&mut self, place: usize) {
        self.kept[place] = self.points[self.at].clone();
    }

    fn restore(&mut self, place: usize) {
        self.reset();
        self.points[0].clone_from(&self.kept[place]);
    }

    fn state(&mut self) -> Option<State> {
        self.is_current.then(|| self.rod.write_shape(&mut self.work).clone())
    }
}

fn part(twist: &Vector6<f64>, row: usize) -> Vector3<f64> {
    Vector3::new(twist[row], twist[row + 1], twist[row + 2])
}

/// Velocity of a point and angular velocity.
fn about(twist: &Vector6<f64>, point: &Vector3<f64>) -> Twist {
    let spin = part(twist, 0);
    (part(twist, 3) + spin.cross(point), spin)
}
