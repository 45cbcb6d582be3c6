//! The inverse of the constant-curvature model on targets that can be reached.

use std::f64::consts::{PI, TAU};
use std::sync::atomic::Ordering;

use nalgebra::{DMatrix, DVector};
use tdcr::Status;
use tdcr::batch::{Control, pool};
use tdcr::constant_curvature::{Arc, displacements};
use tdcr::inverse::{
    Bounds, ConstantCurvatureInverse, InverseSettings, Inverter as _, Target, invert_path,
    invert_rows,
};

use crate::inverse_common::{
    LENGTHS, arcs, arcs_of, bounds, differences, inside, misses, placed, plan, quantile, threes,
    tool, tool_of, touched, transform, trunk, uniform, unknowns,
};
use crate::optimality::unheld;

/// Solves 10,000 random pose targets, checks every answer with the forward model, prints how it went.
fn random_poses(extensible: bool, seed: u64) {
    let robot = trunk();
    let plan = plan(&robot, extensible);
    let bounds = bounds(extensible);
    let settings = InverseSettings::default();
    let inverse = ConstantCurvatureInverse::new(&robot, &plan, &bounds, settings).unwrap();
    let mut work = inverse.scratch();
    let mut u = uniform(seed);
    let (mut starts, mut solved) = (Vec::new(), 0);
    let (mut worst, mut found) = ((0.0_f64, 0.0_f64), vec![0.0; 9]);
    for case in 0..10_000 {
        let target = Target::frame(&tool_of(&robot, &plan, &arcs(&LENGTHS, extensible, &mut u)));
        let answer = inverse.solve(&target, None, &mut work);
        starts.push(answer.starts as f64);
        inverse.write_displacements(&work, &mut found);
        let (distance, angle) = misses(&tool(&robot, &plan, &found), &target);
        assert!(inside(&inverse.arcs(&work), &bounds), "{case}");
        if answer.status == Status::Converged {
            solved += 1;
            worst = (worst.0.max(distance), worst.1.max(angle));
            assert!(distance <= 1e-9 && angle <= 1e-9, "{case} {distance:e} {angle:e}");
        } else {
            println!("not solved: {case} {answer:?}");
        }
    }
    starts.sort_by(f64::total_cmp);
    println!(
        "extensible {extensible}: {solved} of 10000, worst {:.1e} m {:.1e} rad",
        worst.0, worst.1
    );
    for share in [0.5, 0.9, 0.99, 0.999, 1.0] {
        println!("  {share:5}: {:4} starts", quantile(&starts, share));
    }
    assert_eq!(solved, 10_000);
}

#[test]
fn random_poses_of_three_inextensible_segments_are_met() {
    random_poses(false, 61);
}

#[test]
fn random_poses_of_three_extensible_segments_are_met() {
    random_poses(true, 62);
}

/// Bending energy of the uniform trunk over its bending stiffness and mean length.
fn energy(z: &[f64], extensible: bool) -> f64 {
    let bends = arcs_of(z, extensible);
    bends.iter().zip(LENGTHS).map(|(arc, rest)| 0.5 * arc.bend.norm_squared() * 0.062 / rest).sum()
}

/// Moves unknowns to the target along bounds by Newton steps with differences; false unless they get there.
fn onto(
    z: &mut [f64],
    touched: &[DVector<f64>],
    place: &mut impl FnMut(&[f64]) -> DVector<f64>,
) -> bool {
    for _ in 0..6 {
        let off = place(z);
        if off.norm() < 1e-11 {
            return true;
        }
        let rows = [&differences(z, 1e-6, &mut *place), touched].concat();
        let matrix = DMatrix::from_fn(rows.len(), z.len(), |i, j| rows[i][j]);
        let off = DVector::from_fn(rows.len(), |i, _| if i < 3 { -off[i] } else { 0.0 });
        let step = matrix.svd(true, true).solve(&off, 1e-9).unwrap();
        z.iter_mut().zip(step.iter()).for_each(|(z, p)| *z += p);
    }
    false
}

