//! Weighted residuals of the tool with respect to a target, and their derivatives.

use nalgebra::{Matrix3, RowVector3, Vector3, Vector6};

use super::{InverseSettings, Target};
use crate::lie::{Pose, so3};
use crate::robot::Robot;

/// Default weight of one radian, as a share of the robot's length; the tool's reach is added to it.
const RADIAN: f64 = 0.3;

/// Velocity of the tool and angular velocity.
pub(super) type Twist = (Vector3<f64>, Vector3<f64>);

/// Weighted residual of the tool's pose with respect to a target, in the frame of the base.
#[derive(Clone, Debug)]
pub(super) struct PoseResidual<'a> {
    robot: &'a Robot,
    settings: &'a InverseSettings,
    target: Target,
    /// The base's rotation, where weights along world axes differ.
    axes: Option<Matrix3<f64>>,
    /// Weights of the residuals over the robot's reach: position along world axes, rotation about tool
    /// axes.
    weights: Vector6<f64>,
    /// Position of the tool.
    pub(super) tool: Vector3<f64>,
    /// Rotation of the tool.
    rotation: Matrix3<f64>,
    /// Rotation from the tool to the target, tool axes.
    error: Vector3<f64>,
    /// From angular velocity (world axes) to the change of `error`, but for the sign.
    error_rate: Matrix3<f64>,
}

impl<'a> PoseResidual<'a> {
    pub(super) fn new(robot: &'a Robot, settings: &'a InverseSettings) -> Self {
        let tool = robot.tool().translation.norm();
        let reach = robot.backbone().total_length() + tool;
        let default = RADIAN * robot.backbone().total_length() + tool;
        let radian = settings.rotation_weight.map(|w| w.unwrap_or(default) / reach);
        let [x, y, z] = settings.position_weight.map(|w| w / reach);
        Self {
            robot,
            settings,
            target: Target::Position(Vector3::zeros()),
            axes: (x != y || y != z).then(|| robot.base().rotation),
            weights: Vector6::new(x, y, z, radian[0], radian[1], radian[2]),
            tool: Vector3::zeros(),
            rotation: Matrix3::identity(),
            error: Vector3::zeros(),
            error_rate: Matrix3::zeros(),
        }
    }

    /// Sets a target of the world. Residuals are in the frame of the base: the world's origin may be far away.
    pub(super) fn set_target(&mut self, target: Target) {
        let world = self.robot.base().inverse();
        self.target = match target {
            Target::Position(position) => {
                let off = position - self.robot.base().translation;
                Target::Position(world.rotation * off)
            }
            Target::Pose(pose) => {
                let off = pose.translation - self.robot.base().translation;
                let rotation = world.rotation * pose.rotation;
                Target::Pose(Pose { rotation, translation: world.rotation * off })
            }
        };
    }

    /// The target in the base's frame.
    pub(super) fn target(&self) -> Target {
        self.target
    }

    /// Distance from a pose of the tool to a target, over the robot's length, plus the angle \[rad\].
    pub(super) fn relative_distance(&self, from: &Pose, to: &Target) -> f64 {
        let turn = |rotation| so3::log(&from.rotation.tr_mul(rotation)).norm();
        let off = (to.position() - from.translation).norm();
        off / self.robot.backbone().total_length() + to.rotation().map_or(0.0, turn)
    }

    /// Sets the target at a share of the way from a pose of the tool to another target, both in the base's frame.
    pub(super) fn interpolate_target(&mut self, from: &Pose, to: &Target, share: f64) {
        if share >= 1.0 {
            self.target = *to;
            return;
        }
        self.target = match to {
            Target::Position(point) => Target::Position(from.translation.lerp(point, share)),
            Target::Pose(pose) => Target::Pose(from.toward(pose, share)),
        };
    }

    /// True when the target has axes.
    pub(super) fn rotates(&self) -> bool {
        self.target.rotation().is_some()
    }

    /// A vector in the axes that its weights are for.
    fn in_weight_axes(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.axes.map_or(*v, |axes| axes * v)
    }

    /// Number of residuals with a weight.
    pub(super) fn row_count(&self) -> usize {
        let given = if self.rotates() { 6 } else { 3 };
        self.weights.iter().take(given).filter(|weight| **weight > 0.0).count()
    }

