//! The rod among obstacles and under loads as a function of its tensions.
//!
//! At a balance the contacts that push are held as equations: with G the slopes of their gaps, `G dx = 0`. The
//! factors at hand are those of the augmented Lagrangian, which holds them by springs; forces that are found by
//! a few answers of the same factors make up for their compliance.

use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::{Vector3, Vector6};

use super::{Equilibrium, Motion, Twist};
use crate::lie::{Pose, so3};
use crate::model::{Model, State};
use crate::obstacle::Fault;
use crate::rod::contact::continuation::{Checkpoint, TendonTarget};
use crate::rod::contact::model::{LoadedRod, Scratch};
use crate::rod::dual_newton::Ending;
use crate::rod::model::read_state;

/// Evaluations from one set of tensions to the next.
const PATIENCE: usize = 400;
/// Balances that are remembered: what is come back to after steps that did not help is one of them.
const POINTS: usize = 8;

/// A balance under tensions.
#[derive(Clone, Debug, Default)]
struct Point {
    kept: Checkpoint,
    tensions: Vec<f64>,
    sound: bool,
}

impl Point {
    /// Largest difference of its tensions from others; infinite where it is none.
    fn away(&self, tensions: &[f64]) -> f64 {
        if !self.sound {
            return f64::INFINITY;
        }
        let pairs = self.tensions.iter().zip(tensions);
        pairs.fold(0.0, |most, (a, b)| most.max((a - b).abs()))
    }
}

/// A rod among obstacles under tensions, near points where it was balanced before.
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
    /// Whether the descent's shape is that of the point at hand.
    held: bool,
    /// By what the balance at hand lacks: displacements of the disks, twists about the base's origin, and what lengths
    /// gain.
    lack: (Vec<Vector6<f64>>, Vec<f64>),
    motion: Motion,
    /// What every tendon's length gains by every tension, one row per tension \[m\].
    grown: Vec<Vec<f64>>,
}

impl<'r> ContactRod<'r> {
    /// At rest, as far as obstacles and loads allow.
    pub(crate) fn new(rod: LoadedRod<'r>, stop: Option<&'r AtomicBool>) -> Self {
        let count = rod.plan().rest_lengths.len();
        let mut leaning = Self {
            rod,
            stop,
            work: Scratch::default(),
            rest: Point::default(),
            points: Default::default(),
            at: 0,
            kept: Default::default(),
            held: false,
            lack: (Vec::new(), vec![0.0; count]),
            motion: Motion::new(),
            grown: vec![Vec::new(); count],
        };
        leaning.rest = leaning.set_out(&vec![0.0; count]);
        leaning.reset();
        leaning
    }

    /// Climbs from the undeformed robot, without loads; where that leads.
    fn set_out(&mut self, tensions: &[f64]) -> Point {
        let Self { rod, work, .. } = self;
        rod.begin(work);
        let mut budget = rod.plan().settings.max_iterations;
        let given = TendonTarget::Tensions(tensions.to_vec());
        let sunk = rod.sink(work);
        let led = sunk.and_then(|()| rod.climb(&given, None, work, &mut budget, self.stop));
        self.arrived(led, tensions.to_vec())
    }

    /// The point that a climb led to.
    fn arrived(&mut self, led: Result<(), Fault>, tensions: Vec<f64>) -> Point {
        if let Err(fault) = led {
            self.work.fault = Some(fault);
            self.rod.report_fault(&mut self.work);
            return Point::default();
        }
        let sound = self.work.ending == Ending::Converged;
        if sound {
            let (disks, lengths) = &mut self.lack;
            self.work.descent.write_lack(self.rod.plan(), disks, lengths);
        }
        Point { kept: self.work.kept.clone(), tensions, sound }
    }

    /// Climbs from the point at hand; where that leads.
    fn climb(&mut self, tensions: &[f64]) -> Point {
        let (rod, work) = (&self.rod, &mut self.work);
        let from = &self.points[self.at];
        from.kept.restore(&mut work.descent);
        rod.stiffen(work);
        let given = TendonTarget::Tensions(tensions.to_vec());
        let start = TendonTarget::Tensions(from.tensions.clone());
        let mut budget = PATIENCE.min(rod.plan().settings.max_iterations);
        let led = rod.climb(&given, Some(&start), work, &mut budget, self.stop);
        self.arrived(led, tensions.to_vec())
    }

