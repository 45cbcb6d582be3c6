//! Objectives of a swarm: functions of one point, or of the whole swarm at once.

use std::convert::Infallible;

use rayon::ThreadPool;
use rayon::prelude::*;

/// Progress of a run.
///
/// ```
/// use tdcr::solve::pso::{Pointwise, Progress, PsoSettings, Stop, Swarm, Watched};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let mut swarm = Swarm::new(PsoSettings::default(), &[-1.0], &[1.0])?;
/// let objective = Pointwise(|x: &[f64]| x[0] * x[0]);
/// let watch = |progress: &Progress| progress.iteration == 3;
/// let Ok(report) = swarm.run(&mut Watched { objective, watch });
/// assert_eq!((report.stop, report.iterations), (Stop::Callback, 3));
/// # Ok(())
/// # }
/// ```
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
///
/// ```
/// use std::convert::Infallible;
/// use tdcr::solve::pso::{Objective, PsoSettings, Swarm};
///
/// struct Sphere;
///
/// impl Objective for Sphere {
///     type Error = Infallible;
///
///     fn values(&mut self, points: &[f64], n: usize, values: &mut [f64]) -> Result<(), Infallible> {
///         for (value, point) in values.iter_mut().zip(points.chunks_exact(n)) {
///             *value = point.iter().map(|x| x * x).sum();
///         }
///         Ok(())
///     }
/// }
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let mut swarm = Swarm::new(PsoSettings::default(), &[-1.0; 3], &[1.0; 3])?;
/// let Ok(report) = swarm.run(&mut Sphere);
/// assert!(report.value < 1e-6);
/// # Ok(())
/// # }
/// ```
pub trait Objective {
    /// Error of the objective; it ends the run and comes back unchanged.
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
///
/// ```
/// use tdcr::solve::pso::{Pointwise, PsoSettings, Swarm};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let mut swarm = Swarm::new(PsoSettings::default(), &[-1.0], &[1.0])?;
/// let Ok(report) = swarm.run(&mut Pointwise(|x: &[f64]| (x[0] - 0.5).abs()));
/// assert!(report.value < 1e-3);
/// # Ok(())
/// # }
/// ```
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

/// A function of all points at once, called with points, dimensions and the slice for the values.
///
/// ```
/// use tdcr::solve::pso::{PsoSettings, Swarm, Whole};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let mut swarm = Swarm::new(PsoSettings::default(), &[-1.0], &[1.0])?;
/// let squares = |points: &[f64], _: usize, values: &mut [f64]| {
///     values.iter_mut().zip(points).for_each(|(value, x)| *value = x * x);
/// };
/// let Ok(report) = swarm.run(&mut Whole(squares));
/// assert!(report.value < 1e-6);
/// # Ok(())
/// # }
/// ```
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
///
/// ```
/// use tdcr::batch::pool;
/// use tdcr::solve::pso::{Parallel, PsoSettings, Swarm};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let mut swarm = Swarm::new(PsoSettings::default(), &[-1.0], &[1.0])?;
/// let pool = pool(Some(2))?;
/// let Ok(report) = swarm.run(&mut Parallel { function: |x: &[f64]| x[0] * x[0], pool: &pool });
/// assert!(report.value < 1e-6);
/// # Ok(())
/// # }
/// ```
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
///
/// ```
/// use tdcr::solve::pso::{Pointwise, PsoSettings, Swarm, Watched};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let mut swarm = Swarm::new(PsoSettings::default(), &[-1.0], &[1.0])?;
/// let mut moves = 0;
/// let objective = Pointwise(|x: &[f64]| x[0] * x[0]);
/// let watch = |_: &_| {
///     moves += 1;
///     false
/// };
/// let Ok(report) = swarm.run(&mut Watched { objective, watch });
/// assert_eq!(moves, report.iterations + 1);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Watched<O, W> {
    /// Objective to minimise.
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
