//! The augmented Lagrangian of a rod with bounded tendons among obstacles: its value at a shape.
//!
//! Every condition has a multiplier's estimate and a small compliance: a tendon that is too long by s pulls with
//! `max(0, (c T̂ + s) / (c + C))`, C its own compliance, a point that has sunk in by s is pushed with
//! `max(0, λ̂ + s / c)`. What is minimised is then smooth, and exact once the estimates are the multipliers.

use nalgebra::{Matrix3, Vector3, Vector6};

use super::potential::Field;
use super::scene::Scene;
use crate::lie::Pose;
use crate::obstacle::{Fault, Near};
use crate::rod::plan::Plan;
use crate::rod::subsegment::Local;

/// Name of a condition: disk, point, obstacle, part of the obstacle.
pub(super) type Key = (usize, usize, usize, u32);

/// A point before an obstacle.
#[derive(Clone, Copy, Debug)]
pub(in crate::rod) struct ActiveConstraint {
    pub(super) key: Key,
    /// Place of the robot's point in the base's frame \[m\].
    pub(super) at: Vector3<f64>,
    pub(super) near: Near,
    /// Distance left, the body's radius taken off \[m\].
    pub(super) gap: f64,
    /// Compliance \[m per unit\].
    pub(super) give: f64,
    /// Multiplier, at these estimates, and what it would be if contact could pull.
    pub(super) force: f64,
    pub(super) push: f64,
}

impl ActiveConstraint {
    /// What the disks' first-order displacements add to the gap.
    pub(in crate::rod) fn closing(&self, moved: &[Vector6<f64>]) -> f64 {
        let moved = &moved[self.key.0];
        let spin = Vector3::new(moved[0], moved[1], moved[2]);
        let velocity = Vector3::new(moved[3], moved[4], moved[5]) + spin.cross(&self.at);
        self.near.gradient.dot(&velocity)
    }
}

/// A place of a point, with the distance left to the nearest obstacle and the way from there.
#[derive(Clone, Copy, Debug)]
pub(in crate::rod) struct Clearance {
    pub(super) at: Vector3<f64>,
    pub(super) clear: f64,
    pub(super) away: Vector3<f64>,
}

impl Clearance {
    pub(in crate::rod) fn new(at: Vector3<f64>) -> Self {
        Self { at, clear: f64::INFINITY, away: Vector3::zeros() }
    }

    /// Counts an obstacle's part in, for a point of a radius.
    pub(in crate::rod) fn count(&mut self, near: &Near, radius: f64) {
        if near.distance - radius < self.clear {
            (self.clear, self.away) = (near.distance - radius, near.gradient);
        }
    }
}

/// A shape and what it is worth.
#[derive(Clone, Debug, Default)]
pub(in crate::rod) struct Lagrangian {
    pub(in crate::rod) strains: Vec<f64>,
    /// Frame of every disk in the base's, and of every subsegment's end in its base disk's.
    pub(in crate::rod) frames: Vec<Pose>,
    pub(super) ends: Vec<Pose>,
    pub(super) entries: Vec<ActiveConstraint>,
    /// Every point of every disk.
    pub(super) spots: Vec<Clearance>,
    /// What tendons are longer than their bounds (under given tensions, than at rest), elasticity left out \[m\], and
    /// their tensions.
    pub(in crate::rod) over: Vec<f64>,
    pub(in crate::rod) tensions: Vec<f64>,
    /// What these would be if tendons could push.
    pub(super) pulls: Vec<f64>,
    pub(in crate::rod) value: f64,
    /// Sum of the sizes of what the value is made of: its rounding.
    pub(super) size: f64,
    local: Local,
    near: Vec<Near>,
}

