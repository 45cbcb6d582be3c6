//! Constant curvature: the mapping both ways, arcs and their derivatives, robots of several segments.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Matrix4, Rotation3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::constant_curvature::{
    Arc, ConstantCurvature, ConstantCurvatureSettings, Coupling, Length, Mapping, Plan, Workspace,
    displacements, frames, tip_derivative,
};
use tdcr::lie::{Pose, so3};
use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};
use tdcr::{Shape, Status};

const FREE: f64 = f64::INFINITY;

fn uniform(seed: u64) -> impl FnMut(f64, f64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    move |low, high| rng.random_range(low..high)
}

fn even(n: usize) -> Vec<f64> {
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

fn tendon(azimuth: f64, radius: f64, end: usize) -> Tendon {
    let routing =
        Routing::Angles { azimuth: PerDisk::Same(azimuth), radius: PerDisk::Same(radius) };
    Tendon::new(routing, Some(end), None, None).unwrap()
}

/// Three segments of 10 subsegments with three tendons each, 45 degrees apart.
fn three_segments() -> Robot {
    let mut spec = BackboneSpec::straight(0.2, 10);
    spec.length = vec![0.06, 0.0625, 0.064];
    spec.subsegments = vec![10, 12, 8];
    let ends = [10, 22, 30];
    let tendons = (0..9)
        .map(|k| {
            let azimuth = even(3)[k % 3] + (k / 3) as f64 * PI / 4.0;
            tendon(azimuth, 0.0045 - 0.0003 * (k / 3) as f64, ends[k / 3])
        })
        .collect();
    let mut base = Rotation3::new(Vector3::new(0.5, -0.2, 1.0)).to_homogeneous();
    base[(0, 3)] = 0.3;
    let mut tool: Matrix4<f64> = Matrix4::identity();
    tool[(2, 3)] = 0.008;
    Robot::new(Backbone::new(spec).unwrap(), tendons, Some(&base), Some(&tool), None).unwrap()
}

fn solve(robot: &Robot, settings: ConstantCurvatureSettings, displacements: &[f64]) -> Shape {
    let plan = Plan::new(robot, settings).unwrap();
    ConstantCurvature::new(robot, &plan).shape(displacements).unwrap()
}

#[test]
fn robots_reproduce_their_arcs_in_both_readings() {
    let robot = three_segments();
    let mut u = uniform(36);
    for case in 0..400 {
        let coupling = Coupling::ALL[case % 2];
        let extensible = case % 4 >= 2;
        let settings = ConstantCurvatureSettings { coupling, extensible };
        let plan = Plan::new(&robot, settings).unwrap();
        let arcs: Vec<Arc> = [0.06, 0.0625, 0.064]
            .iter()
            .map(|rest| Arc {
                bend: Vector2::new(u(-2.0, 2.0), u(-2.0, 2.0)),
                length: if extensible { rest * u(0.9, 1.2) } else { *rest },
            })
            .collect();
        let given: Vec<f64> = displacements(&plan, &arcs).iter().copied().collect();
        let model = ConstantCurvature::new(&robot, &plan);
        let mut work = Workspace::default();
        let report = model.solve(&given, &mut work).unwrap();
        assert_eq!(report.status, Status::Converged);
        assert!(report.residual < 1e-14, "{}", report.residual);
        assert!(model.message(&given, &work).is_empty());
        for (got, expected) in work.arcs().iter().zip(&arcs) {
            assert!((got.bend - expected.bend).amax() < 1e-12);
            assert!((got.length - expected.length).abs() < 1e-14);
        }
        // Chains end exactly at s = ell.
        let tip = arcs.iter().fold(*robot.base(), |frame, arc| frame.compose(&arc.frame(1.0)));
        let state = model.state(&work);
        assert!((state.frames[30].translation - tip.translation).amax() < 1e-13);
        assert!((state.frames[30].rotation - tip.rotation).amax() < 1e-12);
        assert_eq!(state.frames.len(), 31);
        assert_eq!(state.elongations.len(), if extensible { 30 } else { 0 });
        if coupling == Coupling::Coupled {
            for (k, path) in robot.paths().iter().enumerate() {
                let length = path.rest_length + given[k];
                assert!((state.tendon_lengths[k] - length).abs() < 1e-14);
            }
        }
    }
}

#[test]
fn coupled_and_per_segment_readings_differ_by_the_proximal_share() {
    let robot = robot_of(&[tendon(0.0, 0.01, 5), tendon(0.3, 0.01, 10)]);
    let per_segment =
        ConstantCurvatureSettings { coupling: Coupling::PerSegment, ..Default::default() };
    // Pull the proximal tendon; the distal one as far as the proximal bend shortens it.
    let proximal = [-0.004, -0.004 * 0.3_f64.cos()];
    let coupled = solve(&robot, ConstantCurvatureSettings::default(), &proximal);
    let bend: Vec<f64> = coupled.state.strains.iter().map(nalgebra::Matrix::norm).collect();
    assert!(bend[..5].iter().all(|b| (b - 0.08).abs() < 1e-12));
    assert!(bend[5..].iter().all(|b| b.abs() < 1e-12));
    let same = solve(&robot, per_segment, &[-0.004, 0.0]);
    let off = coupled.state.frames[10].translation - same.state.frames[10].translation;
    assert!(off.amax() < 1e-14);
}

fn robot_of(tendons: &[Tendon]) -> Robot {
    let backbone = Backbone::new(BackboneSpec::straight(0.2, 10)).unwrap();
    Robot::new(backbone, tendons.to_vec(), None, None, None).unwrap()
}

#[test]
fn free_and_single_released_tendons_do_not_count() {
    let settings = ConstantCurvatureSettings::default();
    let three = robot_of(&even(3).iter().map(|a| tendon(*a, 0.01, 10)).collect::<Vec<_>>());
    let shape = solve(&three, settings, &[-0.004, FREE, FREE]);
    assert!((shape.state.strains[0].y - 0.04).abs() < 1e-14);
    let plan = Plan::new(&three, settings).unwrap();
    let model = ConstantCurvature::new(&three, &plan);
    let mut work = Workspace::default();
    // One workspace through changing patterns gives what fresh ones give.
    for pattern in [
        [-0.004, FREE, FREE],
        [0.004, FREE, FREE],
        [-0.002, -0.002, 0.004],
        [FREE, -0.001, 0.0005],
        [FREE, FREE, FREE],
        [-0.004, FREE, FREE],
    ] {
        model.solve(&pattern, &mut work).unwrap();
        let fresh = solve(&three, settings, &pattern);
        assert_eq!(model.state(&work).frames, fresh.state.frames);
        if pattern[0] == 0.004 || pattern.iter().all(|d| *d == FREE) {
            assert!(fresh.state.strains.iter().all(|w| *w == Vector3::zeros()));
        }
    }
    // Three that no arc satisfies: least squares, and by how much each is off.
    let shape = solve(&three, settings, &[-0.004, 0.0, 0.0]);
    assert_eq!(shape.report.status, Status::Converged);
    assert!((shape.report.residual - 0.004 / 3.0 / 0.2).abs() < 1e-15);
    assert!(shape.message.contains("'t1' by -0.001333 m"), "{}", shape.message);
}

#[test]
fn the_tip_jacobian_agrees_with_differences() {
    let robot = three_segments();
    let mut u = uniform(37);
    for case in 0..120 {
        let extensible = case % 2 == 1;
        let coupling = Coupling::ALL[case / 2 % 2];
        let plan = Plan::new(&robot, ConstantCurvatureSettings { coupling, extensible }).unwrap();
        let model = ConstantCurvature::new(&robot, &plan);
        let size = if case % 3 == 0 { 0.0 } else { 0.003 };
        let mut given: Vec<f64> = (0..9).map(|_| size * u(-1.0, 1.0)).collect();
        if case % 5 == 0 && !extensible {
            given[4] = FREE;
        }
        let mut work = Workspace::default();
        let jacobian = model.jacobian(&given, &mut work);
        let tip =
            |given: &[f64]| model.shape(given).unwrap().state.frames[30].compose(robot.tool());
        let here = tip(&given);
        for k in 0..9 {
            let h = 1e-7;
            let moved = |by: f64| {
                let mut given = given.clone();
                given[k] += by;
                tip(&given)
            };
            let (up, down) = (moved(h), moved(-h));
            let velocity = (up.translation - down.translation) / (2.0 * h);
            let spin = so3::vee(&((up.rotation - down.rotation) * here.rotation.transpose()));
            let column = jacobian.column(k);
            assert!((column.fixed_rows::<3>(0) - velocity).amax() < 1e-6, "{case} {k}");
            assert!((column.fixed_rows::<3>(3) - spin / (2.0 * h)).amax() < 1e-5, "{case} {k}");
        }
    }
}

#[test]
fn other_routings_and_pre_bent_backbones_are_refused() {
    let settings = ConstantCurvatureSettings::default();
    let helix =
        Tendon::new(Routing::Helical { azimuth: 0.0, radius: 0.01, turns: 0.1 }, None, None, None);
    let error =
        Plan::new(&robot_of(&[tendon(0.0, 0.01, 10), helix.unwrap()]), settings).unwrap_err();
    assert_eq!(error.argument, "robot.tendons[1]");
    assert!(error.expected.contains("\"linkage\""));
    let mut spec = BackboneSpec::straight(0.2, 2);
    spec.rest = Some(vec![Vector3::new(0.0, 0.1, 0.0); 2]);
    let bent = Robot::new(Backbone::new(spec).unwrap(), vec![], None, None, None).unwrap();
    assert_eq!(Plan::new(&bent, settings).unwrap_err().argument, "robot.backbone.rest");
    let two = robot_of(&[tendon(0.0, 0.01, 10), tendon(1.0, 0.01, 10)]);
    let extensible = ConstantCurvatureSettings { extensible: true, ..settings };
    assert_eq!(Plan::new(&two, extensible).unwrap_err().argument, "settings.extensible");
}

#[test]
fn displacements_that_leave_no_length_are_infeasible() {
    let three = robot_of(&even(3).iter().map(|a| tendon(*a, 0.01, 10)).collect::<Vec<_>>());
    let settings = ConstantCurvatureSettings { extensible: true, ..Default::default() };
    let shape = solve(&three, settings, &[-0.25, -0.25, -0.25]);
    assert_eq!(shape.report.status, Status::Infeasible);
    assert!(shape.message.contains("segment 0 no length"), "{}", shape.message);
}
