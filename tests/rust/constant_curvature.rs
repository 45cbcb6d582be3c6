//! Constant curvature: the mapping both ways, arcs and their derivatives.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Rotation3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::constant_curvature::{Arc, Length, Mapping, Pattern, frames, tip_derivative};
use tdcr::lie::{Pose, so3};

pub(crate) const FREE: f64 = f64::INFINITY;

pub(crate) fn uniform(seed: u64) -> impl FnMut(f64, f64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    move |low, high| rng.random_range(low..high)
}

pub(crate) fn even(n: usize) -> Vec<f64> {
    (0..n).map(|k| TAU * k as f64 / n as f64).collect()
}

/// The seed vector: d = 8 mm, ell = 100 mm, kappa = 5 /m, phi = 60 degrees, three tendons.
#[test]
fn the_seed_vector_holds_both_ways() {
    let mapping = Mapping::new(even(3), vec![0.008], 0.1).unwrap();
    let arc = Arc::new(5.0, PI / 3.0, 0.1);
    let expected = [-0.002, -0.002, 0.004];
    for (got, expected) in mapping.displacements(&arc).iter().zip(expected) {
        assert!((got - expected).abs() < 1e-18);
    }
    let fit = mapping.fit(&expected, Length::Known(0.1)).unwrap();
    assert!((fit.arc.kappa() - 5.0).abs() < 1e-14 && (fit.arc.phi() - PI / 3.0).abs() < 1e-15);
    assert!(fit.residual.iter().all(|r| r.abs() < 1e-17));
}

/// Identity to 5e-15 times the condition number, for any number of tendons anywhere.
#[test]
fn the_mapping_and_its_inverse_undo_each_other() {
    let mut u = uniform(31);
    let mut worst = 0.0_f64;
    for case in 0..20_000 {
        let n = 3 + case % 10;
        let evenly = case % 3 == 0;
        let azimuths = if evenly { even(n) } else { (0..n).map(|_| u(-PI, PI)).collect() };
        let radii = (0..n).map(|_| if evenly { 0.01 } else { u(0.002, 0.02) }).collect();
        let rest = u(0.02, 0.5);
        let mapping = Mapping::new(azimuths.clone(), radii, rest).unwrap();
        let extensible = case % 2 == 1;
        let length = if extensible { rest * u(0.8, 1.3) } else { rest };
        // All quadrants; every seventh with tendon 0 at zero displacement (across the bending plane).
        let phi = if case % 7 == 0 { azimuths[0] + FRAC_PI_2 } else { u(-PI, PI) };
        let kappa = match case % 5 {
            0 => 0.0,
            1 => 1e-300,
            2 => 10f64.powf(u(-12.0, 0.0)),
            _ => u(0.0, 4.0 * PI) / length,
        };
        let arc = Arc::new(kappa, phi, length);
        let mut given = mapping.displacements(&arc);
        if case % 7 == 0 && !extensible {
            given[0] = 0.0;
        }
        let known = if extensible { Length::Free } else { Length::Known(length) };
        let fit = mapping.fit(&given, known).unwrap();
        // Not the norm: its squares underflow.
        let size = arc.bend.amax().max((length - rest).abs() / 0.01);
        let error = (fit.arc.bend - arc.bend).amax() / size.max(f64::MIN_POSITIVE);
        let stretch = (fit.arc.length - length).abs() / length;
        worst = worst.max(error / fit.condition).max(stretch / fit.condition);
        assert!(error <= 5e-15 * fit.condition, "{case} {error:e} {}", fit.condition);
        assert!(stretch <= 5e-15 * fit.condition, "{case} {stretch:e}");
        if kappa > 0.0 && !extensible {
            let turn = (fit.arc.phi() - phi).rem_euclid(TAU);
            assert!(turn.min(TAU - turn) < 1e-14 * fit.condition, "{case} {turn}");
            assert!((fit.arc.kappa() / kappa - 1.0).abs() < 1e-14 * fit.condition);
        }
        if kappa == 0.0 && !extensible {
            assert_eq!((fit.arc.kappa(), fit.arc.phi()), (0.0, 0.0));
        }
    }
    println!("worst error over condition: {worst:.1e}");
}

#[test]
fn one_tendon_and_antagonists_bend_in_their_plane() {
    let one = Mapping::new(vec![0.7], vec![0.01], 0.1).unwrap();
    let arc = one.fit(&[-0.002], Length::Known(0.1)).unwrap().arc;
    assert!((arc.kappa() - 2.0).abs() < 1e-14 && (arc.phi() - 0.7).abs() < 1e-15);
    // Released it stays straight; two released ones count.
    assert_eq!(one.fit(&[0.002], Length::Known(0.1)).unwrap().arc.bend, Vector2::zeros());
    let pair = Mapping::new(vec![0.7, 0.7 + PI], vec![0.01], 0.1).unwrap();
    let arc = pair.fit(&[0.003, -0.003], Length::Known(0.1)).unwrap().arc;
    assert!((arc.kappa() - 3.0).abs() < 1e-13 && (arc.phi() - (0.7 - PI)).abs() < 1e-14);
    // Inconsistent: the mean, and the rest is reported.
    let fit = pair.fit(&[-0.003, 0.001], Length::Known(0.1)).unwrap();
    assert!((fit.arc.kappa() - 2.0).abs() < 1e-13);
    assert!(fit.residual.iter().all(|r| (r + 0.001).abs() < 1e-16), "{:?}", fit.residual);
    // A freed antagonist does not count.
    let arc = pair.fit(&[-0.003, FREE], Length::Known(0.1)).unwrap().arc;
    assert!((arc.kappa() - 3.0).abs() < 1e-13 && (arc.phi() - 0.7).abs() < 1e-14);
    let none = pair.fit(&[FREE, FREE], Length::Known(0.1)).unwrap();
    assert_eq!((none.arc.bend, none.residual), (Vector2::zeros(), vec![0.0, 0.0]));
}