    fn frame(&self) -> Pose {
        let frames = &self.work.descent.here.frames;
        frames.last().copied().unwrap_or_else(Pose::identity)
    }
}

impl Equilibrium for ContactRod<'_> {
    fn reset(&mut self) {
        for point in &mut self.points {
            point.sound = false;
        }
        self.points[0].clone_from(&self.rest);
        (self.at, self.held) = (0, false);
    }

    fn start_from(&mut self, start: &State) -> bool {
        self.reset();
        let (rod, work) = (&self.rod, &mut self.work);
        rod.begin(work);
        let (strains, mut tensions) =
            (&mut work.descent.here.strains, vec![0.0; start.tensions.len()]);
        if read_state(start, rod.plan(), strains, &mut tensions).is_err() {
            return false;
        }
        rod.recall(start, work);
        let given = TendonTarget::Tensions(tensions.clone());
        let mut budget = PATIENCE;
        let led = rod.climb(&given, Some(&given), work, &mut budget, self.stop);
        let point = self.arrived(led, tensions);
        if point.sound {
            self.points[0] = point;
            self.held = true;
        }
        self.held
    }

    fn tensions(&self) -> &[f64] {
        &self.points[self.at].tensions
    }

    fn solve_at(&mut self, tensions: &[f64]) -> bool {
        let away = self.points.each_ref().map(|point| point.away(tensions));
        let nearest = (0..POINTS).fold(0, |best, k| if away[k] < away[best] { k } else { best });
        if away[nearest] == 0.0 && nearest == self.at && self.held {
            return true;
        }
        if self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
            return false;
        }
        self.at = nearest;
        let known = self.points[nearest].sound;
        // Without tensions there may be no shape, where the robot rests in an obstacle or under loads.
        let point = if known { self.climb(tensions) } else { self.set_out(tensions) };
        self.held = point.sound;
        if !point.sound {
            return false;
        }
        if known && away[nearest] > 0.0 {
            let others = (0..POINTS).filter(|k| *k != nearest);
            let farthest =
                others.fold(
                    (nearest + 1) % POINTS,
                    |worst, k| if away[k] > away[worst] { k } else { worst },
                );
            self.at = farthest;
        }
        self.points[self.at] = point;
        true
    }

    fn differentiate(&mut self) {
        let plan = self.rod.plan();
        let tip = self.frame();
        let mut tool = tip.compose(self.rod.robot().tool());
        let lack = self.lack.0.last().copied().unwrap_or_default();
        let (spin, moved) = (part(&lack, 0), part(&lack, 3));
        tool.translation += moved + spin.cross(&tool.translation);
        tool.rotation = so3::exp(&spin) * tool.rotation;
        let count = self.grown.len();
        let moment = self.rod.scene().moment;
        self.motion.begin(tool, count);
        let shares = self.lack.0.windows(2).map(|w| about(&(w[1] - w[0]), &tool.translation));
        self.motion.place(&self.work.descent.here.frames, shares);
        let mut all: Vec<Vec<Vector6<f64>>> = Vec::with_capacity(count);
        for (k, grown) in self.grown.iter_mut().enumerate() {
            all.push(self.work.descent.respond(plan, &moment, k).to_vec());
            self.work.descent.lengthened(plan, grown);
        }
        for i in 1..=plan.data.len() {
            for (k, moved) in all.iter().enumerate() {
                let twist = moved[i] - moved[i - 1];
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
        // Under given tensions what tendons are over is counted from rest.
        let here = &self.work.descent.here;
        // Where an obstacle's function fails before the first balance there is none.
        let (Some(over), Some(tension)) = (here.over.get(k), here.tensions.get(k)) else {
            return 0.0;
        };
        over + self.lack.1[k] - self.rod.plan().compliance[k] * tension
    }

    fn displacement_slope(&self, k: usize, by: usize) -> f64 {
        let give = if k == by { self.rod.plan().compliance[k] } else { 0.0 };
        self.grown[by][k] - give
    }

    fn save(&mut self, place: usize) {
        self.kept[place] = self.points[self.at].clone();
    }

    fn restore(&mut self, place: usize) {
        self.reset();
        self.points[0].clone_from(&self.kept[place]);
    }

    fn state(&mut self) -> Option<State> {
        self.held.then(|| self.rod.written(&mut self.work).clone())
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
