//! Design inverses from Python.

pub(crate) mod prebend;
pub(crate) mod routing;
