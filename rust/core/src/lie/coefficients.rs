//! The coefficients of the maps of rotations as functions of the angle: the one place with series.
//!
//! They are smooth functions of `x = t²`, so `x` is all that is needed of a rotation vector. That it
//! underflows to 0 below 1e-162 does no harm: every coefficient is then at its limit.

use nalgebra::Vector3;

/// Above this squared angle (3.5 rad) the closed forms lose less than three bits by cancellation,
/// and less the larger the angle; every `log` is below.
const SERIES_BELOW: f64 = 12.25;
/// Terms of the series that reach rounding at `SERIES_BELOW`.
const TERMS: usize = 16;
/// Below this squared angle (0.5 rad, more than a subsegment usually bends) a few terms do.
const SHORT_BELOW: f64 = 0.25;
const SHORT_TERMS: usize = 7;

type Series = [f64; TERMS];
const C: Series = series(3, 0);
const B_SLOPE: Series = series(4, 1);
const B_BEND: Series = series(6, 2);
const C_SLOPE: Series = series(5, 1);
const C_BEND: Series = series(7, 2);
const D_SLOPE: Series = series(6, 1);

/// The coefficients of `Σ (−x)ʲ / (2j + k)!`, each times `2j + 2` after one derivative `d/dt / t`, and
/// times `2j + 4` after another.
const fn series(k: usize, derivatives: usize) -> Series {
    let mut terms = [0.0; TERMS];
    let mut factorial = 1.0;
    let mut n = 1; // `factorial` is (n − 1)!, exact up to 22!, beyond which terms are tiny.
    let mut j = 0;
    while j < TERMS {
        while n <= 2 * j + k {
            factorial *= n as f64;
            n += 1;
        }
        let weight = match derivatives {
            0 => 1,
            1 => 2 * j + 2,
            _ => (2 * j + 2) * (2 * j + 4),
        };
        let sign = if j % 2 == 0 { 1.0 } else { -1.0 };
        terms[j] = sign * weight as f64 / factorial;
        j += 1;
    }
    terms
}

/// An angle, read once from a rotation vector.
pub(crate) struct Angle {
    /// The squared angle.
    x: f64,
    /// `sin(t/2) / (t/2)` and `cos(t/2)`: with half the angle, 1 − cos t needs no difference.
    half_sinc: f64,
    half_cos: f64,
}

impl Angle {
    pub(crate) fn of(w: &Vector3<f64>) -> Self {
        Self::of_square(w.norm_squared())
    }

    /// Coefficients at a squared angle.
    pub(crate) fn of_square(x: f64) -> Self {
        let half = 0.5 * x.sqrt();
        let (sin, half_cos) = half.sin_cos();
        let half_sinc = if x == 0.0 { 1.0 } else { sin / half };
        Self { x, half_sinc, half_cos }
    }

    /// `sin t / t`.
    pub(crate) fn a(&self) -> f64 {
        self.half_sinc * self.half_cos
    }

    /// `(1 − cos t) / t²`.
    pub(crate) fn b(&self) -> f64 {
        0.5 * self.half_sinc * self.half_sinc
    }

    /// `(t − sin t) / t³`.
    pub(crate) fn c(&self) -> f64 {
        self.sum(&C).unwrap_or_else(|| (1.0 - self.a()) / self.x)
    }

    /// `(1 − (t/2) cot(t/2)) / t²`, which is `−b′ / (2 b t)`: no difference of its own.
    pub(crate) fn d(&self) -> f64 {
        -self.b_slope() / (2.0 * self.b())
    }

    /// `b′(t) / t = (a − 2b) / t²`.
    pub(crate) fn b_slope(&self) -> f64 {
        self.sum(&B_SLOPE).map_or_else(|| (self.a() - 2.0 * self.b()) / self.x, |sum| -sum)
    }

    /// `(b′ / t)′ / t = (c − b − 4 b′/t) / t²`.
    pub(crate) fn b_bend(&self) -> f64 {
        self.sum(&B_BEND).unwrap_or_else(|| (self.c() - self.b() - 4.0 * self.b_slope()) / self.x)
    }

    /// `c′(t) / t = (b − 3c) / t²`.
    pub(crate) fn c_slope(&self) -> f64 {
        self.sum(&C_SLOPE).map_or_else(|| (self.b() - 3.0 * self.c()) / self.x, |sum| -sum)
    }

    /// `(c′ / t)′ / t = (b′/t − 5 c′/t) / t²`.
    pub(crate) fn c_bend(&self) -> f64 {
        self.sum(&C_BEND).unwrap_or_else(|| (self.b_slope() - 5.0 * self.c_slope()) / self.x)
    }

    /// `d′(t) / t = (1 + a − 4b) / (2 b t⁴)`.
    pub(crate) fn d_slope(&self) -> f64 {
        let numerator = self
            .sum(&D_SLOPE)
            .unwrap_or_else(|| (1.0 + self.a() - 4.0 * self.b()) / (self.x * self.x));
        numerator / (2.0 * self.b())
    }

    /// The sum of a series, if the angle is small enough for it (Horner's rule).
    fn sum(&self, series: &Series) -> Option<f64> {
        let terms = if self.x < SHORT_BELOW {
            &series[..SHORT_TERMS]
        } else if self.x < SERIES_BELOW {
            &series[..]
        } else {
            return None;
        };
        Some(terms.iter().rev().fold(0.0, |sum, term| sum * self.x + term))
    }
}
