//! Memory of equilibria: steps start from the one whose tensions are nearest.

/// Distance of the tensions of a remembered equilibrium from others, the largest difference; infinite where there is
/// none.
pub(super) fn distance(found: bool, own: &[f64], tensions: &[f64]) -> f64 {
    if !found {
        return f64::INFINITY;
    }
    own.iter().zip(tensions).fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

/// Nearest one of the remembered equilibria; of several the first.
pub(super) fn nearest<const N: usize>(distances: &[f64; N]) -> usize {
    (0..N).fold(0, |best, k| if distances[k] < distances[best] { k } else { best })
}

/// Farthest one of the remembered equilibria but one that is kept, which the next one replaces.
pub(super) fn farthest<const N: usize>(distances: &[f64; N], kept: usize) -> usize {
    let others = (0..N).filter(|k| *k != kept);
    let first = (kept + 1) % N;
    others.fold(first, |worst, k| if distances[k] > distances[worst] { k } else { worst })
}
