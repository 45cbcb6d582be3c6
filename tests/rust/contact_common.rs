//! What the tests of contact and loads share: energies, gradients and second-order conditions by kinematics of
//! their own.

use nalgebra::{DMatrix, Matrix3, Rotation3, Vector3};
use tdcr::lie::{Pose, so3};
use tdcr::model::Model;
use tdcr::obstacle::Obstacle;
use tdcr::robot::Robot;
use tdcr::rod::contact::{LoadedRod, Loads, Scene};
use tdcr::rod::{Plan, RodSettings, Subsegment};
use tdcr::{Contact, PointKind, Shape, Status};

pub(crate) type V = Vector3<f64>;

/// A robot in its surroundings.
pub(crate) struct Case {
    pub(crate) robot: Robot,
    pub(crate) settings: RodSettings,
    pub(crate) obstacles: Vec<Obstacle>,
    pub(crate) loads: Option<Loads>,
    pub(crate) body: f64,
}

/// Steps of the differences \[rad\]: their errors go with the fourth power.
const STEP: f64 = 1e-3;
/// Of first derivatives, whose error goes with its fourth power: large forces in narrow places show it.
const SLOPE_STEP: f64 = 2.5e-4;

impl Case {
    pub(crate) fn new(robot: Robot) -> Self {
        let settings = RodSettings::default();
        Self { robot, settings, obstacles: vec![], loads: None, body: 0.0 }
    }

    pub(crate) fn plan(&self) -> Plan {
        Plan::new(&self.robot, self.settings).unwrap()
    }

    pub(crate) fn scene(&self, plan: &Plan) -> Scene {
        Scene::new(&self.robot, plan, &self.obstacles, self.loads.as_ref(), self.body).unwrap()
    }

    pub(crate) fn shape(&self, displacements: &[f64]) -> Shape {
        let plan = self.plan();
        let scene = self.scene(&plan);
        LoadedRod::new(&self.robot, &plan, &scene).unwrap().shape(displacements).unwrap()
    }

    pub(crate) fn solved(&self, displacements: &[f64]) -> Shape {
        let shape = self.shape(displacements);
        assert_eq!(shape.report.status, Status::Converged, "{} {:?}", shape.message, shape.report);
        shape
    }

    fn width(&self) -> usize {
        if self.settings.axial { 4 } else { 3 }
    }

    pub(crate) fn strains(&self, shape: &Shape) -> Vec<f64> {
        let mut flat = vec![0.0; self.width() * shape.state.strains.len()];
        shape.state.write_strains(&mut flat);
        flat
    }

    /// Frames of the disks in the world.
    pub(crate) fn frames(&self, strains: &[f64]) -> Vec<Pose> {
        let m = self.settings.elements;
        let mut frame = *self.robot.base();
        let mut frames = vec![frame];
        for (e, strain) in strains.chunks_exact(self.width()).enumerate() {
            let l = self.robot.backbone().lengths()[e / m] / m as f64;
            let w = V::new(strain[0], strain[1], strain[2]);
            let stretched = l * (1.0 + strain.get(3).unwrap_or(&0.0));
            let along = match self.settings.subsegment {
                Subsegment::Arc => arc(&w),
                Subsegment::Link => Rotation3::from_scaled_axis(w * 0.5) * V::z(),
            };
            frame.translation += frame.rotation * along * stretched;
            frame.rotation *= Rotation3::from_scaled_axis(w).into_inner();
            if (e + 1) % m == 0 {
                frames.push(frame);
            }
        }
        frames
    }

    /// Stiffness of every strain in the unit of the results.
    pub(crate) fn stiffness(&self, k: usize) -> f64 {
        let m = self.settings.elements as f64;
        let backbone = self.robot.backbone();
        let i = k / self.width() / self.settings.elements;
        let l = backbone.lengths()[i] / m;
        let bending = backbone.bending_stiffness(i) / l;
        match k % self.width() {
            2 => bending / (1.0 + backbone.spec().poisson_ratio),
            3 => backbone.axial_stiffness(i).unwrap() * l,
            _ => bending,
        }
    }

