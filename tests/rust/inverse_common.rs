//! What the tests of the inverse of the constant-curvature model share: robots, random arcs, and what the
//! forward model says of an answer.

use std::f64::consts::{PI, TAU};

use nalgebra::{DVector, Matrix4, Rotation3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::Status;
use tdcr::constant_curvature::{
    Arc, ConstantCurvature, ConstantCurvatureSettings, Plan, Scratch, displacements,
};
use tdcr::inverse::{Bounds, Range, Target};
use tdcr::lie::{Pose, so3};
use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};

pub(crate) const LENGTHS: [f64; 3] = [0.06, 0.0625, 0.064];

pub(crate) fn uniform(seed: u64) -> impl FnMut(f64, f64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    move |low, high| rng.random_range(low..high)
}

pub(crate) fn tendon(azimuth: f64, radius: f64, end: usize) -> Tendon {
    let routing =
        Routing::Angles { azimuth: PerDisk::Same(azimuth), radius: PerDisk::Same(radius) };
    Tendon::new(routing, Some(end), None, None).unwrap()
}

/// Segments of two subsegments each.
pub(crate) fn robot_of(lengths: &[f64], tendons: Vec<Tendon>) -> Robot {
    placed(lengths, tendons, None, None)
}

/// The same with a base and a tool frame.
pub(crate) fn placed(
    lengths: &[f64],
    tendons: Vec<Tendon>,
    base: Option<&Matrix4<f64>>,
    tool: Option<&Matrix4<f64>>,
) -> Robot {
    let mut spec = BackboneSpec::straight(0.2, 2);
    spec.length = lengths.to_vec();
    spec.subsegments = vec![2; lengths.len()];
    Robot::new(Backbone::new(spec).unwrap(), tendons, base, tool, None).unwrap()
}

/// Three tendons per segment, 45 degrees on from one segment to the next.
pub(crate) fn threes(radii: &[f64]) -> Vec<Tendon> {
    let of = |k: usize| {
        let azimuth = TAU * (k % 3) as f64 / 3.0 + (k / 3) as f64 * PI / 4.0;
        tendon(azimuth, radii[k / 3], 2 * (k / 3 + 1))
    };
    (0..3 * radii.len()).map(of).collect()
}

/// Three segments with nine tendons.
pub(crate) fn trunk() -> Robot {
    robot_of(&LENGTHS, threes(&[0.0045; 3]))
}

pub(crate) fn transform(translation: [f64; 3], rotation: [f64; 3]) -> Matrix4<f64> {
    let mut frame = Rotation3::new(Vector3::from(rotation)).to_homogeneous();
    for (i, x) in translation.into_iter().enumerate() {
        frame[(i, 3)] = x;
    }
    frame
}

pub(crate) fn plan(robot: &Robot, extensible: bool) -> Plan {
    let settings = ConstantCurvatureSettings { extensible, ..Default::default() };
    Plan::new(robot, settings).unwrap()
}

/// Arcs that turn by up to half a turn, of 0.8 to 1.25 of the rest lengths if these may change.
pub(crate) fn arcs(
    lengths: &[f64],
    extensible: bool,
    u: &mut impl FnMut(f64, f64) -> f64,
) -> Vec<Arc> {
    let of = |rest: &f64| {
        let (angle, phi, ratio) = (u(0.0, PI), u(-PI, PI), u(0.8, 1.25));
        let length = if extensible { rest * ratio } else { *rest };
        Arc::new(angle / length, phi, length)
    };
    lengths.iter().map(of).collect()
}

/// Bounds that all of these arcs meet.
pub(crate) fn bounds(extensible: bool) -> Bounds {
    let range =
        |argument, low: f64, high: f64| Range::new(argument, vec![low], vec![high]).unwrap();
    if extensible {
        let length = Range::new(
            "bounds.length",
            LENGTHS.map(|l| 0.8 * l).to_vec(),
            LENGTHS.map(|l| 1.25 * l).to_vec(),
        );
        return Bounds {
            curvature: Some(range("bounds.curvature", 0.0, PI / (0.8 * LENGTHS[0]))),
            length: Some(length.unwrap()),
            ..Bounds::default()
        };
    }
    let curvature = Some(range("bounds.curvature", 0.0, PI / LENGTHS[0]));
    Bounds { curvature, ..Bounds::default() }
}

/// Where the forward model puts the tool of a robot with these arcs.
pub(crate) fn tool_of(robot: &Robot, plan: &Plan, arcs: &[Arc]) -> Pose {
    tool(robot, plan, displacements(plan, arcs).as_slice())
}

