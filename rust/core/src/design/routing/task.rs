//! Task of a routing design, and robots with the holes that it tries.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::{DVector, Vector2, Vector3};

use super::settings::RoutingSettings;
use crate::error::InvalidInput;
use crate::inverse::Range;
use crate::lie::so3;
use crate::model::State;
use crate::robot::{PerDisk, Robot, Routing, Tendon};
use crate::rod::Plan;

/// Holes per disk that a search uses where azimuths are free.
pub(super) const FINE: usize = 24;

/// Hole of every tendon on every disk: `holes[disk][tendon]`, 0 beyond a tendon's end.
pub(super) type Holes = Vec<Vec<usize>>;

/// Azimuths \[rad\] or radii \[m\] of every tendon's holes, from disk 0 to its end.
pub(super) type PerHole = Vec<Vec<f64>>;

/// A wanted shape, and what may be used to reach it.
pub(super) struct Task<'a> {
    pub(super) robot: &'a Robot,
    pub(super) targets: &'a [Vector3<f64>],
    pub(super) bounds: Option<&'a Range>,
    pub(super) settings: &'a RoutingSettings,
    pub(super) stop: &'a Arc<AtomicBool>,
    /// Plan of the robot's own routing.
    pub(super) plan: Plan,
    /// Radii of the robot's own holes.
    pub(super) radii: PerHole,
}

