//! Planar trunks from Python.

pub(crate) mod inverse;
pub(crate) mod trunk;
