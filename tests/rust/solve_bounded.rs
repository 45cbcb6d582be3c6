//! Quadratic programs with lower bounds: optimality conditions, also of singular ones.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::solve::bounded_program::BoundedProgram;

#[test]
fn answers_meet_the_conditions_of_optimality() {
    let mut draw = ChaCha8Rng::seed_from_u64(1);
    let mut solver = BoundedProgram::default();
    let mut at_bounds = 0;
    for case in 0..2000 {
        let size = draw.random_range(1..10_usize);
        // Some matrices have directions that cost nothing, and right-hand sides that do not pull there.
        let rank = if case % 3 == 0 { size.div_ceil(2) } else { size + 2 };
        let rows = DMatrix::from_fn(rank, size, |_, _| draw.random_range(-1.0..1.0));
        let ridge = DMatrix::identity(size, size) * 1e-14;
        let matrix = rows.transpose() * &rows + ridge;
        let right = rows.transpose() * DVector::from_fn(rank, |_, _| draw.random_range(-1.0..1.0));
        let lower = DVector::from_fn(size, |_, _| {
            if draw.random::<f64>() < 0.5 { 0.0 } else { -draw.random::<f64>() }
        });
        let solved =
            solver.solve(matrix.as_slice(), right.as_slice(), lower.as_slice(), |k| lower[k] < 0.0);
        assert!(solved, "case {case}");
        let step = DVector::from_column_slice(&solver.step);
        let slope = &matrix * &step - right;
        for k in 0..size {
            assert!(step[k] >= lower[k]);
            if step[k] > lower[k] {
                assert!(slope[k].abs() < 1e-9, "case {case}: {slope}");
            } else {
                assert!(slope[k] > -1e-9, "case {case}: {slope}");
                at_bounds += 1;
            }
        }
    }
    assert!(at_bounds > 1000);
}

/// A slack tendon's distance from its bound says nothing about how exact another's slope is.
#[test]
fn a_variable_far_onto_its_bound_hides_no_other() {
    let mut solver = BoundedProgram::default();
    for far in [-1.0, -1e15, -1e300] {
        assert!(solver.solve(&[1.0, 0.1, 0.1, 1.0], &[1e-3, far], &[0.0; 2], |_| false));
        assert_eq!(solver.step, [1e-3, 0.0]);
    }
}

#[test]
fn what_is_not_a_number_is_refused() {
    let mut solver = BoundedProgram::default();
    assert!(!solver.solve(&[f64::NAN], &[1.0], &[-1.0], |_| true));
    assert!(!solver.solve(&[-1.0], &[1.0], &[-1.0], |_| true));
    assert!(solver.solve(&[], &[], &[], |_| true));
}
