//! A run: evaluate, remember, follow, move.

use super::objective::{Objective, Progress};
use super::particles::Particles;
use super::random::RandomStreams;
use super::report::{Report, Stop};
use super::settings::PsoSettings;
use super::topology::Leaders;
use crate::error::InvalidInput;

/// A swarm in a box, with all its memory: runs allocate nothing, and any number of them reuse it.
///
/// ```
/// use tdcr::solve::pso::{Pointwise, PsoSettings, Swarm};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let settings = PsoSettings { target: Some(1e-12), ..PsoSettings::default() };
/// let mut swarm = Swarm::new(settings, &[-5.0, -5.0], &[5.0, 5.0])?;
/// let Ok(report) = swarm.run(&mut Pointwise(|x: &[f64]| (x[0] - 1.0).powi(2) + x[1] * x[1]));
/// assert_eq!(report.status, tdcr::Status::Converged);
/// assert!((swarm.best()[0] - 1.0).abs() < 1e-6);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Swarm {
    settings: PsoSettings,
    dimensions: usize,
    particles: Particles,
    draws: RandomStreams,
    leaders: Leaders,
    /// The value at every particle, and the lowest at each so far: infinity as long as there is none.
    values: Vec<f64>,
    own: Vec<f64>,
    starts: Vec<f64>,
    history: Vec<f64>,
    run: Run,
}

/// Counters of a run.
#[derive(Clone, Copy, Debug, Default)]
struct Run {
    /// The particle with the lowest value so far.
    best: usize,
    iterations: usize,
    evaluations: usize,
    nan_count: usize,
    /// Flags of the last iteration: any particle's best point changed, the best of all fell.
    learned: bool,
    better: bool,
    /// The best value at the last progress, and the iterations since.
    milestone: f64,
    idle: usize,
}

/// Bounds are of a size that leaves widths, mirrored places and squares of distances finite.
const LARGEST_BOUND: f64 = 1e150;

impl Swarm {
    /// A swarm of settings in the box from `lower` to `upper`, one number per dimension. Equal bounds
    /// hold a coordinate.
    ///
    /// # Errors
    /// `InvalidInput` for settings out of range; no dimension; bounds of different number, that are
    /// not finite or larger than 1e150, or whose lower is above the upper; a swarm that does not fit
    /// into memory.
    pub fn new(settings: PsoSettings, lower: &[f64], upper: &[f64]) -> Result<Self, InvalidInput> {
        let mut swarm = Self {
            settings,
            dimensions: 0,
            particles: Particles::default(),
            draws: RandomStreams::default(),
            leaders: Leaders::default(),
            values: Vec::new(),
            own: Vec::new(),
            starts: Vec::new(),
            history: Vec::new(),
            run: Run::default(),
        };
        swarm.reset(settings, lower, upper)?;
        Ok(swarm)
    }

