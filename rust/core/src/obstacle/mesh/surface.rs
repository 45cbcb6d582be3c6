//! A closed surface with all that queries look up: normals, edges, corners, a tree of boxes.

use nalgebra::Vector3;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};
use parry3d_f64::shape::Triangle;

use super::check::{Checked, check};
use crate::error::InvalidInput;

/// Sine of the angle up to which neighbouring faces are one plane: the rounding of single precision,
/// in which STL files are written, tilts long thin triangles by this much.
const FLAT: f64 = 1e-6;

/// Fold of the surface along an edge, seen from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fold {
    Flat,
    /// The solid is convex there.
    Ridge,
    /// The solid is hollow there.
    Valley,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub(super) vertices: [usize; 2],
    pub(super) faces: [usize; 2],
    /// Mean of its faces' normals: its sign tells outside from inside (Baerentzen & Aanaes 2005).
    pub(super) normal: Vector3<f64>,
    pub(super) along: Vector3<f64>,
    pub(super) fold: Fold,
}

/// Kind of a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Corner {
    /// A point within a plane face.
    Face,
    /// A point of a straight edge; one of the edges it lies on.
    Edge(usize),
    Vertex,
}

#[derive(Debug)]
pub(super) struct Surface {
    pub(super) vertices: Vec<Vector3<f64>>,
    pub(super) faces: Vec<[usize; 3]>,
    pub(super) triangles: Vec<Triangle>,
    pub(super) normals: Vec<Vector3<f64>>,
    pub(super) edges: Vec<Edge>,
    /// Edges ab, bc, ca of each face.
    pub(super) face_edges: Vec<[usize; 3]>,
    /// The plane a face lies in, named by the first of its faces.
    pub(super) planes: Vec<usize>,
    /// Means of the normals of the faces around, weighted by their angles: their signs tell outside
    /// from inside (Baerentzen & Aanaes 2005).
    pub(super) vertex_normals: Vec<Vector3<f64>>,
    pub(super) corners: Vec<Corner>,
    /// Faces around each vertex: `fans[fan_starts[v]..fan_starts[v + 1]]`.
    fan_starts: Vec<usize>,
    fans: Vec<usize>,
    pub(super) tree: Bvh,
    /// The largest coordinate \[m\].
    pub(super) scale: f64,
}

pub(super) fn to_parry(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

pub(super) fn from_parry(v: Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

impl Surface {
    /// Surface of checked vertices and faces, with all that queries need.
    pub(super) fn new(
        vertices: &[Vector3<f64>],
        faces: &[[usize; 3]],
    ) -> Result<Self, InvalidInput> {
        let Checked { vertices, faces, edges } = check(vertices, faces)?;
        // Triangles and their normals.
        let corner = |face: &[usize; 3], k: usize| vertices[face[k % 3]];
        let triangles: Vec<Triangle> = (faces.iter())
            .map(|face| {
                let [a, b, c] = face.map(|vertex| to_parry(&vertices[vertex]));
                Triangle::new(a, b, c)
            })
            .collect();
        let normals: Vec<Vector3<f64>> = (faces.iter())
            .map(|face| {
                let a = corner(face, 0);
                (corner(face, 1) - a).cross(&(corner(face, 2) - a)).normalize()
            })
            .collect();
        // Pseudonormals of vertices and edges, which tell inside from outside.
        let vertex_normals = vertex_normals(&vertices, &faces, &normals);
        let edges: Vec<Edge> = edges
            .iter()
            .map(|(ends, sides)| edge(&vertices, &faces, &normals, *ends, *sides))
            .collect();
        // The tree of boxes, and the faces around every vertex.
        let boxes: Vec<Aabb> = triangles.iter().map(Triangle::local_aabb).collect();
        let scale = vertices.iter().map(Vector3::amax).fold(0.0, f64::max);
        let (fan_starts, fans) = fans(vertices.len(), &faces);
        let mut surface = Self {
            face_edges: face_edges(&faces, &edges),
            planes: planes(faces.len(), &edges),
            corners: Vec::new(),
            tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes),
            vertices,
            faces,
            triangles,
            normals,
            edges,
            vertex_normals,
            fan_starts,
            fans,
            scale,
        };
        // Kinds of corners: they need all of the above.
        surface.corners = (0..surface.vertices.len()).map(|v| surface.corner(v)).collect();
        Ok(surface)
    }

    /// The faces around a vertex.
    pub(super) fn fan(&self, vertex: usize) -> &[usize] {
        &self.fans[self.fan_starts[vertex]..self.fan_starts[vertex + 1]]
    }

    /// The edges of the faces around a vertex that end in it, each twice.
    pub(super) fn spokes(&self, vertex: usize) -> impl Iterator<Item = usize> + '_ {
        let edges = self.fan(vertex).iter().flat_map(|face| self.face_edges[*face]);
        edges.filter(move |edge| self.edges[*edge].vertices.contains(&vertex))
    }

    fn corner(&self, vertex: usize) -> Corner {
        let Some(first) = self.fan(vertex).first() else { return Corner::Vertex };
        let mut second = None;
        for face in self.fan(vertex) {
            let plane = self.planes[*face];
            if plane != self.planes[*first] && *second.get_or_insert(plane) != plane {
                return Corner::Vertex;
            }
        }
        // Two planes meet in one line, but a cone of two halves folded flat has several.
        let mut folds = self.spokes(vertex).filter(|edge| self.edges[*edge].fold != Fold::Flat);
        match (second, folds.next()) {
            (None, _) => Corner::Face,
            (Some(_), Some(edge)) => {
                let line = self.edges[edge].along;
                let straight = |e: usize| self.edges[e].along.cross(&line).norm() <= FLAT;
                if folds.all(straight) { Corner::Edge(edge) } else { Corner::Vertex }
            }
            (Some(_), None) => Corner::Vertex,
        }
    }
}

