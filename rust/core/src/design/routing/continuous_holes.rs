//! Holes of any azimuth and radius: shapes, unknowns and exact derivatives.

use std::sync::Arc;

use nalgebra::{DMatrix, Vector3};

use super::task::{PerHole, Task};
use crate::error::InvalidInput;
use crate::model::{Model, State};
use crate::robot::Robot;
use crate::rod::{Plan, Rod, Scratch, Sensitivity};
use crate::solve::pseudo_inverse::PseudoInverse;
use crate::status::Status;

/// Kind of pulls: tensions reach every shape near by, displacements can be bounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pulls {
    Tensions,
    Displacements,
}

/// Unknowns that a descent may change.
#[derive(Clone, Copy, Debug)]
pub(super) struct Freedom {
    pub(super) azimuths: bool,
    pub(super) radii: Option<(f64, f64)>,
    pub(super) pulls: Pulls,
}

impl Freedom {
    /// Holes stay where they are.
    pub(super) const fn of_pulls() -> Self {
        Self { azimuths: false, radii: None, pulls: Pulls::Tensions }
    }

    /// All that the task leaves open.
    pub(super) fn whole(task: &Task<'_>) -> Self {
        Self { azimuths: true, radii: task.settings.radius, pulls: Pulls::Tensions }
    }

    /// Units of so many unknowns, in their order: radians, lengths of the robot, the tension that is one
    /// bending stiffness over length².
    pub(super) fn units(&self, task: &Task<'_>, count: usize) -> Vec<f64> {
        let mut units = Vec::with_capacity(count);
        for azimuths in task.radii.iter().map(Vec::len) {
            units.resize(units.len() + azimuths * usize::from(self.azimuths), 1.0);
            units.resize(units.len() + azimuths * usize::from(self.radii.is_some()), task.length());
        }
        let pull = match self.pulls {
            Pulls::Tensions => task.plan.unit / task.plan.slenderness,
            Pulls::Displacements => task.length(),
        };
        units.resize(count, pull);
        units
    }
}

/// A routed robot and its shape.
#[derive(Clone, Debug)]
pub(super) struct Point {
    pub(super) azimuths: PerHole,
    pub(super) radii: PerHole,
    pub(super) robot: Robot,
    pub(super) state: State,
    pub(super) displacements: Vec<f64>,
    /// Sum of squared distances \[m²\].
    pub(super) value: f64,
}

impl Point {
    /// Under tensions, in the unit of the results. Nothing if there is no such shape.
    pub(super) fn at_tensions(
        task: &Task<'_>,
        robot: Robot,
        (azimuths, radii): (PerHole, PerHole),
        tensions: &[f64],
    ) -> Result<Option<Self>, InvalidInput> {
        let plan = Plan::new(&robot, task.settings.rod)?;
        let rod = Rod::new(&robot, &plan).stopped_by(Arc::clone(task.stop));
        let mut work = Scratch::default();
        if rod.solve_tensions(tensions, &mut work)?.status != Status::Converged {
            return Ok(None);
        }
        let displacements = rod.displacements(rod.state(&work));
        let state = rod.take_state(work);
        let value = task.value(&state);
        Ok(Some(Self { azimuths, radii, robot, state, displacements, value }))
    }

    /// Routing under displacements.
    pub(super) fn at_displacements(
        &self,
        task: &Task<'_>,
        displacements: Vec<f64>,
    ) -> Result<Option<Self>, InvalidInput> {
        let holes = (self.azimuths.clone(), self.radii.clone());
        Self::near(task, self.robot.clone(), holes, displacements, &self.state)
    }

    /// Under displacements, near another shape.
    fn near(
        task: &Task<'_>,
        robot: Robot,
        (azimuths, radii): (PerHole, PerHole),
        displacements: Vec<f64>,
        near: &State,
    ) -> Result<Option<Self>, InvalidInput> {
        let plan = Plan::new(&robot, task.settings.rod)?;
        let rod = Rod::new(&robot, &plan).stopped_by(Arc::clone(task.stop));
        let mut work = Scratch::default();
        if rod.solve_from(near, &displacements, &mut work)?.status != Status::Converged {
            return Ok(None);
        }
        let state = rod.take_state(work);
        let value = task.value(&state);
        Ok(Some(Self { azimuths, radii, robot, state, displacements, value }))
    }

