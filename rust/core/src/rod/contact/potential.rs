//! Potentials of the disks' frames to second order, in the exponential coordinates of a motion of space.
//!
//! A disk moved by the twist ζ = (ω, v) about the base frame's origin is `exp(ζ) g`, so that its points go to
//! `x + (v + ω × x) + ½ ω × (v + ω × x)`.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use crate::lie::so3::hat;

/// Slope W (a wrench: moment about the origin, force) and curvature Φ of a potential by the twist.
#[derive(Clone, Copy, Debug)]
pub(super) struct Potential {
    pub(super) slope: Vector6<f64>,
    pub(super) curvature: Matrix6<f64>,
}

impl Potential {
    pub(super) fn zero() -> Self {
        Self { slope: Vector6::zeros(), curvature: Matrix6::zeros() }
    }

    /// Adds a potential of a point at x, by its gradient n and Hessian N there: slope `(x × n, n)`.
    pub(super) fn add_point(
        &mut self,
        x: &Vector3<f64>,
        gradient: &Vector3<f64>,
        hessian: &Matrix3<f64>,
    ) {
        let moment = x.cross(gradient);
        let x_hat = hat(x);
        // ωv: x̂ N - ½ n̂, and ωω: ½ (n xᵀ + x nᵀ) - (n·x) I - x̂ N x̂.
        let mixed = x_hat * hessian - hat(gradient) * 0.5;
        let mut turning = gradient * x.transpose();
        turning = (turning + turning.transpose()) * 0.5
            - Matrix3::from_diagonal_element(gradient.dot(x))
            - x_hat * hessian * x_hat;
        add_rows(&mut self.slope, 0, &moment);
        add_rows(&mut self.slope, 3, gradient);
        let mut block = self.curvature.fixed_view_mut::<3, 3>(0, 0);
        block += turning;
        turning = mixed;
        let mut block = self.curvature.fixed_view_mut::<3, 3>(0, 3);
        block += turning;
        let mut block = self.curvature.fixed_view_mut::<3, 3>(3, 0);
        block += turning.transpose();
        let mut block = self.curvature.fixed_view_mut::<3, 3>(3, 3);
        block += hessian;
    }

    /// Adds a couple.
    pub(super) fn add_moment(&mut self, slope: &Vector3<f64>) {
        add_rows(&mut self.slope, 0, slope);
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.slope += other.slope;
        self.curvature += other.curvature;
    }
}

fn add_rows(wrench: &mut Vector6<f64>, row: usize, value: &Vector3<f64>) {
    for k in 0..3 {
        wrench[row + k] += value[k];
    }
}

/// Wrench that stands for the bracket with a twist: `x · bracket(W, θ) = W · [x, θ]`.
pub(super) fn bracket(wrench: &Vector6<f64>, twist: &Vector6<f64>) -> Vector6<f64> {
    let part = |v: &Vector6<f64>, row: usize| Vector3::new(v[row], v[row + 1], v[row + 2]);
    let (moment, force) = (part(wrench, 0), part(wrench, 3));
    let (spin, velocity) = (part(twist, 0), part(twist, 3));
    let turning = spin.cross(&moment) + velocity.cross(&force);
    let moving = spin.cross(&force);
    Vector6::new(turning.x, turning.y, turning.z, moving.x, moving.y, moving.z)
}
