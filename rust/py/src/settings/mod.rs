//! Settings of the models.

pub(crate) mod bounds;
pub(crate) mod pso;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use tdcr::InvalidInput;
use tdcr::constant_curvature as cc;
use tdcr::design::{PrebendSettings, RoutingSettings};
use tdcr::inverse;
use tdcr::linkage;
use tdcr::rod::RodSettings;
use tdcr::solve::pso::PsoSettings;

use crate::convert::arguments::{OneOrMany, number, whole};
use crate::convert::arrays::{called, invalid, one_or_tuple};
use crate::design::prebend;
use crate::design::routing;
use crate::forward::rod;
use crate::settings::pso::PsoSettings as PyPsoSettings;

/// How precisely and how long the linkage model solves each subsegment.
///
/// Parameters
/// ----------
/// step_tolerance : float, optional
///     A subsegment is solved when a full Newton step falls below this [rad]; the error left is
///     about its square. In (0, 1e-3].
/// max_iterations : int, optional
///     Newton steps per subsegment at most.
///
/// Raises
/// ------
/// InvalidInput
///     A value out of range.
#[pyclass(frozen, eq, module = "tdcr")]
#[derive(Clone, PartialEq)]
pub(crate) struct LinkageSettings(pub(crate) linkage::LinkageSettings);

fn max_iterations(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    whole("max_iterations", value)
}

fn starts(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    whole("starts", value)
}

fn seed(value: &Bound<'_, PyAny>) -> PyResult<u64> {
    whole("seed", value).map(|seed| seed as u64)
}

#[pymethods]
impl LinkageSettings {
    #[new]
    #[pyo3(signature = (*, step_tolerance=1e-9, max_iterations=50))]
    fn new(
        step_tolerance: f64,
        #[pyo3(from_py_with = max_iterations)] max_iterations: usize,
    ) -> PyResult<Self> {
        let settings = linkage::LinkageSettings { step_tolerance, max_iterations };
        settings.validate().map_err(|e| invalid(&e))?;
        Ok(Self(settings))
    }

    /// Bound on the last Newton step [rad].
    #[getter]
    fn step_tolerance(&self) -> f64 {
        self.0.step_tolerance
    }

    /// Newton steps per subsegment at most.
    #[getter]
    fn max_iterations(&self) -> usize {
        self.0.max_iterations
    }

    fn __hash__(&self) -> u64 {
        self.0.step_tolerance.to_bits().rotate_left(17) ^ self.0.max_iterations as u64
    }

    fn __repr__(&self) -> String {
        let linkage::LinkageSettings { step_tolerance, max_iterations } = self.0;
        format!(
            "LinkageSettings(step_tolerance={step_tolerance:?}, max_iterations={max_iterations})"
        )
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("step_tolerance", self.step_tolerance())?;
        keywords.set_item("max_iterations", self.max_iterations())?;
        Ok((PyTuple::empty(py), keywords))
    }
}

/// Choices of the constant-curvature model.
///
/// Parameters
/// ----------
/// coupling : {"coupled", "per_segment"}, optional
///     "coupled": displacements are measured at the base, and a tendon is shortened in every segment
///     it runs through. "per_segment": each displacement is the part inside the segment where the
///     tendon ends.
/// extensible : bool, optional
///     Whether the length of every segment is an unknown too. At least three tendons must end at
///     each segment that has any.
///
/// Raises
/// ------
/// InvalidInput
///     Another coupling.
#[pyclass(frozen, eq, hash, module = "tdcr")]
#[derive(Clone, PartialEq, Eq, Hash)]
pub(crate) struct ConstantCurvatureSettings(pub(crate) cc::ConstantCurvatureSettings);

#[pymethods]
impl ConstantCurvatureSettings {
    #[new]
    #[pyo3(signature = (*, coupling="coupled", extensible=false))]
    fn new(coupling: &str, extensible: bool) -> PyResult<Self> {
        let known = cc::Coupling::ALL.into_iter().find(|known| known.as_str() == coupling);
        let Some(coupling) = known else {
            let expected = "\"coupled\" or \"per_segment\"";
            let got = format!("\"{coupling}\"");
            return Err(invalid(&InvalidInput::new("coupling", expected, got)));
        };
        Ok(Self(cc::ConstantCurvatureSettings { coupling, extensible }))
    }

