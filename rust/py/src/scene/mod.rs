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
use tdcr::model::{Model as _, State};
use tdcr::obstacle::{Fault, FirstFault, Obstacle, SignedDistance, Volume};
use tdcr::robot::Robot;
use tdcr::rod::contact::{LoadedRod, Scene, Scratch};
use tdcr::rod::{Plan, RodSettings};

use crate::convert::arguments::wrong_type;
use crate::convert::arrays::invalid;
use crate::convert::interruptible;
use crate::forward::rod::Load;
use crate::scene::loads::Loads;
use crate::scene::obstacle::{obstacles, raised};

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

    /// What there is, for those who do not take it: the name of the argument.
    pub(crate) fn any(&self) -> Option<&'static str> {
        if !self.obstacles.is_empty() {
            return Some("obstacles");
        }
        self.loads.as_ref().map(|_| "loads")
    }

    /// The robot's scene.
    pub(crate) fn scene(
        &self,
        robot: &Robot,
        plan: &Plan,
        settings: &RodSettings,
    ) -> Result<Scene, InvalidInput> {
        let loads = self.loads.as_ref().map(|loads| &loads.0);
        Scene::new(robot, plan, &self.obstacles, loads, settings.body_radius)
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

/// Displacements and the shape of a load, found from rest or from an earlier shape.
pub(crate) fn solve_load(
    rod: &LoadedRod<'_>,
    load: Load,
    start: Option<State>,
) -> Result<(Vec<f64>, tdcr::Shape), InvalidInput> {
    let mut work = Scratch::default();
    let report = match (&load, start) {
        (Load::Tensions(tensions), _) => rod.solve_tensions(tensions, &mut work)?,
        (Load::Displacements(displacements), None) => {
            let shape = rod.shape(displacements)?;
            return Ok((displacements.clone(), shape));
        }
        (Load::Displacements(displacements), Some(start)) => {
            rod.robot().check_displacements(displacements)?;
            rod.solve_from(&start, displacements, &mut work)?
        }
    };
    let message = rod.message(&[], &work);
    let state = rod.take_state(work);
    let displacements = match load {
        Load::Displacements(displacements) => displacements,
        Load::Tensions(_) => rod.displacements(&state),
    };
    Ok((displacements, tdcr::Shape { state, report, message }))
}

/// Raises the fault that work ended with, if it did.
pub(crate) fn checked(py: Python<'_>, fault: Option<Fault>) -> PyResult<()> {
    let Some(fault) = fault else { return Ok(()) };
    Err(match fault.downcast::<Named>() {
        Ok(named) => raised(py, named.fault, Some(&format!("obstacles[{}]", named.obstacle))),
        Err(fault) => raised(py, fault, None),
    })
}

/// Rods with more second derivatives than this may take longer than a second among meshes.
const LONG: usize = 400;

/// Solves once without the GIL, where Ctrl-C can stop it, if that may take long; but for the GIL that Python functions of obstacles take; these see Ctrl-C too.
pub(crate) fn solve<T: Send>(
    py: Python<'_>,
    robot: &Robot,
    plan: &Plan,
    scene: &Scene,
    job: impl FnOnce(&LoadedRod<'_>) -> Result<T, InvalidInput> + Send,
) -> PyResult<T> {
    let rod = LoadedRod::new(robot, plan, scene).map_err(|e| invalid(&e))?;
    let mut first_fault = FirstFault::default();
    let shape = if scene.calls_functions() || plan.second_derivatives() < LONG {
        py.detach(|| job(&rod.reporting_to(&first_fault)))
    } else {
        interruptible::run(py, None, |control| {
            first_fault = FirstFault::raising(Arc::clone(&control.stop));
            job(&rod.reporting_to(&first_fault))
        })?
    };
    checked(py, first_fault.take())?;
    shape.map_err(|e| invalid(&e))
}
