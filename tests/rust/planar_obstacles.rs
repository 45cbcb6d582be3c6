//! The inverse by particle swarm among circles, against scans and samples that know nothing of it.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use rayon::prelude::*;
use tdcr::Status;
use tdcr::planar::{
    Circle, Goal, InverseSettings, SwarmSettings, SwarmSolver, Trunk, TwoSections, inverse,
};
use tdcr::solve::pso::{PsoSettings, Topology};

use super::planar_swarm::{solve, tip, to, trunk, uniform};

/// Smallest distance by points along the trunk, never below the exact one.
fn sampled(trunk: &Trunk, turns: &[f64], circles: &[Circle]) -> f64 {
    let curve = trunk.curve(turns, 2001);
    let near = |p: &[f64; 4], c: &Circle| (Vector2::new(p[1], p[2]) - c.center).norm() - c.radius;
    let points = curve.iter().flat_map(|p| circles.iter().map(|c| near(p, c)));
    points.fold(f64::INFINITY, f64::min)
}

#[test]
fn clearances_are_those_of_dense_samples() {
    let mut u = uniform(81);
    for case in 0..300 {
        let m = 1 + case % 5;
        let trunk = trunk(&(0..m).map(|_| u(0.05, 0.2)).collect::<Vec<_>>());
        let turns: Vec<f64> = (0..m).map(|_| u(-6.0, 6.0)).collect();
        let circles: Vec<Circle> = (0..3)
            .map(|_| Circle::new(u(-0.3, 0.3), u(-0.3, 0.3), u(0.001, 0.1)).unwrap())
            .collect();
        let (exact, near) = (trunk.clearance(&turns, &circles), sampled(&trunk, &turns, &circles));
        assert!(exact <= near + 1e-15 && exact > near - 1e-4, "{case} {exact} {near}");
        assert_eq!(trunk.clearance(&turns, &[]), f64::INFINITY);
    }
}

/// Three sections among two circles: on the target, clear of them, and with no more energy than a scan
/// of the first turn with the exact solutions of the rest finds among what is clear.
fn three_sections_among_circles() {
    let lengths = [0.1, 0.08, 0.12];
    let trunk = trunk(&lengths);
    let rest = TwoSections::new(lengths[1], lengths[2], 6.2).unwrap();
    // A ring is slower and more often right.
    let swarm = PsoSettings { topology: Topology::Ring, ..PsoSettings::default() };
    let settings = SwarmSettings { swarm, ..SwarmSettings::default() };
    let cases: Vec<_> = (0..120_u64)
        .into_par_iter()
        .filter_map(|case| {
            let mut u = uniform(8200 + case);
            let aim = tip(&trunk, &[u(-2.0, 2.0), u(-2.0, 2.0), u(-2.0, 2.0)]).0;
            let goal = Goal { limits: vec![6.2], ..to(aim) };
            // The first on the way that would be taken without it.
            let free = inverse(&trunk, &goal, &InverseSettings::default()).unwrap();
            let way = trunk.curve(&free.turns, 3);
            let circles = [
                Circle::new(way[4][1] + u(-0.01, 0.01), way[4][2] + u(-0.01, 0.01), u(0.012, 0.03)),
                Circle::new(u(-0.2, 0.2), u(-0.2, 0.2), 0.03),
            ]
            .map(Result::unwrap);
            let (mut least, mut found) = (f64::INFINITY, Vec::new());
            let n = 20_000;
            for k in 0..=n {
                let turn = 6.2 * (2.0 * f64::from(k) / f64::from(n) - 1.0);
                let joint = tip(&trunk, &[turn, 0.0, 0.0]).0
                    - Vector2::new(turn.cos(), turn.sin()) * (lengths[1] + lengths[2]);
                let (to, (sin, cos)) = (aim - joint, turn.sin_cos());
                rest.solutions(cos * to.x + sin * to.y, cos * to.y - sin * to.x, &mut found);
                for f in &found {
                    let turns = [turn, f[0], f[1]];
                    let energy: f64 =
                        turns.iter().zip(&lengths).map(|(t, l)| 0.5 * t * t / l).sum();
                    if energy < least && trunk.clearance(&turns, &circles) >= 0.0 {
                        least = energy;
                    }
                }
            }
            // Base or target may stand in a circle.
            if least == f64::INFINITY {
                return None;
            }
            let got = solve(&trunk, &circles, &goal, &settings, case);
            let answer = &got.inverse;
            assert_eq!(answer.status, Status::Converged, "{case} {answer:?} {least}");
            assert!(answer.error <= 1e-12 && got.clearance >= 0.0, "{case} {answer:?}");
            assert!((tip(&trunk, &answer.turns).0 - aim).norm() < 2e-12);
            assert!(sampled(&trunk, &answer.turns, &circles) > -1e-15);
            Some((answer.energy / least - 1.0, got.evaluations))
        })
        .collect();
    let mut above: Vec<f64> = cases.iter().map(|c| c.0).collect();
    above.sort_by(f64::total_cmp);
    let n = above.len();
    let evaluations = cases.iter().map(|c| c.1).sum::<usize>() / n;
    let off = above.iter().filter(|a| **a > 1e-3).count();
    println!(
        "{off} of {n} cases, energy over the scan's: least {:.1e}, median {:.1e}, 90 % {:.1e}, most {:.1e}; {evaluations} evaluations",
        above[0],
        above[n / 2],
        above[n * 9 / 10],
        above[n - 1]
    );
    // Most end in the lowest valley; which one it is, no swarm can know.
    assert!(off * 20 <= n && above[n - 1] < 0.2, "{off} {above:?}");
}