    /// How displacements reach the segments: "coupled" or "per_segment".
    #[getter]
    fn coupling(&self) -> &'static str {
        self.0.coupling.as_str()
    }

    /// Whether the length of every segment is an unknown too.
    #[getter]
    fn extensible(&self) -> bool {
        self.0.extensible
    }

    fn __repr__(&self) -> String {
        let extensible = if self.0.extensible { "True" } else { "False" };
        format!(
            "ConstantCurvatureSettings(coupling={:?}, extensible={extensible})",
            self.coupling()
        )
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("coupling", self.coupling())?;
        keywords.set_item("extensible", self.extensible())?;
        Ok((PyTuple::empty(py), keywords))
    }
}

/// How precisely, how long and with which weights an inverse is sought.
///
/// Parameters
/// ----------
/// position_tolerance : float, optional
///     Distance to the target that counts as reached [m].
/// rotation_tolerance : float, optional
///     Angle to the target that counts as reached [rad].
/// position_weight : float or (float, float, float), optional
///     Weight of the distance, or of its parts along the world axes; 0 leaves an axis out.
/// rotation_weight : float or (float, float, float), optional
///     What one radian counts, or one about each tool axis [m]; 0 leaves an axis free: (1, 1, 0) points
///     the tool and lets it roll. Default: 0.3 of the robot's length. Weights decide what is nearest to
///     a target out of reach.
/// starts : int, optional
///     Starts at most before a target counts as out of reach.
/// max_iterations : int, optional
///     Steps per start at most.
/// seed : int, optional
///     Of the random starts. The same seed gives the same answer on any number of threads.
/// least_energy : bool, optional
///     Whether freedom that the target leaves goes to the least bending energy. False keeps the answer
///     near its start: a path then has no jumps where a least energy ends at a bound.
/// swarm : PsoSettings, optional
///     The swarms of method "pso" and of the last resort, their seeds counted from its own. They
///     minimise the squared weighted miss over the robot's length. Default: 30 particles that hand
///     over to descents at 1 % of the robot's length, or when they stagnate.
///
/// Raises
/// ------
/// InvalidInput
///     Tolerances that are not positive, weights that are negative, NaN or zero everywhere, no starts.
#[pyclass(frozen, eq, module = "tdcr")]
#[derive(Clone, PartialEq)]
pub(crate) struct InverseSettings(pub(crate) inverse::InverseSettings);

/// One number for three axes, or three.
fn per_axis(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    let given = OneOrMany::extract(argument, value, number)?.into_vec();
    match given.as_slice() {
        [one] => Ok([*one; 3]),
        &[x, y, z] => Ok([x, y, z]),
        other => {
            let got = format!("{} numbers", other.len());
            Err(invalid(&InvalidInput::new(argument, "one number or three", got)))
        }
    }
}

fn position_weight(value: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    per_axis("position_weight", value)
}

/// Three numbers as one when they are the same.
fn joined<'py>(py: Python<'py>, values: &[f64; 3]) -> PyResult<Bound<'py, PyAny>> {
    let same = values.iter().all(|value| *value == values[0]);
    one_or_tuple(py, if same { &values[..1] } else { values })
}

