//! Obstacles and loads that a rod is solved among, and their Python functions' exceptions on the way back.

pub(crate) mod contact;
pub(crate) mod loads;
pub(crate) mod mesh;
pub(crate) mod obstacle;
pub(crate) mod shapes;
pub(crate) mod signed_distance;

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use pyo3::prelude::*;
use pyo3::types::PyTuple;

use tdcr::InvalidInput;
use tdcr::forward::{Forward, ModelSettings};
use tdcr::obstacle::{Fault, Obstacle, SignedDistance, Volume};
use tdcr::robot::Robot;
use tdcr::rod::Plan;
use tdcr::rod::contact::Scene;

use crate::convert::arguments::wrong_type;
use crate::convert::arrays::invalid;
use crate::scene::loads::Loads;
use crate::scene::obstacle::{fault_exception, obstacles};

/// Obstacles, as Python knows them and as the core does, and loads.
pub(crate) struct Surroundings {
    pub(crate) given: Py<PyTuple>,
    obstacles: Vec<Obstacle>,
    pub(crate) loads: Option<Loads>,
    stop: Stop,
}

/// The flag that ends a batch, once there is one.
type Stop = Arc<OnceLock<Arc<AtomicBool>>>;

impl Surroundings {
    /// From the arguments; nothing at all is an empty place.
    pub(crate) fn new(
        py: Python<'_>,
        given: Option<&Bound<'_, PyAny>>,
        loads: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let loads = loads.map(|value| match value.cast::<Loads>() {
            Ok(loads) => Ok(loads.get().clone()),
            Err(_) => Err(wrong_type("loads", "Loads", value)),
        });
        let (loads, stop) = (loads.transpose()?, Stop::default());
        let Some(given) = given else {
            return Ok(Self { given: PyTuple::empty(py).unbind(), obstacles: vec![], loads, stop });
        };
        let given = if given.is_instance_of::<crate::scene::obstacle::Obstacle>() {
            PyTuple::new(py, [given])?
        } else {
            let expected = "an obstacle or a sequence of obstacles";
            let items = given.try_iter().map_err(|_| wrong_type("obstacles", expected, given))?;
            PyTuple::new(py, items.collect::<PyResult<Vec<_>>>()?)?
        };
        let all = obstacles("obstacles", &given)?;
        let one = all.len() == 1;
        let all = all.into_iter().enumerate();
        let all = all.map(|(i, obstacle)| listening(obstacle, (!one).then_some(i), &stop));
        Ok(Self { given: given.unbind(), obstacles: all.collect(), loads, stop })
    }

    /// Functions fail from when the flag is set, in the midst of a solve.
    pub(crate) fn stopped_by(&self, stop: &Arc<AtomicBool>) {
        self.stop.get_or_init(|| Arc::clone(stop));
    }

    /// Name of the argument that is given, for models that take none.
    pub(crate) fn any(&self) -> Option<&'static str> {
        if !self.obstacles.is_empty() {
            return Some("obstacles");
        }
        self.loads.as_ref().map(|_| "loads")
    }

    /// Refuses surroundings for a model that knows no forces.
    pub(crate) fn check(&self, settings: &ModelSettings) -> PyResult<()> {
        let loads = self.loads.as_ref().map(|loads| &loads.0);
        settings.check_surroundings(&self.obstacles, loads).map_err(|e| invalid(&e))
    }

    /// Robot prepared for a model in these surroundings.
    pub(crate) fn prepare<'r>(
        &self,
        robot: &'r Robot,
        settings: ModelSettings,
    ) -> PyResult<Forward<'r>> {
        let loads = self.loads.as_ref().map(|loads| &loads.0);
        Forward::new(robot, settings)
            .and_then(|forward| forward.among(&self.obstacles, loads))
            .map_err(|e| invalid(&e))
    }

    /// Scene of the rod of a robot, if there is anything around it.
    pub(crate) fn scene(&self, robot: &Robot, plan: &Plan) -> Result<Option<Scene>, InvalidInput> {
        if self.any().is_none() {
            return Ok(None);
        }
        let loads = self.loads.as_ref().map(|loads| &loads.0);
        Scene::new(robot, plan, &self.obstacles, loads, plan.settings().body_radius).map(Some)
    }

    pub(crate) fn same(&self, other: &Self, py: Python<'_>) -> PyResult<bool> {
        Ok(self.loads == other.loads && self.given.bind(py).eq(other.given.bind(py))?)
    }
}

/// A fault of one of several obstacles.
#[derive(Debug)]
struct Named {
    obstacle: usize,
    fault: Fault,
}

impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "obstacles[{}]: {}", self.obstacle, self.fault)
    }
}

impl std::error::Error for Named {}

/// A function that says whose its faults are, where there are several obstacles, and that listens to a flag.
/// Other volumes have no faults and are quick.
fn listening(obstacle: Obstacle, index: Option<usize>, stop: &Stop) -> Obstacle {
    let Volume::SignedDistance(function) = obstacle.volume() else { return obstacle };
    let solid = Obstacle::new(function.clone(), false);
    let stop = Arc::clone(stop);
    let function = SignedDistance::new(Arc::new(move |x| {
        if stop.get().is_some_and(|stop| stop.load(Ordering::SeqCst)) {
            return Err("stopped".into());
        }
        let near = solid.nearest(x).map_err(|fault| match index {
            Some(obstacle) => Box::new(Named { obstacle, fault }),
            None => fault,
        })?;
        Ok((near.distance, near.gradient))
    }));
    Obstacle::new(function, obstacle.inside())
}

/// Raises the fault that work ended with, if it did.
pub(crate) fn raise_fault(py: Python<'_>, fault: Option<Fault>) -> PyResult<()> {
    let Some(fault) = fault else { return Ok(()) };
    Err(match fault.downcast::<Named>() {
        Ok(named) => {
            fault_exception(py, named.fault, Some(&format!("obstacles[{}]", named.obstacle)))
        }
        Err(fault) => fault_exception(py, fault, None),
    })
}
