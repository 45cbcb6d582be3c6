//! The swarm's numbers, and the sweep over them that moves every particle.
//!
//! Everything is particles x dimensions, row by row: the rows are the points that objectives get, and
//! the sweep runs over all coordinates as one flat loop, whatever the number of dimensions.

use std::f64::consts::TAU;

use super::random::uniform_pair;
use super::settings::{Bounds, PsoSettings, Sampling};

/// Places, velocities, best points and the box, each particles x dimensions.
#[derive(Clone, Debug, Default)]
pub(super) struct Particles {
    pub(super) positions: Vec<f64>,
    velocities: Vec<f64>,
    /// Best point p of each particle.
    pub(super) own: Vec<f64>,
    /// The best point of each particle's leader.
    leader_best: Vec<f64>,
    /// The box and the largest velocity, repeated for every particle.
    lower: Vec<f64>,
    upper: Vec<f64>,
    velocity_limits: Vec<f64>,
    /// One particle's direction, for the ball.
    direction: Vec<f64>,
    dimensions: usize,
}

/// Coefficients of a particle's move.
#[derive(Clone, Copy)]
struct Coefficients {
    inertia: f64,
    cognitive: f64,
    social: f64,
}

impl Particles {
    /// Sizes the buffers and sets the box.
    pub(super) fn resize(&mut self, settings: &PsoSettings, lower: &[f64], upper: &[f64]) {
        let (n, particles) = (lower.len(), settings.particles);
        self.dimensions = n;
        for buffer in
            [&mut self.positions, &mut self.velocities, &mut self.own, &mut self.leader_best]
        {
            buffer.resize(particles * n, 0.0);
        }
        for (buffer, bound) in [(&mut self.lower, lower), (&mut self.upper, upper)] {
            buffer.clear();
            (0..particles).for_each(|_| buffer.extend_from_slice(bound));
        }
        // Without a limit, what keeps an unstable swarm's velocities finite.
        let limit = settings.velocity_limit.unwrap_or(1e3);
        self.velocity_limits.clear();
        let widths = self.lower.iter().zip(&self.upper);
        self.velocity_limits.extend(widths.map(|(lower, upper)| limit * (upper - lower)));
        self.direction.resize(n.next_multiple_of(2), 0.0);
    }

    /// Positions uniform in the box, velocities to positions uniform in it.
    pub(super) fn initialize(&mut self, draws: &[u64]) {
        for e in 0..self.positions.len() {
            let (at, to) = uniform_pair(draws[e]);
            let (lower, upper) = (self.lower[e], self.upper[e]);
            let place = clamp_to(lower + at * (upper - lower), lower, upper);
            let velocity_limits = self.velocity_limits[e];
            self.positions[e] = place;
            self.velocities[e] =
                clamp_to(lower + to * (upper - lower) - place, -velocity_limits, velocity_limits);
        }
    }

    /// True when a number is inside the box, as coordinate `e` of the swarm.
    pub(super) fn contains(&self, e: usize, x: f64) -> bool {
        (self.lower[e]..=self.upper[e]).contains(&x)
    }

    /// Sets the positions of the first particles.
    pub(super) fn set_positions(&mut self, points: &[f64]) {
        self.positions[..points.len()].copy_from_slice(points);
    }

    /// Copies the best point g of its leader to every particle.
    pub(super) fn update_leaders(&mut self, leaders: &[usize]) {
        let n = self.dimensions;
        for (row, &leader) in self.leader_best.chunks_exact_mut(n).zip(leaders) {
            let best = &self.own[leader * n..(leader + 1) * n];
            for (place, value) in row.iter_mut().zip(best) {
                *place = *value;
            }
        }
    }

    /// Stores a particle's position as its best point.
    pub(super) fn store_best(&mut self, particle: usize) {
        let row = particle * self.dimensions..(particle + 1) * self.dimensions;
        for e in row {
            self.own[e] = self.positions[e];
        }
    }

