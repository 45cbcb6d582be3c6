//! The quadratic model on the linearised constraints, solved in their null space.

use nalgebra::{SMatrix, SVector};

use super::problem::Linearization;

/// A step of the quadratic model.
pub(super) struct Step<const N: usize, const M: usize> {
    pub(super) full: SVector<f64, N>,
    /// Multipliers of the quadratic model: those expected at the end of the step. With them the merit
    /// takes the full step in the end phase; with the current ones it would halve it.
    pub(super) multipliers: SVector<f64, M>,
    /// `step . H step` with the Hessian that was used.
    pub(super) curvature: f64,
    /// The Hessian was used as it is: not shifted to make it convex.
    pub(super) exact: bool,
}

/// An orthonormal basis adapted to the constraint gradients: `Q^T J^T = [R; 0]` by Householder
/// reflections, so the last `N - M` coordinates span the null space.
pub(super) struct Frame<const N: usize, const M: usize> {
    /// Reflector j in column j from row j down; above it the column of R.
    reflectors: SMatrix<f64, N, M>,
    /// Reflection j is `I - scales_j v v^T`.
    scales: SVector<f64, M>,
    inverse_diagonal: SVector<f64, M>,
    /// Gradient of the objective in the adapted basis.
    gradient: SVector<f64, N>,
    /// Least-squares multipliers at the point.
    pub(super) multipliers: SVector<f64, M>,
}

impl<const N: usize, const M: usize> Frame<N, M> {
    /// Before the first point.
    pub(super) fn new() -> Self {
        Self {
            reflectors: SMatrix::zeros(),
            scales: SVector::zeros(),
            inverse_diagonal: SVector::zeros(),
            gradient: SVector::zeros(),
            multipliers: SVector::zeros(),
        }
    }

    /// Adapts the basis to a point.
    #[inline(always)]
    pub(super) fn adapt(&mut self, at: &Linearization<N, M>) {
        let frame = self;
        frame.reflectors = at.jacobian_transposed;
        frame.gradient = at.gradient;
        // Column j keeps its reflector from row j down (unscaled: one root and one division each)
        // and its part of the triangle above.
        for j in 0..M {
            let mut square = 0.0;
            for i in j..N {
                square += frame.reflectors[(i, j)] * frame.reflectors[(i, j)];
            }
            let pivot = frame.reflectors[(j, j)];
            let diagonal = -square.sqrt().copysign(pivot);
            frame.reflectors[(j, j)] = pivot - diagonal;
            // Two inverses from one division.
            let size = square - pivot * diagonal;
            let both = 1.0 / (size * diagonal);
            frame.scales[j] = both * diagonal;
            frame.inverse_diagonal[j] = both * size;
            for k in (j + 1)..M {
                let mut share = 0.0;
                for i in j..N {
                    share += frame.reflectors[(i, j)] * frame.reflectors[(i, k)];
                }
                share *= frame.scales[j];
                for i in j..N {
                    frame.reflectors[(i, k)] -= share * frame.reflectors[(i, j)];
                }
            }
            frame.gradient = frame.reflect(j, frame.gradient);
        }
        for i in (0..M).rev() {
            let mut value = -frame.gradient[i];
            for k in (i + 1)..M {
                value -= frame.reflectors[(i, k)] * frame.multipliers[k];
            }
            frame.multipliers[i] = value * frame.inverse_diagonal[i];
        }
    }

    /// The reflection of column j applied to a vector.
    #[inline(always)]
    fn reflect(&self, j: usize, mut vector: SVector<f64, N>) -> SVector<f64, N> {
        let mut share = 0.0;
        for i in j..N {
            share += self.reflectors[(i, j)] * vector[i];
        }
        share *= self.scales[j];
        for i in j..N {
            vector[i] -= share * self.reflectors[(i, j)];
        }
        vector
    }

    /// Largest component of the projected gradient.
    pub(super) fn stationarity(&self) -> f64 {
        (M..N).fold(0.0, |largest, i| self.gradient[i].abs().max(largest))
    }

    /// The minimiser of the quadratic model on the linearised constraints.
    pub(super) fn newton_step(
        &self,
        at: &Linearization<N, M>,
        mut h: SMatrix<f64, N, N>,
    ) -> Option<Step<N, M>> {
        self.rotate(&mut h);
        let mut step = self.range_part(at);
        let mut right = SVector::<f64, N>::zeros();
        for i in M..N {
            right[i] = -self.gradient[i];
            for k in 0..M {
                right[i] -= h[(i, k)] * step[k];
            }
        }
        let exact = null_space_solve::<N, M>(&mut h, &right, &mut step)?;
        let hs = h * step;
        let curvature = step.dot(&hs);
        let mut multipliers = SVector::<f64, M>::zeros();
        for i in (0..M).rev() {
            let mut value = -self.gradient[i] - hs[i];
            for k in (i + 1)..M {
                value -= self.reflectors[(i, k)] * multipliers[k];
            }
            multipliers[i] = value * self.inverse_diagonal[i];
        }
        for j in (0..M).rev() {
            step = self.reflect(j, step);
        }
        step.iter().all(|x| x.is_finite()).then_some(Step {
            full: step,
            multipliers,
            curvature,
            exact,
        })
    }

