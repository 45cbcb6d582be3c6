//! Conversions between Python and the core: arguments, arrays, long calls, names of the Python side.

pub(crate) mod arguments;
pub(crate) mod arrays;
pub(crate) mod interruptible;
pub(crate) mod python_side;
