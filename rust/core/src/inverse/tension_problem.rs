//! The rod before what is wanted of it: residuals by the tensions, bounds on displacements, the sum of squared
//! tensions.

use nalgebra::SVector;

use crate::rod::equilibrium::{Equilibrium, Motion};
use crate::solve::levenberg_marquardt::Problem;
use crate::solve::quadratic_program::Rows;

use super::pose_goal::ToolGoal;

/// What is wanted of a rod: residuals at a balance, and their derivatives by the tensions.
pub(super) trait Goal<const R: usize> {
    /// Looks at where the rod is.
    fn place(&mut self, motion: &Motion);

    /// Residuals of the last placing and their derivatives.
    fn write(
        &mut self,
        motion: &Motion,
        residual: &mut SVector<f64, R>,
        jacobian: &mut [SVector<f64, R>],
    );

    /// The squared residuals of the last placing.
    fn squared(&self) -> f64;

    /// Whether residuals, not those of the last placing in every case, are as small as wanted.
    fn met(&self, residual: &SVector<f64, R>) -> bool;

    /// Adds the second derivatives of `weights . r` by the tensions to the lower triangle of a matrix.
    fn curve(&mut self, motion: &mut Motion, weights: &SVector<f64, R>, matrix: &mut [f64]);
}

/// Unknowns: tensions in such units that each is about the angle by which it bends the rod alone \[rad\].
#[derive(Debug)]
pub(super) struct Pull<'a, G = ToolGoal<'a>> {
    pub(super) rod: Box<dyn Equilibrium + 'a>,
    pub(super) aim: G,
    /// Tension of a unit of every unknown.
    units: &'a [f64],
    /// Lowest and highest displacement of every tendon \[m\].
    ranges: &'a [(f64, f64)],
    /// Length of every tendon at rest, which violations are measured by \[m\].
    lengths: &'a [f64],
    bounded: bool,
    /// What tendons without tension are let out by, so that rounding does not lock those that depend on each other \[m\].
    pub(super) hair: f64,
    tensions: Vec<f64>,
    /// The point evaluated last is a balance.
    sound: bool,
    second: Vec<f64>,
}

/// Second derivatives that are nearly right lead to a gradient of this precision in few steps.
const PRECISION: f64 = 1e-6;
/// Place of the balance nearest to what is wanted, among those that are kept.
const NEAREST: usize = 2;
/// A tendon pulls no more than this: it has no tension \[rad\].
const SLACK: f64 = 1e-9;

impl<'a, G> Pull<'a, G> {
    pub(super) fn new(
        rod: Box<dyn Equilibrium + 'a>,
        aim: G,
        lengths: &'a [f64],
        units: &'a [f64],
        ranges: &'a [(f64, f64)],
    ) -> Self {
        let finite = |(lower, upper): &(f64, f64)| lower.is_finite() || upper.is_finite();
        Self {
            rod,
            aim,
            units,
            ranges,
            lengths,
            bounded: ranges.iter().any(finite),
            hair: 0.0,
            tensions: Vec::new(),
            sound: false,
            second: Vec::new(),
        }
    }

    /// Goes to the balance under the tensions of a point and looks at it.
    fn place<const R: usize>(&mut self, z: &[f64]) -> bool
    where
        G: Goal<R>,
    {
        // Rounding leaves no tension below zero.
        let tension = |(z, unit): (&f64, &f64)| (z * unit).max(0.0);
        let wanted = z.iter().zip(self.units).map(tension);
        if !(self.sound && wanted.clone().eq(self.tensions.iter().copied())) {
            self.tensions.clear();
            self.tensions.extend(wanted);
            self.sound = self.rod.solve_at(&self.tensions);
            if self.sound {
                self.rod.differentiate();
            }
        }
        if self.sound {
            self.aim.place(self.rod.motion());
        }
        self.sound
    }

    /// Displacements at hand \[m\]; rounding leaves none outside its bounds.
    pub(super) fn write_displacements(&self, place: &mut [f64]) {
        for (k, (displacement, (lower, upper))) in place.iter_mut().zip(self.ranges).enumerate() {
            // Where an obstacle's function failed before the first balance there are none.
            let own = self.rod.tensions().get(k);
            let slack = own.is_some_and(|tension| *tension <= SLACK * self.units[k]);
            let hair = if slack { self.hair } else { 0.0 };
            *displacement = (self.rod.displacement(k) + hair).max(*lower).min(*upper);
        }
    }

    /// Whether the point evaluated last is a balance.
    pub(super) fn sound(&self) -> bool {
        self.sound
    }

    /// Forgets the point evaluated last: the rod is put elsewhere.
    pub(super) fn forget(&mut self) {
        self.sound = false;
    }

