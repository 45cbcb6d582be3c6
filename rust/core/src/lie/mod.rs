//! Rotations SO(3), rigid motions SE(3), and their derivatives.

pub(crate) mod coefficients;
mod pose;
pub mod se3;
pub mod so3;

pub use pose::Pose;
