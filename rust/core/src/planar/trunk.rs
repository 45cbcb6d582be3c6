//! Sections bent to arcs in one plane, and the cables that bend them (Mahfoudi et al. 2014, eqs. 1-9).

use nalgebra::Vector2;

use super::chord::{Chord, Point};
use crate::error::{InvalidInput, finite, length, positive};

/// Reading of the two cable lengths of a section.
///
/// ```
/// use tdcr::planar::{Cables, Trunk};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let trunk = Trunk::new(vec![0.14], 0.06)?;
/// let [l1, l2] = trunk.cable_lengths(&[0.5], Cables::Arcs)?[0];
/// assert!((l2 - l1 - 0.06 * 0.5).abs() < 1e-15);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Cables {
    /// Straight lines between the platforms (eq. 2): `l2 - l1 = 2 d sin(turn/2)`, |turn| up to pi.
    #[default]
    Chords,
    /// Arcs parallel to the axis: `l2 - l1 = d turn`.
    Arcs,
}

impl Cables {
    /// Both, in the order of their discriminants.
    pub const ALL: [Self; 2] = [Self::Chords, Self::Arcs];

    /// The name used in Python.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Chords => "chords",
            Self::Arcs => "arcs",
        }
    }
}

/// A planar trunk: inextensible sections in a row, two cables along each at equal distances from the
/// axis, cable 1 on the left (+y) and cable 2 on the right.
///
/// ```
/// use tdcr::planar::Trunk;
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let trunk = Trunk::new(vec![0.14, 0.12], 0.06)?;
/// let (tip, heading) = trunk.platforms(&[0.5, -0.5])[1];
/// assert!(tip.y > 0.0 && heading.abs() < 1e-15);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Trunk {
    lengths: Vec<f64>,
    cable_distance: f64,
}

/// Turns that cables give, and what of the cables is not used.
///
/// ```
/// use tdcr::planar::{Cables, Trunk};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let trunk = Trunk::new(vec![0.14], 0.06)?;
/// // The mean of the cables is 1 mm longer than the section.
/// let read = trunk.turns(&[[0.126, 0.156]], Cables::Arcs)?;
/// assert!((read.turns[0] - 0.5).abs() < 1e-12 && (read.misfit[0] - 0.001).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct CableTurns {
    /// Turn of every section \[rad\].
    pub turns: Vec<f64>,
    /// Mean cable length minus the one that fits the section, per section \[m\].
    pub misfit: Vec<f64>,
}

impl Trunk {
    /// From the lengths of the sections, base first, and the distance between the two cables \[m\].
    ///
    /// # Errors
    /// `InvalidInput` for no section, or a length or distance that is not positive.
    pub fn new(lengths: Vec<f64>, cable_distance: f64) -> Result<Self, InvalidInput> {
        if lengths.is_empty() {
            return Err(InvalidInput::new("lengths", "at least one section", "none"));
        }
        for (i, &section) in lengths.iter().enumerate() {
            length(&format!("lengths[{i}]"), section)?;
        }
        length("cable_distance", cable_distance)?;
        Ok(Self { lengths, cable_distance })
    }

    /// Lengths of the sections, base first \[m\].
    #[must_use]
    pub fn lengths(&self) -> &[f64] {
        &self.lengths
    }

    /// Refuses turns that are not one finite number per section.
    ///
    /// # Errors
    /// `InvalidInput` that says which.
    pub fn check_turns(&self, turns: &[f64]) -> Result<(), InvalidInput> {
        if turns.len() != self.lengths.len() {
            let expected = format!("{} values, one per section", self.lengths.len());
            return Err(InvalidInput::new("turns", expected, turns.len()));
        }
        for (i, &turn) in turns.iter().enumerate() {
            finite(&format!("turns[{i}]"), "rad", turn)?;
        }
        Ok(())
    }

