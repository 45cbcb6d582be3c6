//! Tendons and the recipes of the holes that they pass.

use std::f64::consts::TAU;

use crate::error::{InvalidInput, finite, length, positive};
use crate::hashing::{Bits, hash_by_bits};

/// One value for all disks, or one per disk 0..end.
///
/// ```
/// use tdcr::robot::PerDisk;
///
/// let radius = PerDisk::Each(vec![0.010, 0.009, 0.008]);
/// assert_eq!((radius.at(2), radius.count()), (0.008, Some(3)));
/// assert_eq!(PerDisk::Same(0.01).at(7), 0.01);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum PerDisk {
    /// One value on every disk.
    Same(f64),
    /// One per disk, disk 0 first.
    Each(Vec<f64>),
}

impl PerDisk {
    /// The value at a disk.
    #[must_use]
    pub fn at(&self, disk: usize) -> f64 {
        match self {
            Self::Same(value) => *value,
            Self::Each(values) => values[disk],
        }
    }

    /// Number of values when there is one per disk.
    #[must_use]
    pub fn count(&self) -> Option<usize> {
        match self {
            Self::Same(_) => None,
            Self::Each(values) => Some(values.len()),
        }
    }

    fn as_slice(&self) -> &[f64] {
        match self {
            Self::Same(value) => std::slice::from_ref(value),
            Self::Each(values) => values,
        }
    }

    fn as_mut_slice(&mut self) -> &mut [f64] {
        match self {
            Self::Same(value) => std::slice::from_mut(value),
            Self::Each(values) => values,
        }
    }
}

/// The recipe by which a tendon's holes are found; kept as given, resolved by the robot.
///
/// ```
/// use tdcr::robot::{PerDisk, Routing, Tendon};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// // Half a turn about the backbone, 10 mm from it, up to disk 8.
/// let routing = Routing::Helical { azimuth: 0.0, radius: 0.01, turns: 0.5 };
/// let tendon = Tendon::new(routing, Some(8), None, None)?;
/// assert_eq!(tendon.end(), Some(8));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum Routing {
    /// Azimuth \[rad\] and radius \[m\] of the hole on each disk; both constant is straight routing.
    Angles {
        /// Azimuth of the hole \[rad\].
        azimuth: PerDisk,
        /// Distance of the hole from the disk centre \[m\].
        radius: PerDisk,
    },
    /// Azimuth linear in arc length from base to end.
    Helical {
        /// Azimuth at the base \[rad\].
        azimuth: f64,
        /// Distance of the holes from the disk centre \[m\].
        radius: f64,
        /// Turns from base to end, positive counter-clockwise about +z.
        turns: f64,
    },
    /// Holes by number on disks with `count` evenly spaced holes.
    Holes {
        /// Hole number on each disk, 0-based, counter-clockwise.
        indices: Vec<usize>,
        /// Holes per disk.
        count: usize,
        /// Distance of the holes from the disk centre \[m\].
        radius: PerDisk,
        /// Azimuth of hole 0 \[rad\].
        azimuth: f64,
    },
}

/// A cable, by its recipe.
///
/// ```
/// use tdcr::robot::Tendon;
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let tendon = Tendon::straight(0.0, 0.01)?;
/// assert_eq!((tendon.end(), tendon.stiffness()), (None, None));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Tendon {
    routing: Routing,
    end: Option<usize>,
    stiffness: Option<f64>,
    name: Option<String>,
}

impl Tendon {
    /// Checks a recipe on its own; whether it fits a backbone is the robot's question.
    ///
    /// # Errors
    /// `InvalidInput` naming the field: a number that is not finite, a radius or stiffness that is
    /// not positive, an `end` of 0 or that does not fit the values per disk, a hole number beyond
    /// the count, an empty name.
    pub fn new(
        mut routing: Routing,
        end: Option<usize>,
        stiffness: Option<f64>,
        name: Option<String>,
    ) -> Result<Self, InvalidInput> {
        check_numbers(&mut routing)?;
        if end == Some(0) {
            return Err(InvalidInput::new("end", "a disk from 1 on (disk 0 is the base)", 0));
        }
        if let Some(stiffness) = stiffness {
            positive("stiffness", "N", stiffness)?;
        }
        if name.as_ref().is_some_and(|name| name.trim().is_empty()) {
            return Err(InvalidInput::new("name", "a name that is not empty", "''"));
        }
        let tendon = Self { routing, end, stiffness, name };
        tendon.check_counts(end)?;
        Ok(tendon)
    }

