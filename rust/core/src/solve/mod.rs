//! Solvers: they see functions, gradients and block structure, never robots.

pub mod least_squares;
pub mod pso;
pub mod sqp;
