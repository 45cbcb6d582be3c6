//! Goal of a rod as a least-squares problem in the tensions: residuals, bounds on displacements, the sum of squared
//! tensions.

use nalgebra::SVector;

use crate::rod::equilibrium::Equilibrium;
use crate::solve::levenberg_marquardt::Problem;
use crate::solve::quadratic_program::Rows;
use crate::status::Status;

use super::goal::Goal;
use super::multistart::{Multistart, SearchOutcome};
use super::outcome::Answer;
use super::pose_goal::PoseGoal;

/// Unknowns: tensions in such units that each is about the angle by which it bends the rod alone \[rad\].
#[derive(Debug)]
pub(super) struct TensionProblem<'a, G = PoseGoal<'a>> {
    pub(super) rod: Box<dyn Equilibrium + 'a>,
    pub(super) goal: G,
    /// Tension of a unit of every unknown.
    units: &'a [f64],
    /// Lowest and highest displacement of every tendon \[m\].
    ranges: &'a [(f64, f64)],
    /// Length of every tendon at rest, which violations are measured by \[m\].
    rest_lengths: &'a [f64],
    has_bounds: bool,
    /// Length by which slack tendons are let out, so that rounding does not lock those that depend on each other \[m\].
    pub(super) slack_allowance: f64,
    tensions: Vec<f64>,
    /// The point evaluated last is an equilibrium.
    balanced: bool,
    second: Vec<f64>,
}

/// Second derivatives that are nearly right lead to a gradient of this precision in few steps.
const PRECISION: f64 = 1e-6;
/// Slot of the equilibrium nearest to the goal, among those that are kept.
const NEAREST: usize = 2;
/// Largest unknown of a slack tendon \[rad\].
const SLACK: f64 = 1e-9;

impl<'a, G> TensionProblem<'a, G> {
    pub(super) fn new(
        rod: Box<dyn Equilibrium + 'a>,
        goal: G,
        rest_lengths: &'a [f64],
        units: &'a [f64],
        ranges: &'a [(f64, f64)],
    ) -> Self {
        let finite = |(lower, upper): &(f64, f64)| lower.is_finite() || upper.is_finite();
        Self {
            rod,
            goal,
            units,
            ranges,
            rest_lengths,
            has_bounds: ranges.iter().any(finite),
            slack_allowance: 0.0,
            tensions: Vec::new(),
            balanced: false,
            second: Vec::new(),
        }
    }

    /// Moves the rod to the equilibrium under the tensions of a point and updates the goal; false when there is none.
    fn move_to<const R: usize>(&mut self, z: &[f64]) -> bool
    where
        G: Goal<R>,
    {
        // Rounding leaves no tension below zero.
        let tension = |(z, unit): (&f64, &f64)| (z * unit).max(0.0);
        let wanted = z.iter().zip(self.units).map(tension);
        if !(self.balanced && wanted.clone().eq(self.tensions.iter().copied())) {
            self.tensions.clear();
            self.tensions.extend(wanted);
            self.balanced = self.rod.go(&self.tensions);
            if self.balanced {
                self.rod.differentiate();
            }
        }
        if self.balanced {
            self.goal.update(self.rod.motion());
        }
        self.balanced
    }

    /// Displacements at the equilibrium \[m\]; rounding leaves none outside its bounds.
    pub(super) fn write_displacements(&self, place: &mut [f64]) {
        for (k, (displacement, (lower, upper))) in place.iter_mut().zip(self.ranges).enumerate() {
            // There are none where an obstacle's function failed before the first equilibrium.
            let own = self.rod.tensions().get(k);
            let slack = own.is_some_and(|tension| *tension <= SLACK * self.units[k]);
            let slack_allowance = if slack { self.slack_allowance } else { 0.0 };
            *displacement = (self.rod.displacement(k) + slack_allowance).max(*lower).min(*upper);
        }
    }

    /// True when the point evaluated last is an equilibrium.
    pub(super) fn balanced(&self) -> bool {
        self.balanced
    }

    /// Invalidates the point evaluated last: the rod is moved elsewhere.
    pub(super) fn forget(&mut self) {
        self.balanced = false;
    }

    /// Bounds on displacements that are active at the point evaluated last: a tendon, and true for its release.
    pub(super) fn active_bounds(&self, within: f64) -> Vec<(usize, bool)> {
        let mut out = Vec::new();
        for (k, (lower, upper)) in self.ranges.iter().enumerate() {
            let displacement = self.rod.displacement(k);
            if displacement - lower <= within {
                out.push((k, false));
            }
            if upper - displacement <= within {
                out.push((k, true));
            }
        }
        out
    }
}

