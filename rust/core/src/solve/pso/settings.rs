//! Settings of a swarm, and its stopping rules.

use crate::error::InvalidInput;

/// Distribution from which a particle draws its next position.
///
/// ```
/// use tdcr::solve::pso::{PsoSettings, Sampling};
///
/// assert_eq!(PsoSettings::spso2011().sampling, Sampling::Sphere);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// Every coordinate by itself: uniform in a box along the axes, which prefers them.
    Box,
    /// In a ball around the centre of gravity of the place and the two pulls, as in SPSO-2011: the
    /// same in every direction.
    Sphere,
}

/// Whose best point a particle knows besides its own.
///
/// ```
/// use tdcr::solve::pso::{PsoSettings, Topology};
///
/// let ring = PsoSettings { topology: Topology::Ring, neighbours: 2, ..PsoSettings::default() };
/// assert!(ring.validate().is_ok());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topology {
    /// Everybody's ("gbest"): fast, and easily caught.
    Global,
    /// That of `neighbours` particles on either side ("lbest"): slower, and more often right.
    Ring,
    /// Every particle informs itself and `neighbours` others, drawn anew after every iteration that
    /// improved nothing, as in SPSO-2011.
    Random,
}

/// Treatment of a coordinate that leaves the box.
///
/// ```
/// use tdcr::solve::pso::{Bounds, PsoSettings};
///
/// assert_eq!(PsoSettings::default().bounds, Bounds::Absorb);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounds {
    /// It stops on the bound; its velocity stays.
    Clamp,
    /// It is mirrored at the bound, and so is its velocity. What is beyond the other bound then stops
    /// there.
    Reflect,
    /// It stops on the bound, at rest.
    Absorb,
    /// It stops on the bound and turns back at half the velocity, as in SPSO-2011.
    Rebound,
}

macro_rules! names {
    ($type:ident: $($member:ident = $name:literal),+) => {
        impl $type {
            /// Every choice.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$member),+];

            /// The name used in Python.
            #[must_use]
            pub const fn as_str(self) -> &'static str {
                match self {
                    $(Self::$member => $name,)+
                }
            }
        }
    };
}

names!(Sampling: Box = "box", Sphere = "sphere");
names!(Topology: Global = "global", Ring = "ring", Random = "random");
names!(Bounds: Clamp = "clamp", Reflect = "reflect", Absorb = "absorb", Rebound = "rebound");

/// Settings of a swarm, and its stopping rules.
///
/// ```
/// use tdcr::solve::pso::PsoSettings;
///
/// let settings = PsoSettings { particles: 50, seed: 7, ..PsoSettings::constriction() };
/// assert!(settings.validate().is_ok());
/// assert!(PsoSettings { particles: 0, ..settings }.validate().is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PsoSettings {
    /// Distribution from which a particle draws its next position.
    pub sampling: Sampling,
    /// Share of the velocity that is kept, omega.
    pub inertia: f64,
    /// Pull towards the particle's own best point, c1.
    pub cognitive: f64,
    /// Pull towards its leader's best point, c2.
    pub social: f64,
    /// Whose best point it knows.
    pub topology: Topology,
    /// Particles known on either side of a ring, or informed at random, at most as many as there are
    /// and 1e7 in the whole swarm; a global swarm has no use for it.
    pub neighbours: usize,
    /// Size of the swarm.
    pub particles: usize,
    /// Treatment of a coordinate that leaves the box.
    pub bounds: Bounds,
    /// Largest velocity of a coordinate per iteration, as a share of the box's width.
    pub velocity_limit: Option<f64>,
    /// Moves of the whole swarm at most.
    pub max_iterations: usize,
    /// Evaluations of the objective at most: no move is begun that would exceed them.
    pub max_evaluations: Option<usize>,
    /// The value that is low enough to stop.
    pub target: Option<f64>,
    /// Iterations without progress that end the run.
    pub stagnation: Option<usize>,
    /// Progress is a fall of the best value by more than this.
    pub improvement: f64,
    /// Seed of all draws: the same seed, settings and objective give the same run on any number of
    /// threads.
    pub seed: u64,
}

/// Largest number of moves: memory for their history is reserved before the first.
const MOST_ITERATIONS: usize = 1_000_000;

/// Size of a swarm that can be asked for.
const MOST_PARTICLES: usize = 1_000_000;

/// Largest number of links: all are visited between two moves, where nothing can stop the run.
const MOST_LINKS: usize = 10_000_000;

/// Clerc & Kennedy's phi = c1 + c2 with c1 = c2 = 2.05.
pub const PHI: f64 = 4.1;

/// Their constriction coefficient for it, `2 / |2 - phi - sqrt(phi^2 - 4 phi)|`.
pub const CHI: f64 = 0.729_843_788_128_357_6;

/// Inertia of SPSO-2011, `1 / (2 ln 2)`.
pub const SPSO_INERTIA: f64 = 0.721_347_520_444_481_7;

/// Acceleration of SPSO-2011, `1/2 + ln 2`.
pub const SPSO_ACCELERATION: f64 = 1.193_147_180_559_945_3;

