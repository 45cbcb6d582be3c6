//! The rod before a target: residuals of the tool by the tensions, bounds on displacements, the sum of squared
//! tensions.

use nalgebra::Vector6;

use crate::rod::pulled::Pulled;
use crate::solve::fit::Problem;
use crate::solve::quadratic::Rows;

use super::InverseSettings;
use super::aim::Aim;

/// Unknowns: tensions in such units that each is about the angle by which it bends the rod alone \[rad\].
#[derive(Clone, Debug)]
pub(super) struct Pull<'a> {
    pub(super) pulled: Pulled<'a>,
    pub(super) aim: Aim<'a>,
    /// Tension of a unit of every unknown.
    units: &'a [f64],
    /// Lowest and highest displacement of every tendon \[m\].
    ranges: &'a [(f64, f64)],
    /// Length of every tendon at rest, which violations are measured by \[m\].
    lengths: &'a [f64],
    bounded: bool,
    tensions: Vec<f64>,
    /// The point evaluated last is a balance.
    sound: bool,
    moved: Vec<f64>,
    turned: Vec<f64>,
}

/// Second derivatives that are nearly right lead to a gradient of this precision in few steps.
const PRECISION: f64 = 1e-6;

impl<'a> Pull<'a> {
    pub(super) fn new(
        pulled: Pulled<'a>,
        settings: &'a InverseSettings,
        units: &'a [f64],
        ranges: &'a [(f64, f64)],
    ) -> Self {
        let (robot, lengths) = (pulled.robot(), pulled.rest_lengths());
        let finite = |(lower, upper): &(f64, f64)| lower.is_finite() || upper.is_finite();
        Self {
            pulled,
            aim: Aim::new(robot, settings),
            units,
            ranges,
            lengths,
            bounded: ranges.iter().any(finite),
            tensions: Vec::new(),
            sound: false,
            moved: Vec::new(),
            turned: Vec::new(),
        }
    }

    /// Goes to the balance under the tensions of a point and places the tool.
    fn place(&mut self, z: &[f64]) -> bool {
        // Rounding leaves no tension below zero.
        let tension = |(z, unit): (&f64, &f64)| (z * unit).max(0.0);
        let wanted = z.iter().zip(self.units).map(tension);
        if !(self.sound && wanted.clone().eq(self.tensions.iter().copied())) {
            self.tensions.clear();
            self.tensions.extend(wanted);
            self.sound = self.pulled.go(&self.tensions);
            if self.sound {
                self.pulled.differentiate();
            }
        }
        if self.sound {
            let tool = self.pulled.tool;
            self.aim.place(tool.translation, || tool.rotation);
        }
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
            let displacement = self.pulled.displacement(k);
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

impl Problem<6> for Pull<'_> {
    fn evaluate(&mut self, z: &[f64], residual: &mut Vector6<f64>, jacobian: &mut [Vector6<f64>]) {
        if !self.place(z) {
            // No balance there: a step is not taken.
            residual.fill(f64::NAN);
            return;
        }
        *residual = self.aim.residual();
        self.aim.write_columns(&self.pulled.columns, jacobian);
        jacobian.iter_mut().zip(self.units).for_each(|(column, unit)| *column *= *unit);
    }

    fn squared(&mut self, z: &[f64]) -> f64 {
        // What is infinite is no value, to a swarm.
        if self.place(z) { self.aim.residual().norm_squared() } else { f64::INFINITY }
    }

    fn met(&self, residual: &Vector6<f64>) -> bool {
        self.aim.met(residual)
    }

    fn add_hessian(&mut self, z: &[f64], weights: &Vector6<f64>, hessian: &mut [f64]) {
        let size = z.len();
        let rotates = self.aim.rotates();
        let push = self.aim.curvature(weights);
        let Self { pulled, moved, turned, units, .. } = self;
        pulled.curve(&push.force, &push.moment, moved, turned);
        for a in 0..size {
            let spin = &pulled.columns[a].1;
            let row = push.row(spin);
            for b in 0..=a {
                let mut sum = moved[a * size + b] + moved[b * size + a];
                if rotates {
                    let other = &pulled.columns[b].1;
                    sum += push.rotation(&row, spin, other, turned[a * size + b]);
                }
                hessian[a * size + b] += units[a] * units[b] * sum;
            }
        }
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
            let displacement = self.pulled.displacement(k);
            for (sign, room) in [(1.0, upper - displacement), (-1.0, displacement - lower)] {
                if !room.is_finite() {
                    continue;
                }
                let slope = |j| sign * self.pulled.displacement_slope(k, j) * self.units[j];
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
            let displacement = self.pulled.displacement(k);
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

impl Pull<'_> {
    /// Mean square of the units: the energy is then of order 1.
    fn scale(&self) -> f64 {
        self.units.iter().map(|unit| unit * unit).sum::<f64>() / self.units.len().max(1) as f64
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // A test may stop where it fails.
mod tests {
    use nalgebra::Vector3;

    use super::super::Target;
    use super::super::bounds::Bounds;
    use super::super::rod::RodInverse;
    use super::super::rows::Inverter;
    use super::*;
    use crate::lie::{Pose, so3};
    use crate::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
    use crate::rod::{Plan, RodSettings};

    fn robot(n: usize) -> Robot {
        let tendon = |k: usize| {
            let at = |i: usize| 2.1 * k as f64 + 0.6 * (k + 1) as f64 * i as f64 / n as f64;
            let azimuth = PerDisk::Each((0..=n).map(at).collect());
            let routing = Routing::Angles { azimuth, radius: PerDisk::Same(0.008) };
            Tendon::new(routing, None, None, None).unwrap()
        };
        let backbone = Backbone::new(BackboneSpec::straight(0.2, n)).unwrap();
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
            pull.aim.at(Target::Pose(Pose { rotation: turn, translation }));
            check(pull, &[0.9, 0.5, 0.0, 0.7], share);
        }
    }

    fn check(pull: &mut Pull<'_>, z: &[f64], share: f64) {
        let h = 1e-4;
        let weights = Vector6::new(0.3, -0.7, 0.5, 0.4, 0.2, -0.6);
        let mut at = |z: &[f64]| {
            let (mut residual, mut jacobian) = (Vector6::zeros(), vec![Vector6::zeros(); 4]);
            pull.evaluate(z, &mut residual, &mut jacobian);
            let mut hessian = vec![0.0; 16];
            pull.add_hessian(z, &weights, &mut hessian);
            let own: Vec<f64> = (0..4).map(|k| pull.pulled.displacement(k)).collect();
            let slope = |k: usize, j: usize| pull.pulled.displacement_slope(k, j) * pull.units[j];
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
            assert!((slope - jacobian[b]).amax() < 1e-6, "{b} {slope} {}", jacobian[b]);
            for k in 0..4 {
                let slope = (4.0 * once.3[k] - twice.3[k] - 3.0 * none.3[k]) / (2.0 * h);
                assert!((slope - slopes[4 * k + b]).abs() < 1e-8, "{k} {b} {slope}");
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