/// What a position leaves free goes to the least bending energy: the gradient along the target vanishes
/// but for what bounds hold, and no step along the target lowers the energy.
fn least_energy(extensible: bool, seed: u64) {
    let robot = trunk();
    let plan = plan(&robot, extensible);
    let bounds = bounds(extensible);
    let settings = InverseSettings::default();
    let inverse = ConstantCurvatureInverse::new(&robot, &plan, &bounds, settings).unwrap();
    let mut work = inverse.scratch();
    let mut u = uniform(seed);
    let (mut worst, mut compared, mut held, mut iterations) = (0.0_f64, 0, 0, 0);
    for case in 0..400 {
        let made = arcs(&LENGTHS, extensible, &mut u);
        let target = Target::point(tool_of(&robot, &plan, &made).translation).unwrap();
        let answer = inverse.solve(&target, None, &mut work);
        assert_eq!(answer.status, Status::Converged, "{case}");
        iterations += answer.iterations;
        let found = inverse.arcs(&work);
        assert!(inside(&found, &bounds), "{case}");
        let z = unknowns(&found, extensible);
        let mut place = |z: &[f64]| {
            let tip = tool_of(&robot, &plan, &arcs_of(z, extensible)).translation;
            DVector::from_column_slice((tip - target.position()).as_slice())
        };
        assert!(place(&z).norm() < 1e-9);
        let rows = differences(&z, 1e-5, &mut place);
        let slope = differences(&z, 1e-4, |z| DVector::from_element(1, energy(z, extensible)));
        let touched = touched(&z, extensible, &bounds);
        let left = unheld(&slope[0], &rows, &touched);
        worst = worst.max(left);
        assert!(left < 1e-6, "{case} {left:e}");
        held += usize::from(!touched.is_empty());
        let size = z.len();
        let rows = [&rows[..], &touched].concat();
        let across = DMatrix::from_fn(size, size, |i, j| rows.get(i).map_or(0.0, |row| row[j]));
        let along = across.svd(false, true).v_t.unwrap();
        let here = energy(&z, extensible);
        for _ in 0..20 {
            let share: Vec<f64> =
                (0..size).map(|i| if i < rows.len() { 0.0 } else { u(-0.03, 0.03) }).collect();
            let mut near: Vec<f64> = (0..size)
                .map(|j| z[j] + (0..size).map(|i| share[i] * along[(i, j)]).sum::<f64>())
                .collect();
            if onto(&mut near, &touched, &mut place) && inside(&arcs_of(&near, extensible), &bounds)
            {
                compared += 1;
                let there = energy(&near, extensible);
                assert!(there > here - 1e-9, "{case} {there} {here}");
            }
        }
    }
    println!("extensible {extensible}: {held} of 400 at bounds, gradient left {worst:.1e},");
    println!("  {compared} neighbours no lower, {} steps on average", iterations / 400);
    assert!(compared > 2000);
}

#[test]
fn freedom_is_spent_on_the_least_energy_of_inextensible_segments() {
    least_energy(false, 63);
}

#[test]
fn freedom_is_spent_on_the_least_energy_of_extensible_segments() {
    least_energy(true, 64);
}

#[test]
fn one_segment_is_solved_at_once() {
    let mut u = uniform(65);
    for (name, tool_frame) in [
        ("none", transform([0.0; 3], [0.0; 3])),
        ("along z", transform([0.0, 0.0, 0.02], [0.0; 3])),
        ("tilted", transform([0.01, -0.005, 0.02], [0.4, 0.9, -0.3])),
    ] {
        let base = transform([0.2, -0.1, 0.4], [1.0, -0.5, 2.0]);
        let robot = placed(&[0.1], threes(&[0.01]), Some(&base), Some(&tool_frame));
        for (extensible, posed) in [(false, true), (true, true), (false, false), (true, false)] {
            let plan = plan(&robot, extensible);
            let settings = InverseSettings::default();
            let bounds = Bounds::default();
            let inverse = ConstantCurvatureInverse::new(&robot, &plan, &bounds, settings).unwrap();
            let mut work = inverse.scratch();
            for case in 0..1000 {
                let (angle, phi) = (u(0.0, 0.999 * TAU), u(-PI, PI));
                let length = if extensible { 0.1 * u(0.6, 1.9) } else { 0.1 };
                let made = [Arc::new(angle / length, phi, length)];
                let pose = tool_of(&robot, &plan, &made);
                let target = if posed {
                    Target::frame(&pose)
                } else {
                    Target::point(pose.translation).unwrap()
                };
                let answer = inverse.solve(&target, None, &mut work);
                assert_eq!(answer.status, Status::Converged, "{name} {case} {angle}");
                let arc = inverse.arcs(&work)[0];
                let (distance, off) = misses(&tool_of(&robot, &plan, &[arc]), &target);
                assert!(distance < 1e-9 && off < 1e-9, "{name} {case}");
                // The first start is the closed form.
                assert_eq!((answer.iterations, answer.starts), (0, 1), "{name} {case}");
            }
        }
    }
}

