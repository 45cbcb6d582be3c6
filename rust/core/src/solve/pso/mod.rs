//! Particle swarms: minima of any function over a box, without derivatives.
//!
//! Every particle is drawn to the best point it has seen and to the best that its leader has seen
//! (Kennedy & Eberhart 1995, [10.1109/ICNN.1995.488968](https://doi.org/10.1109/ICNN.1995.488968)).
//! All particles are evaluated before any of them learns: the objective sees the whole swarm at once,
//! and may use as many threads as it likes. Every particle draws from a stream of its own, so a run
//! depends on nothing but seed, settings and objective. `docs/pso.md` has the mathematics.

mod objective;
mod particles;
mod random;
mod report;
mod settings;
mod swarm;
mod topology;

pub use objective::{Objective, Parallel, Pointwise, Progress, Watched, Whole};
pub use report::{Report, Stop};
pub use settings::{
    Bounds, CHI, PHI, PsoSettings, SPSO_ACCELERATION, SPSO_INERTIA, Sampling, Topology,
};
pub use swarm::Swarm;
