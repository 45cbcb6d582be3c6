//! The linkages of one subsegment: derivatives, the closed form, the paper's own nine coordinates.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, SMatrix, SVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::linkage::four_bar::{Bend, FourBar};
use tdcr::linkage::seven_bar::{Hole, SevenBar};
use tdcr::linkage::{LinkageSettings, Pose, solve_four_bar, solve_seven_bar};
use tdcr::solve::sqp::{Ending, Linearization, Problem, Settings};

fn settings() -> Settings {
    LinkageSettings::default().sqp()
}

fn uniform(seed: u64) -> impl FnMut(f64, f64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    move |low, high| rng.random_range(low..high)
}

fn polar(radius: f64, azimuth: f64) -> Vector3<f64> {
    Vector3::new(radius * azimuth.cos(), radius * azimuth.sin(), 0.0)
}

fn alike(radius: f64, azimuth: f64, pull: f64) -> Hole {
    Hole::new(polar(radius, azimuth), polar(radius, azimuth), pull)
}

fn linearize<const N: usize, const M: usize, P: Problem<N, M>>(
    problem: &P,
    point: &P::Point,
) -> Linearization<N, M> {
    let mut out = Linearization {
        objective: f64::NAN,
        gradient: SVector::repeat(f64::NAN),
        constraints: SVector::repeat(f64::NAN),
        jacobian_transposed: SMatrix::repeat(f64::NAN),
    };
    problem.linearize(point, &mut out);
    out
}

/// First and second derivatives along the retraction against central differences.
fn check_derivatives<const N: usize, const M: usize, P: Problem<N, M>>(p: &P, x: &P::Point) {
    let at = linearize(p, x);
    let lambda = SVector::<f64, M>::from_fn(|i, _| 0.3 - 0.7 * i as f64);
    let hessian = p.hessian(x, &lambda);
    let moved = |steps: [(usize, f64); 2]| {
        let mut step = SVector::<f64, N>::zeros();
        for (axis, size) in steps {
            // In units of the physical step: the crank's local unit may be large.
            let mut unit = SVector::<f64, N>::zeros();
            unit[axis] = 1.0;
            step[axis] += size / p.step_size(&unit);
        }
        let mut there = *x;
        p.retract(x, &step, 1.0, &mut there);
        let l = linearize(p, &there);
        (l.objective, l.constraints)
    };
    let size = |axis: usize| {
        let mut unit = SVector::<f64, N>::zeros();
        unit[axis] = 1.0;
        p.step_size(&unit)
    };
    let lagrangian = |v: (f64, SVector<f64, M>)| v.0 + lambda.dot(&v.1);
    for a in 0..N {
        let h = 1e-5;
        let (up, down) = (moved([(a, h), (a, 0.0)]), moved([(a, -h), (a, 0.0)]));
        let slope = (up.0 - down.0) / (2.0 * h) * size(a);
        assert!((slope - at.gradient[a]).abs() < 1e-8 * (1.0 + size(a)), "gradient {a}");
        for j in 0..M {
            let slope = (up.1[j] - down.1[j]) / (2.0 * h) * size(a);
            let exact = at.jacobian_transposed[(a, j)];
            assert!((slope - exact).abs() < 1e-8 * (1.0 + size(a)), "jacobian {a} {j}");
        }
        for b in 0..N {
            let h = 1e-4;
            let second = if a == b {
                lagrangian(moved([(a, h), (b, 0.0)]))
                    - 2.0 * lagrangian(moved([(a, 0.0), (b, 0.0)]))
                    + lagrangian(moved([(a, -h), (b, 0.0)]))
            } else {
                (lagrangian(moved([(a, h), (b, h)]))
                    - lagrangian(moved([(a, h), (b, -h)]))
                    - lagrangian(moved([(a, -h), (b, h)]))
                    + lagrangian(moved([(a, -h), (b, -h)])))
                    / 4.0
            };
            let scale = size(a) * size(b);
            let difference = second / (h * h) * scale - hessian[(a, b)];
            assert!(difference.abs() < 2e-6 * (1.0 + scale), "hessian {a} {b}: {difference:e}");
        }
    }
}