/// Every answer of a batch is the one of a solve alone, bit by bit, on any number of threads; some targets
/// are out of reach.
fn batches_equal_single_solves_on_any_number_of_threads() {
    let robot = trunk();
    for extensible in [false, true] {
        let plan = plan(&robot, extensible);
        let bounds = bounds(extensible);
        let settings = InverseSettings { starts: 20, seed: 7, ..InverseSettings::default() };
        let inverse = ConstantCurvatureInverse::new(&robot, &plan, &bounds, settings).unwrap();
        let mut u = uniform(66);
        let targets: Vec<Target> = (0..301)
            .map(|i| {
                let mut pose = tool_of(&robot, &plan, &arcs(&LENGTHS, extensible, &mut u));
                pose.translation *= if i % 10 == 0 { 3.0 } else { 1.0 };
                if i % 3 == 0 { Target::Position(pose.translation) } else { Target::frame(&pose) }
            })
            .collect();
        let mut begin = Vec::new();
        for _ in 0..301 {
            let made = displacements(&plan, &arcs(&LENGTHS, extensible, &mut u));
            begin.extend_from_slice(made.as_slice());
        }
        for starts in [&[][..], &begin[..9], &begin] {
            let solve = |threads| {
                let control = Control::default();
                let pool = pool(Some(threads)).unwrap();
                let rows = invert_rows(&inverse, &targets, starts, &pool, &control);
                let rows = rows.unwrap().unwrap();
                assert_eq!(control.done.load(Ordering::Relaxed), 301);
                rows
            };
            let (one, two) = (solve(1), solve(2));
            assert_eq!(one.answers, two.answers);
            assert_eq!(one.displacements, two.displacements);
            let mut place = vec![0.0; 9];
            for (i, target) in targets.iter().enumerate() {
                let mut work = inverse.scratch();
                let row = if starts.len() == 9 { 0 } else { i };
                let start = starts.chunks_exact(9).nth(row);
                let start = start.map(|own| inverse.start(own, None).unwrap());
                assert_eq!(inverse.solve(target, start.as_deref(), &mut work), one.answers[i]);
                inverse.write_displacements(&work, &mut place);
                assert_eq!(place, one.displacements[9 * i..9 * (i + 1)]);
                let made = displacements(&plan, &inverse.arcs(&work));
                assert!((DVector::from_column_slice(&place) - made).amax() < 1e-16);
                let far = i % 10 == 0 && target.position().norm() > 1.25 * 0.1865;
                assert!(!far || one.answers[i].status == Status::Unreachable, "{i}");
            }
            let other = InverseSettings { seed: 8, ..settings };
            let other = ConstantCurvatureInverse::new(&robot, &plan, &bounds, other).unwrap();
            let pool = pool(Some(2)).unwrap();
            let rows = invert_rows(&other, &targets, starts, &pool, &Control::default());
            assert_ne!(rows.unwrap().unwrap().displacements, one.displacements);
        }
        let control = Control::default();
        control.stop.store(true, Ordering::Relaxed);
        let pool = pool(Some(2)).unwrap();
        assert!(invert_rows(&inverse, &targets, &[], &pool, &control).unwrap().is_none());
        assert!(invert_path(&inverse, &targets, None, &control).unwrap().is_none());
        let go = Control::default();
        let none = invert_rows(&inverse, &[], &[], &pool, &go).unwrap();
        assert!(none.unwrap().answers.is_empty());
        begin[9] = f64::NAN;
        let error = invert_rows(&inverse, &targets, &begin, &pool, &go).unwrap_err();
        assert_eq!(error.argument, "start[1]");
        let error = invert_path(&inverse, &targets, Some(&begin[9..18]), &go).unwrap_err();
        assert_eq!(error.argument, "start");
    }
}

/// Arcs along a smooth closed path of 1,000.
fn along(k: usize, extensible: bool) -> Vec<Arc> {
    let t = TAU * k as f64 / 1000.0;
    let z = |i: f64| {
        [1.2 + 0.5 * (t + i).cos(), 0.8 * (2.0 * t + 1.3 * i).sin(), 1.0 + 0.1 * (t - i).sin()]
    };
    let width = if extensible { 3 } else { 2 };
    let z: Vec<f64> = (0..3).flat_map(|i| z(f64::from(i))[..width].to_vec()).collect();
    arcs_of(&z, extensible)
}