/// Two sections have no choice but between branches: the clear one is taken, even if it costs more.
#[test]
fn the_other_branch_is_taken() {
    let trunk = trunk(&[0.14, 0.12]);
    let two = TwoSections::new(0.14, 0.12, TAU).unwrap();
    let aim = Vector2::new(0.2, 0.06);
    let mut exact = Vec::new();
    two.solutions(aim.x, aim.y, &mut exact);
    for k in 0..2 {
        let middle = trunk.curve(&exact[k], 21)[10];
        let circles = [Circle::new(middle[1], middle[2], 0.01).unwrap()];
        let got = solve(&trunk, &circles, &to(aim), &SwarmSettings::default(), 0);
        assert_eq!(got.inverse.status, Status::Converged);
        assert!((got.inverse.turns[0] - exact[1 - k][0]).abs() < 1e-9, "{k} {got:?}");
        assert_eq!(got.clearance, trunk.clearance(&got.inverse.turns, &circles));
        // History and value are energies.
        assert!((got.value / got.inverse.energy - 1.0).abs() < 1e-9);
    }
    // Both ways shut, or the target itself.
    let shut = exact.iter().map(|turns| trunk.curve(turns, 21)[10]);
    let both: Vec<_> = shut.map(|p| Circle::new(p[1], p[2], 0.01).unwrap()).collect();
    let covered = vec![Circle::new(aim.x, aim.y, 0.01).unwrap()];
    let settings = SwarmSettings { restarts: 1, ..SwarmSettings::default() };
    for circles in [both, covered] {
        let got = solve(&trunk, &circles, &to(aim), &settings, 0);
        assert_eq!(got.inverse.status, Status::Infeasible, "{got:?}");
        assert!(got.clearance < 0.0 && got.inverse.error <= 1e-12 && got.swarms == 2);
    }
    // Out of reach.
    let far = solve(&trunk, &covered_by_nothing(), &to(aim * 3.0), &settings, 0);
    assert_eq!(far.inverse.status, Status::IterationLimit);
}

fn covered_by_nothing() -> Vec<Circle> {
    vec![Circle::new(1.0, 1.0, 0.01).unwrap()]
}

/// Headings and limits hold among circles too.
fn headings_among_circles() {
    let mut solved = 0;
    for case in 0..30 {
        let mut u = uniform(8300 + case);
        let trunk = trunk(&[0.1, 0.1, 0.1, 0.1]);
        let made: Vec<f64> = (0..4).map(|_| u(-1.2, 1.2)).collect();
        let (aim, heading) = tip(&trunk, &made);
        let circles = [Circle::new(u(0.0, 0.3), u(-0.2, 0.2), 0.03).unwrap()];
        if trunk.clearance(&made, &circles) < 0.01 {
            continue;
        }
        let goal = Goal { point: aim, heading: Some(heading), limits: vec![2.0] };
        let got = solve(&trunk, &circles, &goal, &SwarmSettings::default(), case);
        assert_eq!(got.inverse.status, Status::Converged, "{case} {got:?}");
        assert!(got.inverse.heading_error.abs() < 1e-10 && got.clearance >= 0.0);
        assert!(got.inverse.turns.iter().all(|t| t.abs() <= 2.0));
        solved += 1;
    }
    assert!(solved > 15, "{solved}");
}

#[test]
fn bad_circles_name_the_argument() {
    assert_eq!(Circle::new(f64::NAN, 0.0, 1.0).unwrap_err().argument, "x");
    assert_eq!(Circle::new(0.0, f64::INFINITY, 1.0).unwrap_err().argument, "y");
    assert_eq!(Circle::new(0.0, 0.0, 0.0).unwrap_err().argument, "radius");
    let two = trunk(&[0.1, 0.1]);
    let settings =
        SwarmSettings { unknowns: tdcr::planar::Unknowns::Points, ..SwarmSettings::default() };
    let circles = covered_by_nothing();
    let argument = |trunk: &Trunk, circles: &[Circle]| {
        SwarmSolver::new(trunk, circles, &settings).map(|_| ()).unwrap_err().argument
    };
    assert_eq!(argument(&two, &circles), "obstacles");
    assert_eq!(argument(&trunk(&[0.1]), &[]), "objective");
}

crate::common::slow!(headings_among_circles, three_sections_among_circles,);
