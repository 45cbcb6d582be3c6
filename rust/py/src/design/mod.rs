//! Design inverses from Python.

pub(crate) mod fit;
pub(crate) mod prebend;
pub(crate) mod routing;
