//! Augmented Lagrangian M of a rod with bounded tendons among obstacles: its value at a shape.
//!
//! Every condition has an estimate of its multiplier and a small compliance c: a tendon that is too long by s pulls
//! with `T = max(0, (c T̂ + s) / (c + C))`, C its own compliance, a point at a gap g is pushed with
//! `λ = max(0, λ̂ - g / c)`. M is then smooth, and exact once the estimates are the multipliers.

use nalgebra::{Matrix3, Vector3, Vector6};

use super::potential::Potential;
use super::scene::{Clearance, Scene};
use crate::lie::Pose;
use crate::obstacle::{Fault, Near};
use crate::rod::plan::Plan;
use crate::rod::subsegment::Local;

/// Name of a contact condition: disk, point, obstacle, part of the obstacle.
pub(super) type ContactKey = (usize, usize, usize, u32);

/// Contact condition of a point before an obstacle, near enough to matter.
#[derive(Clone, Copy, Debug)]
pub(super) struct ActiveConstraint {
    pub(super) key: ContactKey,
    /// Place x of the robot's point in the base's frame \[m\].
    pub(super) position: Vector3<f64>,
    pub(super) near: Near,
    /// Distance left, the body's radius taken off: d(x) - r \[m\].
    pub(super) gap: f64,
    /// Compliance c \[m per unit\].
    pub(super) compliance: f64,
    /// Multiplier λ at these estimates.
    pub(super) force: f64,
    /// `λ̂ - gap / c`: the multiplier if contact could pull.
    pub(super) trial_force: f64,
}

impl ActiveConstraint {
    /// First-order change of the gap by displacements of the disks.
    pub(super) fn gap_change(&self, displacements: &[Vector6<f64>]) -> f64 {
        let twist = &displacements[self.key.0];
        let spin = Vector3::new(twist[0], twist[1], twist[2]);
        let velocity = Vector3::new(twist[3], twist[4], twist[5]) + spin.cross(&self.position);
        self.near.gradient.dot(&velocity)
    }
}

/// Shape with the value of its augmented Lagrangian, and all that this is made of.
#[derive(Clone, Debug, Default)]
pub(in crate::rod) struct Lagrangian {
    pub(in crate::rod) strains: Vec<f64>,
    /// Frame of every disk in the base's, and of every subsegment's end in its base disk's.
    pub(in crate::rod) frames: Vec<Pose>,
    pub(super) ends: Vec<Pose>,
    pub(super) constraints: Vec<ActiveConstraint>,
    /// Clearance of every point of every disk.
    pub(super) clearances: Vec<Clearance>,
    /// Lengths of the tendons beyond their bounds, `L - bound` (under given tensions: beyond those at rest), elasticity
    /// left out \[m\].
    pub(in crate::rod) excess: Vec<f64>,
    /// Tensions T.
    pub(in crate::rod) tensions: Vec<f64>,
    /// `(c T̂ + L - bound) / (c + C)`: the tensions if tendons could push.
    pub(super) trial_tensions: Vec<f64>,
    /// M.
    pub(super) value: f64,
    /// Sum of the sizes of all terms of M: what its rounding is relative to.
    pub(super) magnitude: f64,
    local: Local,
    near: Vec<Near>,
}