    /// Bounds on displacements that hold the point evaluated last back: a tendon, and whether its release is.
    pub(super) fn holding(&self, within: f64) -> Vec<(usize, bool)> {
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

impl<const R: usize, G: Goal<R>> Problem<R> for Pull<'_, G> {
    fn evaluate(
        &mut self,
        z: &[f64],
        residual: &mut SVector<f64, R>,
        jacobian: &mut [SVector<f64, R>],
    ) {
        if !self.place::<R>(z) {
            // No balance there: a step is not taken.
            residual.fill(f64::NAN);
            return;
        }
        self.aim.write(self.rod.motion(), residual, jacobian);
        jacobian.iter_mut().zip(self.units).for_each(|(column, unit)| *column *= *unit);
    }

    fn squared(&mut self, z: &[f64]) -> f64 {
        // What is infinite is no value, to a swarm.
        if self.place::<R>(z) { self.aim.squared() } else { f64::INFINITY }
    }

    fn met(&self, residual: &SVector<f64, R>) -> bool {
        self.aim.met(residual)
    }

    fn add_hessian(&mut self, z: &[f64], weights: &SVector<f64, R>, hessian: &mut [f64]) {
        let size = z.len();
        let Self { rod, aim, second, units, .. } = self;
        second.clear();
        second.resize(size * size, 0.0);
        aim.curve(rod.motion_mut(), weights, second);
        for a in 0..size {
            for b in 0..=a {
                hessian[a * size + b] += units[a] * units[b] * second[a * size + b];
            }
        }
    }

    fn restart(&mut self) {
        self.rod.reset();
        self.forget();
    }

    fn keep(&mut self) {
        self.rod.save(NEAREST);
    }

    fn go_back(&mut self) {
        self.rod.restore(NEAREST);
        self.forget();
    }

    fn bounded(&self) -> bool {
        self.bounded
    }

    fn linearize(&self, rows: &mut Rows) {
        if !self.sound {
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
        if !(self.bounded && self.sound) {
            return 0.0;
        }
        let rows = self.ranges.iter().zip(self.lengths).enumerate();
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

impl<G> Pull<'_, G> {
    /// Mean square of the units: the energy is then of order 1.
    fn scale(&self) -> f64 {
        self.units.iter().map(|unit| unit * unit).sum::<f64>() / self.units.len().max(1) as f64
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // A test may stop where it fails.
mod tests {
    use nalgebra::{Vector3, Vector6};

    use super::super::InverseSettings;
    use super::super::Target;
    use super::super::batch::Inverter;
    use super::super::bounds::Bounds;
    use super::super::position_goal::PlacesGoal;
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
            let pull = &mut work.pull;
            let turn = so3::exp(&Vector3::new(0.5, -0.3, 0.2));
            let translation = Vector3::new(0.05, 0.02, 0.15);
            pull.aim.aim.at(Target::Pose(Pose { rotation: turn, translation }));
            check(pull, &[0.9, 0.5, 0.0, 0.7], share, (1e-4, 1e-6));
        }
    }

    /// The same where it leans on a ball, under weight and a force and moment at the tip. What
    /// leaning bends is left out of the second derivatives: they are not looked at.
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
            let pull = &mut work.pull;
            pull.aim.aim.at(Target::Position(Vector3::new(0.05, 0.02, 0.15)));
            let z = [0.9, 0.5, 0.0, 0.7];
            // Shapes are balanced to 5e-11 rad.
            check(pull, &z, f64::INFINITY, (1e-3, 3e-6));
            let tensions: Vec<f64> = z.iter().zip(pull.units).map(|(z, unit)| z * unit).collect();
            assert!(pull.rod.solve_at(&tensions));
            let contacts = pull.rod.state().unwrap().contacts;
            assert!(contacts.iter().any(|c| c.force.norm() > 0.0));
        }
    }

    /// Of the sum of squares over wanted places of some of the disks: its slope and, but for how tensions change the
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
        let goal = PlacesGoal::new(wanted.collect(), 0.2, 1e-10);
        let Pull { units, ranges, lengths, rod, .. } = work.pull;
        let mut pull = Pull::new(rod, goal, lengths, units, ranges);
        let mut at = |z: &[f64]| {
            let (mut residual, mut jacobian) =
                (SVector::<f64, 8>::zeros(), vec![SVector::<f64, 8>::zeros(); 4]);
            pull.evaluate(z, &mut residual, &mut jacobian);
            let squared = Problem::<8>::squared(&mut pull, z);
            assert!((residual.norm_squared() - squared).abs() < 1e-15);
            let slope: Vec<f64> = jacobian.iter().map(|column| column.dot(&residual)).collect();
            let mut hessian: Vec<f64> =
                (0..16).map(|i| jacobian[i / 4].dot(&jacobian[i % 4])).collect();
            pull.add_hessian(z, &residual, &mut hessian);
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
    fn check(pull: &mut Pull<'_>, z: &[f64], share: f64, (h, near): (f64, f64)) {
        let weights = Vector6::new(0.3, -0.7, 0.5, 0.4, 0.2, -0.6);
        let mut at = |z: &[f64]| {
            let (mut residual, mut jacobian) = (Vector6::zeros(), vec![Vector6::zeros(); 4]);
            pull.evaluate(z, &mut residual, &mut jacobian);
            let mut hessian = vec![0.0; 16];
            pull.add_hessian(z, &weights, &mut hessian);
            let own: Vec<f64> = (0..4).map(|k| pull.rod.displacement(k)).collect();
            let slope = |k: usize, j: usize| pull.rod.displacement_slope(k, j) * pull.units[j];
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