#[test]
fn derivatives_agree_with_differences() {
    let mut u = uniform(1);
    for k in 0..200 {
        let change = if k % 2 == 0 { 0.0 } else { 1.0 };
        let mut hole = |span: f64| {
            let (radius, azimuth) = (u(0.2, 1.0), u(-3.0, 3.0));
            let upper =
                polar(radius + change * u(-0.1, 0.3), azimuth + change * span * u(-1.0, 1.0));
            let lower = polar(radius, azimuth);
            Hole::new(lower, if change > 0.0 { upper } else { lower }, u(0.1, 0.3))
        };
        let (pair, planar) = ([hole(0.4), hole(0.4)], hole(0.0));
        let mut v = || Vector3::new(u(-0.5, 0.5), u(-0.5, 0.5), u(-0.5, 0.5));
        let pose = Pose::new(&(v() + Vector3::z()), &(v() * 2.0));
        let (two, one) = (SevenBar::<2>::new(&pair), SevenBar::<1>::new(&pair));
        check_derivatives(&two, &two.point(pose));
        check_derivatives(&one, &one.point(pose));
        check_derivatives(&FourBar::new(&planar), &Bend { disk: u(-1.0, 1.5), link: u(-0.7, 0.7) });
    }
}

/// A random pair of alike holes with both tendons pulled, and its exact bend (half sine, azimuth).
fn random_pair(u: &mut impl FnMut(f64, f64) -> f64, half: f64) -> ([Hole; 2], f64) {
    loop {
        let towards = u(-PI, PI);
        let azimuths = {
            let a = u(-PI, PI);
            [a, a + u(0.2, PI - 0.2)]
        };
        let holes = azimuths.map(|azimuth| {
            let radius = 10f64.powf(u(-2.0, 0.5));
            alike(radius, azimuth, 2.0 * half * radius * (azimuth - towards).cos())
        });
        if holes.iter().all(|h| h.pull > 1e-3 * h.upper.norm().min(half) && h.pull < 0.99) {
            return (holes, towards);
        }
    }
}

/// Within 1e-12 of the length for pulls of at least 1e-3 of the radius, 1e-15 a/delta
/// below; from the linear start and from random ones around the answer.
#[test]
fn seven_bars_meet_the_closed_form() {
    let mut u = uniform(2);
    let (mut worst, mut solved_from_given) = (0.0_f64, 0);
    let total = 100_000;
    for k in 0..total {
        let half = match k % 3 {
            0 => u(0.5, 0.99),
            1 => 10f64.powf(u(-3.0, -0.3)),
            _ => 10f64.powf(u(-10.0, -3.0)),
        };
        let (holes, towards) = random_pair(&mut u, half);
        let beta = 2.0 * half.asin();
        let exact = Pose::from_bend(beta, towards);
        let near = Pose::from_bend((beta * u(0.6, 1.4)).min(2.9), towards + u(-0.6, 0.6));
        let mut v = || Vector3::new(u(-0.3, 0.3), u(-0.3, 0.3), u(-0.3, 0.3)) * half;
        let start = Pose::new(&(near.link + v()), &(near.rotation_vector() + v()));
        let found = solve_seven_bar::<2>(&holes, &settings(), (k % 2 == 0).then_some(start));
        assert_eq!(found.ending, Ending::Converged, "{half} {towards} {holes:?}");
        solved_from_given += usize::from(found.iterations < 30);
        let pose = found.point.pose;
        let link = (pose.link - exact.link).amax();
        let disk = (pose.rotation() - exact.rotation()).amax();
        let smallest = holes.iter().map(|h| h.pull / h.upper.norm()).fold(f64::MAX, f64::min);
        let allowed = if smallest >= 1e-3 { 1e-12 } else { 1e-15 / smallest + 1e-12 };
        assert!(link < allowed && disk < allowed, "{link:e} {disk:e} {half} {towards} {holes:?}");
        if smallest >= 1e-3 {
            worst = worst.max(link.max(disk));
        }
    }
    println!("worst error at pulls >= 1e-3 of the radius: {worst:.1e} of the subsegment");
    // Falling back to the own start is for the wildest starts only.
    assert!(solved_from_given > total * 99 / 100);
}

