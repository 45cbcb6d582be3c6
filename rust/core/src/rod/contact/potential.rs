//! Potentials of the disks' frames to second order, in the exponential coordinates of a motion of space.
//!
//! A disk moved by the twist ζ = (ω, v) about the base frame's origin is `exp(ζ) g`, so that its points go to
//! `x + (v + ω × x) + ½ ω × (v + ω × x)`.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use crate::lie::so3::hat;

/// Slope (a wrench: moment about the origin, force) and curvature of a potential by the twist.
#[derive(Clone, Copy, Debug)]
pub(super) struct Field {
    pub(super) slope: Vector6<f64>,
    pub(super) curvature: Matrix6<f64>,
}

impl Field {
    pub(super) fn zero() -> Self {
        Self { slope: Vector6::zeros(), curvature: Matrix6::zeros() }
    }

    /// Adds a potential of a point at `x`, by its gradient and Hessian there.
    pub(super) fn add_point(
        &mut self,
        x: &Vector3<f64>,
        gradient: &Vector3<f64>,
        hessian: &Matrix3<f64>,
    ) {
        let moment = x.cross(gradient);
        let arm = hat(x);
        let mixed = arm * hessian - hat(gradient) * 0.5;
        let mut turned = gradient * x.transpose();
        turned = (turned + turned.transpose()) * 0.5
            - Matrix3::from_diagonal_element(gradient.dot(x))
            - arm * hessian * arm;
        add(&mut self.slope, 0, &moment);
        add(&mut self.slope, 3, gradient);
        let mut place = self.curvature.fixed_view_mut::<3, 3>(0, 0);
        place += turned;
        turned = mixed;
        let mut place = self.curvature.fixed_view_mut::<3, 3>(0, 3);
        place += turned;
        let mut place = self.curvature.fixed_view_mut::<3, 3>(3, 0);
        place += turned.transpose();
        let mut place = self.curvature.fixed_view_mut::<3, 3>(3, 3);
        place += hessian;
    }

    /// Adds a couple.
    pub(super) fn add_moment(&mut self, slope: &Vector3<f64>) {
        add(&mut self.slope, 0, slope);
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.slope += other.slope;
        self.curvature += other.curvature;
    }
}

fn add(place: &mut Vector6<f64>, row: usize, value: &Vector3<f64>) {
    for k in 0..3 {
        place[row + k] += value[k];
    }
}

/// What a wrench does to the bracket of a twist with another: `x · bracket(W, θ) = W · [x, θ]`.
pub(super) fn bracket(wrench: &Vector6<f64>, twist: &Vector6<f64>) -> Vector6<f64> {
    let part = |v: &Vector6<f64>, row: usize| Vector3::new(v[row], v[row + 1], v[row + 2]);
    let (moment, force) = (part(wrench, 0), part(wrench, 3));
    let (spin, sweep) = (part(twist, 0), part(twist, 3));
    let turned = spin.cross(&moment) + sweep.cross(&force);
    let moved = spin.cross(&force);
    Vector6::new(turned.x, turned.y, turned.z, moved.x, moved.y, moved.z)
}
