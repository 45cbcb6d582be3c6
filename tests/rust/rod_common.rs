//! What the tests of the rod share.

use std::f64::consts::TAU;

use nalgebra::{Matrix4, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use tdcr::rod::{Plan, Rod, RodSettings, Scratch};
use tdcr::{Shape, Status};

pub(crate) fn rod_shape(robot: &Robot, settings: RodSettings, displacements: &[f64]) -> Shape {
    let plan = Plan::new(robot, settings).unwrap();
    Rod::new(robot, &plan).shape(displacements).unwrap()
}

/// The shape, which must have converged.
pub(crate) fn solved(robot: &Robot, settings: RodSettings, displacements: &[f64]) -> Shape {
    let shape = rod_shape(robot, settings, displacements);
    assert_eq!(shape.report.status, Status::Converged, "{} ({displacements:?})", shape.message);
    assert!(shape.message.is_empty());
    shape
}

/// Largest distance between disks.
pub(crate) fn apart(one: &Shape, other: &Shape) -> f64 {
    assert_eq!(one.state.frames.len(), other.state.frames.len());
    let pairs = one.state.frames.iter().zip(&other.state.frames);
    pairs.fold(0.0, |most, (a, b)| f64::max(most, (a.translation - b.translation).norm()))
}

/// The shape under given tensions, and the displacements that go with them; none where it does not converge.
pub(crate) fn try_under(
    robot: &Robot,
    settings: RodSettings,
    tensions: &[f64],
) -> Option<(Shape, Vec<f64>)> {
    let plan = Plan::new(robot, settings).unwrap();
    let rod = Rod::new(robot, &plan);
    let mut work = Scratch::default();
    let report = rod.solve_tensions(tensions, &mut work).unwrap();
    let shape = rod.result(&[], report, work);
    let lengths = shape.state.tendon_lengths.iter().zip(rod.rest_lengths());
    let displacements = lengths.map(|(length, rest)| length - rest).collect();
    (shape.report.status == Status::Converged).then_some((shape, displacements))
}

pub(crate) fn under(robot: &Robot, settings: RodSettings, tensions: &[f64]) -> (Shape, Vec<f64>) {
    try_under(robot, settings, tensions).unwrap()
}

/// What a robot is made of, as numbers that can be changed.
#[derive(Clone)]
pub(crate) struct Recipe {
    pub(crate) spec: BackboneSpec,
    /// Azimuth and radius of the hole on each disk, tendon by tendon.
    pub(crate) holes: Vec<(Vec<f64>, Vec<f64>)>,
    pub(crate) base: Option<Matrix4<f64>>,
}

impl Recipe {
    /// Any robot: 1 to `most` subsegments, all of one length, 1 to 8 tendons, straight, helical, wandering or
    /// converging at 0.2 to 0.8 of a subsegment's length, half of them ending before the tip; straight,
    /// evenly bent or wavy at rest.
    pub(crate) fn random(draw: &mut ChaCha8Rng, most: usize) -> Self {
        let n = draw.random_range(1..=most);
        let tendons = draw.random_range(1..=8);
        let l = draw.random_range(0.002..0.032);
        let mut spec = BackboneSpec::straight(l * n as f64, n);
        let (kind, size) = (draw.random_range(0..3), draw.random_range(0.0..0.3));
        let half = |draw: &mut ChaCha8Rng| draw.random_range(-0.5..0.5);
        if kind > 0 {
            let even = Vector3::new(half(draw), half(draw), 0.5 * half(draw)) * size;
            let wave = if kind == 1 { 0.0 } else { 0.2 };
            let rest = |_| even + Vector3::new(half(draw), half(draw), 0.0) * wave;
            spec.rest = Some((0..n).map(rest).collect());
        }
        let holes = (0..tendons).map(|_| random_holes(draw, n, l)).collect();
        Self { spec, holes, base: None }
    }

    pub(crate) fn robot(&self) -> Robot {
        let tendon = |(azimuth, radius): &(Vec<f64>, Vec<f64>)| {
            let end = Some(azimuth.len() - 1);
            let (azimuth, radius) = (azimuth.clone(), radius.clone());
            let routing =
                Routing::Angles { azimuth: PerDisk::Each(azimuth), radius: PerDisk::Each(radius) };
            Tendon::new(routing, end, None, None).unwrap()
        };
        let backbone = Backbone::new(self.spec.clone()).unwrap();
        let tendons = self.holes.iter().map(tendon).collect();
        Robot::new(backbone, tendons, self.base.as_ref(), None, None).unwrap()
    }

    /// Rest length of a subsegment.
    pub(crate) fn piece(&self) -> f64 {
        self.spec.length[0] / self.spec.subsegments[0] as f64
    }

    /// Tensions with a sum of up to `load` EI/l², three in ten of them zero.
    pub(crate) fn random_tensions(&self, draw: &mut ChaCha8Rng, load: f64) -> Vec<f64> {
        let total = draw.random_range(0.0..load) / self.piece().powi(2);
        let mut tension = || if draw.random_bool(0.3) { 0.0 } else { draw.random_range(0.0..1.0) };
        let mut tensions: Vec<f64> = self.holes.iter().map(|_| tension()).collect();
        let sum: f64 = tensions.iter().sum();
        if sum > 0.0 {
            for tension in &mut tensions {
                *tension *= total / sum;
            }
        }
        tensions
    }

    /// Largest bend of a subsegment over the geometric limit: 0.9 l/a, or 1.4 rad.
    pub(crate) fn reach(&self, strains: &[Vector3<f64>]) -> f64 {
        let bends = strains.iter().enumerate().map(|(i, strain)| {
            let passing = self.holes.iter().filter(|(_, radius)| radius.len() > i + 1);
            let outer = passing.flat_map(|(_, radius)| &radius[i..=i + 1]);
            let a = outer.fold(1e-9, |most, radius| f64::max(most, *radius));
            strain.xy().norm() / (0.9 * self.piece() / a).min(1.4)
        });
        bends.fold(0.0, f64::max)
    }
}

fn random_holes(draw: &mut ChaCha8Rng, n: usize, l: f64) -> (Vec<f64>, Vec<f64>) {
    let end = if draw.random_bool(0.5) { n } else { draw.random_range(1..=n) };
    let (azimuth, a) = (draw.random_range(0.0..TAU), l * draw.random_range(0.2..0.8));
    let disks = 0..=end;
    match draw.random_range(0..4) {
        0 => (vec![azimuth; end + 1], vec![a; end + 1]),
        1 => {
            let rate = draw.random_range(-0.3..0.3);
            (disks.map(|i| azimuth + rate * i as f64).collect(), vec![a; end + 1])
        }
        2 => {
            let mut azimuth = azimuth;
            let mut wander = |_| {
                azimuth += draw.random_range(-0.4..0.4);
                azimuth
            };
            (disks.map(&mut wander).collect(), vec![a; end + 1])
        }
        _ => {
            let taper: f64 = draw.random_range(0.3..1.0);
            let radius = |i| a * (1.0 + (taper - 1.0) * i as f64 / end as f64);
            (vec![azimuth; end + 1], disks.map(radius).collect())
        }
    }
}
