//! Paths through waypoints: even, no step too long, every waypoint met.
#![allow(clippy::expect_used, reason = "a test may stop where its input is refused")]

use nalgebra::Vector3;
use proptest::prelude::*;
use tdcr::inverse::{Target, cartesian_path};
use tdcr::lie::{Pose, so3};

fn pose() -> impl Strategy<Value = Pose> {
    (prop::array::uniform3(-1.0..1.0), prop::array::uniform3(-1.5..1.5)).prop_map(|(v, w)| Pose {
        rotation: so3::exp(&Vector3::from(w)),
        translation: Vector3::from(v),
    })
}

fn way(a: &Target, b: &Target) -> (f64, f64) {
    let turn = match (a.rotation(), b.rotation()) {
        (Some(a), Some(b)) => so3::log(&a.tr_mul(b)).norm(),
        _ => 0.0,
    };
    ((a.position() - b.position()).norm(), turn)
}

proptest! {
    #[test]
    fn neighbours_are_near_and_legs_even(
        poses in prop::collection::vec(pose(), 1..5),
        step in 0.01..2.0,
        turn in 0.02..2.0,
        placed in any::<bool>(),
    ) {
        let waypoints: Vec<Target> = poses
            .iter()
            .map(|pose| if placed { Target::frame(pose) } else { Target::Position(pose.translation) })
            .collect();
        let path = cartesian_path(&waypoints, step, turn).expect("valid");
        let at: Vec<usize> = (waypoints.iter())
            .map(|w| path.iter().position(|p| p == w).expect("every waypoint is a row"))
            .collect();
        prop_assert_eq!((at[0], at[at.len() - 1]), (0, path.len() - 1));
        for leg in at.windows(2) {
            let rows = &path[leg[0]..=leg[1]];
            let (whole, angle) = way(&rows[0], &rows[rows.len() - 1]);
            let count = (leg[1] - leg[0]) as f64;
            for pair in rows.windows(2) {
                let (off, turned) = way(&pair[0], &pair[1]);
                prop_assert!(off <= step * (1.0 + 1e-9) && turned <= turn * (1.0 + 1e-9));
                prop_assert!((off - whole / count).abs() < 1e-14);
                prop_assert!((turned - angle / count).abs() < 1e-14);
            }
            // No more rows than it takes.
            prop_assert!(count < 1.0 + (whole / step).max(angle / turn) + 1e-9);
        }
    }
}

#[test]
fn a_step_that_divides_the_way_makes_no_row_more() {
    for parts in 1..1000_u32 {
        let end = Target::Position(Vector3::new(0.3, -0.1, 0.2) * f64::from(parts));
        let step = end.position().norm() / f64::from(parts);
        let path = cartesian_path(&[Target::Position(Vector3::zeros()), end], step, 1.0);
        assert_eq!(path.expect("valid").len(), parts as usize + 1);
    }
}

#[test]
fn waypoints_that_coincide_stay_rows() {
    let here = Target::Position(Vector3::new(0.1, 0.2, 0.3));
    assert_eq!(cartesian_path(&[here; 3], 0.1, 0.1), Ok(vec![here; 3]));
    assert_eq!(cartesian_path(&[], 0.1, 0.1), Ok(vec![]));
}
