//! Linear least squares of small systems, minimum-norm where they are deficient.

use nalgebra::{DMatrix, DVector};

/// Singular values below this share of the largest count as zero.
const DEFICIENT: f64 = 1e-10;

/// The Moore-Penrose inverse of a matrix, by its singular value decomposition.
///
/// ```
/// use nalgebra::{DMatrix, DVector};
/// use tdcr::solve::pseudo_inverse::PseudoInverse;
///
/// // One equation, two unknowns: the shortest answer.
/// let inverse = PseudoInverse::new(&DMatrix::from_row_slice(1, 2, &[1.0, 1.0]));
/// assert_eq!(inverse.rank, 1);
/// assert!((inverse.solve(&DVector::from_vec(vec![2.0])) - DVector::from_vec(vec![1.0; 2])).amax() < 1e-14);
/// ```
#[derive(Clone, Debug)]
pub struct PseudoInverse {
    /// The inverse itself: columns x rows of the matrix.
    pub matrix: DMatrix<f64>,
    /// Largest over smallest singular value that counts; 1 for an empty matrix.
    pub condition: f64,
    /// Number of singular values that count.
    pub rank: usize,
}

impl PseudoInverse {
    /// Pseudo-inverse of a matrix with finite entries.
    #[must_use]
    pub fn new(matrix: &DMatrix<f64>) -> Self {
        let (rows, columns) = matrix.shape();
        let mut inverse = DMatrix::zeros(columns, rows);
        if rows == 0 || columns == 0 {
            return Self { matrix: inverse, condition: 1.0, rank: 0 };
        }
        let decomposition = matrix.clone().svd(true, true);
        let values = &decomposition.singular_values;
        let largest = values.max();
        let mut smallest = largest;
        let mut rank = 0;
        if let (Some(u), Some(v)) = (&decomposition.u, &decomposition.v_t) {
            for (k, &value) in values.iter().enumerate() {
                if value > DEFICIENT * largest {
                    rank += 1;
                    smallest = smallest.min(value);
                    inverse += v.row(k).transpose() * u.column(k).transpose() / value;
                }
            }
        }
        // The decomposition leaves some 1e-14; one step of Ben-Israel and Cohen's iteration, which
        // converges quadratically and keeps the rank, leaves the rounding.
        let twice = &inverse * 2.0;
        inverse = twice - &inverse * matrix * &inverse;
        let condition = if largest > 0.0 { largest / smallest } else { 1.0 };
        Self { matrix: inverse, condition, rank }
    }

    /// The least-squares answer of minimum norm.
    #[must_use]
    pub fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        &self.matrix * right
    }
}

/// Orthonormal directions that a matrix with finite entries takes to zero.
#[must_use]
pub fn null_space(matrix: &DMatrix<f64>) -> Vec<DVector<f64>> {
    let (rows, columns) = matrix.shape();
    // At least square, so that the decomposition has all directions.
    let padded = matrix.clone().resize(rows.max(columns), columns, 0.0);
    if columns == 0 {
        return Vec::new();
    }
    let decomposition = padded.svd(false, true);
    let values = &decomposition.singular_values;
    let small = DEFICIENT * values.max();
    let directions = decomposition.v_t.iter().flat_map(|v| v.row_iter());
    let lost = values.iter().zip(directions).filter(|(value, _)| **value <= small);
    lost.map(|(_, direction)| direction.transpose()).collect()
}