    /// Its displacements within their bounds; what is slack is held at its rest length where that leaves it slack.
    pub(super) fn pulls(&self, task: &Task<'_>) -> Vec<f64> {
        let own = self.displacements.iter().zip(&self.state.tensions).enumerate();
        let bounded = |(k, (pull, tension)): (usize, (&f64, &f64))| {
            let (low, high) = task.bound(k);
            let pull = if *tension > 0.0 { *pull } else { pull.max(0.0) };
            pull.clamp(low, high)
        };
        own.map(bounded).collect()
    }

    pub(super) fn is_met(&self, task: &Task<'_>, share: f64) -> bool {
        task.errors(&self.state)
            .iter()
            .all(|e| *e <= share * task.settings.tolerance * task.length())
    }

    /// The unknowns, and their bounds.
    pub(super) fn unknowns(&self, task: &Task<'_>, freedom: &Freedom) -> [Vec<f64>; 3] {
        let (mut x, mut lower, mut upper) = (Vec::new(), Vec::new(), Vec::new());
        let mut add = |values: &[f64], low: f64, high: f64| {
            x.extend_from_slice(values);
            lower.resize(x.len(), low);
            upper.resize(x.len(), high);
        };
        for k in 0..task.tendons() {
            if freedom.azimuths {
                add(&self.azimuths[k], f64::NEG_INFINITY, f64::INFINITY);
            }
            if let Some((low, high)) = freedom.radii {
                add(&self.radii[k], low, high);
            }
        }
        for k in 0..task.tendons() {
            if freedom.pulls == Pulls::Tensions {
                add(&self.state.tensions[k..=k], 0.0, f64::INFINITY);
            } else {
                let (low, high) = task.bound(k);
                add(&self.displacements[k..=k], low, high);
            }
        }
        [x, lower, upper]
    }

    /// The point of other unknowns.
    pub(super) fn with_unknowns(
        &self,
        task: &Task<'_>,
        freedom: &Freedom,
        x: &[f64],
    ) -> Result<Option<Self>, InvalidInput> {
        let (mut azimuths, mut radii) = (self.azimuths.clone(), self.radii.clone());
        let mut rest = x;
        for k in 0..task.tendons() {
            let count = azimuths[k].len();
            if freedom.azimuths {
                azimuths[k].copy_from_slice(&rest[..count]);
                rest = &rest[count..];
            }
            if freedom.radii.is_some() {
                radii[k].copy_from_slice(&rest[..count]);
                rest = &rest[count..];
            }
        }
        let robot = task.with_azimuths(&azimuths, &radii)?;
        match freedom.pulls {
            Pulls::Tensions => Self::at_tensions(task, robot, (azimuths, radii), rest),
            Pulls::Displacements => {
                Self::near(task, robot, (azimuths, radii), rest.to_vec(), &self.state)
            }
        }
    }

    /// Derivatives of all places by the unknowns.
    pub(super) fn jacobian(
        &self,
        task: &Task<'_>,
        freedom: &Freedom,
    ) -> Result<DMatrix<f64>, InvalidInput> {
        let plan = Plan::new(&self.robot, task.settings.rod)?;
        let rod = Rod::new(&self.robot, &plan);
        let mut work = Scratch::default();
        rod.solve_from(&self.state, &self.displacements, &mut work)?;
        let sensitivity = rod.sensitivity(&self.displacements, &work);
        let (mut places, mut tensions) = self.columns(task, freedom, &sensitivity);
        if freedom.pulls == Pulls::Tensions {
            // At constant tensions instead of displacements.
            let count = task.tendons();
            let holes = places.ncols() - count;
            let inverse = PseudoInverse::new(&tensions.columns(holes, count).into_owned()).matrix;
            let by_tension = places.columns(holes, count) * inverse;
            tensions = tensions.columns(0, holes).into_owned();
            let fixed = places.columns(0, holes) - &by_tension * tensions;
            places.columns_mut(0, holes).copy_from(&fixed);
            places.columns_mut(holes, count).copy_from(&by_tension);
        }
        Ok(places)
    }

