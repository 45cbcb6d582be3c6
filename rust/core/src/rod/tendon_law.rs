//! Law of a tendon: what its displacement imposes on the pieces between the disks.
//!
//! Every decision that depends on the law is a `match` without a default here, or asks one of these: a new law
//! compiles once each of them is answered.

use crate::error::InvalidInput;

/// Law of a tendon that runs from hole to hole: how its displacement is imposed.
///
/// ```
/// use tdcr::rod::{RodSettings, TendonLaw};
///
/// let settings = RodSettings { tendons: TendonLaw::Proportional, ..RodSettings::default() };
/// assert_eq!(settings.tendons.as_str(), "proportional");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TendonLaw {
    /// The total length is bounded; no friction. The multiplier is the tension.
    #[default]
    Sliding,
    /// Every piece shrinks by the same ratio, as in the papers.
    Proportional,
}

/// Length equations of a tendon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Equations {
    /// One for the sum of its pieces: the subsegments share its tension.
    PerTendon,
    /// One for every piece: the subsegments share nothing.
    PerPiece,
}

/// Numbers of a piece that the bound of its length equation is made of.
#[derive(Clone, Copy, Debug)]
pub(super) struct PieceBound {
    /// The piece is the first one of its tendon, from the base.
    pub(super) first: bool,
    /// Length of the piece at rest \[m\].
    pub(super) piece: f64,
    /// Length of its whole tendon at rest \[m\].
    pub(super) tendon: f64,
    /// Displacement of the tendon \[m\].
    pub(super) displacement: f64,
    /// Elastic strain of the tendon under the tension of the piece.
    pub(super) strain: f64,
}

/// Rates of what the bound depends on, or weights by them \[m\].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BoundRate {
    /// Rate of the length of the piece at rest.
    pub(super) piece: f64,
    /// Rate of the length of the whole tendon at rest.
    pub(super) tendon: f64,
    /// Rate of the displacement.
    pub(super) displacement: f64,
    /// Of the elastic strain.
    pub(super) strain: f64,
}

impl TendonLaw {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Sliding, Self::Proportional];

    /// The name used in Python.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Sliding => "sliding",
            Self::Proportional => "proportional",
        }
    }

    /// Length equations that the law poses.
    pub(super) fn equations(self) -> Equations {
        match self {
            Self::Sliding => Equations::PerTendon,
            Self::Proportional => Equations::PerPiece,
        }
    }

    /// Refuses a law under which one tension per tendon does not determine the shape.
    ///
    /// # Errors
    /// `InvalidInput` of the setting `argument`, with what was expected.
    pub(crate) fn require_tensions(
        self,
        argument: &str,
        expected: &str,
    ) -> Result<(), InvalidInput> {
        match self {
            Self::Sliding => Ok(()),
            Self::Proportional => {
                Err(InvalidInput::new(argument, expected, format!("{:?}", self.as_str())))
            }
        }
    }

    /// Excess length of a tendon that a message reports: one that may be slack is never too short without tension.
    pub(super) fn reported_excess(self, excess: f64, tension: f64) -> f64 {
        match self {
            Self::Sliding if tension == 0.0 => excess.max(0.0),
            Self::Sliding | Self::Proportional => excess.abs(),
        }
    }

    /// Bound of the length of a piece's equation, for the lengths at rest of the piece and of its whole tendon.
    pub(super) fn bound(self, piece: f64, tendon: f64, displacement: f64) -> f64 {
        match self {
            Self::Sliding => tendon + displacement,
            Self::Proportional => (1.0 + displacement / tendon) * piece,
        }
    }

    /// Derivative of a piece's bound by its tendon's displacement.
    pub(super) fn bound_slope(self, piece: f64, tendon: f64) -> f64 {
        match self {
            Self::Sliding => 1.0,
            Self::Proportional => piece / tendon,
        }
    }

    /// Share of a piece in the rate of its equation's bound, elasticity of the tendon included.
    pub(super) fn bound_rate(self, at: &PieceBound, rate: &BoundRate) -> f64 {
        match self {
            Self::Sliding if at.first => {
                rate.tendon * (1.0 + at.strain) + rate.displacement + at.tendon * rate.strain
            }
            Self::Sliding => 0.0,
            Self::Proportional => {
                let ratio =
                    (rate.displacement - at.displacement * rate.tendon / at.tendon) / at.tendon;
                let strain = 1.0 + at.displacement / at.tendon + at.strain;
                rate.piece * strain + at.piece * (ratio + rate.strain)
            }
        }
    }

    /// Adjoint of [`Self::bound_rate`]: weights of the rates for a weight of the bound.
    pub(super) fn bound_weights(self, at: &PieceBound, weight: f64) -> BoundRate {
        match self {
            Self::Sliding if at.first => BoundRate {
                tendon: weight * (1.0 + at.strain),
                displacement: weight,
                strain: weight * at.tendon,
                ..BoundRate::default()
            },
            Self::Sliding => BoundRate::default(),
            Self::Proportional => {
                let displacement = weight * at.piece / at.tendon;
                BoundRate {
                    piece: weight * (1.0 + at.displacement / at.tendon + at.strain),
                    tendon: -(displacement * at.displacement / at.tendon),
                    displacement,
                    strain: weight * at.piece,
                }
            }
        }
    }
}
