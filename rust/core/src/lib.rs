//! Tendon-driven continuum robots: from how far each tendon is pulled to the shape, and back.
//!
//! The crate is the pure core of the Python package `tdcr` and knows nothing of Python. Units are
//! SI (m, rad, N, Pa); frames, signs and words are those of the user guide in `docs/`.
//!
//! Rooms, from the bottom up: [`lie`] (rotations and rigid motions), [`solve`] (solvers that know no
//! robots), [`robot`] (backbones and tendons), [`obstacle`] (bodies to stay out of), [`model`] (the
//! interface of forward models), [`linkage`], [`constant_curvature`] and [`rod`] (the forward models),
//! [`batch`] (many solves on all cores), [`inverse`] (from targets to displacements), [`design`] (robots
//! for given shapes), [`planar`] (planar trunks).
//!
//! ```
//! use tdcr::linkage::{Linkage, LinkageSettings, Plan};
//! use tdcr::model::Model;
//! use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
//!
//! # fn main() -> Result<(), tdcr::InvalidInput> {
//! let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
//! let tendons = vec![Tendon::straight(0.0, 0.01)?];
//! let robot = Robot::new(backbone, tendons, None, None, None)?;
//! let plan = Plan::new(&robot)?;
//! let shape = Linkage::new(&robot, &plan, LinkageSettings::default())?.shape(&[-0.01])?;
//! assert_eq!(shape.report.status, tdcr::Status::Converged);
//! // Bent by 1 rad towards +x.
//! assert!((shape.state.strains.iter().map(|w| w.y).sum::<f64>() - 1.0).abs() < 1e-3);
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]

pub mod batch;
pub mod constant_curvature;
pub mod design;
pub mod error;
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
