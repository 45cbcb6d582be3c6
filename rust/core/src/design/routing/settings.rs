//! Choices of a routing design.

use crate::error::InvalidInput;
use crate::rod::RodSettings;

/// Choices of a routing design.
///
/// ```
/// use tdcr::design::RoutingSettings;
///
/// // Any azimuth instead of twelve holes.
/// let settings = RoutingSettings { holes: None, ..RoutingSettings::default() };
/// assert!(settings.validate().is_ok());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoutingSettings {
    /// Settings of the rod model that the design is for.
    pub rod: RodSettings,
    /// Evenly spaced holes per disk; none: any azimuth.
    pub holes: Option<usize>,
    /// Azimuth of hole 0 \[rad\].
    pub azimuth: f64,
    /// Holes between those of neighbouring disks at most; none: all.
    pub max_jump: Option<usize>,
    /// Smallest and largest radius of holes with any azimuth \[m\]; none: the robot's own radii.
    pub radius: Option<(f64, f64)>,
    /// Beginnings of routings that are followed from disk to disk.
    pub beam_width: usize,
    /// Distance of every disk that counts as reached, in shares of the robot's length.
    pub tolerance: f64,
    /// Steps of a descent, and rounds of a search, at most.
    pub max_iterations: usize,
}

impl Default for RoutingSettings {
    fn default() -> Self {
        Self {
            rod: RodSettings::default(),
            holes: Some(12),
            azimuth: 0.0,
            max_jump: None,
            radius: None,
            beam_width: 256,
            tolerance: 1e-8,
            max_iterations: 100,
        }
    }
}

/// Holes per disk and beam widths are not larger.
const MOST_HOLES: usize = 360;
const WIDEST: usize = 1_000_000;

impl RoutingSettings {
    /// Checks the values.
    ///
    /// # Errors
    /// `InvalidInput` for a value out of range, proportional tendons, and radii for holes that are given.
    pub fn validate(&self) -> Result<(), InvalidInput> {
        // The rod model.
        self.rod.validate()?;
        let expected = "\"sliding\" (a proportional piece depends on the whole routing)";
        self.rod.tendons.require_tensions("rod.tendons", expected)?;
        // Holes, by number or of any azimuth.
        if let Some(holes) = self.holes
            && !(1..=MOST_HOLES).contains(&holes)
        {
            let expected = format!("1 to {MOST_HOLES} holes, or none for any azimuth");
            return Err(InvalidInput::new("holes", expected, holes));
        }
        if !self.azimuth.is_finite() {
            return Err(InvalidInput::new("azimuth", "a finite number [rad]", self.azimuth));
        }
        if let (None, Some(jump)) = (self.holes, self.max_jump) {
            let expected = "none where any azimuth is allowed";
            return Err(InvalidInput::new("max_jump", expected, jump));
        }
        // Radii are free only where azimuths are.
        if let Some((low, high)) = self.radius {
            if self.holes.is_some() {
                let expected = "none where holes are given: they have the robot's radii";
                return Err(InvalidInput::new("radius", expected, format!("({low:?}, {high:?})")));
            }
            if !(low > 0.0 && low <= high && high.is_finite()) {
                let expected = "0 < smallest <= largest [m]";
                return Err(InvalidInput::new("radius", expected, format!("({low:?}, {high:?})")));
            }
        }
        // The search.
        if !(1..=WIDEST).contains(&self.beam_width) {
            let expected = format!("a whole number from 1 to {WIDEST}");
            return Err(InvalidInput::new("beam_width", expected, self.beam_width));
        }
        if !(self.tolerance > 0.0 && self.tolerance <= 1e-2) {
            let got = format!("{:?}", self.tolerance);
            return Err(InvalidInput::new("tolerance", "a share in (0, 1e-2]", got));
        }
        if self.max_iterations == 0 {
            return Err(InvalidInput::new("max_iterations", "at least 1", 0));
        }
        Ok(())
    }
}