impl Default for PsoSettings {
    fn default() -> Self {
        Self::constriction()
    }
}

impl PsoSettings {
    /// Clerc & Kennedy's constriction, `v <- chi (v + 2.05 r1 (p - x) + 2.05 r2 (g - x))`
    /// ([10.1109/4235.985692](https://doi.org/10.1109/4235.985692)), with velocities of at most half
    /// the box ([10.1109/CEC.2000.870279](https://doi.org/10.1109/CEC.2000.870279)). The default.
    #[must_use]
    pub const fn constriction() -> Self {
        Self {
            sampling: Sampling::Box,
            inertia: CHI,
            cognitive: CHI * (0.5 * PHI),
            social: CHI * (0.5 * PHI),
            topology: Topology::Global,
            neighbours: 1,
            particles: 30,
            bounds: Bounds::Absorb,
            velocity_limit: Some(0.5),
            max_iterations: 1000,
            max_evaluations: None,
            target: None,
            stagnation: Some(100),
            improvement: 0.0,
            seed: 0,
        }
    }

    /// Standard PSO 2011 ([10.1109/CEC.2013.6557848](https://doi.org/10.1109/CEC.2013.6557848)):
    /// a ball to draw from, random informants, 40 particles.
    #[must_use]
    pub const fn spso2011() -> Self {
        Self {
            sampling: Sampling::Sphere,
            inertia: SPSO_INERTIA,
            cognitive: SPSO_ACCELERATION,
            social: SPSO_ACCELERATION,
            topology: Topology::Random,
            neighbours: 3,
            particles: 40,
            bounds: Bounds::Rebound,
            velocity_limit: None,
            ..Self::constriction()
        }
    }

    /// Equations 15 and 16 of Mahfoudi, Amouri & Zaatri (2014): one inertia weight, one global best,
    /// no velocity limit. The paper prints no numbers. c1 = c2 = 2 are those of its reference 13,
    /// Kennedy & Eberhart ([10.1109/ICNN.1995.488968](https://doi.org/10.1109/ICNN.1995.488968));
    /// with them a swarm settles for inertias between 1/3 and 1/2 only (Poli's condition,
    /// [10.1109/TEVC.2008.2011738](https://doi.org/10.1109/TEVC.2008.2011738)), and this takes 0.4.
    #[must_use]
    pub const fn mahfoudi() -> Self {
        Self {
            inertia: 0.4,
            cognitive: 2.0,
            social: 2.0,
            bounds: Bounds::Clamp,
            velocity_limit: None,
            ..Self::constriction()
        }
    }

    /// Checks the values.
    ///
    /// # Errors
    /// `InvalidInput` for a number that is out of range.
    pub fn validate(&self) -> Result<(), InvalidInput> {
        within("inertia", self.inertia, 0.0, 2.0)?;
        within("cognitive", self.cognitive, 0.0, 10.0)?;
        within("social", self.social, 0.0, 10.0)?;
        count("neighbours", self.neighbours, MOST_PARTICLES)?;
        count("particles", self.particles, MOST_PARTICLES)?;
        self.check_links()?;
        count("max_iterations", self.max_iterations, MOST_ITERATIONS)?;
        count("stagnation", self.stagnation.unwrap_or(1), usize::MAX)?;
        within("improvement", self.improvement, 0.0, f64::MAX)?;
        if let Some(limit) = self.velocity_limit
            && !(limit > 0.0 && limit <= 1e3)
        {
            let expected = "a share of the box in (0, 1000], or none";
            return Err(InvalidInput::new("velocity_limit", expected, format!("{limit:?}")));
        }
        if self.target.is_some_and(f64::is_nan) {
            return Err(InvalidInput::new("target", "a number, or none", "NaN"));
        }
        if self.max_evaluations.is_some_and(|most| most < self.particles) {
            let expected = format!("at least one for each of {} particles", self.particles);
            let got = self.max_evaluations.unwrap_or_default();
            return Err(InvalidInput::new("max_evaluations", expected, got));
        }
        Ok(())
    }

    /// Refuses more neighbours than there are particles, and more links than can be visited.
    fn check_links(&self) -> Result<(), InvalidInput> {
        let most = self.particles.min(MOST_LINKS / self.particles);
        if self.topology == Topology::Global || self.neighbours <= most {
            return Ok(());
        }
        let (topology, particles) = (self.topology.as_str(), self.particles);
        let expected = format!("1 to {most} with topology \"{topology}\" of {particles} particles");
        Err(InvalidInput::new("neighbours", expected, self.neighbours))
    }
}

fn within(argument: &str, value: f64, low: f64, high: f64) -> Result<(), InvalidInput> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    let expected = format!("a number from {low} to {high:?}");
    Err(InvalidInput::new(argument, expected, format!("{value:?}")))
}

fn count(argument: &str, value: usize, most: usize) -> Result<(), InvalidInput> {
    if (1..=most).contains(&value) {
        return Ok(());
    }
    Err(InvalidInput::new(argument, format!("1 to {most}"), value))
}
