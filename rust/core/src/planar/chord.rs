//! The chord of an arc of unit length, as a function of its turn.

use nalgebra::Complex;

/// The plane as complex numbers: x along the start of the arc, y to its left.
pub(super) type Point = Complex<f64>;

/// Below this turn \[rad\] the closed forms lose digits and the series are used.
const SERIES: f64 = 1.0;

/// Terms that the series need there: `1/20!` is below the rounding.
const TERMS: usize = 19;

/// End of an arc of length one that starts at the origin along x and turns by `turn`, with its first
/// two derivatives by the turn: `e(t) = (exp(it) - 1)/(it)`. The n-th derivative is at most
/// `1/(n + 1)` for any turn, being the mean of `(is)^n exp(ist)` over the arc.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chord {
    pub(super) value: Point,
    pub(super) first: Point,
    pub(super) second: Point,
    /// `exp(it)`: the heading at the end.
    pub(super) heading: Point,
}

impl Chord {
    pub(super) fn new(turn: f64) -> Self {
        let (sin, cos) = turn.sin_cos();
        let heading = Point::new(cos, sin);
        if turn.abs() < SERIES {
            return Self::series(turn, heading);
        }
        let half = (0.5 * turn).sin();
        let inverse = 1.0 / turn;
        let value = Point::new(sin * inverse, 2.0 * half * half * inverse);
        let first = (heading - value) * inverse;
        let second = (Point::new(-sin, cos) - first * 2.0) * inverse;
        Self { value, first, second, heading }
    }

    /// `e = sum (it)^n/(n + 1)!`, term by term for the derivatives.
    fn series(turn: f64, heading: Point) -> Self {
        let mut sums = [Point::new(0.0, 0.0); 3];
        // (it)^n/(n + 1)!, as its modulus; the powers of i turn it.
        let mut term = 1.0;
        for n in 0..TERMS {
            let k = n as f64;
            // Factors that take 1/(n+1)! to (n+1)/(n+2)! and to (n+1)(n+2)/(n+3)!.
            let first = (k + 1.0) / (k + 2.0);
            let terms = [term, term * first, term * (k + 1.0) / (k + 3.0)];
            for (sum, size) in sums.iter_mut().zip(terms) {
                match n % 4 {
                    0 => sum.re += size,
                    1 => sum.im += size,
                    2 => sum.re -= size,
                    _ => sum.im -= size,
                }
            }
            term *= turn / (k + 2.0);
        }
        let [value, first, second] = sums;
        Self { value, first: Point::new(-first.im, first.re), second: -second, heading }
    }
}

/// `sin(x)/x` and its derivative by x, from x and the sine and cosine of it.
pub(super) fn sinc(x: f64, sin: f64, cos: f64) -> (f64, f64) {
    if x.abs() < 0.1 {
        let s = x * x;
        let value = 1.0 - s / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0)));
        let slope =
            -x / 3.0 * (1.0 - s / 10.0 * (1.0 - s / 28.0 * (1.0 - s / 54.0 * (1.0 - s / 88.0))));
        return (value, slope);
    }
    let value = sin / x;
    (value, (cos - value) / x)
}

/// `a x b`, the area that two vectors span.
pub(super) fn cross(a: Point, b: Point) -> f64 {
    a.re * b.im - a.im * b.re
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The series and the closed forms meet, and both are the integral of the heading.
    #[test]
    fn chords_and_their_derivatives() {
        for k in -900..900 {
            let turn = f64::from(k) * 0.007;
            let chord = Chord::new(turn);
            // Gauss-Legendre would do; the mean of 2000 midpoints is good to 1e-6.
            let n = 2000;
            let mut sums = [Point::new(0.0, 0.0); 3];
            for i in 0..n {
                let s = (f64::from(i) + 0.5) / f64::from(n);
                let heading = Point::new(0.0, s * turn).exp();
                sums[0] += heading;
                sums[1] += heading * Point::new(0.0, s);
                sums[2] -= heading * s * s;
            }
            for (sum, got) in sums.iter().zip([chord.value, chord.first, chord.second]) {
                assert!((sum / f64::from(n) - got).norm() < 2e-6, "{turn}");
            }
        }
        let (below, above) = (Chord::new(SERIES - 1e-15), Chord::new(SERIES + 1e-15));
        assert!((below.value - above.value).norm() < 2e-15);
        assert!((below.first - above.first).norm() < 2e-15);
        assert!((below.second - above.second).norm() < 4e-15);
        for x in [0.1_f64, -0.1, 1e-9, 0.0] {
            let (value, slope) = sinc(x, x.sin(), x.cos());
            let (near, other) = sinc(x * 1.000_000_1, (x * 1.000_000_1).sin(), x.cos());
            assert!((value - near).abs() < 1e-8 && (slope - other).abs() < 1e-7);
        }
    }
}
