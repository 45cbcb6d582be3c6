//! Obstacles and loads that a rod is solved among, and their Python functions' exceptions on the way back.

pub(crate) mod contact;
pub(crate) mod loads;
pub(crate) mod mesh;
pub(crate) mod obstacle;
pub(crate) mod shapes;
pub(crate) mod signed_distance;

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use pyo3::prelude::*;
use pyo3::types::PyTuple;

use tdcr::InvalidInput;
use tdcr::model::{Model, Report, State};
use tdcr::obstacle::{Fault, Obstacle, SignedDistance, Volume};
use tdcr::robot::Robot;
use tdcr::rod::contact::{LoadedRod, Scene, Scratch};
use tdcr::rod::{Plan, RodSettings};

use crate::convert::arguments::wrong_type;
use crate::convert::arrays::invalid;
use crate::convert::interruptible;
use crate::forward::rod::{Load, estimated_microseconds};
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

/// A rod among obstacles whose first fault ends all work.
pub(crate) struct Watched<'r> {
    rod: LoadedRod<'r>,
    stop: Arc<AtomicBool>,
    fault: &'r Mutex<Option<Fault>>,
}

impl<'r> Watched<'r> {
    pub(crate) fn new(
        rod: LoadedRod<'r>,
        stop: Arc<AtomicBool>,
        fault: &'r Mutex<Option<Fault>>,
    ) -> Self {
        Self { rod: rod.stopped_by(Arc::clone(&stop)), stop, fault }
    }

    /// Displacements and the shape, found from rest or from an earlier shape.
    pub(crate) fn solve_load(
        &self,
        load: Load,
        start: Option<State>,
    ) -> Result<(Vec<f64>, tdcr::Shape), InvalidInput> {
        let mut work = Scratch::default();
        let report = match (&load, start) {
            (Load::Tensions(tensions), _) => self.rod.solve_tensions(tensions, &mut work)?,
            (Load::Displacements(displacements), None) => {
                let shape = self.shape(displacements)?;
                return Ok((displacements.clone(), shape));
            }
            (Load::Displacements(displacements), Some(start)) => {
                self.rod.robot().check_displacements(displacements)?;
                self.rod.solve_from(&start, displacements, &mut work)?
            }
        };
        self.watch(&mut work);
        let message = self.rod.message(&[], &work);
        let state = self.rod.take_state(work);
        let displacements = match load {
            Load::Displacements(displacements) => displacements,
            Load::Tensions(_) => self.rod.displacements(&state),
        };
        Ok((displacements, tdcr::Shape { state, report, message }))
    }

    fn watch(&self, work: &mut Scratch) {
        if let Some(fault) = work.take_fault() {
            self.fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(fault);
            // After that: what others fail with because of it comes too late.
            self.stop.store(true, Ordering::SeqCst);
        }
    }
}

impl Model for Watched<'_> {
    type Scratch = Scratch;

    fn robot(&self) -> &Robot {
        self.rod.robot()
    }

    fn strain_width(&self) -> usize {
        self.rod.strain_width()
    }

    fn elements(&self) -> usize {
        self.rod.elements()
    }

    fn solve(&self, displacements: &[f64], work: &mut Scratch) -> Result<Report, InvalidInput> {
        let report = self.rod.solve(displacements, work)?;
        self.watch(work);
        Ok(report)
    }

    fn resume(&self, displacements: &[f64], work: &mut Scratch) -> Result<Report, InvalidInput> {
        let report = self.rod.resume(displacements, work)?;
        self.watch(work);
        Ok(report)
    }

    fn state<'w>(&self, work: &'w Scratch) -> &'w State {
        self.rod.state(work)
    }

    fn take_state(&self, work: Scratch) -> State {
        self.rod.take_state(work)
    }

    fn message(&self, displacements: &[f64], work: &Scratch) -> String {
        self.rod.message(displacements, work)
    }
}

/// Raises the fault that work ended with, if it did.
pub(crate) fn checked(py: Python<'_>, fault: Mutex<Option<Fault>>) -> PyResult<()> {
    let Some(fault) = fault.into_inner().unwrap_or_else(PoisonError::into_inner) else {
        return Ok(());
    };
    Err(match fault.downcast::<Named>() {
        Ok(named) => raised(py, named.fault, Some(&format!("obstacles[{}]", named.obstacle))),
        Err(fault) => raised(py, fault, None),
    })
}

/// Usual time of a subsegment among obstacles \[µs\]: 10 to 20 among a few bodies, 180 among meshes.
const MICROSECONDS_PER_SUBSEGMENT: f64 = 50.0;

/// Solves once without the GIL, where Ctrl-C can stop it, if that may take long. Python functions of obstacles take
/// the GIL, and see Ctrl-C themselves.
pub(crate) fn solve<T: Send>(
    py: Python<'_>,
    robot: &Robot,
    plan: &Plan,
    scene: &Scene,
    job: impl FnOnce(&Watched<'_>) -> Result<T, InvalidInput> + Send,
) -> PyResult<T> {
    let fault = Mutex::new(None);
    let rod = LoadedRod::new(robot, plan, scene).map_err(|e| invalid(&e))?;
    let microseconds = if scene.calls_functions() {
        0.0
    } else {
        estimated_microseconds(plan, MICROSECONDS_PER_SUBSEGMENT)
    };
    let shape = interruptible::run_if_long(py, microseconds, |control| {
        job(&Watched::new(rod, Arc::clone(&control.stop), &fault))
    })?;
    checked(py, fault)?;
    shape.map_err(|e| invalid(&e))
}