/// Where the forward model puts the tool.
pub(crate) fn tool(robot: &Robot, plan: &Plan, displacements: &[f64]) -> Pose {
    let model = ConstantCurvature::new(robot, plan);
    let mut work = Scratch::default();
    let report = model.solve(displacements, &mut work).unwrap();
    assert_eq!(report.status, Status::Converged);
    assert!(report.residual < 1e-12, "{}", report.residual);
    model.state(&work).frames.last().unwrap().compose(robot.tool())
}

/// Distance and angle from a pose to a target.
pub(crate) fn misses(pose: &Pose, target: &Target) -> (f64, f64) {
    let angle = target.rotation().map_or(0.0, |wanted| {
        // Of the difference, which is exact: log of nearly half a turn is not asked for.
        so3::log(&(pose.rotation.transpose() * wanted)).norm()
    });
    ((target.position() - pose.translation).norm(), angle)
}

/// Whether arcs keep bounds, to rounding.
pub(crate) fn inside(arcs: &[Arc], bounds: &Bounds) -> bool {
    arcs.iter().enumerate().all(|(i, arc)| {
        let curvature = bounds
            .curvature
            .as_ref()
            .is_none_or(|range| arc.bend.norm() <= range.at(i).1 * arc.length * (1.0 + 1e-12));
        let length = bounds.length.as_ref().is_none_or(|range| {
            let ((low, high), off) = (range.at(i), 1e-12 * arc.length);
            arc.length >= low - off && arc.length <= high + off
        });
        curvature && length && arc.bend.norm() <= TAU * (1.0 + 1e-12)
    })
}

pub(crate) fn quantile(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share) as usize]
}

/// Unknowns of a chain of three segments: per segment the bending vector and, if it may change, the length
/// over the rest length.
pub(crate) fn unknowns(arcs: &[Arc], extensible: bool) -> Vec<f64> {
    let mut z = Vec::new();
    for (arc, rest) in arcs.iter().zip(LENGTHS) {
        z.extend_from_slice(arc.bend.as_slice());
        z.extend(extensible.then_some(arc.length / rest));
    }
    z
}

/// The arcs that have these unknowns.
pub(crate) fn arcs_of(z: &[f64], extensible: bool) -> Vec<Arc> {
    let segments = z.chunks(if extensible { 3 } else { 2 }).zip(LENGTHS);
    let arcs = segments.map(|(q, rest)| Arc {
        bend: Vector2::new(q[0], q[1]),
        length: rest * q.get(2).unwrap_or(&1.0),
    });
    arcs.collect()
}

/// Normals of the bounds that unknowns of three segments touch.
pub(crate) fn touched(z: &[f64], extensible: bool, bounds: &Bounds) -> Vec<DVector<f64>> {
    let width = if extensible { 3 } else { 2 };
    let mut normals = Vec::new();
    for (i, (arc, rest)) in arcs_of(z, extensible).iter().zip(LENGTHS).enumerate() {
        let first = width * i;
        let mut normal = DVector::zeros(z.len());
        let angle = arc.bend.norm();
        let most = bounds.curvature.as_ref().map_or(f64::INFINITY, |range| range.at(i).1);
        if angle > (most * arc.length).min(TAU) - 1e-8 {
            normal.rows_mut(first, 2).copy_from(&(arc.bend / angle));
            if extensible && most * arc.length < TAU {
                normal[first + 2] = -most * rest;
            }
            normals.push(normal.clone());
            normal.fill(0.0);
        }
        if extensible {
            let (low, high) = bounds.length.as_ref().map_or((0.5, 2.0), |range| {
                let (low, high) = range.at(i);
                (low / rest, high / rest)
            });
            for (room, sign) in [(z[first + 2] - low, -1.0), (high - z[first + 2], 1.0)] {
                if room < 1e-8 {
                    normal[first + 2] = sign;
                    normals.push(normal.clone());
                }
            }
        }
    }
    normals
}

/// Derivatives of functions of unknowns by central differences, a row each.
pub(crate) fn differences(
    z: &[f64],
    h: f64,
    mut f: impl FnMut(&[f64]) -> DVector<f64>,
) -> Vec<DVector<f64>> {
    let mut columns = Vec::new();
    for j in 0..z.len() {
        let mut moved = z.to_vec();
        moved[j] = z[j] + h;
        let up = f(&moved);
        moved[j] = z[j] - h;
        columns.push((up - f(&moved)) / (2.0 * h));
    }
    let rows = columns[0].len();
    (0..rows).map(|k| DVector::from_iterator(z.len(), columns.iter().map(|c| c[k]))).collect()
}
