//! Rods nearest to places, whatever bends them: what tendons and rest shapes cannot better, and where to seek.

use std::f64::consts::{PI, TAU};
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::{DMatrix, DVector, Vector3};

use super::bend_descent::{BendProblem, clamp_bend, descend};
use crate::error::InvalidInput;
use crate::lie::Pose;
use crate::robot::Robot;
use crate::rod::Subsegment;
use crate::rod::element::Element;

/// Steps of every start, and of the nearest that go on.
const FIRST: usize = 12;
const STEPS: usize = 200;
const KEPT: usize = 12;
/// Places nearer to each other than this share of the length are the same.
const ALIKE: f64 = 1e-2;
/// Largest bends of pursuits \[rad\], turns of arcs, and directions of these.
const CLAMPS: [f64; 4] = [0.3, 0.7, 1.5, PI];
const TURNS: [f64; 3] = [0.3, 0.8, 1.5];
const DIRECTIONS: usize = 8;

/// A rod's bends, and where they take its disks.
#[derive(Clone, Debug)]
pub(super) struct NearestRod {
    pub(super) bends: Vec<Vector3<f64>>,
    /// Disks 1 to n \[m\].
    pub(super) places: Vec<Vector3<f64>>,
    /// Sum of squared distances over the robot's length.
    pub(super) cost: f64,
}

/// Subsegments that bend as they like, with the twists they have.
pub(super) struct NearestRodProblem<'a> {
    pub(super) robot: &'a Robot,
    pub(super) targets: &'a [Vector3<f64>],
    pub(super) kind: Subsegment,
    pub(super) twists: &'a [f64],
    /// Largest bend of a subsegment \[rad\].
    pub(super) most: f64,
    pub(super) stop: &'a AtomicBool,
}

/// Bends, and the chain that they make.
pub(super) struct BentRod {
    bends: Vec<Vector3<f64>>,
    /// Frames of disks 0 to n.
    frames: Vec<Pose>,
    elements: Vec<Element>,
    residual: DVector<f64>,
}