fn vertex_normals(
    vertices: &[Vector3<f64>],
    faces: &[[usize; 3]],
    normals: &[Vector3<f64>],
) -> Vec<Vector3<f64>> {
    let mut sums = vec![Vector3::zeros(); vertices.len()];
    for (face, normal) in faces.iter().zip(normals) {
        for k in 0..3 {
            let at = vertices[face[k]];
            let (u, v) = (vertices[face[(k + 1) % 3]] - at, vertices[face[(k + 2) % 3]] - at);
            sums[face[k]] += normal * u.cross(&v).norm().atan2(u.dot(&v));
        }
    }
    // Zero only where no face is, which is never asked.
    sums.iter().map(|sum| sum.try_normalize(0.0).unwrap_or_default()).collect()
}

fn edge(
    vertices: &[Vector3<f64>],
    faces: &[[usize; 3]],
    normals: &[Vector3<f64>],
    ends: [usize; 2],
    sides: [usize; 2],
) -> Edge {
    let [n, m] = sides.map(|face| normals[face]);
    let opposite = faces[sides[1]].iter().find(|vertex| !ends.contains(vertex));
    let rise = opposite.map_or(0.0, |vertex| n.dot(&(vertices[*vertex] - vertices[ends[0]])));
    let fold = if n.cross(&m).norm() <= FLAT && n.dot(&m) > 0.0 {
        Fold::Flat
    } else if rise <= 0.0 {
        Fold::Ridge
    } else {
        Fold::Valley
    };
    let along = (vertices[ends[1]] - vertices[ends[0]]).normalize();
    // A sheet folded back on itself has no mean normal; its first face's side decides.
    let normal = (n + m).try_normalize(FLAT).unwrap_or(n);
    Edge { vertices: ends, faces: sides, normal, along, fold }
}

fn face_edges(faces: &[[usize; 3]], edges: &[Edge]) -> Vec<[usize; 3]> {
    let mut face_edges = vec![[0; 3]; faces.len()];
    for (e, edge) in edges.iter().enumerate() {
        for side in edge.faces {
            let face = &faces[side];
            for k in 0..3 {
                if edge.vertices.contains(&face[k]) && edge.vertices.contains(&face[(k + 1) % 3]) {
                    face_edges[side][k] = e;
                }
            }
        }
    }
    face_edges
}

/// Faces joined across flat edges, each named by the first of its plane.
fn planes(faces: usize, edges: &[Edge]) -> Vec<usize> {
    let mut parent: Vec<usize> = (0..faces).collect();
    let root = |parent: &[usize], mut face: usize| {
        while parent[face] != face {
            face = parent[face];
        }
        face
    };
    for edge in edges.iter().filter(|edge| edge.fold == Fold::Flat) {
        let [a, b] = edge.faces.map(|face| root(&parent, face));
        parent[a.max(b)] = a.min(b);
        // Short ways up for those to come.
        for face in edge.faces {
            parent[face] = a.min(b);
        }
    }
    for face in 0..faces {
        parent[face] = root(&parent, face);
    }
    parent
}

fn fans(vertices: usize, faces: &[[usize; 3]]) -> (Vec<usize>, Vec<usize>) {
    let mut starts = vec![0; vertices + 1];
    for vertex in faces.iter().flatten() {
        starts[vertex + 1] += 1;
    }
    for v in 0..vertices {
        starts[v + 1] += starts[v];
    }
    let mut at = starts.clone();
    let mut fans = vec![0; 3 * faces.len()];
    for (f, face) in faces.iter().enumerate() {
        for &vertex in face {
            fans[at[vertex]] = f;
            at[vertex] += 1;
        }
    }
    (starts, fans)
}
