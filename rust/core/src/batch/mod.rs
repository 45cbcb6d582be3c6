//! Many solves on all cores: every row kept, in order, the same on any number of threads.

mod field;
mod pool;
mod rows;

pub use field::{Field, Key};
pub use pool::pool;
pub(crate) use rows::in_row;
pub use rows::{Column, Control, Solved, chain_rows, chained_shape, solve_rows};
