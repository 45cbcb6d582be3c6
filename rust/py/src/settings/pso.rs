//! Settings of particle swarms.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use tdcr::InvalidInput;
use tdcr::solve::pso::{self, Bounds, Sampling, Topology};

use crate::convert::arguments::{number, whole};
use crate::convert::arrays::{called, invalid};

/// What a swarm is, and when it stops.
///
/// The defaults are those of `constriction`; `spso2011` and `mahfoudi` are other presets.
///
/// Parameters
/// ----------
/// sampling : {"box", "sphere"}, optional
///     How a particle draws its next place: every coordinate by itself, or in a ball that prefers no
///     direction.
/// inertia : float, optional
///     Share of the velocity that is kept, in [0, 2].
/// cognitive, social : float, optional
///     Pulls towards the particle's own best point and towards its leader's, in [0, 10].
/// topology : {"global", "ring", "random"}, optional
///     Whose best point a particle knows: everybody's, that of `neighbours` particles on either side,
///     or of those that happen to inform it (each informs `neighbours` others, drawn anew after an
///     iteration without progress).
/// neighbours : int, optional
///     At most `particles`, and 1e7/`particles`; topology "global" has no use for it.
/// particles : int, optional
///     Size of the swarm.
/// bounds : {"clamp", "reflect", "absorb", "rebound"}, optional
///     A coordinate that leaves the box stops on the bound with its velocity kept, is mirrored, stops
///     at rest, or turns back at half the velocity.
/// velocity_limit : float or None, optional
///     Largest velocity per iteration, as a share of the box's width; None for no limit.
/// max_iterations : int, optional
///     Moves of the whole swarm at most, up to 1,000,000.
/// max_evaluations : int or None, optional
///     No move is begun that would exceed them.
/// target : float or None, optional
///     The value that is low enough to stop.
/// stagnation : int or None, optional
///     Iterations without progress that end the run.
/// improvement : float, optional
///     Progress is a fall of the best value by more than this.
/// seed : int, optional
///     The same seed, settings and function give the same run.
///
/// Raises
/// ------
/// InvalidInput
///     A value out of range, an unknown name.
/// TypeError
///     A value of another type.
#[pyclass(frozen, eq, module = "tdcr")]
#[derive(Clone, PartialEq)]
pub(crate) struct PsoSettings(pub(crate) pso::PsoSettings);

/// Extractors that name their argument.
macro_rules! extractors {
    ($extract:ident: $type:ty => $($name:ident),+) => {
        $(fn $name(value: &Bound<'_, PyAny>) -> PyResult<$type> {
            $extract(stringify!($name), value)
        })+
    };
}

fn number_or_none(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Option<f64>> {
    if value.is_none() { Ok(None) } else { real(argument, value).map(Some) }
}

fn whole_or_none(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Option<usize>> {
    if value.is_none() { Ok(None) } else { whole(argument, value).map(Some) }
}

/// A number, with -0.0 made 0.0 so that equal settings have equal bits.
fn real(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    Ok(number(argument, value)? + 0.0)
}

extractors!(real: f64 => inertia, cognitive, social, improvement);
extractors!(number_or_none: Option<f64> => velocity_limit, target);
extractors!(whole: usize => neighbours, particles, max_iterations, seed);
extractors!(whole_or_none: Option<usize> => max_evaluations, stagnation);

/// One of a few names.
macro_rules! named {
    ($($type:ident = $argument:ident),+) => {
        $(fn $argument(name: &str) -> PyResult<$type> {
            $type::ALL.into_iter().find(|known| known.as_str() == name).ok_or_else(|| {
                let known = $type::ALL.map(|known| format!("\"{}\"", known.as_str()));
                let expected = format!("one of {}", known.join(", "));
                let got = format!("\"{name}\"");
                invalid(&InvalidInput::new(stringify!($argument), expected, got))
            })
        })+
    };
}

named!(Sampling = sampling, Topology = topology, Bounds = bounds);

/// The settings as the keywords of their constructor.
pub(crate) fn keywords<'py>(
    py: Python<'py>,
    settings: &pso::PsoSettings,
) -> PyResult<Bound<'py, PyDict>> {
    let keywords = PyDict::new(py);
    keywords.set_item("sampling", settings.sampling.as_str())?;
    keywords.set_item("inertia", settings.inertia)?;
    keywords.set_item("cognitive", settings.cognitive)?;
    keywords.set_item("social", settings.social)?;
    keywords.set_item("topology", settings.topology.as_str())?;
    keywords.set_item("neighbours", settings.neighbours)?;
    keywords.set_item("particles", settings.particles)?;
    keywords.set_item("bounds", settings.bounds.as_str())?;
    keywords.set_item("velocity_limit", settings.velocity_limit)?;
    keywords.set_item("max_iterations", settings.max_iterations)?;
    keywords.set_item("max_evaluations", settings.max_evaluations)?;
    keywords.set_item("target", settings.target)?;
    keywords.set_item("stagnation", settings.stagnation)?;
    keywords.set_item("improvement", settings.improvement)?;
    keywords.set_item("seed", settings.seed)?;
    Ok(keywords)
}

/// Settings with some values changed, through the constructor that checks them.
fn changed<'py>(
    py: Python<'py>,
    settings: &pso::PsoSettings,
    changes: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let all = keywords(py, settings)?;
    if let Some(changes) = changes {
        all.update(changes.as_mapping())?;
    }
    py.get_type::<PsoSettings>().call((), Some(&all))
}

