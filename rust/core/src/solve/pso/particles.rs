//! The swarm's numbers, and the sweep over them that moves every particle.
//!
//! Everything is particles x dimensions, row by row: the rows are the points that objectives get, and
//! the sweep runs over all coordinates as one flat loop, whatever the number of dimensions.

use std::f64::consts::TAU;

use super::random::halves;
use super::settings::{Bounds, PsoSettings, Sampling};

/// Places, velocities, best points and the box, each particles x dimensions.
#[derive(Clone, Debug, Default)]
pub(super) struct Cloud {
    pub(super) places: Vec<f64>,
    velocities: Vec<f64>,
    /// Where each particle was best.
    pub(super) own: Vec<f64>,
    /// The best point of each particle's leader.
    led: Vec<f64>,
    /// The box and the largest velocity, repeated for every particle.
    lower: Vec<f64>,
    upper: Vec<f64>,
    fastest: Vec<f64>,
    /// One particle's direction, for the ball.
    direction: Vec<f64>,
    dimensions: usize,
}

/// How a particle moves, without what the swarm is otherwise.
#[derive(Clone, Copy)]
struct Pulls {
    inertia: f64,
    cognitive: f64,
    social: f64,
}

impl Cloud {
    /// Sizes the buffers and sets the box.
    pub(super) fn resize(&mut self, settings: &PsoSettings, lower: &[f64], upper: &[f64]) {
        let (n, particles) = (lower.len(), settings.particles);
        self.dimensions = n;
        for buffer in [&mut self.places, &mut self.velocities, &mut self.own, &mut self.led] {
            buffer.resize(particles * n, 0.0);
        }
        for (buffer, bound) in [(&mut self.lower, lower), (&mut self.upper, upper)] {
            buffer.clear();
            (0..particles).for_each(|_| buffer.extend_from_slice(bound));
        }
        // Without a limit, what keeps an unstable swarm's velocities finite.
        let limit = settings.velocity_limit.unwrap_or(1e3);
        self.fastest.clear();
        let widths = self.lower.iter().zip(&self.upper);
        self.fastest.extend(widths.map(|(lower, upper)| limit * (upper - lower)));
        self.direction.resize(n.next_multiple_of(2), 0.0);
    }

    /// Places uniform in the box, velocities to places uniform in it.
    pub(super) fn scatter(&mut self, draws: &[u64]) {
        for e in 0..self.places.len() {
            let (at, to) = halves(draws[e]);
            let (lower, upper) = (self.lower[e], self.upper[e]);
            let place = held(lower + at * (upper - lower), lower, upper);
            let fastest = self.fastest[e];
            self.places[e] = place;
            self.velocities[e] = held(lower + to * (upper - lower) - place, -fastest, fastest);
        }
    }

    /// Whether a number is inside the box, as coordinate `e` of the swarm.
    pub(super) fn holds(&self, e: usize, x: f64) -> bool {
        (self.lower[e]..=self.upper[e]).contains(&x)
    }

    /// Puts given points in the place of the first particles'.
    pub(super) fn place(&mut self, points: &[f64]) {
        self.places[..points.len()].copy_from_slice(points);
    }

    /// Hands every particle the best point of its leader.
    pub(super) fn follow(&mut self, leaders: &[usize]) {
        let n = self.dimensions;
        for (row, &leader) in self.led.chunks_exact_mut(n).zip(leaders) {
            let best = &self.own[leader * n..(leader + 1) * n];
            for (place, value) in row.iter_mut().zip(best) {
                *place = *value;
            }
        }
    }

    /// Where a particle is becomes its best point.
    pub(super) fn remember(&mut self, particle: usize) {
        let row = particle * self.dimensions..(particle + 1) * self.dimensions;
        for e in row {
            self.own[e] = self.places[e];
        }
    }

    /// The best point of a particle.
    pub(super) fn best(&self, particle: usize) -> &[f64] {
        &self.own[particle * self.dimensions..(particle + 1) * self.dimensions]
    }

    /// Moves every particle once.
    pub(super) fn sweep(&mut self, settings: &PsoSettings, leaders: &[usize], draws: &[u64]) {
        match settings.bounds {
            Bounds::Clamp => self.sweep_to(settings, leaders, draws, clamp),
            Bounds::Reflect => self.sweep_to(settings, leaders, draws, reflect),
            Bounds::Absorb => self.sweep_to(settings, leaders, draws, absorb),
            Bounds::Rebound => self.sweep_to(settings, leaders, draws, rebound),
        }
    }

    fn sweep_to<W>(&mut self, settings: &PsoSettings, leaders: &[usize], draws: &[u64], wall: W)
    where
        W: Fn(f64, f64, f64, f64) -> (f64, f64),
    {
        let PsoSettings { inertia, cognitive, social, .. } = *settings;
        let pulls = Pulls { inertia, cognitive, social };
        match settings.sampling {
            Sampling::Box => self.sweep_boxes(pulls, draws, wall),
            Sampling::Sphere => self.sweep_balls(pulls, leaders, draws, wall),
        }
    }

