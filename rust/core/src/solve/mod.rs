//! Solvers: they see functions, gradients and block structure, never robots.

pub mod sqp;
