//! Regions, nearest points and least energies, against their own definitions.

use nalgebra::{DVector, Matrix4, SVector};
use tdcr::solve::convex_region::{Disc, Region, RestoreScratch};
use tdcr::solve::levenberg_marquardt::{self, Ending, Problem, Purpose};

use crate::inverse_common::uniform;
use crate::optimality::unheld;

/// Three discs, one of which grows with an unknown, bounds, an equation; `inside` meets all.
fn random_region(u: &mut impl FnMut(f64, f64) -> f64) -> (Region, Vec<f64>) {
    let size = 7;
    let mut inside: Vec<f64> = (0..size).map(|_| u(-0.7, 0.7)).collect();
    inside[6] = u(0.6, 1.5);
    let mut region = Region::new(size);
    let along = |normal: &[f64]| normal.iter().zip(&inside).map(|(n, z)| n * z).sum::<f64>();
    let mut normals = vec![];
    for _ in 0..6 {
        normals.push((0..size).map(|_| u(-3.0, 3.0)).collect::<Vec<f64>>());
    }
    if u(0.0, 1.0) < 0.5 {
        region.add_equation(&normals[0], along(&normals[0]));
    }
    for normal in &normals[1..] {
        // Some of them touch the point.
        let room = if u(0.0, 1.0) < 0.3 { 0.0 } else { u(0.0, 2.0) };
        region.add_bound(normal, along(normal) + room);
    }
    let mut height = vec![0.0; size];
    height[6] = -1.0;
    region.add_bound(&height, -0.5);
    region.add_disc(Disc { first: 0, radius: 1.0, scale: None });
    region.add_disc(Disc { first: 2, radius: 1.2, scale: None });
    region.add_disc(Disc { first: 4, radius: 1.8, scale: Some(6) });
    (region, inside)
}

#[test]
fn points_are_restored_into_regions_and_left_alone_inside() {
    let mut u = uniform(42);
    let mut work = RestoreScratch::default();
    for case in 0..5000 {
        let (region, inside) = random_region(&mut u);
        assert!(region.violation(&inside) < 1e-14);
        for spread in [0.1, 2.0, 30.0] {
            let mut z: Vec<f64> = inside.iter().map(|z| z + spread * u(-1.0, 1.0)).collect();
            let before = z.clone();
            assert!(region.restore(&mut z, &mut work), "{case} {spread}");
            assert!(region.contains(&z) && region.violation(&z) < 1.1e-13);
            // No further than to the point inside, but for roundness of the discs.
            let far =
                |a: &[f64]| a.iter().zip(&before).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
            assert!(far(&z) <= 1.5 * far(&inside) + 1e-12, "{case} {spread}");
            let once = z.clone();
            assert!(region.restore(&mut z, &mut work));
            assert_eq!(z, once);
        }
    }
}

#[test]
fn empty_regions_are_found_out() {
    let mut work = RestoreScratch::default();
    let mut restored = |region: &Region| region.restore(&mut [0.3, -0.2, 0.9], &mut work);
    let disc = |radius, scale| Disc { first: 0, radius, scale };
    let region = |bounds: &[([f64; 3], f64)], discs: &[Disc]| {
        let mut region = Region::new(3);
        for (normal, bound) in bounds {
            region.add_bound(normal, *bound);
        }
        for disc in discs {
            region.add_disc(*disc);
        }
        region
    };
    // Contradictory bounds; a disc beside a half-plane; one that would have to grow beyond a bound.
    assert!(!restored(&region(&[([1.0, 1.0, 0.0], -1.0), ([-2.0, -2.0, 0.0], 1.9)], &[])));
    assert!(!restored(&region(&[([-1.0, 0.0, 0.0], -1.1)], &[disc(1.0, None)])));
    let beside = [([-1.0, 0.0, 0.0], -1.1), ([0.0, 0.0, 1.0], 1.09)];
    assert!(!restored(&region(&beside, &[disc(1.0, Some(2))])));
    // Just not empty: a lens, where tangents close in on it slowly, and the centre of a disc.
    for room in [1e-3, 1e-6, 1e-11] {
        assert!(restored(&region(&[([-1.0, 0.0, 0.0], room - 1.0)], &[disc(1.0, None)])));
        let beside = [([-1.0, 0.0, 0.0], -1.1), ([0.0, 0.0, 1.0], 1.1 + room)];
        assert!(restored(&region(&beside, &[disc(1.0, Some(2))])));
    }
    assert!(restored(&region(&[], &[disc(0.0, None)])));
    let mut contradictory = Region::new(3);
    contradictory.add_equation(&[1.0, 0.0, 0.0], 1.0);
    contradictory.add_equation(&[2.0, 0.0, 0.0], 2.1);
    assert!(!restored(&contradictory));
}

