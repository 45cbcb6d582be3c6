//! A chain of arcs before a target: residuals of the tool, their derivatives, the bending energy.

use nalgebra::{Matrix3, Vector2, Vector3, Vector6};

use crate::constant_curvature::Plan;
use crate::constant_curvature::bent::Bent;
use crate::lie::{Pose, so3};
use crate::robot::Robot;
use crate::solve::fit::Problem;

use super::{InverseSettings, Target};

/// How much of the robot's length one radian counts, unless it is said.
const RADIAN: f64 = 0.3;

/// Unknowns, base first: for every segment its bending vector \[rad\] and, if it is extensible, its length
/// over its rest length.
#[derive(Clone, Debug)]
pub(crate) struct Chain<'a> {
    robot: &'a Robot,
    plan: &'a Plan,
    target: Target,
    settings: &'a InverseSettings,
    /// Weights of the residuals over the robot's length: position along world axes, rotation about tool
    /// axes.
    weights: Vector6<f64>,
    /// Stiffness of every segment's bending vector, of mean 1.
    stiffness: Vec<f64>,
    bents: Vec<Bent>,
    /// Length of every segment \[m\].
    lengths: Vec<f64>,
    /// Frame of every segment's base and of the last tip.
    frames: Vec<Pose>,
    /// Place of the tool.
    tool: Vector3<f64>,
    /// Rotation from the tool to the target, tool axes.
    error: Vector3<f64>,
    /// From angular velocity (world axes) to the change of `error`, but for the sign.
    back: Matrix3<f64>,
    /// Velocity of the tool and angular velocity by every unknown.
    columns: Vec<(Vector3<f64>, Vector3<f64>)>,
}

impl<'a> Chain<'a> {
    pub(crate) fn new(robot: &'a Robot, plan: &'a Plan, settings: &'a InverseSettings) -> Self {
        let length = robot.backbone().total_length();
        let radian = settings.rotation_weight.map(|w| w.unwrap_or(RADIAN * length) / length);
        let [x, y, z] = settings.position_weight.map(|w| w / length);
        let count = plan.segments().len();
        let stiffness: Vec<f64> = plan.segments().map(|s| s.stiffness(robot)).collect();
        let mean = stiffness.iter().sum::<f64>() / count as f64;
        Self {
            robot,
            plan,
            target: Target::Position(Vector3::zeros()),
            settings,
            weights: Vector6::new(x, y, z, radian[0], radian[1], radian[2]),
            stiffness: stiffness.iter().map(|s| s / mean).collect(),
            bents: Vec::with_capacity(count),
            lengths: Vec::with_capacity(count),
            frames: Vec::with_capacity(count + 1),
            tool: Vector3::zeros(),
            error: Vector3::zeros(),
            back: Matrix3::zeros(),
            columns: Vec::with_capacity(3 * count),
        }
    }

    pub(crate) fn aim(&mut self, target: Target) {
        self.target = target;
    }

    /// Number of residuals that count.
    pub(crate) fn rows(&self) -> usize {
        let given = if self.target.rotation().is_some() { 6 } else { 3 };
        self.weights.iter().take(given).filter(|weight| **weight > 0.0).count()
    }

    /// Distance \[m\] and angle \[rad\] by which the tool misses the target at the point evaluated last, over
    /// the axes that count; 0 for the angle to a position.
    pub(crate) fn misses(&self) -> (f64, f64) {
        let counts = |weight: f64, value: f64| if weight > 0.0 { value * value } else { 0.0 };
        let off = self.target.position() - self.tool;
        let sum = |offset: usize, v: &Vector3<f64>| {
            (0..3).map(|k| counts(self.weights[offset + k], v[k])).sum::<f64>().sqrt()
        };
        (sum(0, &off), if self.target.rotation().is_some() { sum(3, &self.error) } else { 0.0 })
    }