    pub(crate) fn energy(&self, strains: &[f64]) -> f64 {
        let (m, width) = (self.settings.elements, self.width());
        let own = |(k, strain): (usize, &f64)| {
            let rest = if k % width == 3 {
                0.0
            } else {
                self.robot.backbone().rest(k / width / m)[k % width] / m as f64
            };
            0.5 * self.stiffness(k) * (strain - rest).powi(2)
        };
        strains.iter().enumerate().map(own).sum()
    }

    /// Work of the loads up to these frames; of the moment from those of `from` on.
    pub(crate) fn work(&self, frames: &[Pose], from: &[Pose]) -> f64 {
        let Some(loads) = &self.loads else { return 0.0 };
        let (forces, moment) = loads.forces(&self.robot).unwrap();
        let turn = frames.last().unwrap().rotation * from.last().unwrap().rotation.transpose();
        let turn = so3::log(&turn);
        let work = frames.iter().zip(&forces).map(|(frame, force)| force.dot(&frame.translation));
        work.sum::<f64>() + moment.dot(&turn)
    }

    pub(crate) fn at(&self, contact: &Contact, frames: &[Pose]) -> V {
        let hole =
            |sign: f64| self.robot.paths()[contact.tendon.unwrap()].holes[contact.disk] * sign;
        let local = match contact.kind {
            PointKind::Center => V::zeros(),
            PointKind::Hole => hole(1.0),
            PointKind::Mirror => hole(-1.0),
        };
        frames[contact.disk].transform(&local)
    }

    /// Energy, work of loads, tensions and contact forces at other strains, all multipliers as they are;
    /// obstacles to second order, where they are smooth.
    pub(crate) fn lagrangian(&self, shape: &Shape, strains: &[f64]) -> f64 {
        let frames = self.frames(strains);
        let mut value = self.energy(strains) - self.work(&frames, &shape.state.frames);
        for (path, tension) in self.robot.paths().iter().zip(&shape.state.tensions) {
            value += tension * path.length(&frames);
        }
        for contact in &shape.state.contacts {
            let moved = self.at(contact, &frames) - contact.point;
            let bend = 0.5 * contact.force.norm() * moved.dot(&(self.bend(shape, contact) * moved));
            value -= contact.force.dot(&moved) + bend;
        }
        value
    }

    fn bend(&self, shape: &Shape, contact: &Contact) -> Matrix3<f64> {
        let twin = |c: &&Contact| {
            (c.disk, c.kind, c.tendon, c.obstacle)
                == (contact.disk, contact.kind, contact.tendon, contact.obstacle)
        };
        match shape.state.contacts.iter().filter(twin).count() {
            1 => self.obstacles[contact.obstacle].nearest(&contact.point).unwrap().hessian,
            _ => Matrix3::zeros(),
        }
    }

    /// Largest slope of the Lagrangian, relative to the stiffness \[rad\], by differences.
    pub(crate) fn unbalance(&self, shape: &Shape) -> f64 {
        let strains = self.strains(shape);
        let value = |w: &[f64]| self.lagrangian(shape, w);
        let slopes = (0..strains.len()).map(|k| slope(&value, &strains, k) / self.stiffness(k));
        slopes.fold(0.0, |most, s| most.max(s.abs()))
    }

    /// Signed distance of the point nearest to an obstacle, bodies counted.
    pub(crate) fn clearance(&self, frames: &[Pose]) -> f64 {
        let mut least = f64::INFINITY;
        for (i, frame) in frames.iter().enumerate().skip(1) {
            let mut look = |at: &V, radius: f64| {
                for obstacle in &self.obstacles {
                    let near = obstacle.nearest(&frame.transform(at)).unwrap();
                    least = least.min(near.distance - radius);
                }
            };
            look(&V::zeros(), self.body);
            for path in self.robot.paths().iter().filter(|path| path.end() >= i) {
                look(&path.holes[i], 0.0);
                look(&-path.holes[i], 0.0);
            }
        }
        least
    }