    /// Other settings and another box in the same memory; given starts are forgotten.
    ///
    /// # Errors
    /// As [`Swarm::new`]; the swarm is then as it was.
    pub fn reset(
        &mut self,
        settings: PsoSettings,
        lower: &[f64],
        upper: &[f64],
    ) -> Result<(), InvalidInput> {
        settings.validate()?;
        check_box(lower, upper)?;
        fits(&settings, lower.len())?;
        self.settings = settings;
        self.dimensions = lower.len();
        self.particles.resize(&settings, lower, upper);
        self.draws.resize(settings.particles, lower.len());
        self.leaders.resize(&settings);
        self.values.resize(settings.particles, f64::NAN);
        self.own.resize(settings.particles, f64::INFINITY);
        self.starts.clear();
        self.history.clear();
        self.history.reserve(settings.max_iterations + 1);
        self.run = Run::default();
        Ok(())
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &PsoSettings {
        &self.settings
    }

    /// The seed of the next run.
    pub fn reseed(&mut self, seed: u64) {
        self.settings.seed = seed;
    }

    /// Points (rows) where the first particles of the coming runs start, instead of anywhere.
    ///
    /// # Errors
    /// `InvalidInput` for a number of coordinates that makes no rows, more rows than particles, or a
    /// point outside the box.
    pub fn start_from(&mut self, points: &[f64]) -> Result<(), InvalidInput> {
        let n = self.dimensions;
        if !points.len().is_multiple_of(n) || points.len() / n > self.settings.particles {
            let most = self.settings.particles;
            let expected = format!("up to {most} points (one per particle) of {n} numbers each");
            let got = format!("{} numbers", points.len());
            return Err(InvalidInput::new("start", expected, got));
        }
        for (e, &x) in points.iter().enumerate() {
            if !self.particles.contains(e, x) {
                let got = format!("{x:?} in coordinate {} of point {}", e % n, e / n);
                return Err(InvalidInput::new("start", "points inside the box", got));
            }
        }
        self.starts.clear();
        self.starts.extend_from_slice(points);
        Ok(())
    }

    /// Minimises an objective.
    ///
    /// # Errors
    /// The objective's own, unchanged.
    pub fn run<O: Objective>(&mut self, objective: &mut O) -> Result<Report, O::Error> {
        self.begin();
        self.evaluate(objective)?;
        loop {
            let watched = objective.watch(&self.progress())?;
            if let Some(stop) = self.stop(watched) {
                return Ok(self.report(stop));
            }
            self.choose_leaders();
            self.particles.advance(&self.settings, &self.leaders.of, self.draws.step());
            self.run.iterations += 1;
            self.evaluate(objective)?;
        }
    }

    /// The best point of the last run. Without a value below infinity, that of no merit.
    #[must_use]
    pub fn best(&self) -> &[f64] {
        self.particles.best(self.run.best)
    }

    /// The lowest value of the last run after every iteration, the start first.
    #[must_use]
    pub fn history(&self) -> &[f64] {
        &self.history
    }

    /// Positions of the particles after the last run, in rows.
    #[must_use]
    pub fn places(&self) -> &[f64] {
        &self.particles.positions
    }

    fn begin(&mut self) {
        self.draws.seed(self.settings.seed);
        self.leaders.seed(self.settings.seed);
        self.own.fill(f64::INFINITY);
        self.history.clear();
        self.run = Run { milestone: f64::INFINITY, ..Run::default() };
        self.particles.initialize(self.draws.step());
        self.particles.set_positions(&self.starts);
    }

    /// Evaluates all positions and updates the particles' best points.
    fn evaluate<O: Objective>(&mut self, objective: &mut O) -> Result<(), O::Error> {
        // An objective that leaves a value out has not found one there.
        self.values.fill(f64::NAN);
        objective.values(&self.particles.positions, self.dimensions, &mut self.values)?;
        let run = &mut self.run;
        run.evaluations += self.values.len();
        (run.learned, run.better) = (false, false);
        let before = self.own[run.best];
        for (particle, &value) in self.values.iter().enumerate() {
            run.nan_count += usize::from(value.is_nan());
            if value < self.own[particle] {
                self.own[particle] = value;
                self.particles.store_best(particle);
                run.learned = true;
                if value < self.own[run.best] {
                    run.best = particle;
                }
            } else if self.own[particle] == f64::INFINITY {
                // Nothing to remember yet: not to be drawn back to where it started.
                self.particles.store_best(particle);
                run.learned = true;
            }
        }
        let value = self.own[run.best];
        run.better = value < before;
        if value < run.milestone - self.settings.improvement {
            (run.milestone, run.idle) = (value, 0);
        } else if run.iterations > 0 {
            run.idle += 1;
        }
        self.history.push(value);
        Ok(())
    }

    fn progress(&self) -> Progress {
        Progress {
            iteration: self.run.iterations,
            evaluations: self.run.evaluations,
            value: self.own[self.run.best],
        }
    }

    fn stop(&self, watched: bool) -> Option<Stop> {
        let (settings, run) = (&self.settings, &self.run);
        let next = run.evaluations.saturating_add(settings.particles);
        // Nothing is below minus infinity.
        if self.own[run.best] <= settings.target.unwrap_or(f64::NEG_INFINITY) {
            Some(Stop::Target)
        } else if watched {
            Some(Stop::Callback)
        } else if settings.stagnation.is_some_and(|most| run.idle >= most) {
            Some(Stop::Stagnation)
        } else if run.iterations >= settings.max_iterations {
            Some(Stop::Iterations)
        } else if settings.max_evaluations.is_some_and(|most| next > most) {
            Some(Stop::Evaluations)
        } else {
            None
        }
    }

    /// Leaders and their best points, where they can have changed.
    fn choose_leaders(&mut self) {
        let run = &self.run;
        let first = run.iterations == 0;
        let random = self.leaders.is_random();
        if first || run.learned || (random && !run.better) {
            self.leaders.choose(&self.settings, &self.own, run.best, run.better && !first);
            self.particles.update_leaders(&self.leaders.of);
        }
    }

    fn report(&self, stop: Stop) -> Report {
        let run = &self.run;
        let value = self.own[run.best];
        Report {
            status: stop.status(value, self.settings.target.is_some()),
            stop,
            value,
            iterations: run.iterations,
            evaluations: run.evaluations,
            nan_count: run.nan_count,
            seed: self.settings.seed,
        }
    }
}

fn check_box(lower: &[f64], upper: &[f64]) -> Result<(), InvalidInput> {
    if lower.is_empty() {
        return Err(InvalidInput::new("lower", "a number for every dimension", "none"));
    }
    if lower.len() != upper.len() {
        let expected = format!("{} numbers, as many as lower", lower.len());
        return Err(InvalidInput::new("upper", expected, upper.len()));
    }
    for (argument, bounds) in [("lower", lower), ("upper", upper)] {
        let odd = bounds.iter().position(|b| b.is_nan() || b.abs() > LARGEST_BOUND);
        if let Some(d) = odd {
            let got = format!("{:?} in coordinate {d}", bounds[d]);
            return Err(InvalidInput::new(argument, "finite numbers, at most 1e150", got));
        }
    }
    if let Some(d) = (0..lower.len()).find(|&d| lower[d] > upper[d]) {
        let expected = format!("at least lower, {:?} in coordinate {d}", lower[d]);
        return Err(InvalidInput::new("upper", expected, format!("{:?}", upper[d])));
    }
    Ok(())
}

/// Refuses swarms whose memory cannot be had.
fn fits(settings: &PsoSettings, dimensions: usize) -> Result<(), InvalidInput> {
    // Nine numbers per coordinate and at least one draw, which come in blocks of 32.
    let size = settings.particles.saturating_mul(dimensions.max(32)).saturating_mul(10);
    let size = size.saturating_add(super::topology::links(settings));
    // What any machine has is not asked for: a reset of a small swarm allocates nothing.
    if size <= 1 << 20 {
        return Ok(());
    }
    Vec::<u64>::new().try_reserve_exact(size).map_err(|_| {
        let got = format!("{} in {dimensions} dimensions", settings.particles);
        InvalidInput::new("particles", "a swarm that fits into memory", got)
    })
}
