//! Planar trunks: sections bent to arcs in one plane (C. Mahfoudi, A. Amouri, A. Zaatri, "New approach
//! to modeling a planar flexible continuum robot simulating elephant trunk", 2014).
//!
//! x along the undeformed trunk, y to its left; a turn is the whole angle of a section (the paper's
//! `2 theta`), counter-clockwise. [`Trunk`] and [`AngleFunction`] are the direct model, [`TwoSections`]
//! finds every solution of two sections, [`inverse`] the one of least bending energy of any number,
//! [`SwarmSolver`] one by particle swarm, among obstacles too.

mod angle_function;
mod batch;
mod chord;
mod clearance;
mod least_energy;
mod newton_inverse;
mod swarm;
mod tip_equations;
mod trunk;
mod two_section;

pub use angle_function::{AngleFunction, Curve};
pub use batch::{SolutionRows, inverse_rows, solution_rows};
pub use clearance::Circle;
pub use newton_inverse::{Goal, Inverse, InverseSettings, inverse, inverse_until, polish};
pub use swarm::{
    Row, Rows, SwarmInverse, SwarmSettings, SwarmSolver, Unknowns, WatchDecision, solve_rows,
};
pub use trunk::{CableTurns, Cables, Trunk};
pub use two_section::TwoSections;