    /// The best point of a particle.
    pub(super) fn best(&self, particle: usize) -> &[f64] {
        &self.own[particle * self.dimensions..(particle + 1) * self.dimensions]
    }

    /// Moves every particle once.
    pub(super) fn advance(&mut self, settings: &PsoSettings, leaders: &[usize], draws: &[u64]) {
        match settings.bounds {
            Bounds::Clamp => self.advance_within(settings, leaders, draws, clamp),
            Bounds::Reflect => self.advance_within(settings, leaders, draws, reflect),
            Bounds::Absorb => self.advance_within(settings, leaders, draws, absorb),
            Bounds::Rebound => self.advance_within(settings, leaders, draws, rebound),
        }
    }

    fn advance_within<W>(
        &mut self,
        settings: &PsoSettings,
        leaders: &[usize],
        draws: &[u64],
        wall: W,
    ) where
        W: Fn(f64, f64, f64, f64) -> (f64, f64),
    {
        let PsoSettings { inertia, cognitive, social, .. } = *settings;
        let coefficients = Coefficients { inertia, cognitive, social };
        match settings.sampling {
            Sampling::Box => self.advance_in_boxes(coefficients, draws, wall),
            Sampling::Sphere => self.advance_in_balls(coefficients, leaders, draws, wall),
        }
    }

    /// `v <- w v + c1 r1 (p - x) + c2 r2 (g - x)`, `x <- x + v`.
    fn advance_in_boxes<W>(&mut self, coefficients: Coefficients, draws: &[u64], wall: W)
    where
        W: Fn(f64, f64, f64, f64) -> (f64, f64),
    {
        let size = self.positions.len();
        // Equal lengths in sight of the loop: no bounds are checked in it, and it runs over vectors.
        let (positions, velocities) = (&mut self.positions[..size], &mut self.velocities[..size]);
        let (own, leader_best, draws) =
            (&self.own[..size], &self.leader_best[..size], &draws[..size]);
        let (lower, upper) = (&self.lower[..size], &self.upper[..size]);
        let velocity_limits = &self.velocity_limits[..size];
        for e in 0..size {
            let (first, second) = uniform_pair(draws[e]);
            let place = positions[e];
            let velocity = coefficients.inertia * velocities[e]
                + coefficients.cognitive * first * (own[e] - place)
                + coefficients.social * second * (leader_best[e] - place);
            let velocity = clamp_to(velocity, -velocity_limits[e], velocity_limits[e]);
            (positions[e], velocities[e]) = wall(place + velocity, velocity, lower[e], upper[e]);
        }
    }

    /// `x'` uniform in direction and distance in the ball around G through x, `v <- w v + x' - x`,
    /// `x <- x + v`. G is the mean of x, `x + c1 (p - x)` and `x + c2 (l - x)`; without the last for a
    /// particle that leads itself.
    fn advance_in_balls<W>(
        &mut self,
        coefficients: Coefficients,
        leaders: &[usize],
        draws: &[u64],
        wall: W,
    ) where
        W: Fn(f64, f64, f64, f64) -> (f64, f64),
    {
        let n = self.dimensions;
        for (particle, &leader) in leaders.iter().enumerate() {
            let row = particle * n..(particle + 1) * n;
            // Weights of p - x and l - x in G - x.
            let (own, social) = if leader == particle {
                (coefficients.cognitive / 2.0, 0.0)
            } else {
                (coefficients.cognitive / 3.0, coefficients.social / 3.0)
            };
            let attraction = |place: f64, best: f64, leader_best: f64| {
                own * (best - place) + social * (leader_best - place)
            };
            let radius = (row.clone())
                .map(|e| attraction(self.positions[e], self.own[e], self.leader_best[e]).powi(2))
                .sum::<f64>()
                .sqrt();
            // Direction d of length one and share u of the radius |G - x|.
            let length = direction(&draws[row.clone()], &mut self.direction);
            // In one dimension only the sign of the direction counts, which is the other half.
            let (share, _) = uniform_pair(draws[row.end - 1]);
            let distance = if length > 0.0 { share * radius / length } else { 0.0 };
            // x' - x = G - x + u |G - x| d.
            for (e, along) in row.zip(&self.direction) {
                let place = self.positions[e];
                let velocity = coefficients.inertia * self.velocities[e]
                    + attraction(place, self.own[e], self.leader_best[e])
                    + distance * along;
                let velocity =
                    clamp_to(velocity, -self.velocity_limits[e], self.velocity_limits[e]);
                (self.positions[e], self.velocities[e]) =
                    wall(place + velocity, velocity, self.lower[e], self.upper[e]);
            }
        }
    }
}

