//! Chain of arcs and a target: residuals of the tool, their derivatives, the bending energy.

use nalgebra::{Vector2, Vector3, Vector6};

use crate::constant_curvature::Plan;
use crate::constant_curvature::unit_arc::UnitArc;
use crate::lie::Pose;
use crate::robot::Robot;
use crate::solve::levenberg_marquardt::Problem;

use super::InverseSettings;
use super::pose_residual::{PoseResidual, Twist};

/// Unknowns, base first: for every segment its bending vector \[rad\] and, if it is extensible, its length
/// over its rest length.
#[derive(Clone, Debug)]
pub(crate) struct ArcProblem<'a> {
    robot: &'a Robot,
    plan: &'a Plan,
    pub(super) pose_residual: PoseResidual<'a>,
    /// Stiffness of every segment's bending vector, of mean 1.
    stiffness: Vec<f64>,
    arcs: Vec<UnitArc>,
    /// Length of every segment \[m\].
    lengths: Vec<f64>,
    /// Frame of every segment's base and of the last tip.
    frames: Vec<Pose>,
    /// Velocity of the tool and angular velocity by every unknown.
    columns: Vec<Twist>,
}

impl<'a> ArcProblem<'a> {
    pub(crate) fn new(robot: &'a Robot, plan: &'a Plan, settings: &'a InverseSettings) -> Self {
        let count = plan.segments().len();
        let stiffness: Vec<f64> = plan.segments().map(|s| s.stiffness(robot)).collect();
        let mean = stiffness.iter().sum::<f64>() / count as f64;
        Self {
            robot,
            plan,
            pose_residual: PoseResidual::new(robot, settings),
            stiffness: stiffness.iter().map(|s| s / mean).collect(),
            arcs: Vec::with_capacity(count),
            lengths: Vec::with_capacity(count),
            frames: Vec::with_capacity(count + 1),
            columns: Vec::with_capacity(3 * count),
        }
    }

    /// Composes the frames of all segments.
    fn set_arcs(&mut self, z: &[f64]) {
        self.arcs.clear();
        self.lengths.clear();
        self.frames.clear();
        let mut frame = Pose::identity();
        self.frames.push(frame);
        let width = self.plan.width();
        for (segment, q) in self.plan.segments().zip(z.chunks_exact(width)) {
            let arc = UnitArc::new(Vector2::new(q[0], q[1]));
            let ratio = if width == 3 { q[2] } else { 1.0 };
            let length = segment.rest_length * ratio;
            frame = frame.compose(&arc.frame(length));
            self.arcs.push(arc);
            self.lengths.push(length);
            self.frames.push(frame);
        }
        let tool = self.robot.tool();
        self.pose_residual
            .update(frame.transform(&tool.translation), || frame.rotation * tool.rotation);
    }

    /// Derivatives of the tool's position and rotation with respect to every unknown.
    fn differentiate(&mut self) {
        self.columns.clear();
        for (i, segment) in self.plan.segments().enumerate() {
            let (arc, length) = (&self.arcs[i], self.lengths[i]);
            let base = self.frames[i].rotation;
            let lever = self.pose_residual.tool - self.frames[i + 1].translation;
            for (moved, turned) in arc.end_derivatives().iter().zip(arc.rotation_derivatives()) {
                let spin = base * turned;
                self.columns.push((base * (moved * length) + spin.cross(&lever), spin));
            }
            if self.plan.width() == 3 {
                self.columns.push((base * (arc.end() * segment.rest_length), Vector3::zeros()));
            }
        }
    }

    /// Second derivatives of the tool's position and rotation with respect to two unknowns of one segment.
    fn second_derivatives(&self, i: usize) -> [[(Vector3<f64>, Vector3<f64>); 3]; 3] {
        let second = self.arcs[i].second();
        let base = self.frames[i].rotation;
        let lever = self.pose_residual.tool - self.frames[i + 1].translation;
        let (length, rest) = (self.lengths[i], self.plan.segment(i).rest_length);
        let spins = self.arcs[i].rotation_derivatives().map(|turned| base * turned);
        let moved = self.arcs[i].end_derivatives();
        let mut out = [[(Vector3::zeros(), Vector3::zeros()); 3]; 3];
        for j in 0..2 {
            for k in 0..2 {
                let turned = base * second.turned[j][k];
                let swung = turned.cross(&lever) + spins[j].cross(&spins[k].cross(&lever));
                out[j][k] = (base * (second.end[j + k] * length) + swung, turned);
            }
            out[2][j].0 = base * (moved[j] * rest);
            out[j][2].0 = out[2][j].0;
        }
        out
    }
}

