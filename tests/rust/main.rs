//! Integration tests of the core, one module per room.

mod lie;
mod linkage_bars;
