//! Hashing of descriptions by the bits of their numbers.
//!
//! Checked descriptions hold no NaN and no -0.0, so equal values have equal bits.

use std::hash::Hasher;

use nalgebra::Vector3;

/// Feeds numbers to a hasher.
pub(crate) struct Bits<'a, H: Hasher>(pub(super) &'a mut H);

impl<H: Hasher> Bits<'_, H> {
    pub(crate) fn float(&mut self, value: f64) {
        self.0.write_u64(value.to_bits());
    }

    pub(crate) fn floats(&mut self, values: &[f64]) {
        self.0.write_usize(values.len());
        for &value in values {
            self.float(value);
        }
    }

    pub(crate) fn counts(&mut self, values: &[usize]) {
        self.0.write_usize(values.len());
        for &value in values {
            self.0.write_usize(value);
        }
    }

    pub(crate) fn vectors(&mut self, values: &[Vector3<f64>]) {
        self.0.write_usize(values.len());
        for value in values {
            for &component in value {
                self.float(component);
            }
        }
    }

    pub(crate) fn option(&mut self, value: Option<f64>) {
        self.floats(value.as_slice());
    }

    pub(crate) fn text(&mut self, value: Option<&str>) {
        self.0.write_u8(u8::from(value.is_some()));
        self.0.write(value.unwrap_or_default().as_bytes());
    }
}

/// `Eq` and `Hash` of a checked description, from what it is made of.
macro_rules! hash_by_bits {
    ($type:ty, |$value:ident, $bits:ident| $body:block) => {
        impl Eq for $type {}

        impl std::hash::Hash for $type {
            fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
                let $value = self;
                let mut $bits = Bits(state);
                $body
            }
        }
    };
}

pub(crate) use hash_by_bits;