impl BendProblem for NearestRodProblem<'_> {
    const HEADWAY: f64 = 1e-8;

    type Point = BentRod;

    fn bends<'a>(&self, point: &'a BentRod) -> &'a [Vector3<f64>] {
        &point.bends
    }

    fn residual<'a>(&self, point: &'a BentRod) -> &'a DVector<f64> {
        &point.residual
    }

    fn jacobian(&self, point: &BentRod) -> Result<DMatrix<f64>, InvalidInput> {
        let n = self.targets.len();
        let per_length = 1.0 / self.robot.backbone().total_length();
        let mut out = DMatrix::zeros(3 * n, 2 * n);
        for (i, element) in point.elements.iter().enumerate() {
            let turn = point.frames[i].rotation * per_length;
            for c in 0..2 {
                let (sweep, spin) = (turn * element.sweep.column(c), turn * element.spin.column(c));
                for j in i..n {
                    let lever = point.frames[j + 1].translation - point.frames[i + 1].translation;
                    out.fixed_view_mut::<3, 1>(3 * j, 2 * i + c)
                        .copy_from(&(sweep + spin.cross(&lever)));
                }
            }
        }
        Ok(out)
    }

    fn at(&self, bends: Vec<Vector3<f64>>, _: &BentRod) -> Result<Option<BentRod>, InvalidInput> {
        Ok(Some(self.bend_rod(bends)))
    }

    fn is_met(&self, point: &BentRod) -> bool {
        point.residual.amax() < 1e-15
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

impl NearestRodProblem<'_> {
    /// The minima that were found, the nearest first.
    pub(super) fn minima(&self, own: &[Vector3<f64>]) -> Result<Vec<NearestRod>, InvalidInput> {
        let mut found = Vec::new();
        for start in self.starts(own) {
            found.push(descend(self, self.bend_rod(start), self.most, FIRST)?.0);
        }
        let mut minima = Vec::new();
        for point in self.distinct(found) {
            minima.push(descend(self, point, self.most, STEPS)?.0);
        }
        let nearest = |point: BentRod| NearestRod {
            cost: cost(&point),
            places: point.frames.iter().skip(1).map(|frame| frame.translation).collect(),
            bends: point.bends,
        };
        Ok(self.distinct(minima).into_iter().map(nearest).collect())
    }

    fn bend_rod(&self, bends: Vec<Vector3<f64>>) -> BentRod {
        let lengths = self.robot.backbone().lengths();
        let mut frames = vec![*self.robot.base()];
        let mut elements = Vec::with_capacity(bends.len());
        for (bend, length) in bends.iter().zip(lengths) {
            let element = Element::new(self.kind, *length, *bend, 0.0);
            frames.push(frames[frames.len() - 1].compose(&element.end));
            elements.push(element);
        }
        let size = self.robot.backbone().total_length();
        let off = frames.iter().skip(1).zip(self.targets).flat_map(|(frame, target)| {
            let off = (frame.translation - target) / size;
            [off.x, off.y, off.z]
        });
        let residual = DVector::from_vec(off.collect());
        BentRod { bends, frames, elements, residual }
    }

    /// Bends to start from: pursuits of the places and of the steps between them, straight, the robot's own,
    /// arcs of several turns towards all sides. None is quite in a plane, which would keep a descent in it.
    fn starts(&self, own: &[Vector3<f64>]) -> Vec<Vec<Vector3<f64>>> {
        let n = self.targets.len();
        let mut out = Vec::new();
        for most in CLAMPS {
            out.push(self.pursuit(most, true));
            out.push(self.pursuit(most, false));
        }
        out.push(own.to_vec());
        out.push(vec![Vector3::zeros(); n]);
        for turns in TURNS {
            for k in 0..DIRECTIONS {
                let (sine, cosine) = (TAU * k as f64 / DIRECTIONS as f64).sin_cos();
                out.push(vec![Vector3::new(cosine, sine, 0.0) * (TAU * turns / n as f64); n]);
            }
        }
        for (s, start) in out.iter_mut().enumerate() {
            for (i, bend) in start.iter_mut().enumerate() {
                let phase = (7 * s + 3 * i) as f64;
                bend.x += 0.02 * phase.sin();
                bend.y += 0.02 * (1.7 * phase).cos();
                bend.z = self.twists[i];
                *bend = clamp_bend(bend, self.most);
            }
        }
        out
    }

    /// Bends that point every subsegment at its place, or along the step to it from the place before.
    fn pursuit(&self, most: f64, at_place: bool) -> Vec<Vector3<f64>> {
        let mut frame = *self.robot.base();
        let mut before = frame.translation;
        let mut bends = Vec::with_capacity(self.targets.len());
        for (target, length) in self.targets.iter().zip(self.robot.backbone().lengths()) {
            let from = if at_place { frame.translation } else { before };
            let aim = frame.rotation.tr_mul(&(target - from));
            let across = aim.xy().norm();
            let angle = (2.0 * across.atan2(aim.z)).min(most);
            let share = if across > 0.0 { angle / across } else { 0.0 };
            let bend = Vector3::new(-aim.y, aim.x, 0.0) * share;
            frame = frame.compose(&Element::new(self.kind, *length, bend, 0.0).end);
            before = *target;
            bends.push(bend);
        }
        bends
    }

    /// The nearest whose disks are in different places, nearest first: of mirror images, which come as near, the
    /// tendons may reach but one.
    fn distinct(&self, mut points: Vec<BentRod>) -> Vec<BentRod> {
        points.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
        let within = ALIKE * self.robot.backbone().total_length();
        let mut kept: Vec<BentRod> = Vec::new();
        for point in points {
            let same = |other: &BentRod| {
                let mut pairs = point.frames.iter().zip(&other.frames);
                pairs.all(|(a, b)| (a.translation - b.translation).amax() <= within)
            };
            if kept.len() < KEPT && !kept.iter().any(same) {
                kept.push(point);
            }
        }
        kept
    }
}

fn cost(point: &BentRod) -> f64 {
    point.residual.norm_squared()
}
