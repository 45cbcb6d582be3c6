//! Planar trunks.
mod chord;
mod two_section;

pub use two_section::TwoSections;
