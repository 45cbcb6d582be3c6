//! Conversions between Python and the core: arguments, arrays, long calls.

pub(crate) mod arguments;
pub(crate) mod arrays;
pub(crate) mod interruptible;