    /// Into the adapted basis: H <- Q^T H Q, one symmetric rank-two update per reflection.
    #[inline(always)]
    fn rotate(&self, h: &mut SMatrix<f64, N, N>) {
        for j in 0..M {
            let mut u = SVector::<f64, N>::zeros();
            for k in j..N {
                for i in 0..N {
                    u[i] += h[(i, k)] * self.reflectors[(k, j)];
                }
            }
            u *= self.scales[j];
            let mut inner = 0.0;
            for i in j..N {
                inner += u[i] * self.reflectors[(i, j)];
            }
            inner *= 0.5 * self.scales[j];
            for i in j..N {
                u[i] -= inner * self.reflectors[(i, j)];
            }
            for k in j..N {
                for i in 0..N {
                    h[(i, k)] -= u[i] * self.reflectors[(k, j)];
                }
            }
            for k in 0..N {
                for i in j..N {
                    h[(i, k)] -= self.reflectors[(i, j)] * u[k];
                }
            }
        }
    }

    /// Range-space part of a step in the adapted basis: `R^T y = -c`.
    fn range_part(&self, at: &Linearization<N, M>) -> SVector<f64, N> {
        let mut step = SVector::<f64, N>::zeros();
        for i in 0..M {
            let mut value = -at.constraints[i];
            for k in 0..i {
                value -= self.reflectors[(k, i)] * step[k];
            }
            step[i] = value * self.inverse_diagonal[i];
        }
        step
    }
}

/// Solves the null-space block of `h` for the last `N - M` entries of `step`, shifting the block
/// until it is positive definite; returns whether no shift was needed. `None` when nothing finite
/// comes out.
fn null_space_solve<const N: usize, const M: usize>(
    h: &mut SMatrix<f64, N, N>,
    right: &SVector<f64, N>,
    step: &mut SVector<f64, N>,
) -> Option<bool> {
    let scale = (M..N).fold(f64::MIN_POSITIVE, |s, i| h[(i, i)].abs().max(s));
    if !scale.is_finite() {
        return None;
    }
    let mut shift = 0.0;
    for _ in 0..SHIFTS {
        if let Some((l, inverse)) = factor::<N, M>(h, shift) {
            for i in M..N {
                h[(i, i)] += shift;
            }
            for i in M..N {
                step[i] = right[i];
                for k in M..i {
                    step[i] -= l[(i, k)] * step[k];
                }
            }
            for i in (M..N).rev() {
                step[i] *= inverse[i];
                for k in (i + 1)..N {
                    step[i] -= l[(k, i)] * step[k];
                }
            }
            return Some(shift == 0.0);
        }
        shift = if shift == 0.0 { 1e-3 * scale } else { 4.0 * shift };
    }
    None
}

/// Shifts tried: 4^60 times the first is beyond any cancellation.
const SHIFTS: usize = 60;

/// `L D L^T` of the null-space block plus `shift` on its diagonal: the unit lower factor and the
/// inverses of D. `None` unless it is positive definite to rounding.
fn factor<const N: usize, const M: usize>(
    h: &SMatrix<f64, N, N>,
    shift: f64,
) -> Option<(SMatrix<f64, N, N>, SVector<f64, N>)> {
    let mut l = SMatrix::<f64, N, N>::zeros();
    // Column j of L D, before its division by D_j.
    let mut w = SMatrix::<f64, N, N>::zeros();
    let mut inverse = SVector::<f64, N>::zeros();
    for j in M..N {
        for i in j..N {
            let mut value = if i == j { h[(j, j)] + shift } else { h[(i, j)] };
            for k in M..j {
                value -= w[(i, k)] * l[(j, k)];
            }
            w[(i, j)] = value;
        }
        let diagonal = w[(j, j)];
        if diagonal <= 1e-14 * h[(j, j)].abs() || !diagonal.is_finite() {
            return None;
        }
        inverse[j] = 1.0 / diagonal;
        for i in (j + 1)..N {
            l[(i, j)] = w[(i, j)] * inverse[j];
        }
    }
    Some((l, inverse))
}