impl Task<'_> {
    pub(super) fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    pub(super) fn tendons(&self) -> usize {
        self.radii.len()
    }

    pub(super) fn disks(&self) -> usize {
        self.targets.len() + 1
    }

    /// Disk where a tendon terminates.
    pub(super) fn end(&self, tendon: usize) -> usize {
        self.radii[tendon].len() - 1
    }

    pub(super) fn length(&self) -> f64 {
        self.robot.backbone().total_length()
    }

    /// Bounds of a displacement \[m\].
    pub(super) fn bound(&self, tendon: usize) -> (f64, f64) {
        self.bounds.map_or((f64::NEG_INFINITY, f64::INFINITY), |bounds| bounds.at(tendon))
    }

    /// Residual of the disks from the first: places minus wanted ones, one coordinate after the other \[m\].
    pub(super) fn residual(&self, state: &State) -> DVector<f64> {
        let frames = state.frames.iter().skip(1).zip(self.targets);
        let off = frames.flat_map(|(frame, target)| {
            let off = frame.translation - target;
            [off.x, off.y, off.z]
        });
        DVector::from_iterator(3 * self.targets.len(), off)
    }

    /// Distance of every disk from its place, disk 0 first \[m\].
    pub(super) fn errors(&self, state: &State) -> Vec<f64> {
        let frames = state.frames.iter().skip(1).zip(self.targets);
        let off = frames.map(|(frame, target)| (frame.translation - target).norm());
        std::iter::once(0.0).chain(off).collect()
    }

    /// Sum of the squared distances \[m²\].
    pub(super) fn value(&self, state: &State) -> f64 {
        self.residual(state).norm_squared()
    }

    /// Azimuth of a hole.
    pub(super) fn azimuth(&self, hole: usize, count: usize) -> f64 {
        self.settings.azimuth + TAU / count as f64 * hole as f64
    }

    /// Permission to move on from one hole to another.
    pub(super) fn allows(&self, from: usize, to: usize, count: usize) -> bool {
        let jump = from.abs_diff(to);
        self.settings.max_jump.is_none_or(|most| jump.min(count - jump) <= most)
    }

    /// Place of a hole on a disk, by its number.
    pub(super) fn hole(
        &self,
        tendon: usize,
        disk: usize,
        hole: usize,
        count: usize,
    ) -> Vector3<f64> {
        let (azimuth, radius) = (self.azimuth(hole, count), self.radii[tendon][disk]);
        Vector3::new(radius * azimuth.cos(), radius * azimuth.sin(), 0.0)
    }

    /// The numbers of a tendon's holes, disk 0 to its end.
    pub(super) fn indices(&self, holes: &Holes, tendon: usize) -> Vec<usize> {
        holes[..=self.end(tendon)].iter().map(|row| row[tendon]).collect()
    }

    /// Azimuths of holes given by number.
    pub(super) fn azimuths(&self, holes: &Holes, count: usize) -> PerHole {
        let numbers = (0..self.tendons()).map(|k| self.indices(holes, k));
        numbers.map(|own| own.iter().map(|hole| self.azimuth(*hole, count)).collect()).collect()
    }

    /// The robot with its tendons through other holes.
    pub(super) fn with_routing(
        &self,
        routing: impl Fn(usize, PerDisk) -> Routing,
        radii: &PerHole,
    ) -> Result<Robot, InvalidInput> {
        let tendons = self.robot.tendons().iter().enumerate().map(|(k, tendon)| {
            let own = &radii[k];
            let same = own.iter().all(|radius| *radius == own[0]);
            let radius = if same { PerDisk::Same(own[0]) } else { PerDisk::Each(own.clone()) };
            let name = tendon.name().map(str::to_owned);
            Tendon::new(routing(k, radius), tendon.end(), tendon.stiffness(), name)
        });
        self.robot.with_tendons(tendons.collect::<Result<_, _>>()?)
    }

    /// The robot with its tendons through holes given by number.
    pub(super) fn with_holes(&self, holes: &Holes, count: usize) -> Result<Robot, InvalidInput> {
        let routing = |k: usize, radius| Routing::Holes {
            indices: self.indices(holes, k),
            count,
            radius,
            azimuth: self.settings.azimuth,
        };
        self.with_routing(routing, &self.radii)
    }

    /// The robot with its tendons through holes given by azimuth and radius.
    pub(super) fn with_azimuths(
        &self,
        azimuths: &PerHole,
        radii: &PerHole,
    ) -> Result<Robot, InvalidInput> {
        let routing = |k: usize, radius| Routing::Angles {
            azimuth: PerDisk::Each(azimuths[k].clone()),
            radius,
        };
        self.with_routing(routing, radii)
    }

    /// Moment in every subsegment, as a share of the bending stiffness, by which the rest shape would bend to the
    /// wanted places without torsion: the direction of bending's azimuth, and the amount \[rad\].
    pub(super) fn bends(&self) -> Vec<(f64, f64)> {
        let mut frame = *self.robot.base();
        let mut out = Vec::with_capacity(self.targets.len());
        for (i, target) in self.targets.iter().enumerate() {
            let chord = frame.rotation.tr_mul(&(target - frame.translation));
            let across = chord.xy().norm();
            // No subsegment bends beyond half a turn; what is straight behind may be on any side.
            let angle = (2.0 * across.atan2(chord.z)).min(PI);
            let side = if across > 0.0 { chord.xy() / across } else { Vector2::x() };
            let turn = Vector3::new(-side.y, side.x, 0.0) * angle;
            frame.rotation *= so3::exp(&turn);
            frame.translation = *target;
            let bent = turn - self.robot.backbone().rest(i);
            out.push(((-bent.x).atan2(bent.y), bent.xy().norm()));
        }
        out
    }

    /// Share of all bending that lies before each disk from the first: what is pulled until there.
    pub(super) fn shares(&self) -> Vec<f64> {
        let bends = self.bends();
        let whole: f64 = bends.iter().map(|(_, angle)| angle).sum();
        let mut sum = 0.0;
        let share = bends.iter().map(|(_, angle)| {
            sum += angle;
            if whole > 0.0 { sum / whole } else { 1.0 }
        });
        share.collect()
    }

    /// Tension, in the plan's unit, that bends a subsegment by an angle when all of it pulls on one side.
    pub(super) fn tension_for(&self, subsegment: usize, angle: f64) -> f64 {
        let radius = self.radii.iter().filter_map(|own| own.get(subsegment + 1));
        let radius = radius.fold(0.0_f64, |most, r| most.max(*r));
        if radius > 0.0 { angle * self.plan.stiffness(subsegment) / radius } else { 0.0 }
    }
}