#[pymethods]
impl InverseSettings {
    #[new]
    #[pyo3(
        signature = (*, position_tolerance=1e-10, rotation_tolerance=1e-10, position_weight=[1.0; 3],
            rotation_weight=None, starts=200, max_iterations=50, seed=0, least_energy=true, swarm=None),
        text_signature = "(*, position_tolerance=1e-10, rotation_tolerance=1e-10, \
            position_weight=1.0, rotation_weight=None, starts=200, max_iterations=50, seed=0, \
            least_energy=True, swarm=None)"
    )]
    #[allow(clippy::too_many_arguments)] // Keywords.
    fn new(
        position_tolerance: f64,
        rotation_tolerance: f64,
        #[pyo3(from_py_with = position_weight)] position_weight: [f64; 3],
        rotation_weight: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = starts)] starts: usize,
        #[pyo3(from_py_with = max_iterations)] max_iterations: usize,
        #[pyo3(from_py_with = seed)] seed: u64,
        least_energy: bool,
        swarm: Option<PyRef<'_, PyPsoSettings>>,
    ) -> PyResult<Self> {
        let mut settings = inverse::InverseSettings {
            position_tolerance,
            rotation_tolerance,
            position_weight,
            starts,
            max_iterations,
            seed,
            least_energy,
            ..Default::default()
        };
        if let Some(swarm) = swarm {
            settings.swarm = swarm.0;
        }
        if let Some(weight) = rotation_weight {
            settings.rotation_weight = per_axis("rotation_weight", weight)?.map(Some);
        }
        settings.validate().map_err(|e| invalid(&e))?;
        Ok(Self(settings))
    }

    /// Distance that counts as reached [m].
    #[getter]
    fn position_tolerance(&self) -> f64 {
        self.0.position_tolerance
    }

    /// Angle that counts as reached [rad].
    #[getter]
    fn rotation_tolerance(&self) -> f64 {
        self.0.rotation_tolerance
    }

    /// Weight of the distance, one number or one per world axis.
    #[getter]
    fn position_weight<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        joined(py, &self.0.position_weight)
    }

    /// What one radian counts, one number or one per tool axis [m]; None: 0.3 of the robot's length.
    #[getter]
    fn rotation_weight<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let [Some(x), Some(y), Some(z)] = self.0.rotation_weight else { return Ok(None) };
        joined(py, &[x, y, z]).map(Some)
    }

    /// Starts at most.
    #[getter]
    fn starts(&self) -> usize {
        self.0.starts
    }

    /// Steps per start at most.
    #[getter]
    fn max_iterations(&self) -> usize {
        self.0.max_iterations
    }

    /// Seed of the random starts.
    #[getter]
    fn seed(&self) -> u64 {
        self.0.seed
    }

    /// Whether freedom goes to the least bending energy.
    #[getter]
    fn least_energy(&self) -> bool {
        self.0.least_energy
    }

    /// The swarms, or None for the default.
    #[getter]
    fn swarm(&self) -> Option<PyPsoSettings> {
        let default = inverse::InverseSettings::default().swarm;
        (self.0.swarm != default).then_some(PyPsoSettings(self.0.swarm))
    }

    fn __hash__(&self) -> u64 {
        let settings = &self.0;
        let weights = settings.rotation_weight.into_iter().flatten();
        let floats = [settings.position_tolerance, settings.rotation_tolerance]
            .into_iter()
            .chain(settings.position_weight)
            .chain(weights);
        let bits = floats.map(|value| (value + 0.0).to_bits());
        let counts = [settings.starts as u64, settings.max_iterations as u64, settings.seed];
        bits.chain(counts).fold(0, |hash: u64, bits| hash.rotate_left(13) ^ bits)
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        called("InverseSettings", &slf.get().__getnewargs_ex__(slf.py())?.1)
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("position_tolerance", self.position_tolerance())?;
        keywords.set_item("rotation_tolerance", self.rotation_tolerance())?;
        keywords.set_item("position_weight", self.position_weight(py)?)?;
        keywords.set_item("rotation_weight", self.rotation_weight(py)?)?;
        keywords.set_item("starts", self.starts())?;
        keywords.set_item("max_iterations", self.max_iterations())?;
        keywords.set_item("seed", self.seed())?;
        keywords.set_item("least_energy", self.least_energy())?;
        keywords.set_item("swarm", self.swarm())?;
        Ok((PyTuple::empty(py), keywords))
    }
}

/// Defaults of the core's settings by class name, for the test that compares them with Python's.
#[pyfunction]
pub(crate) fn _rust_defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let linkage = linkage::LinkageSettings::default();
    let values = PyDict::new(py);
    values.set_item("step_tolerance", linkage.step_tolerance)?;
    values.set_item("max_iterations", linkage.max_iterations)?;
    let defaults = PyDict::new(py);
    defaults.set_item("LinkageSettings", values)?;
    let curvature = cc::ConstantCurvatureSettings::default();
    let values = PyDict::new(py);
    values.set_item("coupling", curvature.coupling.as_str())?;
    values.set_item("extensible", curvature.extensible)?;
    defaults.set_item("ConstantCurvatureSettings", values)?;
    let inverse = InverseSettings(inverse::InverseSettings::default());
    defaults.set_item("InverseSettings", inverse.__getnewargs_ex__(py)?.1)?;
    defaults.set_item("RodSettings", rod::keywords(py, &RodSettings::default())?)?;
    defaults.set_item("PrebendSettings", prebend::keywords(py, &PrebendSettings::default())?)?;
    defaults.set_item("RoutingSettings", routing::keywords(py, &RoutingSettings::default())?)?;
    defaults.set_item("PsoSettings", pso::keywords(py, &PsoSettings::default())?)?;
    Ok(defaults)
}
