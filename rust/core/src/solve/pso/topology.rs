//! Leaders of the particles.

use super::random::RandomIntegers;
use super::settings::{PsoSettings, Topology};

/// The leader of every particle: the best one that it knows.
#[derive(Clone, Debug)]
pub(super) struct Leaders {
    /// Particle numbers; a particle that knows of no value follows itself.
    pub(super) of: Vec<usize>,
    /// Whom every particle informs, `neighbours` each.
    informants_of: Vec<usize>,
    integers: RandomIntegers,
}

/// Number of links that a swarm draws.
pub(super) fn links(settings: &PsoSettings) -> usize {
    match settings.topology {
        Topology::Random => settings.neighbours.saturating_mul(settings.particles),
        Topology::Global | Topology::Ring => 0,
    }
}

impl Default for Leaders {
    fn default() -> Self {
        Self { of: Vec::new(), informants_of: Vec::new(), integers: RandomIntegers::new(0) }
    }
}

impl Leaders {
    /// Sizes the buffers.
    pub(super) fn resize(&mut self, settings: &PsoSettings) {
        self.of.resize(settings.particles, 0);
        self.informants_of.resize(links(settings), 0);
    }

    /// Starts the stream of the random links.
    pub(super) fn seed(&mut self, seed: u64) {
        self.integers = RandomIntegers::new(seed);
    }

    /// True when links are drawn, not given.
    pub(super) fn is_random(&self) -> bool {
        !self.informants_of.is_empty()
    }

    /// Finds the leaders among the particles' best values. `better`: whether the last iteration
    /// lowered the best of all.
    pub(super) fn choose(
        &mut self,
        settings: &PsoSettings,
        own: &[f64],
        best: usize,
        better: bool,
    ) {
        match settings.topology {
            // As long as there is no value, everybody is on its own.
            Topology::Global if own[best] == f64::INFINITY => self.everyone_leads_itself(),
            Topology::Global => self.of.fill(best),
            Topology::Ring => self.lead_along_ring(settings.neighbours, own),
            Topology::Random => {
                if !better {
                    for place in &mut self.informants_of {
                        *place = self.integers.below(own.len());
                    }
                }
                self.lead_by_links(settings.neighbours, own);
            }
        }
    }

    fn everyone_leads_itself(&mut self) {
        for (particle, leader) in self.of.iter_mut().enumerate() {
            *leader = particle;
        }
    }

    fn lead_along_ring(&mut self, sides: usize, own: &[f64]) {
        let count = own.len();
        // More on either side than there are: everybody, once.
        let sides = sides.min(count / 2);
        for (particle, leader) in self.of.iter_mut().enumerate() {
            let mut known = particle;
            let mut at =
                if particle >= sides { particle - sides } else { particle + count - sides };
            for _ in 0..=2 * sides {
                if own[at] < own[known] {
                    known = at;
                }
                at = if at + 1 == count { 0 } else { at + 1 };
            }
            *leader = known;
        }
    }

    fn lead_by_links(&mut self, informants_of: usize, own: &[f64]) {
        self.everyone_leads_itself();
        for (informer, links) in self.informants_of.chunks_exact(informants_of).enumerate() {
            for &particle in links {
                if own[informer] < own[self.of[particle]] {
                    self.of[particle] = informer;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaders(topology: Topology, neighbours: usize, own: &[f64]) -> Vec<usize> {
        let settings =
            PsoSettings { topology, neighbours, particles: own.len(), ..PsoSettings::default() };
        let mut leaders = Leaders::default();
        leaders.resize(&settings);
        leaders.seed(1);
        let best = (0..own.len()).min_by(|&a, &b| own[a].total_cmp(&own[b])).unwrap_or(0);
        leaders.choose(&settings, own, best, false);
        leaders.of
    }

    #[test]
    fn everyone_follows_the_best_it_knows() {
        let own = [5.0, 1.0, 4.0, 3.0, 0.0, 2.0];
        assert_eq!(leaders(Topology::Global, 1, &own), [4; 6]);
        assert_eq!(leaders(Topology::Ring, 1, &own), [1, 1, 1, 4, 4, 4]);
        assert_eq!(leaders(Topology::Ring, 2, &own), [4, 1, 4, 4, 4, 4]);
        assert_eq!(leaders(Topology::Ring, 900, &own), [4; 6]);
        let known = leaders(Topology::Random, 3, &own);
        assert!(known.iter().enumerate().all(|(i, &leader)| own[leader] <= own[i]), "{known:?}");
        assert_eq!(leaders(Topology::Random, 60, &own), [4; 6]);
    }

    #[test]
    fn without_a_value_nobody_is_followed() {
        for topology in Topology::ALL {
            assert_eq!(leaders(topology, 1, &[f64::INFINITY; 4]), [0, 1, 2, 3]);
        }
        let one = leaders(Topology::Ring, 1, &[f64::INFINITY, f64::INFINITY, 1.0, f64::INFINITY]);
        assert_eq!(one, [0, 2, 2, 2]);
        assert_eq!(leaders(Topology::Ring, 1, &[2.0]), [0]);
        assert_eq!(leaders(Topology::Ring, 1, &[2.0, 1.0]), [1, 1]);
    }
}
