//! Quadratic programs against the enumeration of all active sets.

use nalgebra::{DMatrix, DVector};
use tdcr::solve::quadratic_program::{Outcome, QuadraticProgram, Rows};

use crate::inverse_common::uniform;

/// A program with its rows as matrices.
struct Program {
    size: usize,
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
    normals: Vec<DVector<f64>>,
    offsets: Vec<f64>,
    equalities: usize,
}

impl Program {
    fn value(&self, p: &DVector<f64>) -> f64 {
        0.5 * p.dot(&(&self.hessian * p)) + self.gradient.dot(p)
    }

    fn meets(&self, p: &DVector<f64>, tolerance: f64) -> bool {
        self.normals.iter().zip(&self.offsets).enumerate().all(|(k, (normal, offset))| {
            let off = normal.dot(p) - offset;
            (if k < self.equalities { off.abs() } else { off }) <= tolerance
        })
    }

    /// The best of the points that are stationary on some set of active rows and meet the others.
    fn by_enumeration(&self) -> Option<DVector<f64>> {
        let mut best: Option<DVector<f64>> = None;
        for set in 0..1_usize << (self.normals.len() - self.equalities) {
            let active: Vec<usize> = (0..self.normals.len())
                .filter(|k| *k < self.equalities || set >> (k - self.equalities) & 1 == 1)
                .collect();
            let (n, m) = (self.size, active.len());
            let mut matrix = DMatrix::zeros(n + m, n + m);
            let mut right = DVector::zeros(n + m);
            matrix.view_mut((0, 0), (n, n)).copy_from(&self.hessian);
            right.rows_mut(0, n).copy_from(&-&self.gradient);
            for (row, &k) in active.iter().enumerate() {
                matrix.view_mut((0, n + row), (n, 1)).copy_from(&self.normals[k]);
                matrix.view_mut((n + row, 0), (1, n)).copy_from(&self.normals[k].transpose());
                right[n + row] = self.offsets[k];
            }
            // The pseudo-inverse takes dependent rows as well.
            let Ok(both) = matrix.svd(true, true).solve(&right, 1e-11) else { continue };
            let point = both.rows(0, n).into_owned();
            let better = best.as_ref().is_none_or(|b| self.value(&point) < self.value(b));
            if self.meets(&point, 1e-8) && better {
                best = Some(point);
            }
        }
        best
    }

    fn solve(&self, work: &mut QuadraticProgram) -> (Outcome, Rows) {
        let mut rows = Rows::default();
        for (normal, offset) in self.normals.iter().zip(&self.offsets) {
            rows.push(self.size, *offset).copy_from_slice(normal.as_slice());
        }
        rows.equalities = self.equalities;
        // Above the diagonal nothing is read.
        let lower = |i, j| if j > i { f64::NAN } else { self.hessian[(i, j)] };
        let hessian: Vec<f64> =
            (0..self.size * self.size).map(|k| lower(k / self.size, k % self.size)).collect();
        assert!(work.factor(&hessian, self.size));
        work.gradient = self.gradient.as_slice().to_vec();
        (work.solve(&rows), rows)
    }
}

/// Rows of one of six kinds around a point that meets them, or that contradict each other.
fn random_program(kind: usize, u: &mut impl FnMut(f64, f64) -> f64) -> Program {
    let size = 1 + u(0.0, 5.0) as usize;
    let flat = DMatrix::from_fn(size, size, |_, _| u(-1.0, 1.0));
    let floor = 10f64.powf(u(-4.0, 0.0));
    let hessian = flat.transpose() * &flat + DMatrix::identity(size, size) * floor;
    let gradient = DVector::from_fn(size, |_, _| u(-1.0, 1.0));
    let inside = DVector::from_fn(size, |_, _| u(-1.0, 1.0));
    let (mut normals, mut offsets) = (Vec::new(), Vec::new());
    let equations = if kind == 0 { 0 } else { u(0.0, size as f64) as usize };
    for _ in 0..equations {
        let normal: DVector<f64> = DVector::from_fn(size, |_, _| u(-1.0, 1.0)).normalize();
        offsets.push(normal.dot(&inside));
        normals.push(normal);
    }
    if equations > 0 && (kind == 2 || kind == 3) {
        // Depends on the others; contradicts them in kind 3.
        let mix: Vec<f64> = (0..equations).map(|_| u(-1.0, 1.0)).collect();
        let sum: DVector<f64> =
            normals.iter().zip(&mix).fold(DVector::zeros(size), |sum, (n, m)| sum + n * *m);
        let off = if kind == 3 { u(0.01, 1.0) } else { 0.0 };
        offsets.push(sum.dot(&inside) / sum.norm() + off);
        normals.push(sum.normalize());
    }
    let equalities = normals.len();
    for _ in 0..u(0.0, 7.0) as usize {
        let normal: DVector<f64> = DVector::from_fn(size, |_, _| u(-1.0, 1.0)).normalize();
        // All through one point in kind 4; around any point, or none, in kind 0.
        let room = match kind {
            0 => u(-1.0, 1.5),
            4 => 0.0,
            _ => u(0.0, 0.5),
        };
        offsets.push(normal.dot(&inside) + room);
        normals.push(normal);
        if kind == 4 && normals.len() - equalities < 6 && u(0.0, 1.0) < 0.3 {
            // Twice, or with its opposite: an equation in two halves.
            let (sign, last) = (if u(0.0, 1.0) < 0.5 { 1.0 } else { -1.0 }, normals.len() - 1);
            normals.push(&normals[last] * sign);
            offsets.push(offsets[last] * sign);
        }
    }
    if kind == 5 {
        normals.push(DVector::zeros(size));
        offsets.push(u(0.0, 1.0));
    }
    Program { size, hessian, gradient, normals, offsets, equalities }
}

