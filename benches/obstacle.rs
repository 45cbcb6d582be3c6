//! Queries of a mesh of 10,000 triangles, 30 points each, from a trunk that leans on it. Every bench
//! checks its answers first.
//!
//! `nearest`: signed distances with derivatives. `constraints`: with all faces, edges and vertices that
//! count within 2 mm. `tube`: a lumen, whose facets meet in hollows. `sphere`: the closed form beside it.
#![allow(missing_docs, clippy::unwrap_used)] // criterion's macros; a bench may stop on a bad answer.

use std::f64::consts::TAU;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Vector3;
use tdcr::obstacle::{Mesh, Near, Obstacle, Sphere};

/// What a step of the trunk may cover \[m\].
const REACH: f64 = 0.002;

type V = Vector3<f64>;

/// A surface of revolution about z, closed by a point at either end: sides * rings * 2 triangles.
fn revolved(sides: usize, rings: usize, profile: impl Fn(f64) -> (f64, f64)) -> Mesh {
    let (_, bottom) = profile(0.0);
    let (_, top) = profile(1.0);
    let mut vertices = vec![V::new(0.0, 0.0, bottom), V::new(0.0, 0.0, top)];
    let mut faces = Vec::new();
    let at = |i: usize, j: usize| 2 + (i - 1) * sides + j % sides;
    for i in 1..=rings {
        let (r, z) = profile(i as f64 / (rings + 1) as f64);
        for j in 0..sides {
            let (sin, cos) = (TAU * j as f64 / sides as f64).sin_cos();
            vertices.push(V::new(r * cos, r * sin, z));
            if i > 1 {
                faces.push([at(i - 1, j), at(i - 1, j + 1), at(i, j + 1)]);
                faces.push([at(i - 1, j), at(i, j + 1), at(i, j)]);
            }
        }
    }
    for j in 0..sides {
        faces.extend([[0, at(1, j + 1), at(1, j)], [1, at(rings, j), at(rings, j + 1)]]);
    }
    Mesh::new(&vertices, &faces).unwrap()
}

/// Disk centres of a trunk 180 mm long that passes `gap` from the axis-parallel surface.
fn trunk(x: f64) -> Vec<V> {
    (0..30).map(|i| V::new(x, 0.0, 0.006 * f64::from(i) - 0.09)).collect()
}

fn distances(obstacle: &Obstacle, points: &[V], out: &mut Vec<Near>) {
    out.clear();
    out.extend(points.iter().map(|x| obstacle.nearest(x).unwrap()));
}

fn constraints(obstacle: &Obstacle, points: &[V], out: &mut Vec<Near>) {
    out.clear();
    for x in points {
        obstacle.constraints(x, REACH, out).unwrap();
    }
}

fn benches(c: &mut Criterion) {
    let mut group = c.benchmark_group("obstacle");
    let mut out = Vec::with_capacity(1000);

    let sphere = Obstacle::new(Sphere::new(&V::zeros(), 0.056).unwrap(), false);
    let arc = |t: f64| ((t * TAU / 2.0).sin() * 0.056, -(t * TAU / 2.0).cos() * 0.056);
    let ball = revolved(100, 50, arc);
    assert_eq!(ball.faces().len(), 10_000);
    let ball = Obstacle::new(ball, false);
    let points = trunk(0.058);
    let exact: Vec<f64> = points.iter().map(|x| sphere.nearest(x).unwrap().distance).collect();
    distances(&ball, &points, &mut out);
    assert!(out.iter().zip(&exact).all(|(got, want)| (got.distance - want).abs() < 2e-4));
    group.bench_function("sphere/30_points", |b| {
        b.iter(|| distances(&sphere, black_box(&points), &mut out));
    });
    group.bench_function("nearest/ball_of_10000/30_points", |b| {
        b.iter(|| distances(&ball, black_box(&points), &mut out));
    });
    constraints(&ball, &points, &mut out);
    assert!(out.len() >= 30);
    group.bench_function("constraints/ball_of_10000/30_points", |b| {
        b.iter(|| constraints(&ball, black_box(&points), &mut out));
    });

    let tube =
        revolved(100, 50, |t| (if t == 0.0 || t == 1.0 { 0.0 } else { 0.02 }, 0.3 * t - 0.15));
    let tube = Obstacle::new(tube, true);
    for (name, x) in [("by_the_wall", 0.0195), ("in_the_middle", 0.005)] {
        let points = trunk(x);
        distances(&tube, &points, &mut out);
        assert!(out.iter().all(|near| (near.distance - (0.02 - x)).abs() < 2e-5));
        constraints(&tube, &points, &mut out);
        assert!(out.len() >= 30);
        group.bench_function(format!("constraints/tube_of_10000/{name}/30_points"), |b| {
            b.iter(|| constraints(&tube, black_box(&points), &mut out));
        });
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
