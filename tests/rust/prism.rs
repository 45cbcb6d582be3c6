//! Tubes of triangles, for tests and benches.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use tdcr::obstacle::Mesh;

/// A prism of `sides` around the z axis between two heights, closed by lids.
pub(crate) fn prism(sides: usize, rings: usize, radius: f64, (low, high): (f64, f64)) -> Mesh {
    let mut vertices = vec![Vector3::new(0.0, 0.0, low), Vector3::new(0.0, 0.0, high)];
    for ring in 0..=rings {
        let z = low + (high - low) * ring as f64 / rings as f64;
        vertices.extend((0..sides).map(|k| {
            let (sin, cos) = (TAU * k as f64 / sides as f64).sin_cos();
            Vector3::new(radius * cos, radius * sin, z)
        }));
    }
    let at = |ring: usize, k: usize| 2 + ring * sides + k % sides;
    let mut faces = Vec::new();
    for k in 0..sides {
        faces.extend([[0, at(0, k + 1), at(0, k)], [1, at(rings, k), at(rings, k + 1)]]);
        for ring in 0..rings {
            let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)];
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    Mesh::new(&vertices, &faces).unwrap()
}