/// The tendon formula of the source divides by cos(phi) and fails where it is zero; least squares over
/// all tendons has the variance sigma^2 2/N of the Clarke form in every direction.
#[test]
fn noise_is_averaged_as_theory_says() {
    let (radius, length, stroke, sigma) = (0.008, 0.1, 0.004, 1e-4);
    let mapping = Mapping::new(even(3), vec![radius], length).unwrap();
    let kappa = stroke / (radius * length);
    let mut u = uniform(33);
    println!("phi [deg]  kappa error [%]: least squares  theory  tendon 1 alone");
    for degrees in [0.0_f64, 30.0, 60.0, 85.0] {
        let phi = degrees.to_radians();
        let exact = mapping.displacements(&Arc::new(kappa, phi, length));
        let (mut fitted, mut single) = (0.0, 0.0);
        let count = 40_000;
        for _ in 0..count {
            // Sum of twelve uniform numbers: normal to three digits.
            let noisy: Vec<f64> = (exact.iter())
                .map(|d| d + sigma * (0..12).map(|_| u(-0.5, 0.5)).sum::<f64>())
                .collect();
            let fit = mapping.fit(&noisy, Length::Known(length)).unwrap();
            fitted += (fit.arc.kappa() / kappa - 1.0).powi(2);
            single += (-noisy[0] / (radius * phi.cos() * length) / kappa - 1.0).powi(2);
        }
        let [fitted, single] = [fitted, single].map(|sum| (sum / f64::from(count)).sqrt());
        let theory = (2.0_f64 / 3.0).sqrt() * sigma / stroke;
        println!(
            "{degrees:8} {:16.3} {:7.3} {:8.3}",
            100.0 * fitted,
            100.0 * theory,
            100.0 * single
        );
        assert!((fitted / theory - 1.0).abs() < 0.02);
        assert!(single > 1.15 * fitted);
    }
}

#[test]
fn bad_mappings_name_the_argument() {
    let name =
        |azimuths, radii, length| Mapping::new(azimuths, radii, length).unwrap_err().argument;
    assert_eq!(name(vec![], vec![0.01], 0.1), "azimuth");
    assert_eq!(name(vec![f64::NAN], vec![0.01], 0.1), "azimuth");
    assert_eq!(name(vec![0.0; 3], vec![0.01; 2], 0.1), "radius");
    assert_eq!(name(vec![0.0], vec![0.0], 0.1), "radius");
    assert_eq!(name(vec![0.0], vec![0.01], 0.0), "length");
    let three = Mapping::new(even(3), vec![0.01], 0.1).unwrap();
    let name = |d: &[f64], length| three.fit(d, length).unwrap_err().argument;
    assert_eq!(name(&[0.0; 2], Length::Known(0.1)), "displacements");
    assert_eq!(name(&[0.0, f64::NAN, 0.0], Length::Known(0.1)), "displacements");
    assert_eq!(name(&[0.0; 3], Length::Known(-0.1)), "ell");
    assert_eq!(name(&[0.0, 0.0, FREE], Length::Free), "ell");
    assert_eq!(name(&[-0.2; 3], Length::Free), "displacements");
}

/// Rows in any order of patterns give what each gives alone.
#[test]
fn rows_are_fitted_as_alone() {
    let mapping = Mapping::new(even(4), vec![0.01], 0.1).unwrap();
    let (mut u, mut pattern) = (uniform(38), Pattern::default());
    for case in 0..200 {
        let mut given: Vec<f64> = (0..4).map(|_| u(-0.003, 0.003)).collect();
        if case % 3 == 0 {
            given[case % 4] = FREE;
        }
        let length = if case % 5 < 2 { Length::Free } else { Length::Known(0.11) };
        let alone = mapping.fit(&given, length).unwrap();
        let mut residual = vec![7.0];
        let arc = mapping.fit_row(&given, length, &mut pattern, &mut residual).unwrap();
        assert_eq!((arc, &residual[1..]), (alone.arc, &alone.residual[..]));
    }
}

#[test]
fn an_overflow_is_called_one() {
    let three = Mapping::new(even(3), vec![0.01], 0.1).unwrap();
    for length in [Length::Known(0.1), Length::Free] {
        for given in [[1e308, -1e308, 1e308], [f64::MAX; 3], [1e200, 0.0, 0.0]] {
            let error = three.fit(&given, length).unwrap_err();
            assert_eq!(
                (error.argument.as_str(), error.got.as_str()),
                ("displacements", "an overflow")
            );
        }
    }
}

