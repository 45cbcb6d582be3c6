//! From rest, or from an earlier shape, to what is given of the tendons and the whole loads, in steps.

use std::sync::atomic::AtomicBool;

use super::augmented_lagrangian::{Descent, Left, Surroundings};
use super::lagrangian::{MultiplierEstimate, TendonInput};
use super::model::{LoadedRod, Scratch};
use crate::obstacle::Fault;
use crate::rod::dual_newton::Ending;
use crate::rod::plan::Plan;

/// Share of the load that is taken first among obstacles, the least, and steps that make the next one longer.
const FIRST: f64 = 0.25;
const SHORTEST: f64 = 1e-3;
const EASY: usize = 10;
/// Evaluations that one load step may take.
const PATIENCE: usize = 200;
/// Parts of obstacles within this share of a subsegment are looked at, and points may slip by this share of
/// one in one step.
pub(in crate::rod) const REACH: f64 = 0.5;
const SLIP: f64 = 0.25;
/// Compliance of a contact, as a share of what the rod gives there, and the least of tendons, as one of that at the tip.
const GIVE: f64 = 0.1;
const LEAST: f64 = 0.04;

/// What is given of every tendon: its greatest length without elasticity \[m\], or its tension.
#[derive(Clone, Debug)]
pub(in crate::rod) enum TendonTarget {
    Lengths(Vec<f64>),
    Tensions(Vec<f64>),
}

impl TendonTarget {
    fn drive(&self) -> TendonInput<'_> {
        match self {
            Self::Lengths(lengths) => TendonInput::Lengths(lengths),
            Self::Tensions(tensions) => TendonInput::Tensions(tensions),
        }
    }

    /// A share of the way from an earlier one of its kind, or from rest. Tendons are let out before others are
    /// pulled.
    fn after(&self, from: Option<&Self>, plan: &Plan, share: f64) -> Self {
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

/// Strains, multipliers and what was given, of the last solve or at the last load that was reached.
#[derive(Clone, Debug, Default)]
pub(in crate::rod) struct Checkpoint {
    pub(in crate::rod) strains: Vec<f64>,
    pub(in crate::rod) tensions: Vec<f64>,
    pub(in crate::rod) forces: Vec<MultiplierEstimate>,
    pub(in crate::rod) given: Option<TendonTarget>,
}

impl Checkpoint {
    fn keep(&mut self, descent: &Descent) {
        self.strains.clone_from(&descent.here.strains);
        self.tensions.clone_from(&descent.estimates.tensions);
        self.forces.clone_from(&descent.estimates.forces);
    }

    pub(in crate::rod) fn restore(&self, descent: &mut Descent) {
        descent.here.strains.clone_from(&self.strains);
        descent.estimates.tensions.clone_from(&self.tensions);
        descent.estimates.forces.clone_from(&self.forces);
    }
}

impl LoadedRod<'_> {
    /// Puts the rest shape without multipliers, and compliances that are small against the rod's.
    pub(in crate::rod) fn begin(&self, work: &mut Scratch) {
        let plan = self.plan();
        let count = plan.rest_lengths.len();
        let chain = &mut work.chain;
        chain.reset(plan);
        chain.set_bounds(plan, &vec![0.0; count]);
        chain.added_compliance = 0.0;
        chain.assemble(plan, f64::INFINITY);
        work.descent.here.strains.clone_from(&chain.strains);
        self.stiffen(work);
        let estimates = &mut work.descent.estimates;
        estimates.tensions.clear();
        estimates.tensions.resize(count, 0.0);
        estimates.forces.clear();
    }

    pub(in crate::rod) fn stiffen(&self, work: &mut Scratch) {
        let plan = self.plan();
        let count = plan.rest_lengths.len();
        let estimates = &mut work.descent.estimates;
        contact_gives(plan, &mut estimates.gives);
        let least = LEAST * estimates.gives.last().copied().unwrap_or_default();
        estimates.stiffness = 1.0;
        estimates.tendon_give.clear();
        let own = (0..count).map(|k| work.chain.schur[k * (count + 1)].max(least));
        estimates.tendon_give.extend(own);
    }

    /// What surrounds a step to what is given, under a share of the loads.
    pub(in crate::rod) fn around<'a>(
        &'a self,
        given: &'a TendonTarget,
        share: f64,
        sides: bool,
        stop: Option<&'a AtomicBool>,
    ) -> Surroundings<'a> {
        Surroundings {
            plan: self.plan(),
            scene: self.scene(),
            share,
            drive: given.drive(),
            reach: REACH * self.shortest,
            slip: SLIP * self.shortest,
            sides,
            stop,
        }
    }

    /// From the shape in the descent, with a share of the load there, to the whole: from rest, or under the whole
    /// loads from what was given there.
    pub(in crate::rod) fn climb(
        &self,
        wanted: &TendonTarget,
        from: Option<&TendonTarget>,
        work: &mut Scratch,
        budget: &mut usize,
        stop: Option<&AtomicBool>,
    ) -> Result<(), Fault> {
        let plan = self.plan();
        let free = self.scene().obstacles.is_empty();
        let mut stride = if free || from.is_some() { 1.0 } else { FIRST };
        (work.load, work.nudged) = (0.0, 0);
        work.kept.keep(&work.descent);
        while work.load < 1.0 {
            let next = (work.load + stride).min(1.0);
            let given = wanted.after(from, plan, next);
            let share = if from.is_none() { next } else { 1.0 };
            let around = self.around(&given, share, work.sunk.is_none(), stop);
            let mut patience = PATIENCE.min(*budget);
            *budget -= patience;
            let before = patience;
            let (ending, left) = work.descent.go(&around, &mut patience)?;
            *budget += patience;
            work.left = left;
            if ending == Ending::Stopped {
                work.ending = ending;
                return Ok(());
            }
            if ending == Ending::Converged {
                work.load = next;
                work.nudged += left.nudged;
                stride *= if before - patience <= EASY { 2.0 } else { 1.0 };
                work.kept.keep(&work.descent);
                work.kept.given = Some(given);
                self.stiffen(work);
                continue;
            }
            work.kept.restore(&mut work.descent);
            self.stiffen(work);
            stride *= 0.25;
            if stride < SHORTEST || *budget == 0 {
                work.ending = if *budget == 0 && !left.locked { Ending::Spent } else { ending };
                let mut once = 1;
                let (_, here) = work.descent.go(&around, &mut once)?;
                work.left = Left { locked: left.locked, ..here };
                return Ok(());
            }
        }
        work.ending = Ending::Converged;
        Ok(())
    }
}

/// Compliances of contacts: shares of how far the rod gives way to a force across it at each disk.
fn contact_gives(plan: &Plan, out: &mut Vec<f64>) {
    out.clear();
    // Sums of 1, s and s² over the stiffness, s the place of a subsegment.
    let (mut s, mut sums) = (0.0, [0.0; 3]);
    for i in 0..=plan.data.len() {
        out.push(GIVE * (s * s * sums[0] - 2.0 * s * sums[1] + sums[2]));
        if i < plan.data.len() {
            let (l, bends) = (plan.length(i), plan.bending_compliance(i));
            let middle = s + 0.5 * l;
            for (sum, power) in sums.iter_mut().zip([1.0, middle, middle * middle]) {
                *sum += power * bends;
            }
            s += l;
        }
    }
}