impl<const R: usize, G: Goal<R>> Problem<R> for TensionProblem<'_, G> {
    fn evaluate(
        &mut self,
        z: &[f64],
        residual: &mut SVector<f64, R>,
        jacobian: &mut [SVector<f64, R>],
    ) {
        if !self.move_to::<R>(z) {
            // Without an equilibrium the step is refused.
            residual.fill(f64::NAN);
            return;
        }
        self.goal.write_residual(self.rod.motion(), residual, jacobian);
        jacobian.iter_mut().zip(self.units).for_each(|(column, unit)| *column *= *unit);
    }

    fn squared_norm(&mut self, z: &[f64]) -> f64 {
        // What is infinite is no value, to a swarm.
        if self.move_to::<R>(z) { self.goal.squared_norm() } else { f64::INFINITY }
    }

    fn is_met(&self, residual: &SVector<f64, R>) -> bool {
        self.goal.is_met(residual)
    }

    fn add_hessian(&mut self, z: &[f64], weights: &SVector<f64, R>, hessian: &mut [f64]) {
        let size = z.len();
        let Self { rod, goal, second, units, .. } = self;
        second.clear();
        second.resize(size * size, 0.0);
        goal.add_hessian(rod.motion_mut(), weights, second);
        for a in 0..size {
            for b in 0..=a {
                hessian[a * size + b] += units[a] * units[b] * second[a * size + b];
            }
        }
    }

    fn restart(&mut self) {
        self.rod.rest();
        self.forget();
    }

    fn save_state(&mut self) {
        self.rod.keep(NEAREST);
    }

    fn restore_state(&mut self) {
        self.rod.go_back(NEAREST);
        self.forget();
    }

    fn has_bounds(&self) -> bool {
        self.has_bounds
    }

    fn linearize(&self, rows: &mut Rows) {
        if !self.balanced {
            return;
        }
        let size = self.units.len();
        for (k, (lower, upper)) in self.ranges.iter().enumerate() {
            let displacement = self.rod.displacement(k);
            for (sign, room) in [(1.0, upper - displacement), (-1.0, displacement - lower)] {
                if !room.is_finite() {
                    continue;
                }
                let slope = |j| sign * self.rod.displacement_slope(k, j) * self.units[j];
                let norm = (0..size).map(|j| slope(j) * slope(j)).sum::<f64>().sqrt();
                if norm > 0.0 {
                    let row = rows.push(size, room / norm);
                    row.iter_mut().enumerate().for_each(|(j, entry)| *entry = slope(j) / norm);
                }
            }
        }
    }

    fn violation(&self) -> f64 {
        if !(self.has_bounds && self.balanced) {
            return 0.0;
        }
        let rows = self.ranges.iter().zip(self.rest_lengths).enumerate();
        rows.fold(0.0, |most, (k, ((lower, upper), length))| {
            let displacement = self.rod.displacement(k);
            most.max((displacement - upper).max(lower - displacement) / length)
        })
    }

    fn precision(&self) -> f64 {
        PRECISION
    }

    fn energy(&self, z: &[f64], gradient: &mut [f64]) -> f64 {
        let scale = self.scale();
        let mut energy = 0.0;
        for (k, (z, unit)) in z.iter().zip(self.units).enumerate() {
            let weight = unit * unit / scale;
            energy += 0.5 * weight * z * z;
            gradient[k] = weight * z;
        }
        energy
    }

    fn add_energy_hessian(&self, z: &[f64], hessian: &mut [f64]) {
        let scale = self.scale();
        for (k, unit) in self.units.iter().enumerate() {
            hessian[k * (z.len() + 1)] += unit * unit / scale;
        }
    }
}

impl<G> TensionProblem<'_, G> {
    /// Mean square of the units: the energy is then of order 1.
    fn scale(&self) -> f64 {
        self.units.iter().map(|unit| unit * unit).sum::<f64>() / self.units.len().max(1) as f64
    }
}

