//! The nearest place of a surface, and the conditions around a point.

use nalgebra::{Matrix3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{BvhLeafCost, BvhNode};
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::TrianglePointLocation;

use super::super::{Near, within};
use super::surface::{Corner, Edge, Fold, Surface, from_parry, to_parry};

/// Share of the surface's size below which the way from an edge or a vertex is rounding, not a direction,
/// and of a triangle's height below which a point lies on its edge.
const TOUCH: f64 = 1e-14;

/// A part of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Face,
    Edge(usize),
    Vertex(usize),
}

/// Nearest point of a triangle to a point.
#[derive(Clone, Copy, Debug)]
struct Hit {
    face: usize,
    place: Place,
    squared: f64,
}

impl BvhLeafCost for Hit {
    fn cost(&self) -> f64 {
        self.squared
    }
}

/// Squared distance of a point from a box of the tree.
fn from_box(node: &BvhNode, x: Vector) -> f64 {
    let outside = (node.mins() - x).max(x - node.maxs()).max(Vector::ZERO);
    outside.length_squared()
}

impl Surface {
    /// The signed distance with its derivatives, positive outside.
    pub(super) fn near(&self, x: &Vector3<f64>) -> Near {
        self.entry(&self.nearest(x), x)
    }

    /// See [`crate::obstacle::Obstacle::constraints`]; in no order.
    pub(super) fn constraints(
        &self,
        x: &Vector3<f64>,
        reach: f64,
        inside: bool,
        out: &mut Vec<Near>,
    ) {
        let start = out.len();
        let nearest = self.nearest(x);
        let first = self.entry(&nearest, x).flip_if(inside);
        if self.is_hollow(nearest.place, inside) {
            for face in self.faces_at(&nearest) {
                push(out, start, self.plane(*face, x).flip_if(inside));
            }
        } else {
            out.push(first);
        }
        let within = within(first.distance, reach);
        if first.distance > within {
            return;
        }
        let mut hollows = false;
        for hit in self.around(x, within) {
            if self.is_hollow(hit.place, inside) {
                hollows = true;
            } else if self.is_nearest_around(&hit, x) {
                let entry = self.entry(&hit, x).flip_if(inside);
                // What is looked at from within the solid is no wall, but the back of one.
                if entry.distance >= 0.0 {
                    push(out, start, entry);
                }
            }
        }
        if hollows {
            self.add_hollows(x, within, inside, start, out);
        }
    }

    /// Adds the planes that meet an entry's in a hollow: both bound the free space there.
    fn add_hollows(
        &self,
        x: &Vector3<f64>,
        within: f64,
        inside: bool,
        start: usize,
        out: &mut Vec<Near>,
    ) {
        let known = out.len();
        // The way out of where x has sunk.
        let tightest =
            out[start..].iter().copied().min_by(|a, b| a.distance.total_cmp(&b.distance));
        let Some(way) = tightest else { return };
        for hit in self.around(x, within) {
            if !self.is_hollow(hit.place, inside) {
                continue;
            }
            let meets = |entries: &[Near]| {
                let there = |face: &usize| {
                    entries.iter().any(|entry| entry.feature as usize == self.planes[*face])
                };
                self.faces_at(&hit).iter().any(there)
            };
            let entry = self.plane(hit.face, x).flip_if(inside);
            // A plane nearer than the surface cuts through free space, and one that x is behind may be
            // the alternative to another, on the far side of a ridge. But one that the way out leads out of,
            // too, would be met all of a sudden where x comes to their common edge.
            let holds = if way.distance < 0.0 && entry.distance < 0.0 {
                let left = entry.distance - way.distance * entry.gradient.dot(&way.gradient);
                left >= 0.0 && meets(&[way])
            } else {
                entry.distance >= way.distance.max(0.0) && meets(&out[start..known])
            };
            if holds {
                push(out, start, entry);
            }
        }
    }

    /// The nearest triangle; of equally near ones always the same.
    fn nearest(&self, x: &Vector3<f64>) -> Hit {
        let p = to_parry(x);
        let best = self.tree.find_best(
            f64::MAX,
            |node, _| from_box(node, p),
            |face, _| Some(self.hit(face as usize, p)),
        );
        // Only a point without numbers has none.
        best.map_or_else(|| self.hit(0, p), |(_, hit)| hit)
    }