/// What is given of the tendons.
#[derive(Clone, Copy, Debug)]
pub(super) enum TendonInput<'a> {
    /// How long they may be at most, elasticity left out (infinite: free) \[m\].
    Lengths(&'a [f64]),
    /// Tensions.
    Tensions(&'a [f64]),
}

/// An estimate of a contact's multiplier, with the plane that the obstacle's part was there.
#[derive(Clone, Copy, Debug)]
pub(in crate::rod) struct MultiplierEstimate {
    pub(super) key: Key,
    pub(super) force: f64,
    normal: Vector3<f64>,
    offset: f64,
}

impl MultiplierEstimate {
    pub(in crate::rod) fn new(key: Key, force: f64, at: &Vector3<f64>, near: &Near) -> Self {
        let normal = near.gradient;
        Self { key, force, normal, offset: normal.dot(at) - near.distance }
    }

    pub(in crate::rod) fn of(entry: &ActiveConstraint) -> Self {
        Self::new(entry.key, entry.force, &entry.at, &entry.near)
    }

    /// The part as it was, for a point from which it is not seen any more.
    fn near(&self, at: &Vector3<f64>) -> Near {
        let distance = self.normal.dot(at) - self.offset;
        Near { distance, gradient: self.normal, hessian: Matrix3::zeros(), feature: self.key.3 }
    }
}

/// Estimates of the multipliers and the compliances that go with them.
#[derive(Clone, Debug, Default)]
pub(in crate::rod) struct Estimates {
    pub(in crate::rod) tensions: Vec<f64>,
    /// Those that are not zero, by key, in order.
    pub(super) forces: Vec<MultiplierEstimate>,
    /// Of each tendon and of contacts of each disk \[m per unit\].
    pub(super) tendon_give: Vec<f64>,
    pub(super) gives: Vec<f64>,
    /// How many times stiffer than at first they are.
    pub(super) stiffness: f64,
}

impl Estimates {
    /// Changes all compliances by a factor.
    pub(in crate::rod) fn scale(&mut self, factor: f64) {
        self.stiffness /= factor;
        let all = self.tendon_give.iter_mut().chain(&mut self.gives);
        all.for_each(|give| *give *= factor);
    }

    /// Those of one point before one obstacle.
    fn of(&self, disk: usize, point: usize, obstacle: usize) -> &[MultiplierEstimate] {
        let name = (disk, point, obstacle);
        let start = self.forces.partition_point(|h| (h.key.0, h.key.1, h.key.2) < name);
        let rest = &self.forces[start..];
        &rest[..rest.partition_point(|h| (h.key.0, h.key.1, h.key.2) == name)]
    }
}

impl Lagrangian {
    /// Evaluates the strains in [`Lagrangian::strains`] for what is given of the tendons and a share of the loads.
    /// `reach`: how far off parts of obstacles are looked at \[m\].
    pub(in crate::rod::contact) fn evaluate(
        &mut self,
        plan: &Plan,
        scene: &Scene,
        drive: TendonInput<'_>,
        share: f64,
        estimates: &Estimates,
        reach: f64,
    ) -> Result<(), Fault> {
        match plan.unknowns() {
            3 => self.place::<3>(plan),
            _ => self.place::<4>(plan),
        }
        self.tensions.clear();
        self.pulls.clear();
        match drive {
            TendonInput::Lengths(bounds) => self.hold(plan, bounds, estimates),
            TendonInput::Tensions(tensions) => self.pull(plan, tensions),
        }
        for (frame, force) in self.frames.iter().zip(&scene.forces) {
            let work = share * force.dot(&frame.translation);
            self.value -= work;
            self.size += work.abs();
        }
        self.touch(scene, estimates, reach)
    }

    /// Tendons of bounded length.
    fn hold(&mut self, plan: &Plan, bounds: &[f64], estimates: &Estimates) {
        for (k, bound) in bounds.iter().enumerate() {
            let give = estimates.tendon_give[k];
            let all = give + plan.compliance[k];
            self.over[k] -= bound;
            let pull = (give * estimates.tensions[k] + self.over[k]) / all;
            let tension = if bound.is_finite() { pull.max(0.0) } else { 0.0 };
            self.tensions.push(tension);
            self.pulls.push(pull);
            self.value += 0.5 * all * tension * tension;
            self.size += 0.5 * all * tension * tension;
        }
    }

    /// Tendons of given tension.
    fn pull(&mut self, plan: &Plan, tensions: &[f64]) {
        for (k, tension) in tensions.iter().enumerate() {
            self.size += tension * self.over[k];
            self.over[k] -= plan.rest_lengths[k];
            self.value += tension * self.over[k];
        }
        self.tensions.extend_from_slice(tensions);
        self.pulls.extend_from_slice(tensions);
    }

    fn place<const D: usize>(&mut self, plan: &Plan) {
        let size = plan.width();
        self.frames.clear();
        self.ends.clear();
        self.over.clear();
        self.over.resize(plan.rest_lengths.len(), 0.0);
        self.value = 0.0;
        let mut frame = Pose::identity();
        self.frames.push(frame);
        for (i, data) in plan.data.iter().enumerate() {
            let strains = &self.strains[i * size..(i + 1) * size];
            self.local.place::<D>(plan.settings.subsegment, data, strains);
            let end = self.local.end();
            frame = frame.compose(&end);
            self.frames.push(frame);
            self.ends.push(end);
            for strain in strains.chunks_exact(D) {
                data.elasticity.add_energy(strain, &mut self.value);
            }
            for piece in &plan.pieces[plan.starts[i]..plan.starts[i + 1]] {
                self.over[piece.tendon] += (end.transform(&piece.to) - piece.from).norm();
            }
        }
        self.size = self.value;
    }

    /// The points before the obstacles.
    fn touch(&mut self, scene: &Scene, estimates: &Estimates, reach: f64) -> Result<(), Fault> {
        self.entries.clear();
        self.spots.clear();
        for (disk, points) in scene.points.iter().enumerate() {
            let (frame, give) = (&self.frames[disk], estimates.gives[disk]);
            for (p, point) in points.iter().enumerate() {
                let at = frame.transform(&point.at);
                let mut spot = Clearance::new(at);
                for (o, obstacle) in scene.obstacles.iter().enumerate() {
                    self.near.clear();
                    obstacle.constraints(&at, reach + point.radius, &mut self.near)?;
                    for near in &self.near {
                        spot.count(near, point.radius);
                    }
                    let held = estimates.of(disk, p, o);
                    let moved = keep_parts(&mut self.near, held, &at);
                    for k in 0..self.near.len() {
                        let near = self.near[k];
                        let gap = near.distance - point.radius;
                        let key = (disk, p, o, near.feature);
                        let own = held.iter().find(|held| moved || held.key == key);
                        let push = own.map_or(0.0, |held| held.force) - gap / give;
                        let force = push.max(0.0);
                        if force > 0.0 || gap < reach {
                            self.entries.push(ActiveConstraint {
                                key,
                                at,
                                near,
                                gap,
                                give,
                                force,
                                push,
                            });
                        }
                        let worth = 0.5 * give * force * force;
                        self.value += worth;
                        self.size += worth;
                    }
                }
                self.spots.push(spot);
            }
        }
        self.entries.sort_by_key(|entry| entry.key);
        Ok(())
    }

    /// Potentials of the disks at this shape, where the entries of `active` push and no others.
    pub(in crate::rod::contact) fn fields(
        &self,
        scene: &Scene,
        share: f64,
        active: &[bool],
        out: &mut Vec<Field>,
    ) {
        out.clear();
        out.resize(self.frames.len(), Field::zero());
        if scene.loaded {
            for ((field, frame), force) in out.iter_mut().zip(&self.frames).zip(&scene.forces) {
                field.add_point(&frame.translation, &(force * -share), &Matrix3::zeros());
            }
            if let Some(tip) = out.last_mut() {
                tip.add_moment(&(scene.moment * -share));
            }
        }
        for (entry, _) in self.entries.iter().zip(active).filter(|(_, active)| **active) {
            let n = entry.near.gradient;
            let curvature = n * n.transpose() / entry.give - entry.near.hessian * entry.force;
            out[entry.key.0].add_point(&entry.at, &(n * -entry.push), &curvature);
        }
    }
}

/// What pushed a point pushes on where the part is not seen any more, lest the value jump: round a ridge the next
/// part takes over (true), in a valley the plane goes on.
fn keep_parts(parts: &mut Vec<Near>, held: &[MultiplierEstimate], at: &Vector3<f64>) -> bool {
    let seen = parts.len();
    for one in held {
        if parts[..seen].iter().any(|near| near.feature == one.key.3) {
            continue;
        }
        let near = one.near(at);
        if held.len() == 1 && seen == 1 && parts[0].distance >= near.distance {
            return true;
        }
        parts.push(near);
    }
    false
}
