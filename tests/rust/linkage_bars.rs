//! The linkages of one subsegment against the closed form and against differences.
use nalgebra::{SVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tdcr::linkage::four_bar::{Bend, FourBar};
use tdcr::linkage::seven_bar::{Hole, Pose, SevenBar};
use tdcr::solve::sqp::{self, Ending, Problem, Settings};

const SETTINGS: Settings = Settings {
    step_bound: 0.5,
    step_tolerance: 1e-9,
    constraint_tolerance: 1e-12,
    max_iterations: 50,
};

fn polar(radius: f64, azimuth: f64) -> Vector3<f64> {
    Vector3::new(radius * azimuth.cos(), radius * azimuth.sin(), 0.0)
}

fn check_derivatives<const N: usize, const M: usize, P: Problem<N, M>>(p: &P, x: &P::Point) {
    let at = p.linearize(x);
    let lambda = SVector::<f64, M>::from_fn(|i, _| 0.3 - 0.7 * i as f64);
    let hess = p.hessian(x, &lambda);
    let h = 1e-4;
    let f = |a: usize, da: f64, b: usize, db: f64| {
        let mut s = SVector::<f64, N>::zeros();
        s[a] += da;
        s[b] += db;
        let l = p.linearize(&p.retract(x, &s));
        (l.objective, l.constraints)
    };
    for a in 0..N {
        let e = 1e-6;
        let (f1, c1) = f(a, e, a, 0.0);
        let (f0, c0) = f(a, -e, a, 0.0);
        assert!(
            ((f1 - f0) / (2.0 * e) - at.gradient[a]).abs() < 1e-8,
            "gradient {a} {} {}",
            (f1 - f0) / (2.0 * e),
            at.gradient[a]
        );
        for j in 0..M {
            assert!(
                ((c1[j] - c0[j]) / (2.0 * e) - at.jacobian_transposed[(a, j)]).abs() < 1e-8,
                "jacobian {a} {j}"
            );
        }
        for b in 0..N {
            let l = |v: (f64, SVector<f64, M>)| v.0 + lambda.dot(&v.1);
            let second = if a == b {
                (l(f(a, h, b, 0.0)) - 2.0 * l(f(a, 0.0, b, 0.0)) + l(f(a, -h, b, 0.0))) / (h * h)
            } else {
                (l(f(a, h, b, h)) - l(f(a, h, b, -h)) - l(f(a, -h, b, h)) + l(f(a, -h, b, -h)))
                    / (4.0 * h * h)
            };
            assert!(
                (second - hess[(a, b)]).abs() < 1e-5 * (1.0 + second.abs()),
                "hessian {a} {b}: {second} {} N{N} M{M}",
                hess[(a, b)]
            );
        }
    }
}

#[test]
fn derivatives() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut u = move |a: f64, b: f64| rng.random_range(a..b);
    for k in 0..200 {
        let alike = k % 2 == 0;
        let (r, s, az, bz) = (u(0.2, 1.0), u(0.2, 1.0), u(-3.0, 3.0), u(-3.0, 3.0));
        let d = if alike { 0.0 } else { 1.0 };
        let mut holes = [
            Hole {
                lower: polar(r, az),
                upper: polar(r + d * u(-0.1, 0.3), az + d * u(-0.4, 0.4)),
                pull: u(0.1, 0.3),
            },
            Hole {
                lower: polar(s, bz),
                upper: polar(s + d * u(-0.1, 0.3), bz + d * u(-0.4, 0.4)),
                pull: u(0.1, 0.3),
            },
        ];
        if alike {
            holes[0].upper = holes[0].lower;
            holes[1].upper = holes[1].lower;
        }
        let x = Pose::new(
            &Vector3::new(u(-0.5, 0.5), u(-0.5, 0.5), 1.0),
            &Vector3::new(u(-1.0, 1.0), u(-1.0, 1.0), u(-1.0, 1.0)),
        );
        check_derivatives(&SevenBar::<2>::new(&holes), &x);
        check_derivatives(&SevenBar::<1>::new(&holes), &x);
        let h = Hole {
            lower: polar(r, 0.0),
            upper: polar(r + d * u(-0.1, 0.1), 0.0),
            pull: u(0.01, 0.3),
        };
        check_derivatives(&FourBar::new(&h), &Bend { disk: u(-1.0, 1.5), link: u(-0.7, 0.7) });
    }
}

