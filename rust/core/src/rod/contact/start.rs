//! Start of a solve: the contacts of an earlier shape, and the depth of the undeformed robot in the obstacles.

use super::lagrangian::MultiplierEstimate;
use super::model::{LoadedRod, Scratch, TOUCHING};
use super::scene::DiskPoint;
use crate::lie::Pose;
use crate::model::{Model as _, State};
use crate::obstacle::{Fault, Near};

impl LoadedRod<'_> {
    /// Makes the contact forces of an earlier shape the estimates, where the scene still has what they name.
    pub(in crate::rod) fn recall_contacts(&self, start: &State, work: &mut Scratch) {
        let (plan, scene, base) = (self.plan(), self.scene(), self.robot().base());
        let detection = self.detection_distance();
        let mut near = Vec::new();
        for contact in start.contacts.iter().filter(|c| c.disk < scene.points.len()) {
            // The point and the obstacle that the contact names.
            let is_own = |p: &DiskPoint| (p.kind, p.tendon) == (contact.kind, contact.tendon);
            let points = &scene.points[contact.disk];
            let (Some(p), Some(obstacle)) =
                (points.iter().position(is_own), scene.obstacles.get(contact.obstacle))
            else {
                continue;
            };
            // The part of the obstacle whose normal is nearest to the contact's.
            let position = base.inverse().transform(&contact.point);
            let normal = base.rotation.tr_mul(&contact.normal);
            near.clear();
            // A fault comes again, and is reported, where the shape is evaluated.
            if obstacle.constraints(&position, detection + points[p].radius, &mut near).is_err() {
                return;
            }
            let along = |part: &Near| part.gradient.dot(&normal);
            let Some(part) = near.iter().max_by(|a, b| along(a).total_cmp(&along(b))) else {
                continue;
            };
            let key = (contact.disk, p, contact.obstacle, part.feature);
            let force = contact.force.norm() / plan.unit;
            let estimate = MultiplierEstimate::new(key, force, &position, part);
            work.minimizer.estimates.contacts.push(estimate);
        }
        work.minimizer.estimates.contacts.sort_by_key(|own| own.key);
    }

    /// Measures how deep the undeformed robot is in the obstacles.
    pub(in crate::rod) fn measure_penetration(&self, work: &mut Scratch) -> Result<(), Fault> {
        work.initial_penetration = None;
        let mut frame = Pose::identity();
        let (plan, scene) = (self.plan(), self.scene());
        for (disk, points) in scene.points.iter().enumerate() {
            if disk > 0 {
                frame = frame.compose(&work.chain.ends[disk - 1]);
            }
            for point in points {
                for (o, obstacle) in scene.obstacles.iter().enumerate() {
                    let near = obstacle.nearest(&frame.transform(&point.position))?;
                    let depth = point.radius - near.distance;
                    let deepest = work.initial_penetration.map(|(depth, _, _)| depth);
                    if depth > deepest.unwrap_or(TOUCHING * plan.total_length()) {
                        work.initial_penetration = Some((depth, o, disk));
                    }
                }
            }
        }
        Ok(())
    }
}
