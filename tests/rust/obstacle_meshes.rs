//! Mesh obstacles: distances, constraints where faces meet, and surfaces that are none.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use tdcr::lie::{Pose, so3};
use tdcr::obstacle::{Cuboid, Mesh, Near, Obstacle, Sphere};

type V = Vector3<f64>;
type Faces = Vec<[usize; 3]>;

fn nearest(obstacle: &Obstacle, x: &V) -> Near {
    obstacle.nearest(x).unwrap()
}

fn constraints(obstacle: &Obstacle, x: &V, reach: f64) -> Vec<Near> {
    let mut out = Vec::new();
    obstacle.constraints(x, reach, &mut out).unwrap();
    out
}

/// A prism over a polygon that is given counter-clockwise with its triangles.
fn prism(outline: &[(f64, f64)], lid: &[[usize; 3]], height: f64) -> (Vec<V>, Faces) {
    let n = outline.len();
    let vertices =
        [0.0, height].into_iter().flat_map(|z| outline.iter().map(move |(x, y)| V::new(*x, *y, z)));
    let mut faces: Faces = lid.iter().map(|t| t.map(|i| i + n)).collect();
    faces.extend(lid.iter().map(|[a, b, c]| [*a, *c, *b]));
    for i in 0..n {
        let j = (i + 1) % n;
        faces.extend([[i, j, j + n], [i, j + n, i + n]]);
    }
    (vertices.collect(), faces)
}

/// An L of arms 2 wide, with its inner edge along z through (1, 1).
fn l_shape(inside: bool) -> Obstacle {
    let outline = [(-1.0, -1.0), (3.0, -1.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (-1.0, 3.0)];
    let lid = [[0, 1, 3], [1, 2, 3], [0, 3, 5], [3, 4, 5]];
    let (vertices, faces) = prism(&outline, &lid, 4.0);
    Obstacle::new(Mesh::new(&vertices, &faces).unwrap(), inside)
}

const HALF: [f64; 3] = [1.0, 2.0, 1.5];

fn cube_parts() -> (Vec<V>, Faces) {
    let [a, b, c] = HALF;
    let (mut vertices, faces) =
        prism(&[(-a, -b), (a, -b), (a, b), (-a, b)], &[[0, 1, 2], [0, 2, 3]], 2.0 * c);
    for vertex in &mut vertices {
        vertex.z -= c;
    }
    (vertices, faces)
}

fn cubes(pose: &Pose, inside: bool) -> (Obstacle, Obstacle) {
    let (vertices, faces) = cube_parts();
    let mesh = Mesh::new(&vertices, &faces).unwrap();
    let cuboid = Cuboid::new(&V::zeros(), &V::from(HALF), &Matrix3::identity()).unwrap();
    let place = |obstacle: Obstacle| obstacle.transform(pose);
    (place(Obstacle::new(mesh, inside)), place(Obstacle::new(cuboid, inside)))
}

/// An octahedron whose triangles are split in four `level` times, on the unit sphere.
fn ball(level: usize) -> (Vec<V>, Faces) {
    let mut vertices: Vec<V> =
        [V::x(), V::y(), V::z()].iter().flat_map(|axis| [*axis, -axis]).collect();
    let mut faces: Faces = vec![];
    for (x, y, z) in [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4)] {
        faces.extend([[x, y, z], [y, x, 5]]);
    }
    for _ in 0..level {
        let mut middles = HashMap::new();
        let mut middle = |a: usize, b: usize| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                vertices.push((vertices[a] + vertices[b]).normalize());
                vertices.len() - 1
            })
        };
        faces = (faces.iter())
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    (vertices, faces)
}