impl Problem<6> for ArcProblem<'_> {
    fn evaluate(&mut self, z: &[f64], residual: &mut Vector6<f64>, jacobian: &mut [Vector6<f64>]) {
        self.set_arcs(z);
        self.differentiate();
        *residual = self.pose_residual.residual();
        self.pose_residual.write_jacobian(&self.columns, jacobian);
    }

    fn squared_norm(&mut self, z: &[f64]) -> f64 {
        self.set_arcs(z);
        self.pose_residual.residual().norm_squared()
    }

    fn is_met(&self, residual: &Vector6<f64>) -> bool {
        self.pose_residual.is_met(residual)
    }

    fn add_hessian(&mut self, _: &[f64], weights: &Vector6<f64>, hessian: &mut [f64]) {
        let width = self.plan.width();
        let size = self.columns.len();
        let rotates = self.pose_residual.rotates();
        let push = self.pose_residual.curvature(weights);
        for i in 0..size / width {
            let own = self.second_derivatives(i);
            for a in width * i..width * (i + 1) {
                let (velocity, spin) = &self.columns[a];
                let row = push.row(spin);
                for b in 0..=a {
                    let other = &self.columns[b].1;
                    // The proximal unknown turns all that the distal one does.
                    let (moved, turned) = if b >= width * i {
                        own[a - width * i][b - width * i]
                    } else {
                        (other.cross(velocity), other.cross(spin))
                    };
                    let mut sum = push.force.dot(&moved);
                    if rotates {
                        sum += push.rotation(&row, spin, other, push.moment.dot(&turned));
                    }
                    hessian[a * size + b] += sum;
                }
            }
        }
    }

    fn energy(&self, z: &[f64], gradient: &mut [f64]) -> f64 {
        let width = self.plan.width();
        let mut energy = 0.0;
        gradient.fill(0.0);
        for (i, (stiffness, q)) in self.stiffness.iter().zip(z.chunks_exact(width)).enumerate() {
            energy += 0.5 * stiffness * (q[0] * q[0] + q[1] * q[1]);
            gradient[width * i] = stiffness * q[0];
            gradient[width * i + 1] = stiffness * q[1];
        }
        energy
    }

    fn add_energy_hessian(&self, z: &[f64], hessian: &mut [f64]) {
        let (width, size) = (self.plan.width(), z.len());
        for (i, stiffness) in self.stiffness.iter().enumerate() {
            for k in [width * i, width * i + 1] {
                hessian[k * size + k] += stiffness;
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // A test may stop where it fails.
mod tests {
    use nalgebra::{Matrix4, Rotation3};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::super::Target;
    use super::*;
    use crate::constant_curvature::ConstantCurvatureSettings;
    use crate::lie::so3;
    use crate::robot::{Backbone, BackboneSpec, PerDisk, Routing, Tendon};

    fn robot(placed: bool) -> Robot {
        let mut spec = BackboneSpec::straight(0.2, 1);
        spec.length = vec![0.06, 0.0625, 0.064];
        spec.subsegments = vec![1; 3];
        let tendon = |k: usize| {
            let (azimuth, radius) = (PerDisk::Same(2.2 * k as f64), PerDisk::Same(0.005));
            let routing = Routing::Angles { azimuth, radius };
            Tendon::new(routing, Some(k / 3 + 1), None, None).unwrap()
        };
        let frame = |rotation: [f64; 3], translation: [f64; 3]| -> Matrix4<f64> {
            let mut frame = Rotation3::new(Vector3::from(rotation)).to_homogeneous();
            (0..3).for_each(|i| frame[(i, 3)] = translation[i]);
            frame
        };
        let base = placed.then(|| frame([0.4, -1.0, 2.0], [0.1, -0.2, 0.3]));
        let tool = placed.then(|| frame([-0.7, 0.5, 0.2], [0.01, 0.02, 0.05]));
        let backbone = Backbone::new(spec).unwrap();
        let tendons = (0..9).map(tendon).collect();
        Robot::new(backbone, tendons, base.as_ref(), tool.as_ref(), None).unwrap()
    }

    fn uniform(seed: u64) -> impl FnMut(f64, f64) -> f64 {
        let mut draws = ChaCha8Rng::seed_from_u64(seed);
        move |low, high| draws.random_range(low..high)
    }

    /// Unknowns of three segments, straight in every fourth case.
    fn unknowns(case: usize, extensible: bool, u: &mut impl FnMut(f64, f64) -> f64) -> Vec<f64> {
        let mut z = Vec::new();
        for _ in 0..3 {
            let size = if case.is_multiple_of(4) { 0.0 } else { 2.5 };
            z.extend([size * u(-1.0, 1.0), size * u(-1.0, 1.0)]);
            if extensible {
                z.push(u(0.6, 1.8));
            }
        }
        z
    }

    /// Jacobian against differences of residuals, and second derivatives against differences of the
    /// Jacobian: to positions and to poses up to 3 rad off.
    #[test]
    fn derivatives_agree_with_differences() {
        let mut u = uniform(51);
        let mut largest = 0.0_f64;
        for case in 0..400 {
            let (extensible, placed, posed) = (case % 2 == 1, case % 8 < 4, case % 5 > 0);
            let robot = robot(placed);
            let choices = ConstantCurvatureSettings { extensible, ..Default::default() };
            let plan = Plan::new(&robot, choices).unwrap();
            let settings = InverseSettings {
                position_weight: [1.0, 0.5, 2.0],
                rotation_weight: [None, Some(0.1), Some(0.02)],
                ..InverseSettings::default()
            };
            let mut problem = ArcProblem::new(&robot, &plan, &settings);
            let z = unknowns(case, extensible, &mut u);
            problem.set_arcs(&z);
            let tip = problem.frames[3].compose(robot.tool());
            let axis = Vector3::from_fn(|_, _| u(-1.0, 1.0)).normalize();
            let off = axis * if case % 3 == 0 { 1e-6 } else { u(0.0, 3.0) };
            largest = largest.max(off.norm());
            let translation = tip.translation + Vector3::from_fn(|_, _| u(-0.1, 0.1));
            problem.pose_residual.set_target(if posed {
                Target::Pose(Pose { rotation: tip.rotation * so3::exp(&off), translation })
            } else {
                Target::Position(translation)
            });
            check(&mut problem, &z, &Vector6::from_fn(|_, _| u(-1.0, 1.0)), case);
        }
        assert!(largest > 2.95);
    }

    fn check(problem: &mut ArcProblem<'_>, z: &[f64], weights: &Vector6<f64>, case: usize) {
        let (size, h) = (z.len(), 1e-5);
        let mut at = |z: &[f64]| {
            let (mut residual, mut jacobian) = (Vector6::zeros(), vec![Vector6::zeros(); size]);
            problem.evaluate(z, &mut residual, &mut jacobian);
            let mut hessian = vec![0.0; size * size];
            problem.add_hessian(z, weights, &mut hessian);
            (residual, jacobian, hessian)
        };
        let (_, jacobian, hessian) = at(z);
        for a in 0..size {
            let mut moved = |by: f64| {
                let mut z = z.to_vec();
                z[a] += by;
                at(&z)
            };
            let (up, down) = (moved(h), moved(-h));
            let column = (up.0 - down.0) / (2.0 * h);
            let scale = 1.0 + column.amax();
            assert!((column - jacobian[a]).amax() < 1e-7 * scale, "{case} {a}");
            for b in 0..=a {
                let arc = weights.dot(&(up.1[b] - down.1[b])) / (2.0 * h);
                let off = (hessian[a * size + b] - arc).abs();
                assert!(off < 1e-6 * (1.0 + arc.abs()), "{case} {a} {b} {off:e} {arc}");
            }
        }
    }

    #[test]
    fn the_energy_has_its_derivatives() {
        let robot = robot(false);
        let mut u = uniform(52);
        for extensible in [false, true] {
            let choices = ConstantCurvatureSettings { extensible, ..Default::default() };
            let plan = Plan::new(&robot, choices).unwrap();
            let settings = InverseSettings::default();
            let problem = ArcProblem::new(&robot, &plan, &settings);
            let z = unknowns(1, extensible, &mut u);
            let size = z.len();
            let (mut slope, mut other) = (vec![0.0; size], vec![0.0; size]);
            let mut hessian = vec![0.0; size * size];
            problem.energy(&z, &mut slope);
            problem.add_energy_hessian(&z, &mut hessian);
            for a in 0..size {
                let h = 1e-4;
                let mut moved = z.clone();
                moved[a] += h;
                let up = problem.energy(&moved, &mut other);
                assert!((other[a] - slope[a] - h * hessian[a * (size + 1)]).abs() < 1e-12);
                moved[a] -= 2.0 * h;
                let down = problem.energy(&moved, &mut other);
                assert!(((up - down) / (2.0 * h) - slope[a]).abs() < 1e-10);
            }
        }
    }
}