#[test]
fn seven_bar_oracle() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut u = move |a: f64, b: f64| rng.random_range(a..b);
    let (mut worst, mut bad, mut iters, mut maxit) = (0.0_f64, 0, 0, 0);
    let n = 100_000;
    for k in 0..n {
        let half = if k % 3 == 0 { u(0.5, 0.99) } else { 10f64.powf(u(-3.3, -0.3)) };
        let phi = u(-3.14, 3.14);
        let (az, gap) = (u(-3.14, 3.14), u(0.2, 2.9));
        let bz = az + gap;
        let (c, s) = (2.0 * half * phi.cos(), 2.0 * half * phi.sin());
        let (ra, rb) = (10f64.powf(u(-2.0, 0.5)), 10f64.powf(u(-2.0, 0.5)));
        let pa = ra * (c * az.cos() + s * az.sin());
        let pb = rb * (c * bz.cos() + s * bz.sin());
        if pa < 0.0 || pb < 0.0 || pa > 0.99 || pb > 0.99 || half < 5e-4 {
            continue;
        }
        let holes = [
            Hole { lower: polar(ra, az), upper: polar(ra, az), pull: pa },
            Hole { lower: polar(rb, bz), upper: polar(rb, bz), pull: pb },
        ];
        let p = SevenBar::<2>::new(&holes);
        let beta = 2.0 * half.asin();
        let exact = Pose::bent(beta, phi);
        let start = if k % 2 == 0 {
            p.start()
        } else {
            let b = Pose::bent((beta * u(0.6, 1.4)).min(2.9), phi + u(-0.6, 0.6));
            Pose::new(
                &(b.link + Vector3::new(u(-0.3, 0.3), u(-0.3, 0.3), u(-0.3, 0.3)) * half),
                &(b.rotation_vector() + Vector3::new(0., 0., half * u(-0.5, 0.5))),
            )
        };
        let sol = sqp::minimize(&p, start, &SETTINGS);
        let e = (sol.point.link - exact.link)
            .amax()
            .max((sol.point.rotation() - exact.rotation()).amax());
        if sol.ending != Ending::Converged || e > 1e-12 {
            bad += 1;
            if bad < 20 {
                println!(
                    "{:?} {e:e} half {half} phi {phi} az {az} gap {gap} ra {ra} rb {rb} pa {pa} pb {pb} it {} start {} viol {:e} stat {:e} link {:?}",
                    sol.ending,
                    sol.iterations,
                    k % 2,
                    sol.violation,
                    sol.stationarity,
                    sol.point.link
                );
            }
        } else {
            worst = worst.max(e);
        }
        iters += sol.iterations;
        maxit = maxit.max(sol.iterations);
    }
    println!("worst {worst:e} bad {bad} mean it {} max {maxit}", iters as f64 / n as f64);
    let p = |k: f64| {
        SevenBar::<2>::new(&[
            Hole { lower: polar(0.4, 0.0), upper: polar(0.4, 0.0), pull: 0.4 * k },
            Hole { lower: polar(0.4, 2.0), upper: polar(0.4, 2.0), pull: 0.2 * k },
        ])
    };
    for k in [1e-1, 1e-3, 1e-6, 1e-9, 1e-12, 1e-100] {
        let q = p(k);
        let s = q.start();
        let sol = sqp::minimize(
            &q,
            Pose::new(&(s.link + Vector3::new(0.3 * k, 0.1 * k, 0.)), &(s.rotation_vector() * 0.7)),
            &SETTINGS,
        );
        println!(
            "{k:e} {:?} it {} viol {:e} stat {:e} rot {:?} link {:?}",
            sol.ending,
            sol.iterations,
            sol.violation,
            sol.stationarity,
            sol.point.rotation_vector(),
            sol.point.link
        );
    }
    let t = std::time::Instant::now();
    let mut acc = 0.0;
    for i in 0..1_000_000 {
        let q = p(0.05 + 1e-8 * i as f64);
        let sol = sqp::minimize(&q, q.start(), &SETTINGS);
        acc += sol.point.link.x + sol.iterations as f64;
    }
    println!("{:?} per 1e6, {acc}", t.elapsed());
    assert_eq!(bad, 0);
}
