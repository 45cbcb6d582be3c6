//! Checks that triangles are the surface of a solid.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::error::{InvalidInput, finite_vector};

/// Share of its longest side below which a triangle's height has no digits left.
const FLATTEST: f64 = 1e-12;

/// Both ends of an edge and the faces that run along it, there and back.
pub(super) type Ends = ([usize; 2], [usize; 2]);

/// Vertices, faces and edges of a surface that has passed.
pub(super) struct Checked {
    pub(super) vertices: Vec<Vector3<f64>>,
    /// Counter-clockwise from outside.
    pub(super) faces: Vec<[usize; 3]>,
    pub(super) edges: Vec<Ends>,
}

pub(super) fn check(
    vertices: &[Vector3<f64>],
    faces: &[[usize; 3]],
) -> Result<Checked, InvalidInput> {
    let vertices = check_vertices(vertices)?;
    check_faces(&vertices, faces)?;
    let volume = volume(&vertices, faces)?;
    let mut faces = faces.to_vec();
    if volume < 0.0 {
        for face in &mut faces {
            face.swap(1, 2);
        }
    }
    let edges = edges(&faces)?;
    if volume == 0.0 {
        return Err(InvalidInput::new("faces", "a surface around a volume", "no volume"));
    }
    check_fans(vertices.len(), &faces)?;
    Ok(Checked { vertices, faces, edges })
}

fn check_vertices(vertices: &[Vector3<f64>]) -> Result<Vec<Vector3<f64>>, InvalidInput> {
    if vertices.is_empty() {
        return Err(InvalidInput::new("vertices", "at least 4 vertices", "none"));
    }
    let limit = 1e15;
    let check = |(i, vertex): (usize, &Vector3<f64>)| {
        let argument = format!("vertices[{i}]");
        let vertex = finite_vector(&argument, "m", vertex)?;
        if vertex.amax() > limit {
            let expected = format!("coordinates up to {limit:e} m");
            return Err(InvalidInput::new(argument, expected, format!("{:?}", vertex.amax())));
        }
        Ok(vertex)
    };
    vertices.iter().enumerate().map(check).collect()
}

fn check_faces(vertices: &[Vector3<f64>], faces: &[[usize; 3]]) -> Result<(), InvalidInput> {
    if faces.is_empty() {
        return Err(InvalidInput::new("faces", "at least 4 triangles", "none"));
    }
    // Faces, edges and vertices are numbered together in u32; a closed surface has 1.5 edges a face.
    let most = 500_000_000;
    if faces.len() > most || vertices.len() > most {
        let expected = format!("at most {most} triangles and vertices");
        let got = format!("{} and {}", faces.len(), vertices.len());
        return Err(InvalidInput::new("faces", expected, got));
    }
    for (i, face) in faces.iter().enumerate() {
        let argument = || format!("faces[{i}]");
        if let Some(missing) = face.iter().find(|vertex| **vertex >= vertices.len()) {
            let expected = format!("vertex numbers from 0 to {}", vertices.len() - 1);
            return Err(InvalidInput::new(argument(), expected, missing));
        }
        let [a, b, c] = face.map(|vertex| vertices[vertex]);
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        let height = (b - a).cross(&(c - a)).norm();
        if height <= FLATTEST * longest * longest {
            let got = format!("vertices {face:?} on one line");
            return Err(InvalidInput::new(argument(), "a triangle with an area", got));
        }
    }
    Ok(())
}

/// Six times the volume, positive when the faces turn outwards.
fn volume(vertices: &[Vector3<f64>], faces: &[[usize; 3]]) -> Result<f64, InvalidInput> {
    let origin = vertices[faces[0][0]];
    let (mut sum, mut size) = (0.0, 0.0);
    for face in faces {
        let [a, b, c] = face.map(|vertex| vertices[vertex] - origin);
        let part = a.dot(&b.cross(&c));
        sum += part;
        size += part.abs();
    }
    if !sum.is_finite() {
        return Err(InvalidInput::new("vertices", "a volume that is a number", sum));
    }
    // What rounding leaves of a flat sheet's two sides is no volume.
    Ok(if sum.abs() <= 1e-14 * size { 0.0 } else { sum })
}

/// Every edge with its two faces, in the order of the first face that has it.
fn edges(faces: &[[usize; 3]]) -> Result<Vec<Ends>, InvalidInput> {
    let mut directed = HashMap::with_capacity(3 * faces.len());
    for (f, face) in faces.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            if let Some(other) = directed.insert((a, b), f) {
                let expected = "faces that all turn the same way, two to an edge";
                let got = format!("faces {other} and {f} both running from vertex {a} to {b}");
                return Err(InvalidInput::new("faces", expected, got));
            }
        }
    }
    let mut edges = Vec::with_capacity(3 * faces.len() / 2);
    for (f, face) in faces.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            let Some(&other) = directed.get(&(b, a)) else {
                let expected = "a closed surface, two faces to an edge";
                let got = format!(
                    "an open one: the edge of vertices {a} and {b} has face {f} only (vertices that \
                     are given twice have to be merged)"
                );
                return Err(InvalidInput::new("faces", expected, got));
            };
            if a < b {
                edges.push(([a, b], [f, other]));
            }
        }
    }
    Ok(edges)
}

/// Refuses vertices in which surfaces only touch: inside and outside are not told apart there.
fn check_fans(vertices: usize, faces: &[[usize; 3]]) -> Result<(), InvalidInput> {
    let mut count = vec![0_usize; vertices];
    let mut next = HashMap::with_capacity(3 * faces.len());
    let mut first = vec![None; vertices];
    for face in faces {
        for k in 0..3 {
            let (vertex, from, to) = (face[k], face[(k + 1) % 3], face[(k + 2) % 3]);
            count[vertex] += 1;
            first[vertex] = Some(from);
            next.insert((vertex, from), to);
        }
    }
    for (vertex, first) in first.iter().enumerate() {
        let Some(first) = *first else { continue };
        let (mut around, mut steps) = (first, 0);
        while let Some(&to) = next.get(&(vertex, around)) {
            around = to;
            steps += 1;
            if around == first {
                break;
            }
        }
        if steps != count[vertex] {
            let expected = "a surface that does not touch itself in a vertex";
            let got = format!("vertex {vertex}, where parts of it meet in a point");
            return Err(InvalidInput::new("faces", expected, got));
        }
    }
    Ok(())
}
