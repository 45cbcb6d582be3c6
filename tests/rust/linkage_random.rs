//! Random robots and random subsegments: solved, or honestly flagged.

use std::f64::consts::PI;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::Status;
use tdcr::linkage::seven_bar::Hole;
use tdcr::linkage::{LinkageSettings, Pose, solve_seven_bar};
use tdcr::robot::{PerDisk, Routing, Tendon};
use tdcr::solve::sqp::Ending;

use crate::common::{FREE, robot, try_solve};

/// Pairs of differing holes pulled anywhere: every one is solved or infeasible with a stationary
/// violation, and the infeasible ones are so from other starts too.
fn unreachable_pairs_are_infeasible() {
    let mut rng = ChaCha8Rng::seed_from_u64(22);
    let mut u = move |low: f64, high: f64| rng.random_range(low..high);
    let settings = LinkageSettings::default().sqp();
    let (mut solved, mut infeasible, mut other, mut missed) = (0, 0, 0, 0);
    for _ in 0..4000 {
        let azimuth = u(-PI, PI);
        let second = azimuth + u(0.4, 2.7);
        let holes = [azimuth, second].map(|azimuth| {
            let polar = |r: f64| Vector3::new(r * azimuth.cos(), r * azimuth.sin(), 0.0);
            let (lower, upper) = (polar(u(0.25, 1.5)), polar(u(0.25, 1.5)));
            Hole::new(lower, upper, u(0.0, 1.3))
        });
        if holes.iter().any(|hole| hole.pull >= hole.rest) {
            continue;
        }
        let found = solve_seven_bar::<2>(&holes, &settings, None);
        match found.ending {
            Ending::Converged => solved += 1,
            Ending::Infeasible => {
                infeasible += 1;
                assert!(found.violation > 1e-6);
                for _ in 0..5 {
                    let bend = Pose::from_bend(u(0.0, 2.8), u(-PI, PI));
                    let again = solve_seven_bar::<2>(&holes, &settings, Some(bend));
                    missed += usize::from(again.ending == Ending::Converged);
                }
            }
            _ => other += 1,
        }
    }
    println!("solved {solved}, infeasible {infeasible}, neither {other}, missed {missed}");
    assert!(solved > 1000 && infeasible > 100);
    assert!(other * 100 <= infeasible, "{other}");
    assert_eq!(missed, 0);
}

/// Any robot, any pull: an answer within the budget, finite, and never called converged when a tendon
/// is longer than it may be or a link is not as long as it is.
#[test]
fn random_robots_are_solved_or_honestly_flagged() {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let mut u = move |low: f64, high: f64| rng.random_range(low..high);
    let (mut gentle, mut gentle_solved, mut refused) = (0, 0, 0);
    for case in 0..3000 {
        let n = u(1.0, 40.0) as usize;
        let length = u(0.05, 0.5);
        let count = u(1.0, 5.0) as usize;
        let tendons: Vec<Tendon> = (0..count)
            .map(|_| {
                let end = u(1.0, n as f64 + 1.0) as usize;
                let (azimuth, radius) = (u(-PI, PI), u(0.004, 0.012));
                let routing = match u(0.0, 4.0) as usize {
                    0 => Routing::Helical {
                        azimuth,
                        radius,
                        turns: u(-1.0, 1.0) * end as f64 / 40.0,
                    },
                    1 => Routing::Holes {
                        indices: (0..=end).map(|i| (i / 5) % 12).collect(),
                        count: 12,
                        radius: PerDisk::Same(radius),
                        azimuth,
                    },
                    2 => Routing::Angles {
                        azimuth: PerDisk::Same(azimuth),
                        radius: PerDisk::Each((0..=end).map(|_| u(0.8, 1.2) * radius).collect()),
                    },
                    _ => Routing::Angles {
                        azimuth: PerDisk::Same(azimuth),
                        radius: PerDisk::Same(radius),
                    },
                };
                Tendon::new(routing, Some(end), None, None).unwrap()
            })
            .collect();
        let trunk = robot(length, n, tendons);
        // Two in three: one tendon pulled gently, the rest free. Else: anything.
        let mild = case % 3 != 0;
        let displacements: Vec<f64> = (0..count)
            .map(|k| match (mild, k) {
                (true, 0) => -u(0.0, 0.02) * trunk.paths()[0].rest_length,
                (true, _) => FREE,
                (false, _) => u(-0.3, 0.3) * length,
            })
            .collect();
        let Ok(shape) = try_solve(&trunk, &displacements) else {
            refused += 1;
            continue;
        };
        assert!(shape.state.frames.iter().all(|f| f.translation.iter().all(|x| x.is_finite())));
        // A converged answer has nothing to say, but that a tendon would have to push.
        let says = !shape.message.is_empty() && !shape.message.contains("have to push");
        assert_eq!(says, shape.report.status != Status::Converged, "{}", shape.message);
        if mild {
            gentle += 1;
            gentle_solved += usize::from(shape.report.status == Status::Converged);
        }
        if shape.report.status != Status::Converged {
            continue;
        }
        for (k, path) in trunk.paths().iter().enumerate() {
            let slack = path.rest_length + displacements[k] - shape.state.tendon_lengths[k];
            assert!(slack > -1e-9 * path.rest_length, "{case} {k} {slack:e}");
        }
        for (pair, rest) in shape.state.frames.windows(2).zip(trunk.backbone().lengths()) {
            let link = (pair[1].translation - pair[0].translation).norm();
            assert!((link / rest - 1.0).abs() < 1e-11);
        }
    }
    println!("gentle pulls solved: {gentle_solved} of {gentle}; refused: {refused}");
    assert_eq!(gentle_solved, gentle);
    assert!(refused < 10);
}

crate::common::slow!(unreachable_pairs_are_infeasible,);