#[test]
fn paths_are_followed_smoothly() {
    let robot = trunk();
    for (extensible, posed) in [(false, true), (true, true), (false, false), (true, false)] {
        let plan = plan(&robot, extensible);
        let bounds = bounds(extensible);
        let settings = InverseSettings::default();
        let inverse = ConstantCurvatureInverse::new(&robot, &plan, &bounds, settings).unwrap();
        let targets: Vec<Target> = (0..1000)
            .map(|k| {
                let pose = tool_of(&robot, &plan, &along(k, extensible));
                if posed { Target::frame(&pose) } else { Target::Position(pose.translation) }
            })
            .collect();
        let start = displacements(&plan, &along(0, extensible));
        let control = Control::default();
        let rows = invert_path(&inverse, &targets, Some(start.as_slice()), &control);
        let rows = rows.unwrap().unwrap();
        assert_eq!(control.done.load(Ordering::Relaxed), 1000);
        let (mut most, mut step, mut made) = (0, 0.0_f64, 0.0_f64);
        for k in 0..1000 {
            let answer = rows.answers[k];
            assert_eq!((answer.status, answer.starts), (Status::Converged, 1), "{k}");
            most = most.max(answer.iterations);
            let given = &rows.displacements[9 * k..9 * (k + 1)];
            let (distance, angle) = misses(&tool(&robot, &plan, given), &targets[k]);
            assert!(distance < 1e-9 && angle < 1e-9, "{k}");
            if k > 0 {
                let before = &rows.displacements[9 * (k - 1)..9 * k];
                let gap = |a: &[f64], b: &[f64]| {
                    a.iter().zip(b).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()))
                };
                step = step.max(gap(given, before));
                let [now, last] = [k, k - 1].map(|k| displacements(&plan, &along(k, extensible)));
                made = made.max(gap(now.as_slice(), last.as_slice()));
            }
        }
        println!(
            "extensible {extensible}, poses {posed}: {most} steps at most, \
             largest change {step:.1e} m, {made:.1e} m where the path was made"
        );
        // Of extensible poses the least energy jumps where a bound lets go: only met, not smooth.
        assert!((extensible && posed) || step < 5.0 * made);
    }
}

/// Whether two chains are the same but for rounding.
fn same(a: &[Arc], b: &[Arc]) -> bool {
    a.iter().zip(b).all(|(a, b)| {
        (a.bend - b.bend).amax() < 1e-6 && (a.length - b.length).abs() < 1e-6 * b.length
    })
}

/// All answers for random poses: each meets the target, none twice, in order; how often the arcs that the
/// pose was made of are among them.
fn solutions_are_distinct_and_most_are_found() {
    let robot = trunk();
    let plan = plan(&robot, false);
    let bounds = bounds(false);
    for (starts, targets) in [(200, 100), (2000, 40)] {
        let settings = InverseSettings { starts, ..InverseSettings::default() };
        let inverse = ConstantCurvatureInverse::new(&robot, &plan, &bounds, settings).unwrap();
        let mut u = uniform(67);
        let (mut among, mut count, mut hits) = (0, 0, 0);
        for case in 0..targets {
            let made = arcs(&LENGTHS, false, &mut u);
            let target = Target::frame(&tool_of(&robot, &plan, &made));
            let solutions = inverse.solutions(&target);
            for (i, solution) in solutions.iter().enumerate() {
                assert_eq!(solution.answer.status, Status::Converged);
                assert!(inside(&solution.arcs, &bounds), "{case}");
                let given = solution.displacements.clone();
                let (distance, angle) = misses(&tool(&robot, &plan, &given), &target);
                assert!(distance < 1e-9 && angle < 1e-9, "{case}");
                let others = &solutions[..i];
                assert!(others.iter().all(|other| !same(&other.arcs, &solution.arcs)), "{case}");
                assert!(others.last().is_none_or(|other| other.energy <= solution.energy));
                hits += solution.hits;
            }
            count += solutions.len();
            among += usize::from(solutions.iter().any(|solution| same(&solution.arcs, &made)));
        }
        println!(
            "{starts} starts: {among} of {targets} among the answers, {:.2} answers and {:.1} hits on \
             average",
            count as f64 / targets as f64,
            hits as f64 / targets as f64
        );
        assert!(100 * among >= 95 * targets);
    }
}

crate::common::slow!(
    batches_equal_single_solves_on_any_number_of_threads,
    solutions_are_distinct_and_most_are_found,
);
