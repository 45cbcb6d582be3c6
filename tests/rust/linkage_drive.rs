//! Which tendons form the linkage, and what is said of the others.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use tdcr::Status;

use crate::common::{FREE, robot, solve, straight, tip, try_solve};

#[test]
fn the_two_most_pulled_tendons_drive_and_the_others_are_checked() {
    let three = robot(0.2, 10, straight(&[0.0, TAU / 3.0, 2.0 * TAU / 3.0], 0.01));
    // Consistent displacements of a bend towards azimuth 0.5.
    let consistent: Vec<f64> =
        (0..3).map(|k| -0.004 * (f64::from(k) * TAU / 3.0 - 0.5).cos()).collect();
    let shape = solve(&three, &consistent);
    assert_eq!(shape.report.status, Status::Converged, "{}", shape.message);
    let strain = shape.state.strains[0];
    assert!(((-strain.x).atan2(strain.y) - 0.5).abs() < 1e-12);
    // Released further: still fine, slack. Free: fine. Released too little: said so.
    let mut looser = consistent.clone();
    looser[2] += 0.001;
    assert_eq!(solve(&three, &looser).report.status, Status::Converged);
    looser[2] = FREE;
    assert_eq!(solve(&three, &looser).report.status, Status::Converged);
    let mut tighter = consistent;
    tighter[2] -= 0.001;
    let shape = solve(&three, &tighter);
    assert_eq!(shape.report.status, Status::Infeasible);
    assert!(shape.message.contains("'t2' would need +0.00"), "{}", shape.message);
}

#[test]
fn pulling_one_of_three_against_two_held_ones_names_them() {
    let three = robot(0.2, 10, straight(&[0.0, TAU / 3.0, 2.0 * TAU / 3.0], 0.01));
    let shape = solve(&three, &[-0.004, 0.0, 0.0]);
    assert_eq!(shape.report.status, Status::Infeasible);
    assert!(shape.message.contains("held at their rest length: 't1', 't2'"), "{}", shape.message);
    assert!(shape.message.contains("free") && shape.message.contains("release"));
    // Freed or released it is the plane of the pulled tendon.
    for others in [FREE, 0.002, 0.1] {
        let shape = solve(&three, &[-0.004, others, others]);
        assert_eq!(shape.report.status, Status::Converged, "{}", shape.message);
        assert!(tip(&shape).y.abs() < 1e-15 && tip(&shape).x > 0.0);
    }
}

#[test]
fn a_held_tendon_that_would_stretch_becomes_part_of_the_linkage() {
    let held = robot(0.2, 10, straight(&[0.0, 2.0], 0.01));
    let shape = solve(&held, &[-0.004, 0.0]);
    assert_eq!(shape.report.status, Status::Converged, "{}", shape.message);
    assert!((shape.state.tendon_lengths[0] - 0.196).abs() < 1e-14);
    assert!((shape.state.tendon_lengths[1] - 0.2).abs() < 1e-14);
    // One that the bend shortens, or that stands across, is left out.
    for azimuth in [1.0, FRAC_PI_2] {
        let held = robot(0.2, 10, straight(&[0.0, azimuth], 0.01));
        let shape = solve(&held, &[-0.004, 0.0]);
        assert_eq!(shape.report.status, Status::Converged, "{}", shape.message);
        assert!(tip(&shape).y.abs() < 1e-15);
    }
}

#[test]
fn antagonists_pulled_together_are_infeasible() {
    let pair = robot(0.2, 10, straight(&[0.0, PI], 0.01));
    let shape = solve(&pair, &[-0.004, -0.002]);
    assert_eq!(shape.report.status, Status::Infeasible);
    assert!(shape.message.contains("'t1' would need"), "{}", shape.message);
    assert_eq!(solve(&pair, &[-0.004, 0.004]).report.status, Status::Converged);
}

#[test]
fn two_pulled_tendons_on_one_azimuth_are_refused() {
    let twins = robot(0.2, 10, straight(&[0.7, 0.7 + TAU], 0.01));
    let error = try_solve(&twins, &[-0.001, -0.002]).unwrap_err();
    assert_eq!(error.argument, "displacements");
    assert!(error.got.contains("'t1'") && error.got.contains("'t0'"), "{error}");
    assert!(try_solve(&twins, &[-0.001, FREE]).is_ok());
}

/// Of several held tendons the one that asks for most sideways bend joins, not the most stretched.
#[test]
fn the_held_tendon_that_asks_for_most_bend_joins() {
    let degrees = |d: f64| d.to_radians();
    let trunk = robot(0.2, 20, straight(&[0.0, degrees(170.0), degrees(100.0)], 0.01));
    let given = [-0.01, 0.008_848, 0.0];
    let shape = solve(&trunk, &given);
    assert_eq!(shape.report.status, Status::Converged, "{}", shape.message);
    for (k, bound) in given.iter().enumerate() {
        assert!(shape.state.tendon_lengths[k] < 0.2 + bound + 1e-9 * 0.2);
    }
}

/// Both pulled lengths hold, as in the paper, also where one would have to push: it is said.
#[test]
fn a_pulled_tendon_that_would_have_to_push_is_named() {
    let trunk = robot(0.2, 20, straight(&[0.0, PI / 3.0], 0.01));
    let shape = solve(&trunk, &[-0.01, -0.001]);
    assert_eq!(shape.report.status, Status::Converged);
    assert!((shape.state.tendon_lengths[1] - 0.199).abs() < 1e-14);
    assert!(shape.message.starts_with("'t1' is kept at its length and would have to push"));
    for fine in [[-0.01, -0.006], [-0.01, FREE], [-0.01, 0.0]] {
        assert!(solve(&trunk, &fine).message.is_empty());
    }
}