const SIZE: usize = 4;

/// Quadratic residuals, and an energy with a quartic term.
struct Curved {
    linear: [SVector<f64, SIZE>; 3],
    square: [Matrix4<f64>; 3],
    wanted: SVector<f64, 3>,
    stiffness: Matrix4<f64>,
}

impl Curved {
    fn random(u: &mut impl FnMut(f64, f64) -> f64) -> Self {
        let mut square = || {
            let any = Matrix4::from_fn(|_, _| u(-0.5, 0.5));
            any + any.transpose()
        };
        let square = [square(), square(), square()];
        let any = Matrix4::from_fn(|_, _| u(-0.5, 0.5));
        Self {
            square,
            linear: std::array::from_fn(|_| SVector::from_fn(|_, _| u(-1.0, 1.0))),
            wanted: SVector::from_fn(|_, _| u(-1.0, 1.0)),
            stiffness: any.transpose() * any,
        }
    }

    fn residual(&self, z: &[f64]) -> SVector<f64, 3> {
        let point = SVector::<f64, SIZE>::from_column_slice(z);
        SVector::from_fn(|k, _| {
            let curved = 0.5 * point.dot(&(self.square[k] * point));
            self.linear[k].dot(&point) + curved - self.wanted[k]
        })
    }

    fn slope(&self, z: &[f64], k: usize) -> SVector<f64, SIZE> {
        self.linear[k] + self.square[k] * SVector::<f64, SIZE>::from_column_slice(z)
    }
}

impl Problem<3> for Curved {
    fn evaluate(&mut self, z: &[f64], r: &mut SVector<f64, 3>, j: &mut [SVector<f64, 3>]) {
        *r = self.residual(z);
        for k in 0..3 {
            let slope = self.slope(z, k);
            (0..SIZE).for_each(|i| j[i][k] = slope[i]);
        }
    }

    fn squared_norm(&mut self, z: &[f64]) -> f64 {
        self.residual(z).norm_squared()
    }

    fn is_met(&self, residual: &SVector<f64, 3>) -> bool {
        residual.amax() < 1e-11
    }

    fn add_hessian(&mut self, _: &[f64], weights: &SVector<f64, 3>, hessian: &mut [f64]) {
        let sum: Matrix4<f64> = (0..3).map(|k| self.square[k] * weights[k]).sum();
        for (i, j) in (0..SIZE).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            hessian[i * SIZE + j] += sum[(i, j)];
        }
    }

    fn energy(&self, z: &[f64], gradient: &mut [f64]) -> f64 {
        let point = SVector::<f64, SIZE>::from_column_slice(z);
        let slope = self.stiffness * point + point * point.norm_squared();
        gradient.copy_from_slice(slope.as_slice());
        0.5 * point.dot(&(self.stiffness * point)) + 0.25 * point.norm_squared().powi(2)
    }

    fn add_energy_hessian(&self, z: &[f64], hessian: &mut [f64]) {
        let point = SVector::<f64, SIZE>::from_column_slice(z);
        let all = self.stiffness
            + Matrix4::identity() * point.norm_squared()
            + 2.0 * point * point.transpose();
        for (i, j) in (0..SIZE).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            hessian[i * SIZE + j] += all[(i, j)];
        }
    }
}

