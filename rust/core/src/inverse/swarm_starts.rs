//! Particle swarms over the unknowns: starts of descents from their best points.

use std::convert::Infallible;
use std::sync::atomic::{AtomicBool, Ordering};

use super::bounds::SearchSpace;
use super::multistart::Multistart;
use crate::solve::convex_region::{Region, RestoreScratch};
use crate::solve::levenberg_marquardt::Problem;
use crate::solve::pso::{Objective, Progress, PsoSettings, Swarm};

/// The squared residual at the nearest point of the region, and the squared way there: a box holds the
/// swarm, the region's other bounds draw it in.
struct Cost<'a, F> {
    squared: F,
    region: &'a Region,
    inside: RestoreScratch,
    point: Vec<f64>,
    stop: Option<&'a AtomicBool>,
}

impl<F: FnMut(&[f64]) -> f64> Objective for Cost<'_, F> {
    type Error = Infallible;

    fn values(
        &mut self,
        points: &[f64],
        size: usize,
        values: &mut [f64],
    ) -> Result<(), Infallible> {
        for (value, place) in values.iter_mut().zip(points.chunks_exact(size)) {
            self.point.clear();
            self.point.extend_from_slice(place);
            // A value that is not written counts as none.
            if self.region.restore(&mut self.point, &mut self.inside) {
                let way = self.point.iter().zip(place).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
                *value = (self.squared)(&self.point) + way;
            }
        }
        Ok(())
    }

    fn watch(&mut self, _: &Progress) -> Result<bool, Infallible> {
        Ok(self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed)))
    }
}

impl<const R: usize> Multistart<'_, R> {
    /// Runs a swarm and puts its best point, brought into the region, into `point`; false when it found none.
    pub(super) fn swarm_start<P: Problem<R>>(
        &mut self,
        problem: &mut P,
        space: &SearchSpace,
        settings: &PsoSettings,
        round: usize,
    ) -> bool {
        if self.swarm.is_none() {
            self.swarm = Swarm::new(*settings, &space.lower, &space.upper).ok();
        }
        let Some(swarm) = &mut self.swarm else { return false };
        swarm.reseed(settings.seed.wrapping_add(round as u64));
        let mut cost = Cost {
            squared: |z: &[f64]| problem.squared_norm(z),
            region: &space.region,
            inside: RestoreScratch::default(),
            point: Vec::new(),
            stop: self.stop,
        };
        let Ok(report) = swarm.run(&mut cost);
        self.point.clear();
        self.point.extend_from_slice(swarm.best());
        report.value.is_finite() && self.solver.restore(&space.region, &mut self.point)
    }
}
