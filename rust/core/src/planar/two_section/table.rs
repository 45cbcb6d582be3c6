//! Arcs at the middles of the intervals that the search meets first: they depend on no trunk and no
//! target, so they are computed once.

use std::f64::consts::TAU;
use std::sync::OnceLock;

use crate::planar::chord::{Chord, Point};

/// Intervals that the search starts with, over turns from -2 pi to 2 pi.
pub(super) const ROOTS: usize = 16;

/// Halvings that the table covers.
const LEVELS: usize = 5;

/// Half-width of a first interval \[rad\].
pub(super) const FIRST: f64 = TAU / ROOTS as f64;

/// First section at a turn, seen in the frame at its end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// The turn \[rad\].
    pub(super) turn: f64,
    /// `exp(-i turn)`.
    pub(super) back: Point,
    /// The chord of unit length, `e exp(-i turn)`, and its derivatives times the same.
    pub(super) chord: Point,
    pub(super) first: Point,
    pub(super) second: Point,
    /// Moduli of the derivatives.
    pub(super) first_norm: f64,
    pub(super) second_norm: f64,
}

impl Node {
    pub(super) fn new(turn: f64) -> Self {
        let chord = Chord::new(turn);
        let back = chord.heading.conj();
        let (first, second) = (chord.first * back, chord.second * back);
        Self {
            turn,
            back,
            chord: chord.value * back,
            first,
            second,
            first_norm: first.norm(),
            second_norm: second.norm(),
        }
    }
}

/// The nodes level by level: level k halves the first intervals k times.
pub(super) fn nodes() -> &'static [Node] {
    static NODES: OnceLock<Vec<Node>> = OnceLock::new();
    NODES.get_or_init(|| {
        let level = |k: usize| {
            let count = ROOTS << k;
            let width = 2.0 * TAU / count as f64;
            (0..count).map(move |i| Node::new((i as f64 + 0.5) * width - TAU))
        };
        (0..=LEVELS).flat_map(level).collect()
    })
}

/// Number of the first node of a level, if the table holds it.
pub(super) const fn level_start(level: usize) -> Option<usize> {
    if level <= LEVELS { Some(ROOTS * ((1 << level) - 1)) } else { None }
}