    /// Least eigenvalue of the Lagrangian's Hessian where taut tendons and pushing contacts leave freedom, in units
    /// of the first subsegment's bending stiffness.
    pub(crate) fn least_curvature(&self, shape: &Shape) -> f64 {
        let strains = self.strains(shape);
        let n = strains.len();
        let value = |w: &[f64]| self.lagrangian(shape, w);
        let here = value(&strains);
        let mut hessian = DMatrix::zeros(n, n);
        let shifted = |steps: &[(usize, f64)]| {
            let mut w = strains.clone();
            for (k, s) in steps {
                w[*k] += s;
            }
            value(&w)
        };
        let h = STEP;
        let plus: Vec<f64> = (0..n).map(|k| shifted(&[(k, h)])).collect();
        let minus: Vec<f64> = (0..n).map(|k| shifted(&[(k, -h)])).collect();
        for a in 0..n {
            for b in 0..=a {
                let both = shifted(&[(a, h), (b, h)]) + shifted(&[(a, -h), (b, -h)]);
                let single = plus[a] + plus[b] + minus[a] + minus[b] - 2.0 * here;
                let twice = if a == b {
                    (plus[a] + minus[a] - 2.0 * here) / (h * h)
                } else {
                    (both - single) / (2.0 * h * h)
                };
                (hessian[(a, b)], hessian[(b, a)]) = (twice, twice);
            }
        }
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for (path, tension) in self.robot.paths().iter().zip(&shape.state.tensions) {
            if *tension > 0.0 {
                let length = |w: &[f64]| path.length(&self.frames(w));
                rows.push((0..n).map(|k| slope(&length, &strains, k)).collect());
            }
        }
        for contact in shape.state.contacts.iter().filter(|c| c.force.norm() > 0.0) {
            let gap = |w: &[f64]| contact.normal.dot(&self.at(contact, &self.frames(w)));
            rows.push((0..n).map(|k| slope(&gap, &strains, k)).collect());
        }
        // Conditions are held by a stiffness far above all others.
        for row in &rows {
            let row = nalgebra::DVector::from_vec(row.clone());
            let size = row.norm_squared();
            hessian += &row * row.transpose() * (1e6 * self.stiffness(0) / size);
        }
        hessian.symmetric_eigenvalues().min() / self.stiffness(0)
    }
}

/// Derivative by one unknown, of order 4.
pub(crate) fn slope(value: &impl Fn(&[f64]) -> f64, at: &[f64], k: usize) -> f64 {
    let mut w = at.to_vec();
    let mut moved = |s: f64| {
        w[k] = at[k] + s * SLOPE_STEP;
        value(&w)
    };
    (8.0 * (moved(1.0) - moved(-1.0)) - (moved(2.0) - moved(-2.0))) / (12.0 * SLOPE_STEP)
}

/// End of an arc of length one.
fn arc(w: &V) -> V {
    let square = w.norm_squared();
    let angle = square.sqrt();
    let (b, c) = if angle < 0.1 {
        let series = |first: f64| {
            let mut term = 1.0 / (1..=first as u64).product::<u64>() as f64;
            let mut sum = 0.0;
            for k in 0..6 {
                sum += term;
                let next = first + 2.0 * f64::from(k);
                term *= -square / ((next + 1.0) * (next + 2.0));
            }
            sum
        };
        (series(2.0), series(3.0))
    } else {
        ((1.0 - angle.cos()) / square, (angle - angle.sin()) / (square * angle))
    };
    let once = w.cross(&V::z());
    V::z() + once * b + w.cross(&once) * c
}
