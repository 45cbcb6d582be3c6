//! Many solves on all cores: every row kept, in order, the same on any number of threads.

mod field;
mod pool;
mod rows;

pub use field::{Field, Key};
pub use pool::pool;
pub use rows::{Column, Control, Solved, solve_rows};