    /// Derivatives of places and of tensions by holes and displacements.
    fn columns(
        &self,
        task: &Task<'_>,
        freedom: &Freedom,
        sensitivity: &Sensitivity<'_>,
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        // Changes of one hole at a time: around the disk's centre, then away from it.
        let mut change = sensitivity.no_change();
        let mut variations = Vec::new();
        for k in 0..task.tendons() {
            let holes = self.azimuths[k].iter().zip(&self.radii[k]);
            let holes: Vec<(f64, f64)> =
                holes.map(|(azimuth, radius)| (*azimuth, *radius)).collect();
            // ∂h/∂azimuth and ∂h/∂radius.
            let around = |(azimuth, radius): (f64, f64)| {
                Vector3::new(-radius * azimuth.sin(), radius * azimuth.cos(), 0.0)
            };
            let out = |(azimuth, _): (f64, f64)| Vector3::new(azimuth.cos(), azimuth.sin(), 0.0);
            let mut add = |moves: &dyn Fn((f64, f64)) -> Vector3<f64>| {
                for (disk, hole) in holes.iter().enumerate() {
                    change.holes[k][disk] = moves(*hole);
                    variations.push(sensitivity.forward(&change));
                    change.holes[k][disk] = Vector3::zeros();
                }
            };
            if freedom.azimuths {
                add(&around);
            }
            if freedom.radii.is_some() {
                add(&out);
            }
        }
        // Changes of one displacement at a time.
        for k in 0..task.tendons() {
            change.displacements[k] = 1.0;
            variations.push(sensitivity.forward(&change));
            change.displacements[k] = 0.0;
        }
        // ∂p and ∂T, one column per change.
        let places = DMatrix::from_fn(3 * task.targets.len(), variations.len(), |row, column| {
            variations[column].velocities[1 + row / 3][row % 3]
        });
        let tensions =
            DMatrix::from_fn(task.tendons(), variations.len(), |k, c| variations[c].tensions[k]);
        (places, tensions)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // A test may stop where it fails.
mod tests {
    use super::*;
    use crate::design::RoutingSettings;
    use crate::robot::{Backbone, BackboneSpec, Tendon};

    #[test]
    fn derivatives_are_those_of_the_places() {
        let mut spec = BackboneSpec::straight(0.1, 5);
        spec.rest = Some((0..5).map(|i| Vector3::new(0.05 * f64::from(i), -0.1, 0.02)).collect());
        let tendons = vec![
            Tendon::straight(0.3, 8e-3).unwrap(),
            Tendon::new(
                crate::robot::Routing::Helical { azimuth: 2.0, radius: 9e-3, turns: 0.4 },
                Some(3),
                None,
                None,
            )
            .unwrap(),
        ];
        let robot = Robot::new(Backbone::new(spec).unwrap(), tendons, None, None, None).unwrap();
        let settings = RoutingSettings::default();
        let targets = vec![Vector3::zeros(); 5];
        let radii: PerHole =
            robot.paths().iter().map(|p| p.holes.iter().map(Vector3::norm).collect()).collect();
        let azimuths: PerHole = robot.paths().iter().map(|p| p.azimuths.clone()).collect();
        let plan = Plan::new(&robot, settings.rod).unwrap();
        let stop = Arc::default();
        let task = Task {
            robot: &robot,
            targets: &targets,
            bounds: None,
            settings: &settings,
            stop: &stop,
            plan,
            radii: radii.clone(),
        };
        let start = task.with_azimuths(&azimuths, &radii).unwrap();
        let point =
            Point::at_tensions(&task, start, (azimuths, radii), &[150.0, 220.0]).unwrap().unwrap();
        for pulls in [Pulls::Tensions, Pulls::Displacements] {
            let freedom = Freedom { azimuths: true, radii: Some((1e-3, 2e-2)), pulls };
            let jacobian = point.jacobian(&task, &freedom).unwrap();
            let [x, _, _] = point.unknowns(&task, &freedom);
            assert_eq!((jacobian.nrows(), jacobian.ncols()), (15, 22));
            for i in 0..x.len() {
                let step = if i + 2 >= x.len() { 1e-5 * x[i].abs() } else { 1e-6 };
                let at = |sign: f64| {
                    let mut moved = x.clone();
                    moved[i] += sign * step;
                    task.residual(
                        &point.with_unknowns(&task, &freedom, &moved).unwrap().unwrap().state,
                    )
                };
                let difference = (at(1.0) - at(-1.0)) / (2.0 * step);
                let column = jacobian.column(i);
                let off = (&difference - column).amax() / column.amax();
                assert!(off < 2e-5, "{pulls:?} {i}: {off}");
            }
        }
    }
}