#[test]
fn four_bars_meet_the_closed_form() {
    let mut u = uniform(3);
    for k in 0..20_000 {
        let half = if k % 2 == 0 { u(0.1, 0.99) } else { 10f64.powf(u(-12.0, -1.0)) };
        let radius = 10f64.powf(u(-2.0, 0.0)).min(0.49 / half);
        let hole = alike(radius, 0.0, 2.0 * half * radius);
        let problem = FourBar::new(&hole);
        let beta = 2.0 * half.asin();
        let found = solve_four_bar(&hole, &settings());
        assert_eq!(found.ending, Ending::Converged);
        if beta > 0.01 {
            let off = (problem.start().disk - beta).abs();
            assert!(off > 1e-3 * beta.powi(5), "the start is the answer");
        }
        // Conditioning: d(beta)/d(half) = 2 / cos(beta / 2), and a piece of length l is met in l^2.
        let rounding = 1e-15 / ((0.5 * beta).cos() * (1.0 - hole.pull));
        assert!((found.point.disk - beta).abs() < rounding * (1.0 + 10.0 * beta), "{half}");
        assert!((found.point.link - 0.5 * beta).abs() < 1e-12 + 1e-16 / half, "{half} {radius}");
    }
}

/// The points of the paper for a pose: x0, xa, xb in nine coordinates.
fn points(pose: &Pose, holes: &[Hole; 2]) -> DVector<f64> {
    let r: Matrix3<f64> = pose.rotation();
    let all = [pose.link, pose.link + r * holes[0].upper, pose.link + r * holes[1].upper];
    DVector::from_iterator(9, all.iter().flat_map(|p| p.iter().copied()).collect::<Vec<_>>())
}

/// The paper's objective (eq. 9) and constraints (eq. 10) in nine coordinates, as they are printed.
fn paper(x: &DVector<f64>, holes: &[Hole; 2]) -> (f64, DVector<f64>) {
    let p = |k: usize| Vector3::new(x[3 * k], x[3 * k + 1], x[3 * k + 2]);
    let (x0, xa, xb) = (p(0), p(1), p(2));
    let (a, b) = (holes[0].lower, holes[1].lower);
    let objective = (xa - x0).angle(&a).powi(2) + (xb - x0).angle(&b).powi(2);
    let constraints = vec![
        x0.norm() - 1.0,
        (xa - a).norm() - (1.0 - holes[0].pull),
        (xb - b).norm() - (1.0 - holes[1].pull),
        (xa - x0).norm() - a.norm(),
        (xb - x0).norm() - b.norm(),
        (xa - x0).angle(&(xb - x0)) - a.angle(&b),
    ];
    (objective, DVector::from_vec(constraints))
}

/// The five coordinates of the solver are the paper's nine less its four rigid equalities: the answer
/// satisfies the first-order conditions of the problem as printed.
#[test]
fn answers_satisfy_the_paper_s_nine_coordinate_conditions() {
    let mut u = uniform(4);
    for _ in 0..200 {
        let half = u(0.05, 0.6);
        let (holes, _) = random_pair(&mut u, half);
        let found = solve_seven_bar::<2>(&holes, &settings(), None);
        let x = points(&found.point.pose, &holes);
        let (_, constraints) = paper(&x, &holes);
        assert!(constraints.amax() < 1e-13, "{constraints}");
        let h = 1e-6;
        let mut gradient = DVector::zeros(9);
        let mut jacobian = DMatrix::zeros(6, 9);
        for i in 0..9 {
            let (mut up, mut down) = (x.clone(), x.clone());
            up[i] += h;
            down[i] -= h;
            let (up, down) = (paper(&up, &holes), paper(&down, &holes));
            gradient[i] = (up.0 - down.0) / (2.0 * h);
            jacobian.set_column(i, &((up.1 - down.1) / (2.0 * h)));
        }
        let decomposition = jacobian.transpose().svd(true, true);
        let multipliers = decomposition.solve(&-&gradient, 1e-12).unwrap();
        let residual = (&gradient + jacobian.transpose() * multipliers).amax();
        assert!(residual < 1e-6 * gradient.amax(), "{residual:e} {}", gradient.amax());
    }
}

