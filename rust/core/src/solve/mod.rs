//! Solvers: they see functions, gradients and block structure, never robots.

pub mod bounded;
pub mod fit;
mod least;
pub mod least_squares;
pub mod pso;
pub mod quadratic;
pub mod region;
pub mod sqp;