/// Normal numbers (Box & Muller, [10.1214/aoms/1177706645](https://doi.org/10.1214/aoms/1177706645)),
/// two from a draw, and the length of the vector they make: no direction is preferred.
fn direction(draws: &[u64], out: &mut [f64]) -> f64 {
    for (pair, &draw) in out.chunks_exact_mut(2).zip(draws) {
        let (first, second) = uniform_pair(draw);
        let radius = (-2.0 * (1.0 - first).ln()).sqrt();
        let (sine, cosine) = (TAU * second).sin_cos();
        pair.copy_from_slice(&[radius * cosine, radius * sine]);
    }
    out[..draws.len()].iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The nearest number in an interval. Not `clamp`, which panics on an empty one.
#[inline(always)]
fn clamp_to(x: f64, lower: f64, upper: f64) -> f64 {
    let x = if x < lower { lower } else { x };
    if x > upper { upper } else { x }
}

#[inline(always)]
fn clamp(x: f64, v: f64, lower: f64, upper: f64) -> (f64, f64) {
    (clamp_to(x, lower, upper), v)
}

#[inline(always)]
fn reflect(x: f64, v: f64, lower: f64, upper: f64) -> (f64, f64) {
    let mirrored = if x < lower { 2.0 * lower - x } else { x };
    let mirrored = if x > upper { 2.0 * upper - x } else { mirrored };
    (clamp_to(mirrored, lower, upper), if clamp_to(x, lower, upper) == x { v } else { -v })
}

#[inline(always)]
fn absorb(x: f64, v: f64, lower: f64, upper: f64) -> (f64, f64) {
    let place = clamp_to(x, lower, upper);
    (place, if place == x { v } else { 0.0 })
}

#[inline(always)]
fn rebound(x: f64, v: f64, lower: f64, upper: f64) -> (f64, f64) {
    let place = clamp_to(x, lower, upper);
    (place, if place == x { v } else { -0.5 * v })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls() {
        for (wall, left, far) in [
            (clamp as fn(f64, f64, f64, f64) -> (f64, f64), (0.0, -0.5), (1.0, 5.0)),
            (reflect, (0.25, 0.5), (0.0, -5.0)),
            (absorb, (0.0, 0.0), (1.0, 0.0)),
            (rebound, (0.0, 0.25), (1.0, -2.5)),
        ] {
            assert_eq!(wall(0.3, 0.1, 0.0, 1.0), (0.3, 0.1));
            assert_eq!(wall(-0.25, -0.5, 0.0, 1.0), left);
            assert_eq!(wall(5.0, 5.0, 0.0, 1.0), far);
        }
    }

    /// Directions fill the circle evenly, in any number of dimensions each coordinate alike.
    #[test]
    fn directions_prefer_nothing() {
        let mut draws = super::super::random::RandomStreams::default();
        draws.resize(1, 3);
        draws.seed(5);
        let (mut mean, mut square) = ([0.0; 3], [0.0; 3]);
        let mut out = [0.0; 4];
        for _ in 0..60_000 {
            let length = direction(draws.step(), &mut out);
            for d in 0..3 {
                mean[d] += out[d] / length / 60_000.0;
                square[d] += (out[d] / length).powi(2) / 60_000.0;
            }
        }
        assert!(mean.iter().all(|m| m.abs() < 0.01), "{mean:?}");
        assert!(square.iter().all(|s| (s - 1.0 / 3.0).abs() < 0.01), "{square:?}");
    }
}