/// Why holes that differ between the disks need more than coupler angles: taken alone they have
/// zeros where the subsegment is sheared and the disk does not turn at all.
#[test]
fn coupler_angles_alone_vanish_at_a_shear() {
    let hole = Hole::new(polar(0.5, 0.0), polar(0.45, 0.0), 0.02);
    let rest = hole.rest;
    let offset = hole.upper - hole.lower;
    // |d + offset| = rest - pull with the disk parallel: d.offset is known, and d is a unit vector.
    let along = ((rest - hole.pull).powi(2) - 1.0 - offset.norm_squared()) / (2.0 * offset.norm());
    let link = Vector3::new(along * offset.x.signum(), 0.0, (1.0 - along * along).sqrt());
    assert!(((link + offset).norm() - (rest - hole.pull)).abs() < 1e-15);
    assert!(link.x > 0.3, "a tilt of {} rad without any coupler angle", link.x.asin());
    // With the angles between crank and disk axes the answer is a bend with the link in its middle.
    let bend = solve_four_bar(&hole, &settings()).point;
    assert!(bend.disk > 0.03 && (bend.link / bend.disk - 0.5).abs() < 0.1, "{bend:?}");
}

/// At equal holes the added angles change nothing: answers are continuous in the holes.
#[test]
fn answers_are_continuous_where_the_objective_changes() {
    let mut u = uniform(5);
    for _ in 0..100 {
        let half = u(0.01, 0.5);
        let (holes, _) = random_pair(&mut u, half);
        let same = solve_seven_bar::<2>(&holes, &settings(), None).point.pose;
        let nearly = holes.map(|h| Hole::new(h.lower, h.upper * (1.0 + 1e-9), h.pull));
        let near = solve_seven_bar::<2>(&nearly, &settings(), None).point.pose;
        assert!((same.link - near.link).amax() < 1e-7);
        assert!((same.rotation() - near.rotation()).amax() < 1e-7);
        let planar = alike(holes[0].upper.norm(), 0.0, 1.9 * half * holes[0].upper.norm().min(0.5));
        let bend = solve_four_bar(&planar, &settings()).point;
        let nearly = Hole::new(planar.lower, planar.upper * (1.0 + 1e-9), planar.pull);
        let near = solve_four_bar(&nearly, &settings()).point;
        assert!((bend.disk - near.disk).abs() < 1e-7 && (bend.link - near.link).abs() < 1e-7);
    }
}

#[test]
fn one_tendon_in_space_agrees_with_the_plane() {
    // A straight tendon in the spatial linkage (second hole without tendon) is the four-bar.
    let mut u = uniform(6);
    for _ in 0..200 {
        let (radius, azimuth, half) = (u(0.1, 0.8), u(-PI, PI), u(0.001, 0.5));
        let pull = 2.0 * half * radius;
        let span = alike(radius, azimuth + 0.5 * PI, 0.0);
        let space = solve_seven_bar::<1>(&[alike(radius, azimuth, pull), span], &settings(), None);
        assert_eq!(space.ending, Ending::Converged);
        let exact = Pose::from_bend(2.0 * half.asin(), azimuth);
        assert!((space.point.pose.rotation() - exact.rotation()).amax() < 1e-12);
        assert!((space.point.pose.link - exact.link).amax() < 1e-11);
    }
}

#[test]
fn poses_report_the_rotation_vector_they_were_made_from() {
    let mut u = uniform(7);
    for k in 0..1000 {
        let size = if k % 2 == 0 { u(0.0, PI) } else { 10f64.powf(u(-300.0, 0.0)) };
        let vector = Vector3::new(u(-1.0, 1.0), u(-1.0, 1.0), u(-1.0, 1.0)).normalize() * size;
        let pose = Pose::new(&Vector3::z(), &vector);
        assert!((pose.rotation_vector() - vector).amax() <= 4e-15 * size);
        let reference = Rotation3::new(vector);
        assert!((pose.rotation() - reference.matrix()).amax() < 2e-15);
    }
}