/// A ring of radius 1 and thickness 0.4: saddles within, hills without.
fn torus(n: usize, m: usize) -> (Vec<V>, Faces) {
    let mut vertices = Vec::new();
    let mut faces = Vec::new();
    for i in 0..n {
        let (sin, cos) = (TAU * i as f64 / n as f64).sin_cos();
        for j in 0..m {
            let (up, out) = (TAU * j as f64 / m as f64).sin_cos();
            vertices.push(V::new(cos * (1.0 + 0.4 * out), sin * (1.0 + 0.4 * out), 0.4 * up));
            let at = |i: usize, j: usize| (i % n) * m + j % m;
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    (vertices, faces)
}

fn point(size: f64) -> impl Strategy<Value = V> {
    prop::array::uniform3(-size..size).prop_map(V::from)
}

fn pose() -> impl Strategy<Value = Pose> {
    (prop::array::uniform3(-1.8..1.8f64), prop::array::uniform3(-1.0..1.0f64))
        .prop_map(|(w, t)| Pose { rotation: so3::exp(&w.into()), translation: t.into() })
}

/// What the constraints say of the distance a small step on: the least of their expansions.
fn foreseen(entries: &[Near], step: &V) -> f64 {
    let value = |e: &Near| e.distance + e.gradient.dot(step) + step.dot(&(e.hessian * step)) / 2.0;
    entries.iter().map(value).fold(f64::INFINITY, f64::min)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn a_mesh_box_is_the_box(x in point(3.0), pose in pose(), inside: bool) {
        let (mesh, cuboid) = cubes(&pose, inside);
        let x = pose.transform(&x);
        let (got, want) = (nearest(&mesh, &x), nearest(&cuboid, &x));
        prop_assert!((got.distance - want.distance).abs() < 1e-14);
        // On the middle planes of the box either face is right.
        if (got.gradient - want.gradient).amax() > 1e-12 {
            prop_assert!(got.distance < 0.0);
        }
        let tied = constraints(&cuboid, &x, want.distance + 1e-9).len() > 1;
        prop_assert!(tied || (got.hessian - want.hessian).amax() < 1e-12 * (1.0 + want.hessian.amax()));
        if !inside || want.distance > 0.0 {
            let (got, want) = (constraints(&mesh, &x, 1.2), constraints(&cuboid, &x, 1.2));
            prop_assert_eq!(got.len(), want.len());
            for (got, want) in got.iter().zip(&want) {
                prop_assert!((got.distance - want.distance).abs() < 1e-14);
            }
        } else {
            // Sunk into the wall: the planes of the corner in which x is caught are among them.
            let got = constraints(&mesh, &x, 0.0);
            for face in constraints(&cuboid, &x, 0.0).iter().filter(|face| face.distance < 0.0) {
                let same = |e: &&Near| (e.gradient - face.gradient).amax() < 1e-12;
                let found = got.iter().find(same);
                prop_assert!(found.is_some_and(|e| (e.distance - face.distance).abs() < 1e-13));
            }
        }
    }

    #[test]
    fn the_tightest_constraint_is_the_distance_and_none_is_beyond_reach(
        x in point(4.0), inside: bool, reach in 0.0..1.0f64,
    ) {
        let obstacle = l_shape(inside);
        let d = nearest(&obstacle, &x).distance;
        let entries = constraints(&obstacle, &x, reach);
        prop_assert!(entries.windows(2).all(|pair| pair[0].distance <= pair[1].distance));
        prop_assert!(entries.iter().all(|e| e.distance >= d - 1e-14 && e.distance <= d.max(reach - d.min(0.0)) + 1e-14));
        for (i, e) in entries.iter().enumerate() {
            prop_assert!(entries[..i].iter().all(|other| other.feature != e.feature));
        }
        if d > 0.0 {
            prop_assert_eq!(entries[0].distance, d);
        } else {
            prop_assert!(entries[0].distance <= 0.0);
        }
    }

    /// Together they are the distance nearby, to second order, also where single gradients jump.
    #[test]
    fn constraints_foresee_the_distance_nearby(
        x in point(4.0), step in point(1.0), inside: bool, on_diagonal: bool,
    ) {
        let obstacle = l_shape(inside);
        // Halfway between the arms of the L both are as near.
        let x = if on_diagonal { V::new(x.x, x.x, x.z) } else { x };
        let step = step * 1e-4;
        let d = nearest(&obstacle, &x).distance;
        if d <= 0.01 {
            return Ok(());
        }
        let entries = constraints(&obstacle, &x, d + 2.0 * step.norm());
        let error = (foreseen(&entries, &step) - nearest(&obstacle, &(x + step)).distance).abs();
        prop_assert!(error < 1.01 * step.norm_squared() / d, "{x:?} {d} {error:e} {entries:?}");
    }

    /// Of a shape with right angles the planes a point has sunk behind lead it out, each by its own depth.
    #[test]
    fn sunk_points_are_led_to_the_surface(x in point(4.0), inside: bool) {
        let obstacle = l_shape(inside);
        let near = nearest(&obstacle, &x);
        if near.distance >= 0.0 {
            return Ok(());
        }
        let entries = constraints(&obstacle, &x, 0.3);
        let behind = entries.iter().filter(|e| e.distance < 0.0);
        let out = behind.fold(x, |out, e| out - e.gradient * e.distance);
        prop_assert!(((out - x).norm() + near.distance).abs() < 1e-14, "{x:?} {entries:?}");
        prop_assert!(nearest(&obstacle, &out).distance.abs() < 1e-14, "{x:?} {entries:?}");
    }

    /// On a ring's saddles, too, nobody is told to stay out of free space.
    #[test]
    fn on_a_ring_they_hold_wherever_there_is_room(x in point(1.6), inside: bool, step in point(0.1)) {
        let (vertices, faces) = torus(24, 12);
        let obstacle = Obstacle::new(Mesh::new(&vertices, &faces).unwrap(), inside);
        let d = nearest(&obstacle, &x).distance;
        if d <= 0.0 {
            return Ok(());
        }
        let entries = constraints(&obstacle, &x, d + 0.1);
        prop_assert_eq!(entries[0].distance, d);
        // Any step shorter than d ends in free space, and all constraints allow it.
        let step = step.normalize() * d * 0.999;
        prop_assert!(entries.iter().all(|e| e.distance + e.gradient.dot(&step) > 0.0));
        prop_assert!(nearest(&obstacle, &(x + step)).distance > 0.0);
    }

    #[test]
    fn a_fine_ball_is_nearly_the_sphere(x in point(1.5)) {
        let sphere = Obstacle::new(Sphere::new(&V::zeros(), 1.0).unwrap(), false);
        let want = nearest(&sphere, &x);
        prop_assume!(x.norm() > 0.2);
        for (level, tolerance) in [(2, 0.06), (4, 0.004)] {
            let (vertices, faces) = ball(level);
            let mesh = Obstacle::new(Mesh::new(&vertices, &faces).unwrap(), false);
            let got = nearest(&mesh, &x);
            prop_assert!((got.distance - want.distance).abs() < tolerance);
            // Normals of facets are off by up to half the angle between neighbours.
            prop_assert!((got.gradient - want.gradient).norm() < 6.0 * tolerance.sqrt());
            prop_assert_eq!(constraints(&mesh, &x, 0.0).is_empty(), false);
        }
    }
}

#[test]
fn distances_from_a_ball_converge_with_order_two() {
    let errors = [2, 3, 4, 5].map(|level| {
        let (vertices, faces) = ball(level);
        let mesh = Obstacle::new(Mesh::new(&vertices, &faces).unwrap(), false);
        let error = |i: u32| {
            let angle = 2.4 * f64::from(i);
            let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / 400.0;
            let r = (1.0 - z * z).sqrt();
            let x = 1.2 * V::new(r * angle.cos(), r * angle.sin(), z);
            (nearest(&mesh, &x).distance - 0.2).abs()
        };
        (0..400).map(error).fold(0.0, f64::max)
    });
    for pair in errors.windows(2) {
        let rate = (pair[0] / pair[1]).log2();
        assert!((1.8..2.2).contains(&rate), "{errors:?}");
    }
}

#[test]
fn in_the_hollow_of_an_l_both_arms_count() {
    let l = l_shape(false);
    let both = constraints(&l, &V::new(1.3, 1.2, 2.0), 0.4);
    let gradients: Vec<V> = both.iter().map(|e| e.gradient).collect();
    assert_eq!(gradients, [V::y(), V::x()]);
    assert!((both[0].distance - 0.2).abs() < 1e-15 && (both[1].distance - 0.3).abs() < 1e-15);
    // One arm only, once the other is out of reach.
    assert_eq!(constraints(&l, &V::new(1.3, 1.2, 2.0), 0.25).len(), 1);
    // Sunk into one arm: the other still bounds the way.
    let sunk = constraints(&l, &V::new(1.01, 0.95, 2.0), 0.1);
    assert!((sunk[0].distance + 0.05).abs() < 1e-15 && (sunk[1].distance - 0.01).abs() < 1e-15);
    // Sunk into the edge itself: out through both.
    let caught = constraints(&l, &V::new(0.98, 0.97, 2.0), 0.0);
    let values: Vec<f64> = caught.iter().map(|e| e.distance).collect();
    assert!((values[0] + 0.03).abs() < 1e-15 && (values[1] + 0.02).abs() < 1e-15);
    assert!(caught.iter().all(|e| e.hessian.amax() == 0.0));
    // Over a ridge: the edge alone, curved.
    let ridge = constraints(&l, &V::new(3.3, -1.4, 2.0), 0.7);
    assert_eq!(ridge.len(), 1);
    assert!((ridge[0].distance - 0.5).abs() < 1e-15);
    assert!((ridge[0].hessian.amax() - 0.64 / 0.5).abs() < 1e-12);
    // A thin wall's back side says nothing to one who stands before it, or is caught in it.
    let plate =
        prism(&[(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)], &[[0, 1, 2], [0, 2, 3]], 0.1);
    let plate = Obstacle::new(Mesh::new(&plate.0, &plate.1).unwrap(), false);
    assert_eq!(constraints(&plate, &V::new(0.1, 0.2, 0.15), 0.5).len(), 1);
    let caught = constraints(&plate, &V::new(0.1, 0.2, 0.07), 0.5);
    assert!(caught.len() == 1 && (caught[0].distance + 0.03).abs() < 1e-15);
}

#[test]
fn parts_that_lie_apart_count_each() {
    let (mut vertices, mut faces) = cube_parts();
    let n = vertices.len();
    vertices.extend(vertices.clone().iter().map(|vertex| vertex + V::new(2.5, 0.0, 0.0)));
    faces.extend(faces.clone().iter().map(|face| face.map(|vertex| vertex + n)));
    let pair = Obstacle::new(Mesh::new(&vertices, &faces).unwrap(), false);
    let both = constraints(&pair, &V::new(1.2, 0.0, 0.0), 0.4);
    let gradients: Vec<V> = both.iter().map(|e| e.gradient).collect();
    assert_eq!(gradients, [V::x(), -V::x()]);
}

#[test]
fn points_of_diagonals_edges_and_touching_points_have_one_answer() {
    let (mesh, cuboid) = cubes(&Pose::identity(), false);
    for x in [
        V::new(0.0, 0.0, 2.0),  // before a diagonal
        V::new(1.0, 0.0, 0.0),  // on a face
        V::new(1.0, 2.0, 0.3),  // on an edge
        V::new(1.0, 2.0, 1.5),  // on a vertex
        V::new(1.0, 0.0, 2.0),  // before an edge
        V::new(1.0, 2.0, 1.75), // before a vertex
    ] {
        let (got, want) = (nearest(&mesh, &x), nearest(&cuboid, &x));
        assert!((got.distance - want.distance).abs() < 1e-15, "{x:?}");
        assert!((got.gradient.norm() - 1.0).abs() < 1e-15);
        assert!(got.gradient.dot(&want.gradient) > 0.5, "{x:?} {got:?}");
        assert!(got.hessian.amax() < 10.0);
        assert_eq!(constraints(&mesh, &x, 0.6).len(), 1, "{x:?}");
        assert_eq!(got, nearest(&mesh, &x));
    }
    // Vertices within a plane or a straight edge are none: a face split around its middle.
    let (mut vertices, mut faces) = cube_parts();
    let [a, b, c] = faces[0];
    vertices.push((vertices[a] + vertices[b] + vertices[c]) / 3.0);
    let top = vertices.len() - 1;
    faces.splice(0..1, [[a, b, top], [b, c, top], [c, a, top]]);
    let above = vertices[top] + V::new(0.0, 0.0, 0.5);
    let split = Obstacle::new(Mesh::new(&vertices, &faces).unwrap(), false);
    let entries = constraints(&split, &above, 0.6);
    assert!(entries.len() == 1 && entries[0].hessian.amax() == 0.0);
    assert_eq!(entries[0].gradient, V::z());
}

#[test]
fn surfaces_that_are_inside_out_are_turned() {
    let (vertices, faces) = cube_parts();
    let turned: Faces = faces.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    let (outward, inward) =
        (Mesh::new(&vertices, &faces).unwrap(), Mesh::new(&vertices, &turned).unwrap());
    assert_eq!(outward.faces(), faces);
    assert!(outward == inward && outward.vertices() == vertices);
}

#[test]
fn surfaces_that_are_none_are_named() {
    let (vertices, faces) = cube_parts();
    let refused = |vertices: &[V], faces: &[[usize; 3]]| {
        let error = Mesh::new(vertices, faces).unwrap_err();
        (error.argument.clone(), error.to_string())
    };
    let mut broken = vertices.clone();
    broken[3].y = f64::NAN;
    assert_eq!(refused(&broken, &faces).0, "vertices[3]");
    assert_eq!(refused(&[], &[]).0, "vertices");
    assert_eq!(refused(&vertices, &[]).0, "faces");
    let (argument, text) = refused(&vertices, &faces[1..]);
    assert!(argument == "faces" && text.contains("the edge of vertices"), "{text}");
    let with = |i: usize, face: [usize; 3]| {
        let mut faces = faces.clone();
        faces[i] = face;
        refused(&vertices, &faces)
    };
    let missing = with(2, [0, 1, 8]);
    assert!(missing.0 == "faces[2]" && missing.1.contains("from 0 to 7, got 8"), "{}", missing.1);
    let thin = with(2, [0, 1, 1]);
    assert!(thin.0 == "faces[2]" && thin.1.contains("on one line"), "{}", thin.1);
    let [a, b, c] = faces[4];
    let turned = with(4, [a, c, b]);
    assert!(
        turned.1.contains("same way") && turned.1.contains("both running from vertex"),
        "{}",
        turned.1
    );
    // Both sides of one triangle are closed, but around nothing.
    let text = refused(&vertices, &[[0, 1, 2], [0, 2, 1]]).1;
    assert!(text.contains("no volume"), "{text}");
    // Two tetrahedra that share a vertex.
    let corner = [V::zeros(), V::x(), V::y(), V::z(), -V::x(), -V::y(), -V::z()];
    let one = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let other = [[0, 4, 5], [0, 6, 4], [0, 5, 6], [4, 6, 5]];
    assert!(Mesh::new(&corner, &one).is_ok() && Mesh::new(&corner, &other).is_ok());
    let text = refused(&corner, &[one, other].concat()).1;
    assert!(text.contains("vertex 0, where parts of it meet"), "{text}");
}

#[test]
fn a_trunk_in_a_tube_sees_the_walls_around_it() {
    // A closed tube of radius 1: 64 sides, 40 rings, as a lumen.
    let (vertices, faces) = torus(64, 40);
    let lumen = Obstacle::new(Mesh::new(&vertices, &faces).unwrap(), true);
    for i in 0..50 {
        let (sin, cos) = (0.1 * f64::from(i)).sin_cos();
        let x = V::new(cos, sin, 0.2 + 0.19 * (PI * f64::from(i) / 50.0).sin());
        let entries = constraints(&lumen, &x, 0.2);
        assert!(!entries.is_empty() && entries.len() < 12, "{}", entries.len());
        assert_eq!(entries[0].distance, nearest(&lumen, &x).distance);
    }
}