    /// Places every segment.
    fn place(&mut self, z: &[f64]) {
        self.bents.clear();
        self.lengths.clear();
        self.frames.clear();
        let mut frame = *self.robot.base();
        self.frames.push(frame);
        let width = self.plan.width();
        for (segment, q) in self.plan.segments().zip(z.chunks_exact(width)) {
            let bent = Bent::new(Vector2::new(q[0], q[1]));
            let ratio = if width == 3 { q[2] } else { 1.0 };
            let length = segment.rest_length * ratio;
            frame = frame.compose(&bent.frame(length));
            self.bents.push(bent);
            self.lengths.push(length);
            self.frames.push(frame);
        }
        self.tool = frame.transform(&self.robot.tool().translation);
        if let Some(wanted) = self.target.rotation() {
            let tool = frame.rotation * self.robot.tool().rotation;
            self.error = so3::log(&(tool.transpose() * wanted));
            self.back = so3::left_jacobian_inverse(&self.error) * tool.transpose();
        }
    }

    /// Derivatives of the tool's place and rotation by every unknown.
    fn differentiate(&mut self) {
        self.columns.clear();
        for (i, segment) in self.plan.segments().enumerate() {
            let (bent, length) = (&self.bents[i], self.lengths[i]);
            let base = self.frames[i].rotation;
            let lever = self.tool - self.frames[i + 1].translation;
            for (moved, turned) in bent.moved().iter().zip(bent.turned()) {
                let spin = base * turned;
                self.columns.push((base * (moved * length) + spin.cross(&lever), spin));
            }
            if self.plan.width() == 3 {
                self.columns.push((base * (bent.end() * segment.rest_length), Vector3::zeros()));
            }
        }
    }

    /// Second derivatives of the tool's place and rotation by two unknowns of one segment.
    fn within(&self, i: usize) -> [[(Vector3<f64>, Vector3<f64>); 3]; 3] {
        let second = self.bents[i].second();
        let base = self.frames[i].rotation;
        let lever = self.tool - self.frames[i + 1].translation;
        let (length, rest) = (self.lengths[i], self.plan.segment(i).rest_length);
        let spins = self.bents[i].turned().map(|turned| base * turned);
        let moved = self.bents[i].moved();
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

impl Problem<6> for Chain<'_> {
    fn evaluate(&mut self, z: &[f64], residual: &mut Vector6<f64>, jacobian: &mut [Vector6<f64>]) {
        self.place(z);
        self.differentiate();
        let off = self.target.position() - self.tool;
        let rotates = self.target.rotation().is_some();
        for k in 0..3 {
            residual[k] = self.weights[k] * off[k];
            residual[k + 3] = if rotates { self.weights[k + 3] * self.error[k] } else { 0.0 };
        }
        for (column, (velocity, spin)) in jacobian.iter_mut().zip(&self.columns) {
            let turned = if rotates { self.back * spin } else { Vector3::zeros() };
            for k in 0..3 {
                column[k] = -self.weights[k] * velocity[k];
                column[k + 3] = -self.weights[k + 3] * turned[k];
            }
        }
    }

    fn met(&self, _: &Vector6<f64>) -> bool {
        let (distance, angle) = self.misses();
        distance <= self.settings.position_tolerance && angle <= self.settings.rotation_tolerance
    }

    fn add_hessian(&self, weights: &Vector6<f64>, hessian: &mut [f64]) {
        let width = self.plan.width();
        let size = self.columns.len();
        let push = -weights.component_mul(&self.weights);
        let force: Vector3<f64> = push.fixed_rows::<3>(0).into();
        let twist: Vector3<f64> = push.fixed_rows::<3>(3).into();
        let rotates = self.target.rotation().is_some();
        // In world axes, as `back` carries it.
        let moment = if rotates { self.back.transpose() * twist } else { Vector3::zeros() };
        let tool = self.frames[self.frames.len() - 1].rotation * self.robot.tool().rotation;
        let bends = |spin: &Vector3<f64>| {
            so3::left_jacobian_inverse_derivative(&self.error, &(tool.transpose() * spin))
        };
        for i in 0..size / width {
            let own = self.within(i);
            for a in width * i..width * (i + 1) {
                let (velocity, spin) = &self.columns[a];
                let row = twist.transpose() * bends(spin);
                for b in 0..=a {
                    let other = &self.columns[b].1;
                    // The proximal unknown turns all that the distal one does.
                    let (moved, turned) = if b >= width * i {
                        own[a - width * i][b - width * i]
                    } else {
                        (other.cross(velocity), other.cross(spin))
                    };
                    let mut sum = force.dot(&moved);
                    if rotates {
                        sum += moment.dot(&(turned - other.cross(spin)));
                        sum -= (row * (self.back * other))[0];
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
