//! Solvers: they see functions, gradients and block structure, never robots.

pub mod bounded_program;
pub mod convex_region;
pub(crate) mod dense;
pub mod levenberg_marquardt;
pub mod pseudo_inverse;
pub mod pso;
pub mod quadratic_program;
pub mod sqp;