/// The formula of the source where it is defined, its limit where it is not.
#[test]
fn arcs_are_those_of_the_source() {
    let mut u = uniform(34);
    for _ in 0..1000 {
        let (kappa, phi, length) = (u(0.1, 60.0), u(-PI, PI), u(0.05, 0.3));
        let share = u(0.0, 1.0);
        let frame = Arc::new(kappa, phi, length).frame(share);
        let angle = kappa * length * share;
        let turn = |angle| Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
        let bend = Rotation3::from_axis_angle(&Vector3::y_axis(), angle);
        let flat = Vector3::new((1.0 - angle.cos()) / kappa, 0.0, angle.sin() / kappa);
        let rotation = turn(phi) * bend * turn(-phi);
        assert!((frame.rotation - rotation.matrix()).amax() < 1e-14);
        assert!((frame.translation - turn(phi) * flat).amax() < 1e-15);
    }
    for kappa in [0.0, 1e-300, 1e-12] {
        let frame = Arc::new(kappa, 1.0, 0.2).frame(0.5);
        assert!((frame.translation - Vector3::new(0.0, 0.0, 0.1)).amax() < 1e-14);
    }
}

/// Base and tip of every segment are among the frames, and the tip is at s = ell to the bit.
#[test]
fn frames_along_a_chain() {
    let arcs = [Arc::new(8.0, 0.3, 0.06), Arc::new(0.0, 0.0, 0.1), Arc::new(30.0, -2.0, 0.2)];
    for points in [2, 3, 10, 500] {
        let mut along = Vec::new();
        frames(&Pose::identity(), &arcs, points, &mut along);
        assert_eq!(along.len(), 3 * points);
        let mut base = Pose::identity();
        for (i, arc) in arcs.iter().enumerate() {
            for k in 0..points {
                let exact = base.compose(&arc.frame(k as f64 / (points - 1) as f64));
                let got = along[i * points + k];
                assert!((got.translation - exact.translation).amax() < 1e-14, "{points} {i} {k}");
                assert!((got.rotation - exact.rotation).amax() < 1e-13);
            }
            base = base.compose(&arc.frame(1.0));
            assert_eq!(along[(i + 1) * points - 1], base);
        }
    }
}

#[test]
fn derivatives_agree_with_differences_and_the_chain_rule() {
    let mut u = uniform(35);
    for case in 0..300 {
        let straight = case % 4 == 0;
        let mut arc = || Arc {
            bend: if straight {
                Vector2::zeros()
            } else {
                Vector2::new(u(-3.0, 3.0), u(-3.0, 3.0))
            },
            length: u(0.05, 0.3),
        };
        let arcs = [arc(), arc(), arc()];
        let base = Pose { rotation: so3::exp(&Vector3::new(0.3, 1.0, -2.0)), ..Pose::identity() };
        let tool = Pose { translation: Vector3::new(0.01, -0.02, 0.03), ..Pose::identity() };
        let tip = |arcs: &[Arc]| {
            arcs.iter().fold(base, |frame, arc| frame.compose(&arc.frame(1.0))).compose(&tool)
        };
        let exact = tip_derivative(&base, &tool, &arcs);
        let here = tip(&arcs);
        for i in 0..3 {
            for j in 0..3 {
                let h = 1e-6;
                let moved = |by: f64| {
                    let mut arcs = arcs;
                    match j {
                        2 => arcs[i].length += by,
                        _ => arcs[i].bend[j] += by,
                    }
                    tip(&arcs)
                };
                let (up, down) = (moved(h), moved(-h));
                let velocity = (up.translation - down.translation) / (2.0 * h);
                let spin = so3::vee(&((up.rotation - down.rotation) * here.rotation.transpose()));
                let column = exact.column(3 * i + j);
                assert!((column.fixed_rows::<3>(0) - velocity).amax() < 1e-8, "{case} {i} {j}");
                assert!((column.fixed_rows::<3>(3) - spin / (2.0 * h)).amax() < 1e-8);
            }
        }
        // By (kappa, phi, ell) through the chain rule, finite where the arc is straight.
        let (kappa, phi) = (arcs[1].kappa(), arcs[1].phi());
        let by = arcs[1].derivative() * Arc::by_parameters(kappa, phi, arcs[1].length);
        assert!(by.iter().all(|x| x.is_finite()));
        let h = 1e-6;
        let end = |k: f64, p: f64, l: f64| Arc::new(k, p, l).frame(1.0).translation;
        let l = arcs[1].length;
        let differences = [
            end(kappa + h, phi, l) - end(kappa - h, phi, l),
            end(kappa, phi + h, l) - end(kappa, phi - h, l),
            end(kappa, phi, l + h) - end(kappa, phi, l - h),
        ];
        for (j, difference) in differences.iter().enumerate() {
            let error = by.fixed_view::<3, 1>(0, j) - difference / (2.0 * h);
            assert!(error.amax() < 1e-8, "{case} {j} {error}");
        }
    }
}