    /// Turns of given cable lengths (l1, l2) per section \[m\] (eqs. 3-5). Only `l2 - l1` is used; a
    /// mean that does not fit the section is reported.
    ///
    /// # Errors
    /// `InvalidInput` for another number of pairs than sections, a length that is not positive, or
    /// chords that differ by more than twice the cable distance.
    pub fn turns(&self, cables: &[[f64; 2]], reading: Cables) -> Result<CableTurns, InvalidInput> {
        if cables.len() != self.lengths.len() {
            let expected = format!("{} pairs (l1, l2), one per section", self.lengths.len());
            return Err(InvalidInput::new("cable_lengths", expected, cables.len()));
        }
        let mut bent = CableTurns { turns: Vec::new(), misfit: Vec::new() };
        for (i, (&[l1, l2], section)) in cables.iter().zip(&self.lengths).enumerate() {
            for (k, cable) in [l1, l2].into_iter().enumerate() {
                positive(&format!("cable_lengths[{i}][{k}]"), "m", cable)?;
            }
            let share = (l2 - l1) / self.cable_distance;
            let rounding = (2.0 * f64::EPSILON * (l1 + l2) / self.cable_distance).max(1e-12);
            let turn = match reading {
                Cables::Arcs => share,
                // Half a circle, whose lengths have been rounded, is one.
                Cables::Chords if share.abs() <= 2.0 + rounding => {
                    let sin = (0.5 * share).clamp(-1.0, 1.0);
                    2.0 * sin.atan2((1.0 - sin * sin).sqrt())
                }
                Cables::Chords => {
                    let expected = "chords that differ by at most twice the cable distance";
                    let got = format!("{} m apart", (l2 - l1).abs());
                    let argument = format!("cable_lengths[{i}]");
                    return Err(InvalidInput::new(argument, expected, got));
                }
            };
            let fits = section * mean_share(turn, reading);
            bent.turns.push(turn);
            bent.misfit.push(0.5 * (l1 + l2) - fits);
        }
        Ok(bent)
    }

    /// Cable lengths (l1, l2) per section \[m\] at given turns.
    ///
    /// # Errors
    /// `InvalidInput` for turns that do not fit the trunk, a chord turned by more than pi, or a turn
    /// that leaves a cable no length.
    pub fn cable_lengths(
        &self,
        turns: &[f64],
        reading: Cables,
    ) -> Result<Vec<[f64; 2]>, InvalidInput> {
        self.check_turns(turns)?;
        let one = |(i, (turn, section)): (usize, (&f64, &f64))| {
            let apart = match reading {
                Cables::Arcs => self.cable_distance * turn,
                Cables::Chords => 2.0 * self.cable_distance * (0.5 * turn).sin(),
            };
            let mean = section * mean_share(*turn, reading);
            let [l1, l2] = [mean - 0.5 * apart, mean + 0.5 * apart];
            let legal = reading == Cables::Arcs || turn.abs() <= std::f64::consts::PI;
            if legal && l1 > 0.0 && l2 > 0.0 {
                return Ok([l1, l2]);
            }
            let expected = "a turn that leaves both cables a length (chords: within pi) [rad]";
            Err(InvalidInput::new(format!("turns[{i}]"), expected, turn))
        };
        turns.iter().zip(&self.lengths).enumerate().map(one).collect()
    }

    /// End of every section: position \[m\] and heading \[rad\], the sum of the turns up to there.
    #[must_use]
    pub fn platforms(&self, turns: &[f64]) -> Vec<(Vector2<f64>, f64)> {
        let (mut at, mut heading) = (Point::new(0.0, 0.0), 0.0_f64);
        let ends = turns.iter().zip(&self.lengths).map(|(turn, length)| {
            at += Point::new(heading.cos(), heading.sin()) * Chord::new(*turn).value * length;
            heading += turn;
            (Vector2::new(at.re, at.im), heading)
        });
        ends.collect()
    }

    /// The exact curve: `points` (at least 2) evenly spaced on every section, its ends included, as
    /// (s, x, y, heading) \[m, m, m, rad\].
    #[must_use]
    pub fn curve(&self, turns: &[f64], points: usize) -> Vec<[f64; 4]> {
        let last = points.max(2) - 1;
        let mut out = Vec::with_capacity(self.lengths.len() * (last + 1));
        let (mut at, mut heading, mut start) = (Point::new(0.0, 0.0), 0.0_f64, 0.0);
        for (turn, length) in turns.iter().zip(&self.lengths) {
            let frame = Point::new(heading.cos(), heading.sin());
            let mut end = at;
            for k in 0..=last {
                let share = k as f64 / last as f64;
                end = at + frame * Chord::new(turn * share).value * (length * share);
                out.push([start + length * share, end.re, end.im, heading + turn * share]);
            }
            (at, heading, start) = (end, heading + turn, start + length);
        }
        out
    }
}

/// Mean cable length that fits, as a share of the section's.
fn mean_share(turn: f64, reading: Cables) -> f64 {
    match reading {
        Cables::Arcs => 1.0,
        Cables::Chords => Chord::new(turn).value.norm(),
    }
}