    /// A straight tendon that ends at the tip.
    ///
    /// # Errors
    /// `InvalidInput` for an azimuth that is not finite or a radius that is not positive.
    pub fn straight(azimuth: f64, radius: f64) -> Result<Self, InvalidInput> {
        let routing =
            Routing::Angles { azimuth: PerDisk::Same(azimuth), radius: PerDisk::Same(radius) };
        Self::new(routing, None, None, None)
    }

    /// The recipe of its holes.
    #[must_use]
    pub fn routing(&self) -> &Routing {
        &self.routing
    }

    /// Disk where it terminates, if stated; else the tip.
    #[must_use]
    pub fn end(&self) -> Option<usize> {
        self.end
    }

    /// Axial stiffness EA \[N\], if stated; else rigid.
    #[must_use]
    pub fn stiffness(&self) -> Option<f64> {
        self.stiffness
    }

    /// Its name, if it has one.
    #[must_use]
    pub fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// Checks that values given per disk are one for each of the disks 0..end.
    pub(super) fn check_counts(&self, end: Option<usize>) -> Result<(), InvalidInput> {
        let counts: [(&str, Option<usize>); 2] = match &self.routing {
            Routing::Angles { azimuth, radius } => {
                [("azimuth", azimuth.count()), ("radius", radius.count())]
            }
            Routing::Helical { .. } => return Ok(()),
            Routing::Holes { indices, radius, .. } => {
                [("indices", Some(indices.len())), ("radius", radius.count())]
            }
        };
        let first = counts.iter().find_map(|(_, count)| *count);
        let wanted = end.map(|end| end + 1).or(first);
        for (argument, count) in counts {
            match (count, wanted) {
                (Some(count), Some(wanted)) if count != wanted => {
                    let expected = format!("{wanted} values, one per disk 0..{}", wanted - 1);
                    return Err(InvalidInput::new(argument, expected, count));
                }
                (Some(count), _) if count < 2 => {
                    let expected = "at least 2 values, one per disk 0..end";
                    return Err(InvalidInput::new(argument, expected, count));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Azimuth \[rad\] and radius \[m\] of the hole on each disk 0..end.
    pub(super) fn resolve(&self, end: usize, arc_lengths: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let disks = 0..=end;
        match &self.routing {
            Routing::Angles { azimuth, radius } => (
                disks.clone().map(|i| azimuth.at(i)).collect(),
                disks.map(|i| radius.at(i)).collect(),
            ),
            Routing::Helical { azimuth, radius, turns } => {
                let rate = TAU * turns / arc_lengths[end];
                (
                    disks.clone().map(|i| azimuth + rate * arc_lengths[i]).collect(),
                    vec![*radius; end + 1],
                )
            }
            Routing::Holes { indices, count, radius, azimuth } => {
                let step = TAU / *count as f64;
                (
                    indices.iter().map(|&index| azimuth + step * index as f64).collect(),
                    disks.map(|i| radius.at(i)).collect(),
                )
            }
        }
    }
}

hash_by_bits!(Tendon, |tendon, bits| {
    match &tendon.routing {
        Routing::Angles { azimuth, radius } => {
            bits.floats(azimuth.as_slice());
            bits.floats(radius.as_slice());
        }
        Routing::Helical { azimuth, radius, turns } => bits.floats(&[*azimuth, *radius, *turns]),
        Routing::Holes { indices, count, radius, azimuth } => {
            bits.counts(indices);
            bits.counts(&[*count]);
            bits.floats(radius.as_slice());
            bits.float(*azimuth);
        }
    }
    bits.counts(tendon.end.as_slice());
    bits.option(tendon.stiffness);
    bits.text(tendon.name.as_deref());
});

fn check_numbers(routing: &mut Routing) -> Result<(), InvalidInput> {
    match routing {
        Routing::Angles { azimuth, radius } => {
            for value in azimuth.as_mut_slice() {
                *value = finite("azimuth", "rad", *value)?;
            }
            check_radius(radius)
        }
        Routing::Helical { azimuth, radius, turns } => {
            *azimuth = finite("azimuth", "rad", *azimuth)?;
            *turns = finite("turns", "1", *turns)?;
            length("radius", *radius).map(|_| ())
        }
        Routing::Holes { indices, count, radius, azimuth } => {
            *azimuth = finite("azimuth", "rad", *azimuth)?;
            if *count == 0 {
                return Err(InvalidInput::new("count", "at least 1 hole per disk", 0));
            }
            if let Some(index) = indices.iter().find(|&index| index >= count) {
                let expected = format!("hole numbers from 0 to {}", *count - 1);
                return Err(InvalidInput::new("indices", expected, index));
            }
            check_radius(radius)
        }
    }
}

fn check_radius(radius: &PerDisk) -> Result<(), InvalidInput> {
    for &value in radius.as_slice() {
        length("radius", value)?;
    }
    Ok(())
}
