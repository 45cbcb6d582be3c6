//! Small dense systems: inner products, Cholesky factors, triangular solves.

/// `sum_i a_i b_i`.
#[inline(always)]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (x, y)| sum + x * y)
}

/// Cholesky factor in place of the lower triangle, row by row, its diagonal inverted; false unless
/// positive definite.
pub(crate) fn cholesky(matrix: &mut [f64], size: usize) -> bool {
    for i in 0..size {
        for j in 0..=i {
            let (above, below) = matrix.split_at_mut(i * size);
            let sum = if j == i {
                below[j] - dot(&below[..j], &below[..j])
            } else {
                below[j] - dot(&below[..j], &above[j * size..j * size + j])
            };
            if j < i {
                below[j] = sum * above[j * size + j];
            } else if sum > 0.0 {
                below[j] = 1.0 / sum.sqrt();
            } else {
                return false;
            }
        }
    }
    true
}

/// Solves `L x = x` in place.
pub(crate) fn forward(factor: &[f64], size: usize, x: &mut [f64]) {
    for i in 0..size {
        let row = &factor[i * size..i * size + i];
        x[i] = (x[i] - dot(row, &x[..i])) * factor[i * size + i];
    }
}

/// Solves `L^T x = x` in place.
pub(crate) fn backward(factor: &[f64], size: usize, x: &mut [f64]) {
    for i in (0..size).rev() {
        x[i] *= factor[i * size + i];
        let value = x[i];
        for (entry, l) in x[..i].iter_mut().zip(&factor[i * size..i * size + i]) {
            *entry -= l * value;
        }
    }
}