    /// All triangles within a distance.
    fn around(&self, x: &Vector3<f64>, within: f64) -> impl Iterator<Item = Hit> + '_ {
        let p = to_parry(x);
        let most = within * within;
        let faces = self.tree.leaves(move |node: &BvhNode| from_box(node, p) <= most);
        faces.map(move |face| self.hit(face as usize, p)).filter(move |hit| hit.squared <= most)
    }

    fn hit(&self, face: usize, p: Vector) -> Hit {
        let triangle = &self.triangles[face];
        let (projection, location) = triangle.project_local_point_and_get_location(p, false);
        let place = self.place(face, location);
        Hit { face, place, squared: (p - projection.point).length_squared() }
    }

    /// The part of the surface that a triangle's point lies on: its edges and vertices take what rounding
    /// cannot tell from them, so that the triangles that share them agree.
    fn place(&self, face: usize, location: TrianglePointLocation) -> Place {
        let weights = match location {
            TrianglePointLocation::OnVertex(k) => {
                return Place::Vertex(self.faces[face][k as usize]);
            }
            TrianglePointLocation::OnEdge(0, [a, b]) => [a, b, 0.0],
            TrianglePointLocation::OnEdge(1, [b, c]) => [0.0, b, c],
            TrianglePointLocation::OnEdge(_, [a, c]) => [a, 0.0, c],
            TrianglePointLocation::OnFace(_, weights) => weights,
            TrianglePointLocation::OnSolid => return Place::Face,
        };
        let mut clear = (0..3).filter(|k| weights[*k] > TOUCH);
        match (clear.next(), clear.next(), clear.next()) {
            // Edges are ab, bc, ca.
            (Some(0), Some(2), None) => Place::Edge(self.face_edges[face][2]),
            (Some(k), Some(_), None) => Place::Edge(self.face_edges[face][k]),
            (Some(k), None, _) => Place::Vertex(self.faces[face][k]),
            _ => Place::Face,
        }
    }

    /// The faces that meet in a place.
    fn faces_at<'a>(&'a self, hit: &'a Hit) -> &'a [usize] {
        match hit.place {
            Place::Face => std::slice::from_ref(&hit.face),
            Place::Edge(edge) => &self.edges[edge].faces,
            Place::Vertex(vertex) => self.fan(vertex),
        }
    }

    /// True when the free space is convex in an edge or vertex: the faces there bound it together.
    fn is_hollow(&self, place: Place, inside: bool) -> bool {
        let hollow = if inside { Fold::Ridge } else { Fold::Valley };
        match place {
            Place::Face => false,
            Place::Edge(edge) => self.edges[edge].fold == hollow,
            Place::Vertex(vertex) => {
                let mut folds = self.spokes(vertex).map(|e| self.edges[e].fold);
                let mut some = false;
                folds.all(|fold| {
                    some |= fold == hollow;
                    fold == hollow || fold == Fold::Flat
                }) && some
            }
        }
    }

    /// True when a triangle's nearest point is the nearest of the surface around it. Of the triangles
    /// that share the place only one says so.
    fn is_nearest_around(&self, hit: &Hit, x: &Vector3<f64>) -> bool {
        match hit.place {
            Place::Face => true,
            Place::Edge(edge) => {
                let [a, b] = self.edges[edge].faces;
                hit.face == a.min(b) && self.hit(a.max(b), to_parry(x)).place == hit.place
            }
            Place::Vertex(vertex) => {
                let from = x - self.vertices[vertex];
                self.fan(vertex).first() == Some(&hit.face)
                    && self.spokes(vertex).all(|spoke| {
                        let edge = &self.edges[spoke];
                        let away = if edge.vertices[0] == vertex { 1.0 } else { -1.0 };
                        away * edge.along.dot(&from) <= 0.0
                    })
            }
        }
    }

    /// The distance from a place, positive outside.
    fn entry(&self, hit: &Hit, x: &Vector3<f64>) -> Near {
        match hit.place {
            Place::Face => self.plane(hit.face, x),
            Place::Edge(edge) => self.edge_entry(edge, hit.face, x),
            Place::Vertex(vertex) => match self.corners[vertex] {
                Corner::Face => self.plane(hit.face, x),
                Corner::Edge(edge) => self.edge_entry(edge, hit.face, x),
                Corner::Vertex => self.vertex_entry(vertex, x),
            },
        }
    }

    fn plane(&self, face: usize, x: &Vector3<f64>) -> Near {
        let normal = self.normals[face];
        let distance = normal.dot(&(x - from_parry(self.triangles[face].a)));
        Near::flat(distance, normal).of(self.planes[face])
    }

    fn edge_entry(&self, edge: usize, face: usize, x: &Vector3<f64>) -> Near {
        let Edge { fold, along, normal, vertices, .. } = &self.edges[edge];
        if *fold == Fold::Flat {
            return self.plane(face, x);
        }
        let from = x - self.vertices[vertices[0]];
        let across = Matrix3::identity() - along * along.transpose();
        self.corner_entry(&(across * from), &across, normal).of(self.faces.len() + edge)
    }

    fn vertex_entry(&self, vertex: usize, x: &Vector3<f64>) -> Near {
        let from = x - self.vertices[vertex];
        let before = self.faces.len() + self.edges.len();
        let normal = &self.vertex_normals[vertex];
        self.corner_entry(&from, &Matrix3::identity(), normal).of(before + vertex)
    }

    /// Around an edge or a vertex, on the side that its mean normal says.
    fn corner_entry(
        &self,
        from: &Vector3<f64>,
        across: &Matrix3<f64>,
        normal: &Vector3<f64>,
    ) -> Near {
        if from.norm() <= TOUCH * self.scale {
            return Near::flat(normal.dot(from), *normal);
        }
        Near::round(from, across, 0.0, *normal).flip_if(normal.dot(from) < 0.0)
    }
}

/// Adds an entry unless its face, edge or vertex is there already.
fn push(out: &mut Vec<Near>, start: usize, entry: Near) {
    if out[start..].iter().all(|other| other.feature != entry.feature) {
        out.push(entry);
    }
}