    /// Distance \[m\] and angle \[rad\] from the tool of the last update to the target, over
    /// the axes that count; 0 for the angle to a position.
    pub(super) fn errors(&self) -> (f64, f64) {
        let counts = |weight: f64, value: f64| if weight > 0.0 { value * value } else { 0.0 };
        let off = self.in_weight_axes(&(self.target.position() - self.tool));
        let sum = |offset: usize, v: &Vector3<f64>| {
            (0..3).map(|k| counts(self.weights[offset + k], v[k])).sum::<f64>().sqrt()
        };
        (sum(0, &off), if self.rotates() { sum(3, &self.error) } else { 0.0 })
    }

    /// Updates the pose of the tool, given in the base's frame.
    pub(super) fn update(&mut self, point: Vector3<f64>, rotation: impl FnOnce() -> Matrix3<f64>) {
        self.tool = point;
        if let Some(wanted) = self.target.rotation() {
            self.rotation = rotation();
            self.error = so3::log(&(self.rotation.transpose() * wanted));
            self.error_rate = so3::left_jacobian_inverse(&self.error) * self.rotation.transpose();
        }
    }

    /// Residuals of the last update.
    pub(super) fn residual(&self) -> Vector6<f64> {
        let off = self.in_weight_axes(&(self.target.position() - self.tool));
        let turn = if self.rotates() { self.error } else { Vector3::zeros() };
        Vector6::new(off.x, off.y, off.z, turn.x, turn.y, turn.z).component_mul(&self.weights)
    }

    /// Derivatives of the residuals with respect to unknowns that move the tool with these twists.
    pub(super) fn write_jacobian<'t>(
        &self,
        twists: impl IntoIterator<Item = &'t Twist>,
        jacobian: &mut [Vector6<f64>],
    ) {
        let (rotates, axes) = (self.rotates(), self.axes);
        for (column, (velocity, spin)) in jacobian.iter_mut().zip(twists) {
            let turned = if rotates { self.error_rate * spin } else { Vector3::zeros() };
            let velocity = axes.map_or(*velocity, |axes| axes * velocity);
            for k in 0..3 {
                column[k] = -self.weights[k] * velocity[k];
                column[k + 3] = -self.weights[k + 3] * turned[k];
            }
        }
    }

    /// True when residuals, which need not be those of the last update, are within the tolerances.
    pub(super) fn is_met(&self, residual: &Vector6<f64>) -> bool {
        let sum = |rows: std::ops::Range<usize>| {
            let counted = rows.filter(|k| self.weights[*k] > 0.0);
            counted.map(|k| (residual[k] / self.weights[k]).powi(2)).sum::<f64>().sqrt()
        };
        sum(0..3) <= self.settings.position_tolerance
            && sum(3..6) <= self.settings.rotation_tolerance
    }

    /// Second derivatives of `weights . r`.
    pub(super) fn curvature(&self, weights: &Vector6<f64>) -> Curvature<'_, 'a> {
        let push = -weights.component_mul(&self.weights);
        let force: Vector3<f64> = push.fixed_rows::<3>(0).into();
        let force = self.axes.map_or(force, |axes| axes.tr_mul(&force));
        let twist: Vector3<f64> = push.fixed_rows::<3>(3).into();
        let moment =
            if self.rotates() { self.error_rate.transpose() * twist } else { Vector3::zeros() };
        Curvature { residual: self, force, moment, twist }
    }
}

/// Force and moment on the tool that weights of the residuals amount to.
pub(super) struct Curvature<'t, 'a> {
    residual: &'t PoseResidual<'a>,
    /// Along the base's axes.
    pub(super) force: Vector3<f64>,
    /// Moment along the base's axes.
    pub(super) moment: Vector3<f64>,
    /// About the tool's axes.
    twist: Vector3<f64>,
}

impl Curvature<'_, '_> {
    /// Row of one unknown's angular velocity for [`Self::rotation`].
    pub(super) fn row(&self, spin: &Vector3<f64>) -> RowVector3<f64> {
        let turned = self.residual.rotation.transpose() * spin;
        self.twist.transpose()
            * so3::left_jacobian_inverse_derivative(&self.residual.error, &turned)
    }

    /// Rotational part for two unknowns by their spins, the row of the first, and the moment's work on the
    /// change of the first one's spin by the other.
    pub(super) fn rotation(
        &self,
        row: &RowVector3<f64>,
        spin: &Vector3<f64>,
        other: &Vector3<f64>,
        turned: f64,
    ) -> f64 {
        turned - self.moment.dot(&other.cross(spin)) - (row * (self.residual.error_rate * other))[0]
    }
}
