//! Random numbers: a `ChaCha` stream per particle, drawn in blocks and laid out for the sweep.

use rand_chacha::ChaCha8Core;
use rand_chacha::rand_core::SeedableRng;
use rand_chacha::rand_core::block::Generator;

/// Words that the generator makes at a time.
const BLOCK: usize = 64;

/// Which purpose a stream serves, so that equal seeds elsewhere give other numbers.
const PURPOSE: &[u8; 16] = b"tdcr::solve::pso";

/// The stream of one particle: seed and particle are the cipher's key.
fn stream(seed: u64, particle: u64) -> ChaCha8Core {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&particle.to_le_bytes());
    key[16..].copy_from_slice(PURPOSE);
    ChaCha8Core::from_seed(key)
}

/// Two numbers in [0, 1) from the two halves of a draw.
#[inline(always)]
pub(super) fn uniform_pair(draw: u64) -> (f64, f64) {
    // The word becomes the top of a mantissa in [1, 2): shifts that run over vectors, where a
    // conversion of integers would not.
    const ONE: u64 = 1023 << 52;
    let low = f64::from_bits(ONE | ((draw & 0xffff_ffff) << 20)) - 1.0;
    let high = f64::from_bits(ONE | ((draw >> 32) << 20)) - 1.0;
    (low, high)
}

/// One draw of 64 bits per coordinate and step. A particle takes them from a stream of its own, step
/// after step; they lie step after step for the whole swarm.
#[derive(Clone, Debug, Default)]
pub(super) struct RandomStreams {
    streams: Vec<ChaCha8Core>,
    /// Steps x particles x dimensions.
    ahead: Vec<u64>,
    /// One particle's words of one filling.
    words: Vec<[u32; BLOCK]>,
    dimensions: usize,
    steps: usize,
    used: usize,
}

impl RandomStreams {
    /// Sizes the buffers.
    pub(super) fn resize(&mut self, particles: usize, dimensions: usize) {
        let blocks = (2 * dimensions).div_ceil(BLOCK);
        self.dimensions = dimensions;
        self.steps = blocks * BLOCK / (2 * dimensions);
        self.words.resize(blocks, [0; BLOCK]);
        self.ahead.resize(self.steps * particles * dimensions, 0);
        self.streams.resize(particles, stream(0, 0));
    }

    /// Starts all streams.
    pub(super) fn seed(&mut self, seed: u64) {
        for (particle, place) in self.streams.iter_mut().enumerate() {
            *place = stream(seed, particle as u64);
        }
        self.used = self.steps;
    }

    /// The draws of the next step: particles x dimensions.
    pub(super) fn step(&mut self) -> &[u64] {
        if self.used == self.steps {
            self.fill();
            self.used = 0;
        }
        let size = self.streams.len() * self.dimensions;
        let first = self.used * size;
        self.used += 1;
        &self.ahead[first..first + size]
    }

    fn fill(&mut self) {
        let n = self.dimensions;
        let size = self.streams.len() * n;
        for (particle, stream) in self.streams.iter_mut().enumerate() {
            for block in &mut self.words {
                stream.generate(block);
            }
            let mut pairs = self.words.as_flattened().chunks_exact(2);
            for step in self.ahead.chunks_exact_mut(size) {
                let row = &mut step[particle * n..(particle + 1) * n];
                for (place, pair) in row.iter_mut().zip(pairs.by_ref()) {
                    *place = u64::from(pair[0]) | (u64::from(pair[1]) << 32);
                }
            }
        }
    }
}

/// Whole numbers below a bound, from a stream that belongs to no particle.
#[derive(Clone, Debug)]
pub(super) struct RandomIntegers {
    stream: ChaCha8Core,
    words: [u32; BLOCK],
    used: usize,
}

impl RandomIntegers {
    pub(super) fn new(seed: u64) -> Self {
        Self { stream: stream(seed, u64::MAX), words: [0; BLOCK], used: BLOCK }
    }

    /// Uniform in 0..bound but for 2^-32 bound; the bound is at most 2^32.
    pub(super) fn below(&mut self, bound: usize) -> usize {
        if self.used == BLOCK {
            self.stream.generate(&mut self.words);
            self.used = 0;
        }
        let word = u64::from(self.words[self.used]);
        self.used += 1;
        usize::try_from((word * bound as u64) >> 32).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A particle's numbers do not depend on how many others there are, nor on the layout.
    #[test]
    fn streams_belong_to_particles() {
        for n in [1, 2, 3, 31, 32, 33, 100] {
            let mut swarm = RandomStreams::default();
            swarm.resize(5, n);
            swarm.seed(7);
            let mut alone = RandomStreams::default();
            alone.resize(1, n);
            alone.seed(7);
            for _ in 0..50 {
                assert_eq!(swarm.step()[..n], *alone.step());
            }
        }
    }

    #[test]
    fn halves_are_uniform() {
        assert_eq!(uniform_pair(0), (0.0, 0.0));
        let largest = uniform_pair(u64::MAX);
        assert!(largest.0 == 1.0 - 2f64.powi(-32) && largest.0 == largest.1);
        assert_eq!(uniform_pair(1 << 31), (0.5, 0.0));
        let mut draws = RandomStreams::default();
        draws.resize(100, 3);
        draws.seed(1);
        let (mut sum, mut squares, mut product) = (0.0, 0.0, 0.0);
        for _ in 0..1000 {
            for &draw in draws.step() {
                let (a, b) = uniform_pair(draw);
                sum += a + b;
                squares += a * a + b * b;
                product += a * b;
            }
        }
        let count = 300_000.0;
        assert!((sum / (2.0 * count) - 0.5).abs() < 2e-3);
        assert!((squares / (2.0 * count) - 1.0 / 3.0).abs() < 2e-3);
        assert!((product / count - 0.25).abs() < 2e-3);
    }

    #[test]
    fn lots_are_uniform() {
        let mut integers = RandomIntegers::new(3);
        let mut seen = [0_u32; 7];
        for _ in 0..70_000 {
            seen[integers.below(7)] += 1;
        }
        assert!(seen.iter().all(|&count| count.abs_diff(10_000) < 500), "{seen:?}");
    }
}
