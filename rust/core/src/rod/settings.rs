//! Choices of the rod model.

use super::tendon_law::TendonLaw;
use crate::error::InvalidInput;

/// Kinematics of an element (design rule of the papers, or a rod's own).
///
/// ```
/// use tdcr::rod::{RodSettings, Subsegment};
///
/// let settings = RodSettings { subsegment: Subsegment::Link, ..RodSettings::default() };
/// assert_eq!(settings.subsegment.as_str(), "link");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Subsegment {
    /// A constant-strain arc.
    #[default]
    Arc,
    /// A rigid link that bisects the bend, as in the papers.
    Link,
}

impl Subsegment {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Arc, Self::Link];

    /// The name used in Python.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Arc => "arc",
            Self::Link => "link",
        }
    }
}

/// Choices of the rod model.
///
/// ```
/// use tdcr::rod::RodSettings;
///
/// let settings = RodSettings { elements: 2, ..RodSettings::default() };
/// assert!(settings.validate().is_ok());
/// assert!(RodSettings { elements: 0, ..settings }.validate().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RodSettings {
    /// Kinematics of an element.
    pub subsegment: Subsegment,
    /// Law by which displacements are imposed.
    pub tendons: TendonLaw,
    /// Elements stretch; needs Young's modulus and diameter.
    pub axial: bool,
    /// Elements between two disks.
    pub elements: usize,
    /// Relative residual of forces and lengths that counts as solved.
    pub tolerance: f64,
    /// Evaluations of the whole rod at most, each of which ends in a Newton step.
    pub max_iterations: usize,
    /// Radius of a body around the backbone that keeps clear of obstacles, for a
    /// [`Scene`](super::contact::Scene) \[m\]; 0 for none.
    pub body_radius: f64,
}

impl Default for RodSettings {
    fn default() -> Self {
        Self {
            subsegment: Subsegment::Arc,
            tendons: TendonLaw::Sliding,
            axial: false,
            elements: 1,
            tolerance: 1e-11,
            max_iterations: 600,
            body_radius: 0.0,
        }
    }
}

/// Elements per subsegment at most.
const MOST_ELEMENTS: usize = 100;
/// Rounding of a thousand subsegments; below it, shapes that exist would be infeasible.
const LEAST_TOLERANCE: f64 = 1e-13;

impl RodSettings {
    /// Checks the values.
    ///
    /// # Errors
    /// `InvalidInput` for a value out of range.
    pub fn validate(&self) -> Result<(), InvalidInput> {
        if !(1..=MOST_ELEMENTS).contains(&self.elements) {
            let expected = format!("a whole number from 1 to {MOST_ELEMENTS}");
            return Err(InvalidInput::new("elements", expected, self.elements));
        }
        if !(LEAST_TOLERANCE..=1e-3).contains(&self.tolerance) {
            let expected = format!("a number from {LEAST_TOLERANCE:e} to 1e-3");
            return Err(InvalidInput::new("tolerance", expected, format!("{:?}", self.tolerance)));
        }
        if self.max_iterations == 0 || self.max_iterations > 1_000_000 {
            let expected = "a whole number from 1 to 1000000";
            return Err(InvalidInput::new("max_iterations", expected, self.max_iterations));
        }
        if !(self.body_radius.is_finite() && self.body_radius >= 0.0) {
            let got = format!("{:?}", self.body_radius);
            return Err(InvalidInput::new("body_radius", "0 m or more", got));
        }
        Ok(())
    }
}
