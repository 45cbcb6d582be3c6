//! Settings of particle swarms.

use pyo3::prelude::*;
use pyo3::types::PyDict;

use tdcr::solve::pso::{self, Bounds, Sampling, Topology};

use crate::settings::fields::{
    Count, Number, OneOf, Optional, Seed, Unsigned, choices, settings_class,
};

choices!(["one of ", ", "]; Sampling, Topology, Bounds);

settings_class! {
    /// What a swarm is, and when it stops.
    ///
    /// The defaults are those of `constriction`; `spso2011` and `mahfoudi` are other presets.
    PsoSettings: pso::PsoSettings, checked by pso::PsoSettings::validate; {
        /// sampling : {"box", "sphere"}, optional
        ///     How a particle draws its next place: every coordinate by itself, or in a ball that prefers no
        ///     direction.
        sampling: OneOf<Sampling> = "box",
            "How a particle draws its next place: \"box\" or \"sphere\".";

        /// inertia : float, optional
        ///     Share of the velocity that is kept, in [0, 2].
        inertia: Unsigned<Number> = 0.7298437881283576, "Share of the velocity that is kept.";

        /// cognitive, social : float, optional
        ///     Pulls towards the particle's own best point and towards its leader's, in [0, 10].
        cognitive: Unsigned<Number> = 1.496179765663133, "Pull towards the particle's own best point.";

        social: Unsigned<Number> = 1.496179765663133, "Pull towards its leader's best point.";

        /// topology : {"global", "ring", "random"}, optional
        ///     Whose best point a particle knows: everybody's, that of `neighbours` particles on either side,
        ///     or of those that happen to inform it (each informs `neighbours` others, drawn anew after an
        ///     iteration without progress).
        topology: OneOf<Topology> = "global",
            "Whose best point a particle knows: \"global\", \"ring\" or \"random\".";

        /// neighbours : int, optional
        ///     At most `particles`, and 1e7/`particles`; topology "global" has no use for it.
        neighbours: Count = 1, "Particles known on either side of a ring, or informed at random.";

        /// particles : int, optional
        ///     Size of the swarm.
        particles: Count = 30, "Size of the swarm.";

        /// bounds : {"clamp", "reflect", "absorb", "rebound"}, optional
        ///     A coordinate that leaves the box stops on the bound with its velocity kept, is mirrored, stops
        ///     at rest, or turns back at half the velocity.
        bounds: OneOf<Bounds> = "absorb",
            "What happens at the bounds: \"clamp\", \"reflect\", \"absorb\" or \"rebound\".";

        /// velocity_limit : float or None, optional
        ///     Largest velocity per iteration, as a share of the box's width; None for no limit.
        velocity_limit: Optional<Unsigned<Number>> = 0.5,
            "Largest velocity as a share of the box's width, or None.";

        /// max_iterations : int, optional
        ///     Moves of the whole swarm at most, up to 1,000,000.
        max_iterations: Count = 1000, "Moves of the whole swarm at most.";

        /// max_evaluations : int or None, optional
        ///     No move is begun that would exceed them.
        max_evaluations: Optional<Count> = None, "Evaluations at most, or None.";

        /// target : float or None, optional
        ///     The value that is low enough to stop.
        target: Optional<Unsigned<Number>> = None, "The value that is low enough to stop, or None.";

        /// stagnation : int or None, optional
        ///     Iterations without progress that end the run.
        stagnation: Optional<Count> = 100, "Iterations without progress that end the run, or None.";

        /// improvement : float, optional
        ///     Progress is a fall of the best value by more than this.
        improvement: Unsigned<Number> = 0.0, "Progress is a fall of the best value by more than this.";

        /// seed : int, optional
        ///     The same seed, settings and function give the same run.
        seed: Seed = 0, "Seed of all draws.";
    }

    /// Raises
    /// ------
    /// InvalidInput
    ///     A value out of range, an unknown name.
    /// TypeError
    ///     A value of another type.
    methods {
        /// Clerc & Kennedy's constriction (10.1109/4235.985692): chi = 0.72984, c1 = c2 = 2.05 chi, one
        /// global best, velocities of at most half the box. Keywords change single values.
        #[staticmethod]
        #[pyo3(signature = (**changes))]
        fn constriction<'py>(
            py: Python<'py>,
            changes: Option<&Bound<'py, PyDict>>,
        ) -> PyResult<Bound<'py, PyAny>> {
            self::replace(py, &pso::PsoSettings::constriction(), changes)
        }

        /// Standard PSO 2011 (10.1109/CEC.2013.6557848): draws from a ball, three random informants, 40
        /// particles. Keywords change single values.
        #[staticmethod]
        #[pyo3(signature = (**changes))]
        fn spso2011<'py>(
            py: Python<'py>,
            changes: Option<&Bound<'py, PyDict>>,
        ) -> PyResult<Bound<'py, PyAny>> {
            self::replace(py, &pso::PsoSettings::spso2011(), changes)
        }

        /// Equations 15 and 16 of Mahfoudi, Amouri & Zaatri (2014), who print no numbers: c1 = c2 = 2 as
        /// in their source, inertia 0.4, with which such a swarm settles. Keywords change single values.
        #[staticmethod]
        #[pyo3(signature = (**changes))]
        fn mahfoudi<'py>(
            py: Python<'py>,
            changes: Option<&Bound<'py, PyDict>>,
        ) -> PyResult<Bound<'py, PyAny>> {
            self::replace(py, &pso::PsoSettings::mahfoudi(), changes)
        }

        /// These settings with the given ones changed.
        #[pyo3(signature = (**changes))]
        fn replace<'py>(
            &self,
            py: Python<'py>,
            changes: Option<&Bound<'py, PyDict>>,
        ) -> PyResult<Bound<'py, PyAny>> {
            self::replace(py, &self.0, changes)
        }
    }
}

/// Settings with some values changed, through the constructor that checks them.
fn replace<'py>(
    py: Python<'py>,
    settings: &pso::PsoSettings,
    changes: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let all = PsoSettings(*settings).keywords(py)?;
    if let Some(changes) = changes {
        all.update(changes.as_mapping())?;
    }
    py.get_type::<PsoSettings>().call((), Some(&all))
}
