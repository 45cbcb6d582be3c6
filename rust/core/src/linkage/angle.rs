//! Squared angle between two unit vectors, from the square of their distance.
//!
//! `arccos` of a dot product has an infinite slope at angle 0, where every trunk starts. The squared
//! distance `z = |u - v|^2 = 2 - 2 u.v` has none: the squared angle is the analytic function
//! `F(z) = 4 asin(sqrt(z)/2)^2 = z + z^2/12 + z^3/90 + ...`, and `z` is known to full relative
//! precision when the difference of the vectors is.

/// `F = angle^2` and its derivatives by `z`, the squared distance of the unit vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SquaredAngle {
    /// `angle^2` \[rad^2\].
    pub(super) value: f64,
    /// `dF/dz`, which is `angle / sin(angle)`.
    pub(super) first: f64,
    /// `d2F/dz2`.
    pub(super) second: f64,
}

/// Above this the closed form is precise enough; below, ten terms of the series are.
const SERIES_BELOW: f64 = 0.06;

/// Coefficients of the terms n = 2 ... 10: of the value at z^(n-1) (times z), of the first derivative
/// at z^(n-1), of the second at z^(n-2).
const TERMS: [[f64; 3]; 9] = {
    // n^2 binom(2n, n) / 2.
    let d = [12.0, 90.0, 560.0, 3150.0, 16_632.0, 84_084.0, 411_840.0, 1_969_110.0, 9_237_800.0];
    let mut terms = [[0.0; 3]; 9];
    let mut i = 0;
    let mut n = 2.0;
    while i < 9 {
        terms[i] = [1.0 / d[i], n / d[i], n * (n - 1.0) / d[i]];
        i += 1;
        n += 1.0;
    }
    terms
};

impl SquaredAngle {
    /// From `z` in [0, 4].
    #[inline]
    pub(super) fn from_squared_distance(z: f64) -> Self {
        if z < SERIES_BELOW { Self::series(z) } else { Self::closed_form(z) }
    }

    /// `4 asin(x/2)^2 = 2 sum x^(2n) / (n^2 binom(2n, n))`: terms fall like (z/4)^n.
    fn series(z: f64) -> Self {
        let mut value = 0.0;
        let mut first = 0.0;
        let mut second = 0.0;
        for term in TERMS.iter().rev() {
            value = value * z + term[0];
            first = first * z + term[1];
            second = second * z + term[2];
        }
        // The linear term of the value has no second derivative: its row holds the next one's.
        Self { value: (value * z + 1.0) * z, first: first * z + 1.0, second }
    }

    fn closed_form(z: f64) -> Self {
        let half = (0.5 * z.sqrt()).min(1.0);
        let angle = 2.0 * half.asin();
        let cosine = 1.0 - 0.5 * z;
        // At a half turn the slope is infinite; a large finite one still points downhill.
        let sine = (z * (1.0 - 0.25 * z)).max(1e-24).sqrt();
        let first = angle / sine;
        Self { value: angle * angle, first, second: 0.5 * (1.0 - first * cosine) / (sine * sine) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_meets_closed_form() {
        for z in [0.03, 0.0599, 0.06, 0.07] {
            let (s, c) = (SquaredAngle::series(z), SquaredAngle::closed_form(z));
            assert!((s.value - c.value).abs() < 1e-15, "{z}");
            assert!((s.first - c.first).abs() < 4e-15, "{z}");
            assert!((s.second - c.second).abs() < 2e-13, "{z}");
        }
    }

    #[test]
    fn derivatives_are_those_of_the_value() {
        for z in [1e-3, 0.05, 0.2, 1.0, 2.0, 3.5] {
            let h = 1e-5 * z;
            let f = SquaredAngle::from_squared_distance;
            let (lo, hi, mid) = (f(z - h), f(z + h), f(z));
            assert!(((hi.value - lo.value) / (2.0 * h) / mid.first - 1.0).abs() < 1e-8);
            assert!(((hi.first - lo.first) / (2.0 * h) / mid.second - 1.0).abs() < 1e-7);
        }
    }

    #[test]
    fn quarter_turn_is_exact() {
        let quarter = SquaredAngle::from_squared_distance(2.0);
        let pi = std::f64::consts::PI;
        assert!((quarter.value - pi * pi / 4.0).abs() < 1e-15);
        assert!((quarter.first - pi / 2.0).abs() < 1e-15);
    }
}