fn quadratic_programs_match_the_enumeration_of_active_sets() {
    let mut u = uniform(41);
    let mut work = QuadraticProgram::default();
    let mut counts = [[0; 2]; 6];
    for case in 0..30_000 {
        let kind = case % 6;
        let program = random_program(kind, &mut u);
        let (outcome, rows) = program.solve(&mut work);
        let best = program.by_enumeration();
        counts[kind][usize::from(best.is_none())] += 1;
        let Some(best) = best else {
            assert_eq!(outcome, Outcome::Infeasible, "{case}");
            continue;
        };
        assert_eq!(outcome, Outcome::Solved, "{case} kind {kind}");
        let step = DVector::from_column_slice(&work.step);
        assert!((&step - &best).amax() < 1e-6, "{case} {step} {best}");
        assert!(program.meets(&step, 1e-11), "{case}");
        // Stationarity, signs, complementarity.
        let mut left = &program.hessian * &step + &program.gradient;
        let strongest = work.multipliers.iter().fold(1.0_f64, |most, m| most.max(m.abs()));
        for (&row, multiplier) in work.active.iter().zip(&work.multipliers) {
            let normal = DVector::from_column_slice(rows.normal(program.size, row));
            assert!((normal.dot(&step) - rows.offsets[row]).abs() < 1e-10 * strongest, "{case}");
            assert!(row < rows.equalities || *multiplier >= -1e-12 * strongest, "{case}");
            left += normal * *multiplier;
        }
        assert!(left.amax() < 1e-10 * strongest, "{case} {left} {strongest}");
    }
    println!("feasible and infeasible programs by kind: {counts:?}");
    assert!(counts[0][1] > 500 && counts[3][1] > 1000 && counts[4][0] > 4500);
}

/// Least squares with freedom left, barely damped, in a box: independent rows are nearly parallel in the
/// metric of such a Hessian.
#[test]
fn nearly_singular_programs_are_solved_in_a_box() {
    let mut u = uniform(44);
    let mut work = QuadraticProgram::default();
    for case in 0..10_000 {
        let size = 3 + case % 7;
        let jacobian = DMatrix::from_fn(1 + case % 3, size, |_, _| u(-1.0, 1.0));
        let damping = 1e-13 * jacobian.norm_squared();
        let hessian = jacobian.transpose() * &jacobian + DMatrix::identity(size, size) * damping;
        let residual = DVector::from_fn(jacobian.nrows(), |_, _| u(-1.0, 1.0));
        let mut program = Program {
            size,
            gradient: jacobian.transpose() * residual * 10f64.powf(u(-8.0, 0.0)),
            hessian,
            normals: vec![],
            offsets: vec![],
            equalities: 0,
        };
        for i in 0..2 * size {
            let sign = if i < size { 1.0 } else { -1.0 };
            program
                .normals
                .push(DVector::from_fn(size, |k, _| if k == i % size { sign } else { 0.0 }));
            // At the corner, on the way to it, or far.
            program.offsets.push(if u(0.0, 1.0) < 0.4 { 0.0 } else { u(0.0, 0.5) });
        }
        let (outcome, rows) = program.solve(&mut work);
        assert_eq!(outcome, Outcome::Solved, "{case}");
        let step = DVector::from_column_slice(&work.step);
        assert!(program.meets(&step, 1e-10), "{case}");
        let mut left = &program.hessian * &step + &program.gradient;
        for (&row, multiplier) in work.active.iter().zip(&work.multipliers) {
            assert!(*multiplier >= -1e-12, "{case}");
            left += DVector::from_column_slice(rows.normal(size, row)) * *multiplier;
        }
        assert!(left.amax() < 1e-8, "{case} {left}");
    }
}

crate::common::slow!(quadratic_programs_match_the_enumeration_of_active_sets,);