/// Input of the tendons.
#[derive(Clone, Copy, Debug)]
pub(super) enum TendonInput<'a> {
    /// Bounds of their lengths, elasticity left out (infinite: free) \[m\].
    Lengths(&'a [f64]),
    /// Tensions.
    Tensions(&'a [f64]),
}

/// Estimate λ̂ of a contact's multiplier, with the plane that the obstacle's part was there.
#[derive(Clone, Copy, Debug)]
pub(super) struct MultiplierEstimate {
    pub(super) key: ContactKey,
    pub(super) force: f64,
    normal: Vector3<f64>,
    offset: f64,
}

impl MultiplierEstimate {
    pub(super) fn new(key: ContactKey, force: f64, position: &Vector3<f64>, near: &Near) -> Self {
        let normal = near.gradient;
        Self { key, force, normal, offset: normal.dot(position) - near.distance }
    }

    pub(super) fn of(constraint: &ActiveConstraint) -> Self {
        Self::new(constraint.key, constraint.force, &constraint.position, &constraint.near)
    }

    /// The part's plane, for a point that does not see the part any more.
    fn plane(&self, position: &Vector3<f64>) -> Near {
        let distance = self.normal.dot(position) - self.offset;
        Near { distance, gradient: self.normal, hessian: Matrix3::zeros(), feature: self.key.3 }
    }
}

/// Estimates of the multipliers and the compliances that go with them.
#[derive(Clone, Debug, Default)]
pub(super) struct Estimates {
    /// T̂.
    pub(super) tensions: Vec<f64>,
    /// λ̂ where it is not zero, by key, in order.
    pub(super) contacts: Vec<MultiplierEstimate>,
    /// c of each tendon and of the contacts of each disk \[m per unit\].
    pub(super) tendon_compliance: Vec<f64>,
    pub(super) contact_compliance: Vec<f64>,
    /// Ratio of the first compliances to these.
    pub(super) stiffness: f64,
}

impl Estimates {
    /// Changes all compliances by a factor.
    pub(super) fn scale_compliance(&mut self, factor: f64) {
        self.stiffness /= factor;
        let all = self.tendon_compliance.iter_mut().chain(&mut self.contact_compliance);
        all.for_each(|compliance| *compliance *= factor);
    }

    /// Estimates of one point before one obstacle.
    fn of_point(&self, disk: usize, point: usize, obstacle: usize) -> &[MultiplierEstimate] {
        let name = (disk, point, obstacle);
        let name_of = |own: &MultiplierEstimate| (own.key.0, own.key.1, own.key.2);
        let start = self.contacts.partition_point(|own| name_of(own) < name);
        let rest = &self.contacts[start..];
        &rest[..rest.partition_point(|own| name_of(own) == name)]
    }
}

impl Lagrangian {
    /// Evaluates M at [`Lagrangian::strains`], under a share of the loads. Parts of obstacles count up to the detection
    /// distance \[m\].
    pub(super) fn evaluate(
        &mut self,
        plan: &Plan,
        scene: &Scene,
        tendons: TendonInput<'_>,
        load_share: f64,
        estimates: &Estimates,
        detection: f64,
    ) -> Result<(), Fault> {
        match plan.unknowns() {
            3 => self.set_strain_energy::<3>(plan),
            _ => self.set_strain_energy::<4>(plan),
        }
        self.tensions.clear();
        self.trial_tensions.clear();
        match tendons {
            TendonInput::Lengths(bounds) => self.add_bounded_tendons(plan, bounds, estimates),
            TendonInput::Tensions(tensions) => self.add_given_tensions(plan, tensions),
        }
        // - Σ f·p.
        for (frame, force) in self.frames.iter().zip(&scene.forces) {
            let work = load_share * force.dot(&frame.translation);
            self.value -= work;
            self.magnitude += work.abs();
        }
        self.add_contacts(scene, estimates, detection)
    }

    /// Frames, tendon lengths and strain energy E of the strains.
    fn set_strain_energy<const D: usize>(&mut self, plan: &Plan) {
        let width = plan.width();
        self.frames.clear();
        self.ends.clear();
        self.excess.clear();
        self.excess.resize(plan.rest_lengths.len(), 0.0);
        self.value = 0.0;
        let mut frame = Pose::identity();
        self.frames.push(frame);
        for (i, data) in plan.data.iter().enumerate() {
            let strains = &self.strains[i * width..(i + 1) * width];
            self.local.place::<D>(plan.settings.subsegment, data, strains);
            let end = self.local.end();
            frame = frame.compose(&end);
            self.frames.push(frame);
            self.ends.push(end);
            for strain in strains.chunks_exact(D) {
                data.elasticity.add_energy(strain, &mut self.value);
            }
            for piece in &plan.pieces[plan.starts[i]..plan.starts[i + 1]] {
                self.excess[piece.tendon] += (end.transform(&piece.to) - piece.from).norm();
            }
        }
        self.magnitude = self.value;
    }

    /// Adds `½ (c + C) T²` of tendons with bounded lengths.
    fn add_bounded_tendons(&mut self, plan: &Plan, bounds: &[f64], estimates: &Estimates) {
        for (k, bound) in bounds.iter().enumerate() {
            let c = estimates.tendon_compliance[k];
            let whole = c + plan.compliance[k];
            self.excess[k] -= bound;
            let trial = (c * estimates.tensions[k] + self.excess[k]) / whole;
            let tension = if bound.is_finite() { trial.max(0.0) } else { 0.0 };
            self.tensions.push(tension);
            self.trial_tensions.push(trial);
            self.value += 0.5 * whole * tension * tension;
            self.magnitude += 0.5 * whole * tension * tension;
        }
    }

    /// Adds `T (L - L_rest)` of tendons with given tensions.
    fn add_given_tensions(&mut self, plan: &Plan, tensions: &[f64]) {
        for (k, tension) in tensions.iter().enumerate() {
            self.magnitude += tension * self.excess[k];
            self.excess[k] -= plan.rest_lengths[k];
            self.value += tension * self.excess[k];
        }
        self.tensions.extend_from_slice(tensions);
        self.trial_tensions.extend_from_slice(tensions);
    }

    /// Adds `½ c λ²` of all points before all obstacles.
    fn add_contacts(
        &mut self,
        scene: &Scene,
        estimates: &Estimates,
        detection: f64,
    ) -> Result<(), Fault> {
        self.constraints.clear();
        self.clearances.clear();
        for (disk, points) in scene.points.iter().enumerate() {
            let (frame, c) = (&self.frames[disk], estimates.contact_compliance[disk]);
            for (p, point) in points.iter().enumerate() {
                // x, and its clearance from all obstacles.
                let position = frame.transform(&point.position);
                let mut clearance = Clearance::new(position);
                for (o, obstacle) in scene.obstacles.iter().enumerate() {
                    // Parts within the detection distance, and those that pushed the point before.
                    self.near.clear();
                    obstacle.constraints(&position, detection + point.radius, &mut self.near)?;
                    for near in &self.near {
                        clearance.include(near, point.radius);
                    }
                    let earlier = estimates.of_point(disk, p, o);
                    let is_ridge = add_unseen_parts(&mut self.near, earlier, &position);
                    for near in &self.near {
                        // λ = max(0, λ̂ - gap / c).
                        let gap = near.distance - point.radius;
                        let key = (disk, p, o, near.feature);
                        let own = earlier.iter().find(|own| is_ridge || own.key == key);
                        let trial_force = own.map_or(0.0, |own| own.force) - gap / c;
                        let force = trial_force.max(0.0);
                        // Conditions that push, or may push at the end of a step.
                        if force > 0.0 || gap < detection {
                            self.constraints.push(ActiveConstraint {
                                key,
                                position,
                                near: *near,
                                gap,
                                compliance: c,
                                force,
                                trial_force,
                            });
                        }
                        // ½ c λ².
                        let term = 0.5 * c * force * force;
                        self.value += term;
                        self.magnitude += term;
                    }
                }
                self.clearances.push(clearance);
            }
        }
        self.constraints.sort_by_key(|constraint| constraint.key);
        Ok(())
    }

    /// Potentials of the disks at this shape, where the `active` constraints push and no others.
    pub(super) fn potentials(
        &self,
        scene: &Scene,
        load_share: f64,
        active: &[bool],
        out: &mut Vec<Potential>,
    ) {
        out.clear();
        out.resize(self.frames.len(), Potential::zero());
        if scene.has_loads {
            for ((disk, frame), force) in out.iter_mut().zip(&self.frames).zip(&scene.forces) {
                disk.add_point(&frame.translation, &(force * -load_share), &Matrix3::zeros());
            }
            if let Some(tip) = out.last_mut() {
                tip.add_moment(&(scene.moment * -load_share));
            }
        }
        for (own, _) in self.constraints.iter().zip(active).filter(|(_, active)| **active) {
            let n = own.near.gradient;
            let curvature = n * n.transpose() / own.compliance - own.near.hessian * own.force;
            out[own.key.0].add_point(&own.position, &(n * -own.trial_force), &curvature);
        }
    }
}

/// Adds the planes of parts that pushed a point and are not seen from it any more, lest M jump. Round a ridge the next
/// part takes the estimate over instead (true), in a valley the plane goes on.
fn add_unseen_parts(
    parts: &mut Vec<Near>,
    earlier: &[MultiplierEstimate],
    position: &Vector3<f64>,
) -> bool {
    let seen = parts.len();
    for own in earlier {
        if parts[..seen].iter().any(|near| near.feature == own.key.3) {
            continue;
        }
        let plane = own.plane(position);
        if earlier.len() == 1 && seen == 1 && parts[0].distance >= plane.distance {
            return true;
        }
        parts.push(plane);
    }
    false
}
