//! From where the tool should be to tendon displacements.
//!
//! [`ConstantCurvatureInverse`] finds the arcs by descents from many starts ([`crate::solve::levenberg_marquardt`]),
//! inside bounds, and spends the remaining freedom on the least bending energy; [`RodInverse`] finds tensions
//! likewise, none below zero, and spends it on the least of them.

mod arc_problem;
mod batch;
mod bounds;
mod cartesian_path;
mod constant_curvature;
mod goal;
mod multistart;
mod outcome;
mod pose_goal;
mod pose_residual;
mod position_goal;
mod rod;
mod settings;
mod single;
mod swarm_starts;
mod target;
mod tension_problem;

pub use batch::{InverseRows, Inverter, invert_path, invert_rows};
pub use bounds::{Bounds, Range};
pub use cartesian_path::cartesian_path;
pub use constant_curvature::{ConstantCurvatureInverse, Scratch, Solution};
pub use outcome::Answer;
pub use rod::{RodInverse, RodScratch};
pub use settings::{InverseSettings, Method};
pub use single::{Inversion, invert, solve_start};
pub use target::Target;
