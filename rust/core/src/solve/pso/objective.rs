//! What a swarm minimises: a function of one point, or of the whole swarm at once.

use std::convert::Infallible;

use rayon::ThreadPool;
use rayon::prelude::*;

/// How far a run has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Moves of the whole swarm so far.
    pub iteration: usize,
    /// Evaluations so far.
    pub evaluations: usize,
    /// Lowest value so far; infinity before there is one.
    pub value: f64,
}

/// A function to minimise over a box.
pub trait Objective {
    /// What can go wrong in it; it ends the run and comes back unchanged.
    type Error;

    /// Writes the value at every point. Points are rows of `dimensions` numbers. NaN is no value:
    /// it is counted and never best.
    ///
    /// # Errors
    /// What ends the run.
    fn values(
        &mut self,
        points: &[f64],
        dimensions: usize,
        values: &mut [f64],
    ) -> Result<(), Self::Error>;

    /// Sees every iteration, the start included; true ends the run.
    ///
    /// # Errors
    /// What ends the run.
    fn watch(&mut self, _progress: &Progress) -> Result<bool, Self::Error> {
        Ok(false)
    }
}

/// A function of one point.
#[derive(Clone, Copy, Debug)]
pub struct Pointwise<F>(pub F);

impl<F: FnMut(&[f64]) -> f64> Objective for Pointwise<F> {
    type Error = Infallible;

    #[inline]
    fn values(&mut self, points: &[f64], n: usize, values: &mut [f64]) -> Result<(), Infallible> {
        for (value, point) in values.iter_mut().zip(points.chunks_exact(n)) {
            *value = (self.0)(point);
        }
        Ok(())
    }
}

/// A function of all points at once, called with points, dimensions and the place for the values.
#[derive(Clone, Copy, Debug)]
pub struct Whole<F>(pub F);

impl<F: FnMut(&[f64], usize, &mut [f64])> Objective for Whole<F> {
    type Error = Infallible;

    #[inline]
    fn values(&mut self, points: &[f64], n: usize, values: &mut [f64]) -> Result<(), Infallible> {
        (self.0)(points, n, values);
        Ok(())
    }
}

/// A function of one point, evaluated on all threads of a pool. The run is the same as on one.
#[derive(Clone, Copy, Debug)]
pub struct Parallel<'p, F> {
    /// The function.
    pub function: F,
    /// The threads; see [`crate::batch::pool`].
    pub pool: &'p ThreadPool,
}

impl<F: Fn(&[f64]) -> f64 + Sync> Objective for Parallel<'_, F> {
    type Error = Infallible;

    fn values(&mut self, points: &[f64], n: usize, values: &mut [f64]) -> Result<(), Infallible> {
        let function = &self.function;
        self.pool.install(|| {
            let pairs = values.par_iter_mut().zip(points.par_chunks_exact(n));
            pairs.for_each(|(value, point)| *value = function(point));
        });
        Ok(())
    }
}

/// An objective and who watches it; the watcher ends the run by returning true.
#[derive(Clone, Copy, Debug)]
pub struct Watched<O, W> {
    /// What is minimised.
    pub objective: O,
    /// Sees every iteration.
    pub watch: W,
}

impl<O: Objective, W: FnMut(&Progress) -> bool> Objective for Watched<O, W> {
    type Error = O::Error;

    #[inline]
    fn values(&mut self, points: &[f64], n: usize, values: &mut [f64]) -> Result<(), O::Error> {
        self.objective.values(points, n, values)
    }

    fn watch(&mut self, progress: &Progress) -> Result<bool, O::Error> {
        Ok((self.watch)(progress) || self.objective.watch(progress)?)
    }
}
