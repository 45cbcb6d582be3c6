//! State of a load: what is given of the tendons, and the shape and multipliers that were found for it.

use super::augmented_lagrangian::Minimizer;
use super::lagrangian::{MultiplierEstimate, TendonInput};
use crate::rod::plan::Plan;

/// Target of the tendons: greatest lengths without elasticity \[m\], or tensions.
#[derive(Clone, Debug)]
pub(in crate::rod) enum TendonTarget {
    Lengths(Vec<f64>),
    Tensions(Vec<f64>),
}

impl TendonTarget {
    pub(super) fn input(&self) -> TendonInput<'_> {
        match self {
            Self::Lengths(lengths) => TendonInput::Lengths(lengths),
            Self::Tensions(tensions) => TendonInput::Tensions(tensions),
        }
    }

    /// Target at a share of the way from an earlier one of its kind, or from rest. Tendons are let out before others
    /// are pulled.
    pub(super) fn at_share(&self, from: Option<&Self>, plan: &Plan, share: f64) -> Self {
        match self {
            Self::Lengths(wanted) => {
                let start = |k: usize| match from {
                    Some(Self::Lengths(lengths)) => lengths[k],
                    _ => plan.rest_lengths[k],
                };
                let at = |(k, wanted): (usize, &f64)| {
                    let start = if start(k).is_finite() { start(k) } else { *wanted };
                    if *wanted < start { start + share * (wanted - start) } else { *wanted }
                };
                Self::Lengths(wanted.iter().enumerate().map(at).collect())
            }
            Self::Tensions(wanted) => {
                let start = |k: usize| match from {
                    Some(Self::Tensions(tensions)) => tensions[k],
                    _ => 0.0,
                };
                let at = |(k, wanted): (usize, &f64)| {
                    if share < 1.0 { start(k) + share * (wanted - start(k)) } else { *wanted }
                };
                Self::Tensions(wanted.iter().enumerate().map(at).collect())
            }
        }
    }
}

/// Strains, multipliers and target of the last solve, or at the last load that was reached.
#[derive(Clone, Debug, Default)]
pub(in crate::rod) struct Checkpoint {
    strains: Vec<f64>,
    tensions: Vec<f64>,
    contacts: Vec<MultiplierEstimate>,
    pub(super) target: Option<TendonTarget>,
}

impl Checkpoint {
    /// Copies the shape and the multipliers.
    pub(super) fn save(&mut self, minimizer: &Minimizer) {
        self.strains.clone_from(&minimizer.current.strains);
        self.tensions.clone_from(&minimizer.estimates.tensions);
        self.contacts.clone_from(&minimizer.estimates.contacts);
    }

    /// Copies the shape and the multipliers back.
    pub(super) fn restore(&self, minimizer: &mut Minimizer) {
        minimizer.current.strains.clone_from(&self.strains);
        minimizer.estimates.tensions.clone_from(&self.tensions);
        minimizer.estimates.contacts.clone_from(&self.contacts);
    }
}