/// A disc, one that grows, and two bounds; normals of what is active at a point.
fn small_region() -> Region {
    let mut region = Region::new(SIZE);
    region.add_bound(&[0.0, 0.0, 0.0, 1.0], 1.2);
    region.add_bound(&[0.0, 0.0, 0.0, -1.0], -0.4);
    region.add_bound(&[1.0, 1.0, 1.0, 0.0], 0.8);
    region.add_bound(&[0.0, 0.0, -1.0, 0.0], 1.0);
    region.add_disc(Disc { first: 0, radius: 0.7, scale: Some(3) });
    region.add_disc(Disc { first: 0, radius: 0.6, scale: None });
    region
}

fn active_normals(z: &[f64]) -> Vec<DVector<f64>> {
    let across = z[0].hypot(z[1]);
    let (x, y) = (z[0] / across, z[1] / across);
    [
        (z[3] - 1.2, vec![0.0, 0.0, 0.0, 1.0]),
        (0.4 - z[3], vec![0.0, 0.0, 0.0, -1.0]),
        (z[0] + z[1] + z[2] - 0.8, vec![1.0, 1.0, 1.0, 0.0]),
        (-z[2] - 1.0, vec![0.0, 0.0, -1.0, 0.0]),
        (across - 0.7 * z[3], vec![x, y, 0.0, -0.7]),
        (across - 0.6, vec![x, y, 0.0, 0.0]),
    ]
    .into_iter()
    .filter(|(excess, _)| *excess > -1e-9)
    .map(|(_, normal)| DVector::from_vec(normal))
    .collect()
}

#[test]
fn nearest_points_and_least_energies_are_stationary() {
    let mut u = uniform(43);
    let region = small_region();
    let mut work = levenberg_marquardt::Scratch::<3>::default();
    let (mut met, mut stalled, mut lowest, mut active, mut limits) = (0, 0, 0, 0, 0);
    let mut worst = (0.0_f64, 0.0_f64);
    for case in 0..4000 {
        let mut problem = Curved::random(&mut u);
        let mut z: Vec<f64> = (0..SIZE).map(|_| u(-1.0, 1.0)).collect();
        assert!(work.restore(&region, &mut z));
        let ending = work.descend(&mut problem, &region, &mut z, Purpose::Nearest, 300);
        assert!(region.violation(&z) < 2e-13);
        let normals = active_normals(&z);
        let slopes: Vec<DVector<f64>> =
            (0..3).map(|k| DVector::from_column_slice(problem.slope(&z, k).as_slice())).collect();
        match ending {
            Ending::Stalled => {
                stalled += 1;
                let gradient =
                    (0..3).fold(DVector::zeros(SIZE), |sum, k| sum + &slopes[k] * work.residual[k]);
                let off = unheld(&gradient, &[], &normals) / work.residual.norm();
                worst.0 = worst.0.max(off);
                // The root of rounding: below, squared residuals do not tell two points apart.
                assert!(off < 3e-7, "{case} {off:e}");
                active += usize::from(!normals.is_empty());
            }
            Ending::Met => {
                met += 1;
                let ending = work.minimize_energy(&mut problem, &region, &mut z, 300);
                assert!(region.violation(&z) < 2e-13 && work.residual.amax() < 1e-11, "{case}");
                if ending != Ending::Met {
                    limits += 1;
                    continue;
                }
                lowest += 1;
                let mut gradient = vec![0.0; SIZE];
                problem.energy(&z, &mut gradient);
                let slopes: Vec<DVector<f64>> = (0..3)
                    .map(|k| DVector::from_column_slice(problem.slope(&z, k).as_slice()))
                    .collect();
                let gradient = DVector::from_vec(gradient);
                let off = unheld(&gradient, &slopes, &active_normals(&z));
                worst.1 = worst.1.max(off);
                assert!(off < 1e-6, "{case} {off:e}");
            }
            other => panic!("{case} {other:?}"),
        }
    }
    println!(
        "{met} met, {lowest} of them lowest, {limits} not; {stalled} nearest, {active} at bounds"
    );
    println!("gradients left: {worst:?}");
}