    /// `v <- w v + c1 r1 (p - x) + c2 r2 (g - x)`, `x <- x + v`.
    fn sweep_boxes<W>(&mut self, pulls: Pulls, draws: &[u64], wall: W)
    where
        W: Fn(f64, f64, f64, f64) -> (f64, f64),
    {
        let size = self.places.len();
        // Equal lengths in sight of the loop: no bounds are checked in it, and it runs over vectors.
        let (places, velocities) = (&mut self.places[..size], &mut self.velocities[..size]);
        let (own, led, draws) = (&self.own[..size], &self.led[..size], &draws[..size]);
        let (lower, upper) = (&self.lower[..size], &self.upper[..size]);
        let fastest = &self.fastest[..size];
        for e in 0..size {
            let (first, second) = halves(draws[e]);
            let place = places[e];
            let velocity = pulls.inertia * velocities[e]
                + pulls.cognitive * first * (own[e] - place)
                + pulls.social * second * (led[e] - place);
            let velocity = held(velocity, -fastest[e], fastest[e]);
            (places[e], velocities[e]) = wall(place + velocity, velocity, lower[e], upper[e]);
        }
    }

    /// `x'` uniform in direction and distance in the ball around G through x, `v <- w v + x' - x`,
    /// `x <- x + v`. G is the mean of x, `x + c1 (p - x)` and `x + c2 (l - x)`; without the last for a
    /// particle that leads itself.
    fn sweep_balls<W>(&mut self, pulls: Pulls, leaders: &[usize], draws: &[u64], wall: W)
    where
        W: Fn(f64, f64, f64, f64) -> (f64, f64),
    {
        let n = self.dimensions;
        for (particle, &leader) in leaders.iter().enumerate() {
            let row = particle * n..(particle + 1) * n;
            let (own, social) = if leader == particle {
                (pulls.cognitive / 2.0, 0.0)
            } else {
                (pulls.cognitive / 3.0, pulls.social / 3.0)
            };
            let towards =
                |place: f64, best: f64, led: f64| own * (best - place) + social * (led - place);
            let radius = (row.clone())
                .map(|e| towards(self.places[e], self.own[e], self.led[e]).powi(2))
                .sum::<f64>()
                .sqrt();
            let length = direction(&draws[row.clone()], &mut self.direction);
            // In one dimension only the sign of the direction counts, which is the other half.
            let (share, _) = halves(draws[row.end - 1]);
            let distance = if length > 0.0 { share * radius / length } else { 0.0 };
            for (e, along) in row.zip(&self.direction) {
                let place = self.places[e];
                let velocity = pulls.inertia * self.velocities[e]
                    + towards(place, self.own[e], self.led[e])
                    + distance * along;
                let velocity = held(velocity, -self.fastest[e], self.fastest[e]);
                (self.places[e], self.velocities[e]) =
                    wall(place + velocity, velocity, self.lower[e], self.upper[e]);
            }
        }
    }
}

/// Normal numbers (Box & Muller, [10.1214/aoms/1177706645](https://doi.org/10.1214/aoms/1177706645)),
/// two from a draw, and the length of the vector they make: no direction is preferred.
fn direction(draws: &[u64], out: &mut [f64]) -> f64 {
    for (pair, &draw) in out.chunks_exact_mut(2).zip(draws) {
        let (first, second) = halves(draw);
        let radius = (-2.0 * (1.0 - first).ln()).sqrt();
        let (sine, cosine) = (TAU * second).sin_cos();
        pair.copy_from_slice(&[radius * cosine, radius * sine]);
    }
    out[..draws.len()].iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The nearest number in an interval. Not `clamp`, which panics on an empty one.
#[inline(always)]
fn held(x: f64, lower: f64, upper: f64) -> f64 {
    let x = if x < lower { lower } else { x };
    if x > upper { upper } else { x }
}

#[inline(always)]
fn clamp(x: f64, v: f64, lower: f64, upper: f64) -> (f64, f64) {
    (held(x, lower, upper), v)
}

#[inline(always)]
fn reflect(x: f64, v: f64, lower: f64, upper: f64) -> (f64, f64) {
    let mirrored = if x < lower { 2.0 * lower - x } else { x };
    let mirrored = if x > upper { 2.0 * upper - x } else { mirrored };
    (held(mirrored, lower, upper), if held(x, lower, upper) == x { v } else { -v })
}

#[inline(always)]
fn absorb(x: f64, v: f64, lower: f64, upper: f64) -> (f64, f64) {
    let place = held(x, lower, upper);
    (place, if place == x { v } else { 0.0 })
}

#[inline(always)]
fn rebound(x: f64, v: f64, lower: f64, upper: f64) -> (f64, f64) {
    let place = held(x, lower, upper);
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
        let mut draws = super::super::random::Draws::default();
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
