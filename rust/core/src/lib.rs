#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

pub mod batch;
pub mod constant_curvature;
pub mod design;
pub mod error;
pub mod forward;
mod hashing;
pub mod inverse;
pub mod lie;
pub mod linkage;
pub mod model;
pub mod obstacle;
pub mod planar;
pub mod robot;
pub mod rod;
pub mod solve;
mod status;

pub use error::InvalidInput;
pub use model::{Contact, PointKind, Shape};
pub use status::Status;