/// Outcome of a search whose point is evaluated once more; `errors` measures distance \[m\] and angle \[rad\] there.
pub(super) fn evaluate_answer<const R: usize, G: Goal<R>>(
    mut found: SearchOutcome,
    problem: &mut TensionProblem<'_, G>,
    search: &mut Multistart<'_, R>,
    errors: impl FnOnce(&G) -> (f64, f64),
) -> Answer {
    let failed = found.status == Status::NumericalError && !search.is_stopped();
    if failed && Problem::<R>::violation(problem) > 0.0 {
        // No start could be brought inside.
        found.status = Status::Infeasible;
    }
    search.solver.evaluate(problem, &search.point);
    if failed && !problem.balanced() {
        return Answer::without_shape(found);
    }
    Answer::of(found, errors(&problem.goal))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // A test may stop where it fails.
mod tests {
    use nalgebra::{Vector3, Vector6};

    use super::super::InverseSettings;
    use super::super::Target;
    use super::super::batch::Inverter;
    use super::super::bounds::Bounds;
    use super::super::position_goal::PositionGoal;
    use super::super::rod::RodInverse;
    use super::*;
    use crate::lie::{Pose, so3};
    use crate::obstacle::{Obstacle, Sphere};
    use crate::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
    use crate::rod::contact::{Loads, Scene};
    use crate::rod::{Plan, RodSettings};

    fn robot(n: usize) -> Robot {
        let tendon = |k: usize| {
            let at = |i: usize| 2.1 * k as f64 + 0.6 * (k + 1) as f64 * i as f64 / n as f64;
            let azimuth = PerDisk::Each((0..=n).map(at).collect());
            let routing = Routing::Angles { azimuth, radius: PerDisk::Same(0.008) };
            Tendon::new(routing, None, None, None).unwrap()
        };
        let steel = BackboneSpec {
            youngs_modulus: Some(200e9),
            diameter: Some(vec![1e-3]),
            ..BackboneSpec::straight(0.2, n)
        };
        let backbone = Backbone::new(steel).unwrap();
        Robot::new(backbone, (0..4).map(tendon).collect(), None, None, None).unwrap()
    }

    /// The Jacobian and the slopes of displacements against differences; second derivatives, which leave out how
    /// tensions change the stiffness, to a share that falls with the load of a subsegment.
    #[test]
    fn derivatives_agree_with_differences() {
        let settings = InverseSettings::default();
        for (n, elements, share) in [(12, 1, 0.2), (12, 2, 0.2), (48, 1, 0.02)] {
            let robot = robot(n);
            let plan = Plan::new(&robot, RodSettings { elements, ..RodSettings::default() });
            let plan = plan.unwrap();
            let bounds = Bounds::default();
            let inverse = RodInverse::new(&robot, &plan, &bounds, settings).unwrap();
            let mut work = inverse.buffers(None);
            let problem = &mut work.problem;
            let turn = so3::exp(&Vector3::new(0.5, -0.3, 0.2));
            let translation = Vector3::new(0.05, 0.02, 0.15);
            problem
                .goal
                .pose_residual
                .set_target(Target::Pose(Pose { rotation: turn, translation }));
            check(problem, &[0.9, 0.5, 0.0, 0.7], share, (1e-4, 1e-6));
        }
    }

    /// Derivatives where the rod leans on a ball, under weight and a force and moment at the tip. What
    /// contact bends is not in the second derivatives: they are not compared.
    #[test]
    fn derivatives_agree_with_differences_in_contact() {
        let settings = InverseSettings::default();
        for (n, elements) in [(12, 1), (12, 2), (48, 1)] {
            let robot = robot(n);
            let plan = Plan::new(&robot, RodSettings { elements, ..RodSettings::default() });
            let plan = plan.unwrap();
            let ball = Sphere::new(&Vector3::new(0.02, 0.025, 0.1), 0.02).unwrap();
            let loads = Loads {
                disk_mass: 1e-3,
                tip_force: Vector3::new(0.05, 0.02, -0.03),
                tip_moment: Vector3::new(1e-3, -2e-3, 1e-3),
                ..Loads::default()
            };
            let balls = [Obstacle::new(ball, false)];
            let scene = Scene::new(&robot, &plan, &balls, Some(&loads), 0.0).unwrap();
            let bounds = Bounds::default();
            let inverse = RodInverse::new(&robot, &plan, &bounds, settings).unwrap();
            let inverse = inverse.among(&scene).unwrap();
            let mut work = inverse.buffers(None);
            let problem = &mut work.problem;
            problem.goal.pose_residual.set_target(Target::Position(Vector3::new(0.05, 0.02, 0.15)));
            let z = [0.9, 0.5, 0.0, 0.7];
            // Shapes are balanced to 5e-11 rad.
            check(problem, &z, f64::INFINITY, (1e-3, 3e-6));
            let tensions: Vec<f64> =
                z.iter().zip(problem.units).map(|(z, unit)| z * unit).collect();
            assert!(problem.rod.go(&tensions));
            let contacts = problem.rod.state().unwrap().contacts;
            assert!(contacts.iter().any(|c| c.force.norm() > 0.0));
        }
    }

    /// Sum of squares over target positions of some of the disks: its slope and, but for how tensions change the
    /// stiffness, its second derivatives.
    #[test]
    fn derivatives_of_places_agree_with_differences() {
        let robot = robot(48);
        let plan = Plan::new(&robot, RodSettings::default()).unwrap();
        let bounds = Bounds::default();
        let settings = InverseSettings::default();
        let inverse = RodInverse::new(&robot, &plan, &bounds, settings).unwrap();
        let work = inverse.buffers(None);
        let wanted = (0..6_usize).map(|i| {
            let s = 0.2 * (i + 1) as f64 / 6.0;
            (8 * i + 7, Vector3::new(0.3 * s, -0.4 * s, 0.8 * s))
        });
        let goal = PositionGoal::new(wanted.collect(), 0.2, 1e-10);
        let TensionProblem { units, ranges, rest_lengths, rod, .. } = work.problem;
        let mut problem = TensionProblem::new(rod, goal, rest_lengths, units, ranges);
        let mut at = |z: &[f64]| {
            let (mut residual, mut jacobian) =
                (SVector::<f64, 8>::zeros(), vec![SVector::<f64, 8>::zeros(); 4]);
            problem.evaluate(z, &mut residual, &mut jacobian);
            let squared = Problem::<8>::squared_norm(&mut problem, z);
            assert!((residual.norm_squared() - squared).abs() < 1e-15);
            let slope: Vec<f64> = jacobian.iter().map(|column| column.dot(&residual)).collect();
            let mut hessian: Vec<f64> =
                (0..16).map(|i| jacobian[i / 4].dot(&jacobian[i % 4])).collect();
            problem.add_hessian(z, &residual, &mut hessian);
            (0.5 * squared, slope, hessian)
        };
        let (z, h) = ([0.9, 0.5, 0.3, 0.7], 1e-4);
        let (_, slope, hessian) = at(&z);
        let (mut off, mut whole) = (0.0, 0.0);
        for b in 0..4 {
            let mut moved = |by: f64| {
                let mut z = z;
                z[b] += by;
                at(&z)
            };
            let (ahead, behind) = (moved(h), moved(-h));
            assert!(((ahead.0 - behind.0) / (2.0 * h) - slope[b]).abs() < 1e-8);
            for a in b..4 {
                let bent = (ahead.1[a] - behind.1[a]) / (2.0 * h);
                off += (hessian[4 * a + b] - bent).powi(2);
                whole += bent * bent;
            }
        }
        assert!(off < 0.02 * 0.02 * whole, "{}", (off / whole).sqrt());
    }

    /// Steps of `h`, differences right to `near`.
    fn check(problem: &mut TensionProblem<'_>, z: &[f64], share: f64, (h, near): (f64, f64)) {
        let weights = Vector6::new(0.3, -0.7, 0.5, 0.4, 0.2, -0.6);
        let mut at = |z: &[f64]| {
            let (mut residual, mut jacobian) = (Vector6::zeros(), vec![Vector6::zeros(); 4]);
            problem.evaluate(z, &mut residual, &mut jacobian);
            let mut hessian = vec![0.0; 16];
            problem.add_hessian(z, &weights, &mut hessian);
            let own: Vec<f64> = (0..4).map(|k| problem.rod.displacement(k)).collect();
            let slope =
                |k: usize, j: usize| problem.rod.displacement_slope(k, j) * problem.units[j];
            let slopes: Vec<f64> = (0..16).map(|i| slope(i / 4, i % 4)).collect();
            (residual, jacobian, hessian, own, slopes)
        };
        let (_, jacobian, hessian, _, slopes) = at(z);
        let (mut off, mut whole) = (0.0, 0.0);
        for b in 0..4 {
            let mut moved = |by: f64| {
                let mut z = z.to_vec();
                z[b] += by;
                at(&z)
            };
            // None is pulled below zero: differences of second order to one side.
            let (once, twice, none) = (moved(h), moved(2.0 * h), moved(0.0));
            let slope = (once.0 * 4.0 - twice.0 - none.0 * 3.0) / (2.0 * h);
            assert!((slope - jacobian[b]).amax() < near, "{b} {slope} {}", jacobian[b]);
            for k in 0..4 {
                let slope = (4.0 * once.3[k] - twice.3[k] - 3.0 * none.3[k]) / (2.0 * h);
                assert!((slope - slopes[4 * k + b]).abs() < 1e-2 * near, "{k} {b} {slope}");
                if k >= b {
                    let bent = weights.dot(&(once.1[k] - none.1[k])) / h;
                    off += (hessian[4 * k + b] - bent).powi(2);
                    whole += bent * bent;
                }
            }
        }
        assert!(off < share * share * whole, "{}", (off / whole).sqrt());
    }
}
