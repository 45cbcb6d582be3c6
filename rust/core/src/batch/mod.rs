//! Many solves on all cores: every row kept, in order, the same on any number of threads.

mod pool;
mod rows;

pub use pool::pool;
pub use rows::{Columns, Control, Fields, solve_rows};
