//! Continuation in the load: from rest, or from an earlier shape, to the target of the tendons and the whole loads.

use std::sync::atomic::AtomicBool;

use super::augmented_lagrangian::{Problem, Residuals};
use super::load_state::{Checkpoint, TendonTarget};
use super::model::{LoadedRod, Scratch};
use crate::obstacle::Fault;
use crate::rod::dual_newton::Ending;
use crate::rod::plan::Plan;

/// First step among obstacles, as a share of the load, and the shortest.
const FIRST_STEP: f64 = 0.25;
const SHORTEST_STEP: f64 = 1e-3;
/// A load step of so few Newton steps makes the next one longer.
const EASY: usize = 10;
/// Newton steps that one load step may take.
const PATIENCE: usize = 200;
/// Slip that is allowed to a point in one step, as a share of a subsegment.
const ALLOWED_SLIP: f64 = 0.25;
/// Compliance c of a contact, as a share of the rod's own there, and the least of tendons, as one of that at the tip.
const CONTACT_COMPLIANCE: f64 = 0.1;
const LEAST_TENDON_COMPLIANCE: f64 = 0.04;

impl LoadedRod<'_> {
    /// Sets the rest shape without multipliers, and compliances that are small against the rod's.
    pub(in crate::rod) fn set_rest(&self, work: &mut Scratch) {
        let plan = self.plan();
        let count = plan.rest_lengths.len();
        let chain = &mut work.chain;
        chain.reset(plan);
        chain.set_bounds(plan, &vec![0.0; count]);
        chain.added_compliance = 0.0;
        chain.assemble(plan, f64::INFINITY);
        work.minimizer.current.strains.clone_from(&chain.strains);
        self.reset_compliance(work);
        let estimates = &mut work.minimizer.estimates;
        estimates.tensions.clear();
        estimates.tensions.resize(count, 0.0);
        estimates.contacts.clear();
    }

    /// Sets the compliances c that every load step starts with.
    fn reset_compliance(&self, work: &mut Scratch) {
        let plan = self.plan();
        let count = plan.rest_lengths.len();
        let estimates = &mut work.minimizer.estimates;
        write_contact_compliance(plan, &mut estimates.contact_compliance);
        let tip = estimates.contact_compliance.last().copied().unwrap_or_default();
        let least = LEAST_TENDON_COMPLIANCE * tip;
        estimates.stiffness = 1.0;
        estimates.tendon_compliance.clear();
        let own = (0..count).map(|k| work.chain.schur[k * (count + 1)].max(least));
        estimates.tendon_compliance.extend(own);
    }

    /// Goes back to a checkpoint, with the compliances that a load step starts with.
    pub(in crate::rod) fn restore(&self, checkpoint: &Checkpoint, work: &mut Scratch) {
        checkpoint.restore(&mut work.minimizer);
        self.reset_compliance(work);
    }

    /// Steps the load from the shape at hand to the whole: from rest, or under the whole loads from the target that was
    /// met there.
    pub(in crate::rod) fn step_load(
        &self,
        wanted: &TendonTarget,
        from: Option<&TendonTarget>,
        work: &mut Scratch,
        budget: &mut usize,
        stop: Option<&AtomicBool>,
    ) -> Result<(), Fault> {
        let plan = self.plan();
        let is_free = self.scene().obstacles.is_empty();
        let mut step = if is_free || from.is_some() { 1.0 } else { FIRST_STEP };
        (work.load, work.saddles_left) = (0.0, 0);
        // Where to go back to if the first step fails.
        work.checkpoint.save(&work.minimizer);
        while work.load < 1.0 {
            // The minimum of M at the next load, in a part of the budget.
            let next = (work.load + step).min(1.0);
            let target = wanted.at_share(from, plan, next);
            let problem = Problem {
                plan,
                scene: self.scene(),
                load_share: if from.is_none() { next } else { 1.0 },
                tendons: target.input(),
                detection: self.detection_distance(),
                allowed_slip: ALLOWED_SLIP * self.shortest,
                keeps_side: work.initial_penetration.is_none(),
                stop,
            };
            let granted = PATIENCE.min(*budget);
            *budget -= granted;
            let mut remaining = granted;
            let (ending, residuals) = work.minimizer.minimize(&problem, &mut remaining)?;
            *budget += remaining;
            work.residuals = residuals;
            if ending == Ending::Stopped {
                work.ending = ending;
                return Ok(());
            }
            // Reached: on from here, in a longer step after an easy one.
            if ending == Ending::Converged {
                work.load = next;
                work.saddles_left += residuals.saddles_left;
                step *= if granted - remaining <= EASY { 2.0 } else { 1.0 };
                work.checkpoint.save(&work.minimizer);
                work.checkpoint.target = Some(target);
                self.reset_compliance(work);
                continue;
            }
            // Not reached: back to the last load, and a shorter step from there.
            work.checkpoint.restore(&mut work.minimizer);
            self.reset_compliance(work);
            // A quarter, so that a short step is found soon.
            step *= 0.25;
            if step < SHORTEST_STEP || *budget == 0 {
                // The end: residuals are those of the last load's shape under the next one.
                let is_spent = *budget == 0 && !residuals.locked;
                work.ending = if is_spent { Ending::Spent } else { ending };
                let mut once = 1;
                let (_, last) = work.minimizer.minimize(&problem, &mut once)?;
                work.residuals = Residuals { locked: residuals.locked, ..last };
                return Ok(());
            }
        }
        work.ending = Ending::Converged;
        Ok(())
    }
}

/// Compliances c of contacts: shares of `Σ (s_i - s_j)² / k_j`, how far the rod yields to a force across it at disk i.
fn write_contact_compliance(plan: &Plan, out: &mut Vec<f64>) {
    out.clear();
    // Sums of 1, s and s² over the stiffness, s the place of a subsegment.
    let (mut s, mut sums) = (0.0, [0.0; 3]);
    for i in 0..=plan.data.len() {
        out.push(CONTACT_COMPLIANCE * (s * s * sums[0] - 2.0 * s * sums[1] + sums[2]));
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