#[pymethods]
impl PsoSettings {
    #[new]
    #[pyo3(signature = (
        *,
        sampling="box",
        inertia=0.729_843_788_128_357_6,
        cognitive=1.496_179_765_663_133,
        social=1.496_179_765_663_133,
        topology="global",
        neighbours=1,
        particles=30,
        bounds="absorb",
        velocity_limit=0.5,
        max_iterations=1000,
        max_evaluations=None,
        target=None,
        stagnation=100,
        improvement=0.0,
        seed=0,
    ))]
    #[allow(clippy::too_many_arguments)] // One per field.
    fn new(
        sampling: &str,
        #[pyo3(from_py_with = inertia)] inertia: f64,
        #[pyo3(from_py_with = cognitive)] cognitive: f64,
        #[pyo3(from_py_with = social)] social: f64,
        topology: &str,
        #[pyo3(from_py_with = neighbours)] neighbours: usize,
        #[pyo3(from_py_with = particles)] particles: usize,
        bounds: &str,
        #[pyo3(from_py_with = velocity_limit)] velocity_limit: Option<f64>,
        #[pyo3(from_py_with = max_iterations)] max_iterations: usize,
        #[pyo3(from_py_with = max_evaluations)] max_evaluations: Option<usize>,
        #[pyo3(from_py_with = target)] target: Option<f64>,
        #[pyo3(from_py_with = stagnation)] stagnation: Option<usize>,
        #[pyo3(from_py_with = improvement)] improvement: f64,
        #[pyo3(from_py_with = seed)] seed: usize,
    ) -> PyResult<Self> {
        let settings = pso::PsoSettings {
            sampling: self::sampling(sampling)?,
            inertia,
            cognitive,
            social,
            topology: self::topology(topology)?,
            neighbours,
            particles,
            bounds: self::bounds(bounds)?,
            velocity_limit,
            max_iterations,
            max_evaluations,
            target,
            stagnation,
            improvement,
            seed: seed as u64,
        };
        settings.validate().map_err(|e| invalid(&e))?;
        Ok(Self(settings))
    }

    /// Clerc & Kennedy's constriction (10.1109/4235.985692): chi = 0.72984, c1 = c2 = 2.05 chi, one
    /// global best, velocities of at most half the box. Keywords change single values.
    #[staticmethod]
    #[pyo3(signature = (**changes))]
    fn constriction<'py>(
        py: Python<'py>,
        changes: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        changed(py, &pso::PsoSettings::constriction(), changes)
    }

    /// Standard PSO 2011 (10.1109/CEC.2013.6557848): draws from a ball, three random informants, 40
    /// particles. Keywords change single values.
    #[staticmethod]
    #[pyo3(signature = (**changes))]
    fn spso2011<'py>(
        py: Python<'py>,
        changes: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        changed(py, &pso::PsoSettings::spso2011(), changes)
    }

    /// Equations 15 and 16 of Mahfoudi, Amouri & Zaatri (2014), who print no numbers: c1 = c2 = 2 as
    /// in their source, inertia 0.4, with which such a swarm settles. Keywords change single values.
    #[staticmethod]
    #[pyo3(signature = (**changes))]
    fn mahfoudi<'py>(
        py: Python<'py>,
        changes: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        changed(py, &pso::PsoSettings::mahfoudi(), changes)
    }

    /// The same settings but for the given ones.
    #[pyo3(signature = (**changes))]
    fn replace<'py>(
        &self,
        py: Python<'py>,
        changes: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        changed(py, &self.0, changes)
    }

    /// How a particle draws its next place: "box" or "sphere".
    #[getter]
    fn sampling(&self) -> &'static str {
        self.0.sampling.as_str()
    }

    /// Share of the velocity that is kept.
    #[getter]
    fn inertia(&self) -> f64 {
        self.0.inertia
    }

    /// Pull towards the particle's own best point.
    #[getter]
    fn cognitive(&self) -> f64 {
        self.0.cognitive
    }

    /// Pull towards its leader's best point.
    #[getter]
    fn social(&self) -> f64 {
        self.0.social
    }

    /// Whose best point a particle knows: "global", "ring" or "random".
    #[getter]
    fn topology(&self) -> &'static str {
        self.0.topology.as_str()
    }

    /// Particles known on either side of a ring, or informed at random.
    #[getter]
    fn neighbours(&self) -> usize {
        self.0.neighbours
    }

    /// Size of the swarm.
    #[getter]
    fn particles(&self) -> usize {
        self.0.particles
    }

    /// What happens at the bounds: "clamp", "reflect", "absorb" or "rebound".
    #[getter]
    fn bounds(&self) -> &'static str {
        self.0.bounds.as_str()
    }

    /// Largest velocity as a share of the box's width, or None.
    #[getter]
    fn velocity_limit(&self) -> Option<f64> {
        self.0.velocity_limit
    }

    /// Moves of the whole swarm at most.
    #[getter]
    fn max_iterations(&self) -> usize {
        self.0.max_iterations
    }

    /// Evaluations at most, or None.
    #[getter]
    fn max_evaluations(&self) -> Option<usize> {
        self.0.max_evaluations
    }

    /// The value that is low enough to stop, or None.
    #[getter]
    fn target(&self) -> Option<f64> {
        self.0.target
    }

    /// Iterations without progress that end the run, or None.
    #[getter]
    fn stagnation(&self) -> Option<usize> {
        self.0.stagnation
    }

    /// Progress is a fall of the best value by more than this.
    #[getter]
    fn improvement(&self) -> f64 {
        self.0.improvement
    }

    /// Seed of all draws.
    #[getter]
    fn seed(&self) -> u64 {
        self.0.seed
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<u64> {
        let mut hasher = DefaultHasher::new();
        self.__repr__(py)?.hash(&mut hasher);
        Ok(hasher.finish())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        called("PsoSettings", &keywords(py, &self.0)?)
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        Ok((PyTuple::empty(py), keywords(py, &self.0)?))
    }
}
