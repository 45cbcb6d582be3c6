//! The particle swarm: published constants, reproducibility, bounds, stops, bad values.

use std::f64::consts::{LN_2, TAU};

use tdcr::Status;
use tdcr::batch::pool;
use tdcr::solve::pso::{
    Bounds, CHI, Objective, PHI, Parallel, Pointwise, Progress, PsoSettings, Report,
    SPSO_ACCELERATION, SPSO_INERTIA, Sampling, Stop, Swarm, Topology, Watched, Whole,
};

pub(crate) fn sphere(x: &[f64]) -> f64 {
    x.iter().map(|x| (x - 1.0).powi(2)).sum()
}

pub(crate) fn rosenbrock(x: &[f64]) -> f64 {
    x.windows(2).map(|w| 100.0 * (w[1] - w[0] * w[0]).powi(2) + (1.0 - w[0]).powi(2)).sum()
}

pub(crate) fn rastrigin(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x - 10.0 * (TAU * x).cos() + 10.0).sum()
}

/// Every preset, with every topology where it has a choice.
pub(crate) fn kinds() -> Vec<(&'static str, PsoSettings)> {
    let constriction = PsoSettings::constriction();
    vec![
        ("constriction", constriction),
        ("constriction, ring", PsoSettings { topology: Topology::Ring, ..constriction }),
        ("spso2011", PsoSettings::spso2011()),
        ("spso2011, ring", PsoSettings { topology: Topology::Ring, ..PsoSettings::spso2011() }),
        ("mahfoudi", PsoSettings::mahfoudi()),
    ]
}

pub(crate) fn swarm(settings: PsoSettings, half: f64, n: usize) -> Swarm {
    Swarm::new(settings, &vec![-half; n], &vec![half; n]).unwrap()
}

/// Chi = 0.7298 and 1.49618 for c = 2.05: Clerc & Kennedy 2002, 10.1109/4235.985692, and Eberhart & Shi
/// 2000, 10.1109/CEC.2000.870279. 0.721 and 1.193: Zambrano-Bigiarini, Clerc & Rojas 2013,
/// 10.1109/CEC.2013.6557848.
#[test]
fn presets_are_those_published() {
    let chi = 2.0 / (2.0 - PHI - (PHI * PHI - 4.0 * PHI).sqrt()).abs();
    assert!((CHI - chi).abs() < 1e-15 && (CHI - 0.7298).abs() < 5e-5);
    let constriction = PsoSettings::constriction();
    assert_eq!((constriction.inertia, constriction.cognitive), (CHI, CHI * 2.05));
    assert!((constriction.social - 1.49618).abs() < 5e-6);
    assert_eq!(PsoSettings::default(), constriction);
    assert!((SPSO_INERTIA - 0.5 / LN_2).abs() < 1e-15 && (SPSO_INERTIA - 0.721).abs() < 5e-4);
    assert!((SPSO_ACCELERATION - (0.5 + LN_2)).abs() < 1e-15);
    let spso = PsoSettings::spso2011();
    assert_eq!((spso.sampling, spso.bounds), (Sampling::Sphere, Bounds::Rebound));
    assert_eq!((spso.topology, spso.neighbours, spso.particles), (Topology::Random, 3, 40));
    // Poli 2009, 10.1109/TEVC.2008.2011738: c1 + c2 < 24 (1 - w^2) / (7 - 5 w) settles.
    for (name, PsoSettings { inertia: w, cognitive, social, sampling, .. }) in kinds() {
        let settles = cognitive + social < 24.0 * (1.0 - w * w) / (7.0 - 5.0 * w);
        assert!(settles || sampling == Sampling::Sphere, "{name}");
    }
}

/// The numbers of a run, to the bit.
fn trace<O: Objective>(swarm: &mut Swarm, objective: &mut O) -> (Report, Vec<f64>, Vec<f64>)
where
    O::Error: std::fmt::Debug,
{
    let report = swarm.run(objective).unwrap();
    (report, swarm.history().to_vec(), swarm.places().to_vec())
}

#[test]
fn the_run_depends_on_the_seed_alone() {
    for (name, settings) in kinds() {
        let settings = PsoSettings { max_iterations: 60, seed: 11, ..settings };
        let one = trace(&mut swarm(settings, 5.0, 5), &mut Pointwise(rastrigin));
        for threads in [1, 2, 7] {
            let pool = pool(Some(threads)).unwrap();
            let mut parallel = Parallel { function: rastrigin, pool: &pool };
            assert_eq!(trace(&mut swarm(settings, 5.0, 5), &mut parallel), one, "{name} {threads}");
        }
        let mut whole = Whole(|points: &[f64], n: usize, values: &mut [f64]| {
            for (value, point) in values.iter_mut().zip(points.chunks(n)) {
                *value = rastrigin(point);
            }
        });
        assert_eq!(trace(&mut swarm(settings, 5.0, 5), &mut whole), one, "{name}");
        // A swarm used before, in another box and number of dimensions, is as good as new.
        let mut used = swarm(PsoSettings { particles: 3, ..settings }, 1.0, 40);
        used.run(&mut Pointwise(rosenbrock)).unwrap();
        used.reset(settings, &[-5.0; 5], &[5.0; 5]).unwrap();
        assert_eq!(trace(&mut used, &mut Pointwise(rastrigin)), one, "{name}");
        assert_eq!(trace(&mut used, &mut Pointwise(rastrigin)), one, "{name}, again");
        used.reseed(12);
        let other = trace(&mut used, &mut Pointwise(rastrigin));
        assert!(other.0.seed == 12 && one.0.seed == 11 && other.2 != one.2, "{name}");
    }
}

#[test]
fn no_point_leaves_the_box() {
    // Dimensions of very different width, one without any.
    let (lower, upper) = ([-1.0, 3.0, -1e-9, 2.0, -1e150], [1.0, 1e6, 1e-9, 2.0, 1e150]);
    for (name, kind) in kinds() {
        for bounds in Bounds::ALL {
            for (velocity_limit, inertia) in
                [(None, kind.inertia), (Some(0.1), kind.inertia), (Some(1000.0), 1.5), (None, 2.0)]
            {
                let settings = PsoSettings {
                    bounds,
                    velocity_limit,
                    inertia,
                    max_iterations: 200,
                    stagnation: None,
                    ..kind
                };
                let mut swarm = Swarm::new(settings, &lower, &upper).unwrap();
                let mut on_bounds = 0;
                // Draws the swarm to a corner, where the bounds work.
                let mut objective = Pointwise(|x: &[f64]| {
                    for d in 0..5 {
                        assert!((lower[d]..=upper[d]).contains(&x[d]), "{name} {bounds:?} {x:?}");
                        on_bounds += usize::from(d != 3 && x[d] == lower[d]);
                    }
                    x[0] + 1e-6 * x[1] + 1e9 * x[2] + 1e-150 * x[4]
                });
                swarm.run(&mut objective).unwrap();
                assert!(on_bounds > 0 || bounds == Bounds::Reflect, "{name} {bounds:?}");
            }
        }
    }
}

/// No coordinate moves by more than the limit, wherever nothing is mirrored.
#[test]
fn velocities_are_limited() {
    for (name, kind) in kinds() {
        let settings = PsoSettings {
            velocity_limit: Some(0.03),
            bounds: Bounds::Absorb,
            max_iterations: 100,
            ..kind
        };
        let mut swarm = swarm(settings, 5.0, 3);
        let mut before: Vec<f64> = Vec::new();
        let mut objective = Whole(|points: &[f64], _, values: &mut [f64]| {
            for (old, new) in before.iter().zip(points) {
                assert!((old - new).abs() <= 0.3 + 1e-12, "{name}");
            }
            before = points.to_vec();
            values.iter_mut().zip(points.chunks(3)).for_each(|(v, p)| *v = rastrigin(p));
        });
        swarm.run(&mut objective).unwrap();
    }
}

#[test]
fn runs_stop_where_they_should() {
    let run = |settings| swarm(settings, 5.0, 2).run(&mut Pointwise(sphere)).unwrap();
    let base = PsoSettings { particles: 10, stagnation: None, ..PsoSettings::default() };
    let hit = run(PsoSettings { target: Some(1e-3), ..base });
    assert!(hit.stop == Stop::Target && hit.value <= 1e-3 && hit.status == Status::Converged);
    assert_eq!(hit.evaluations, 10 * (hit.iterations + 1));
    let at_once = run(PsoSettings { target: Some(1e3), ..base });
    assert_eq!((at_once.iterations, at_once.evaluations), (0, 10));

    let long = run(PsoSettings { target: Some(-1.0), max_iterations: 37, ..base });
    assert_eq!((long.stop, long.status), (Stop::Iterations, Status::IterationLimit));
    assert_eq!((long.iterations, long.evaluations), (37, 380));
    for most in [10, 19, 20, 95] {
        let spent = run(PsoSettings { max_evaluations: Some(most), ..base });
        assert_eq!((spent.stop, spent.evaluations), (Stop::Evaluations, most / 10 * 10));
        assert_eq!(spent.status, Status::IterationLimit);
    }

    // Steps of the value smaller than the improvement asked for are no progress.
    let still = PsoSettings { stagnation: Some(20), improvement: 1e-3, ..base };
    let idle = run(still);
    assert_eq!((idle.stop, idle.status), (Stop::Stagnation, Status::Converged));
    let missed = run(PsoSettings { target: Some(-1.0), ..still });
    assert_eq!((missed.stop, missed.status), (Stop::Stagnation, Status::IterationLimit));
    assert_eq!(missed.value, idle.value);
    let flat = swarm(PsoSettings { stagnation: Some(1), ..base }, 5.0, 2)
        .run(&mut Pointwise(|_: &[f64]| 3.0))
        .unwrap();
    assert_eq!((flat.iterations, flat.value), (1, 3.0));
    assert!(missed.message(Some(-1.0)).contains("makes no progress"));
    assert_eq!(hit.message(Some(1e-3)), "");
}

#[test]
fn a_watcher_sees_every_iteration_and_may_stop() {
    let mut swarm = swarm(PsoSettings::default(), 5.0, 2);
    let mut seen: Vec<Progress> = Vec::new();
    let report = swarm
        .run(&mut Watched {
            objective: Pointwise(sphere),
            watch: |progress: &Progress| {
                seen.push(*progress);
                progress.iteration == 7
            },
        })
        .unwrap();
    assert_eq!((report.stop, report.status), (Stop::Callback, Status::IterationLimit));
    assert!(seen.iter().map(|p| p.iteration).eq(0..=7));
    assert!(seen.iter().map(|p| p.value).eq(swarm.history().iter().copied()));
    assert!(swarm.history().windows(2).all(|w| w[1] <= w[0]));
    assert_eq!(*swarm.history().last().unwrap(), report.value);
}

/// What goes wrong in an objective ends the run and comes back as it is.
#[test]
fn errors_of_the_objective_come_back() {
    struct Fails(usize);
    impl Objective for Fails {
        type Error = String;
        fn values(&mut self, _: &[f64], _: usize, values: &mut [f64]) -> Result<(), String> {
            self.0 += 1;
            values.fill(1.0 / self.0 as f64);
            if self.0 == 5 { Err("five".to_owned()) } else { Ok(()) }
        }
    }
    let mut swarm = swarm(PsoSettings::default(), 1.0, 2);
    assert_eq!(swarm.run(&mut Fails(0)), Err("five".to_owned()));
    // And the swarm goes on as if nothing had been.
    assert!(swarm.run(&mut Pointwise(sphere)).unwrap().value < 1e-3);
}

#[test]
fn nan_is_counted_and_never_best() {
    for (name, kind) in kinds() {
        let settings = PsoSettings { target: Some(1e-8), ..kind };
        let mut count = 0;
        let mut half = Pointwise(|x: &[f64]| {
            // No value in half of the box, and just beside the minimum (1, 1).
            if x[0] < 0.9 {
                count += 1;
                f64::NAN
            } else {
                sphere(x)
            }
        });
        let mut swarm = swarm(settings, 5.0, 2);
        let report = swarm.run(&mut half).unwrap();
        assert_eq!(report.status, Status::Converged, "{name}");
        assert_eq!(report.nan_count, count, "{name}");
        assert!(count > 0 && swarm.best()[0] >= 0.9);

        let never = swarm.run(&mut Pointwise(|_: &[f64]| f64::NAN)).unwrap();
        assert_eq!((never.status, never.stop), (Status::NumericalError, Stop::Stagnation));
        assert_eq!((never.nan_count, never.value), (never.evaluations, f64::INFINITY));
        assert!(never.message(None).contains("below infinity"));
    }
}

/// As long as there is no value, particles only coast: nothing draws them back to where they were.
#[test]
fn without_a_value_nothing_pulls() {
    for (name, kind) in kinds() {
        let settings = PsoSettings { max_iterations: 4, bounds: Bounds::Clamp, ..kind };
        let mut seen: Vec<Vec<f64>> = Vec::new();
        let mut nowhere = Whole(|points: &[f64], _, _: &mut [f64]| seen.push(points.to_vec()));
        swarm(settings, 5.0, 2).run(&mut nowhere).unwrap();
        let mut coasting = 0;
        for e in 0..seen[0].len() {
            // Those that meet a wall stop there.
            if seen.iter().all(|places| places[e].abs() < 5.0) {
                coasting += 1;
                for w in seen.windows(3) {
                    let (before, after) = (w[1][e] - w[0][e], w[2][e] - w[1][e]);
                    assert!((after - kind.inertia * before).abs() < 1e-14, "{name}");
                }
            }
        }
        assert!(coasting > 5, "{name}");
    }
}

/// An objective that forgets a value has not found one.
#[test]
fn values_left_out_are_nan() {
    let settings = PsoSettings { max_iterations: 9, particles: 10, ..PsoSettings::default() };
    let mut one = Whole(|points: &[f64], _, values: &mut [f64]| values[3] = points[6]);
    let report = swarm(settings, 1.0, 2).run(&mut one).unwrap();
    assert_eq!(report.nan_count, 90);
}

#[test]
fn infinities_are_values() {
    for (name, kind) in kinds() {
        // Forbidden: worse than anything. The minimum is on the fence.
        let mut fence =
            Pointwise(|x: &[f64]| if x[0] > 0.5 { f64::INFINITY } else { sphere(x) - 0.25 });
        let settings = PsoSettings { target: Some(1e-4), ..kind };
        let report = swarm(settings, 5.0, 2).run(&mut fence).unwrap();
        assert!(report.status == Status::Converged && report.nan_count == 0, "{name}");
        // Nothing is lower.
        let mut log = Pointwise(|x: &[f64]| if x[0] > 4.0 { f64::NEG_INFINITY } else { x[1] });
        let report = swarm(kind, 5.0, 2).run(&mut log).unwrap();
        assert_eq!((report.stop, report.value), (Stop::Target, f64::NEG_INFINITY), "{name}");
        let mut wall = Pointwise(|_: &[f64]| f64::INFINITY);
        let report = swarm(kind, 5.0, 2).run(&mut wall).unwrap();
        assert_eq!(report.status, Status::NumericalError, "{name}");
    }
}

#[test]
fn given_points_are_where_the_first_particles_start() {
    let mut swarm = swarm(PsoSettings { particles: 3, ..PsoSettings::default() }, 5.0, 2);
    swarm.start_from(&[1.0, 1.0, -5.0, 5.0]).unwrap();
    let mut first = Vec::new();
    let mut objective = Pointwise(|x: &[f64]| {
        first.push(x.to_vec());
        sphere(x)
    });
    let report = swarm.run(&mut objective).unwrap();
    assert_eq!((report.value, swarm.best()), (0.0, &[1.0, 1.0][..]));
    assert_eq!(first[..2], [[1.0, 1.0], [-5.0, 5.0]]);
    let name = |result: Result<(), tdcr::InvalidInput>| result.unwrap_err().argument;
    assert_eq!(name(swarm.start_from(&[1.0])), "start");
    assert_eq!(name(swarm.start_from(&[1.0; 8])), "start");
    assert_eq!(name(swarm.start_from(&[1.0, 5.1])), "start");
    assert_eq!(name(swarm.start_from(&[f64::NAN, 1.0])), "start");
}

/// One particle, one dimension, equal bounds: small, but swarms.
#[test]
fn the_smallest_swarms_run() {
    for (name, kind) in kinds() {
        for (particles, n) in [(1, 1), (1, 3), (2, 1), (2, 2), (5, 1)] {
            let neighbours = kind.neighbours.min(particles);
            let settings = PsoSettings { particles, neighbours, ..kind };
            let report = swarm(settings, 5.0, n).run(&mut Pointwise(sphere)).unwrap();
            assert!(report.value.is_finite(), "{name}");
        }
        let mut point = Swarm::new(kind, &[2.0], &[2.0]).unwrap();
        assert_eq!(point.run(&mut Pointwise(sphere)).unwrap().value, 1.0);
        let settings = PsoSettings { target: Some(1e-10), ..kind };
        let line = swarm(settings, 5.0, 1).run(&mut Pointwise(sphere)).unwrap();
        assert_eq!(line.status, Status::Converged, "{name}");
    }
}

#[test]
fn bad_input_names_the_argument() {
    let base = PsoSettings::default();
    let settings = [
        ("inertia", PsoSettings { inertia: f64::NAN, ..base }),
        ("inertia", PsoSettings { inertia: -0.1, ..base }),
        ("cognitive", PsoSettings { cognitive: f64::INFINITY, ..base }),
        ("social", PsoSettings { social: -1.0, ..base }),
        ("neighbours", PsoSettings { neighbours: 0, ..base }),
        ("particles", PsoSettings { particles: 0, ..base }),
        ("particles", PsoSettings { particles: 1_000_001, ..base }),
        ("velocity_limit", PsoSettings { velocity_limit: Some(0.0), ..base }),
        ("velocity_limit", PsoSettings { velocity_limit: Some(f64::NAN), ..base }),
        ("max_iterations", PsoSettings { max_iterations: 0, ..base }),
        ("max_iterations", PsoSettings { max_iterations: usize::MAX, ..base }),
        ("max_evaluations", PsoSettings { max_evaluations: Some(29), ..base }),
        ("target", PsoSettings { target: Some(f64::NAN), ..base }),
        ("stagnation", PsoSettings { stagnation: Some(0), ..base }),
        ("improvement", PsoSettings { improvement: -1.0, ..base }),
    ];
    for (argument, settings) in settings {
        let error = Swarm::new(settings, &[0.0], &[1.0]).unwrap_err();
        assert_eq!(error.argument, argument, "{error}");
    }
    let of = |lower: &[f64], upper: &[f64]| Swarm::new(base, lower, upper).unwrap_err().argument;
    assert_eq!(of(&[], &[]), "lower");
    assert_eq!(of(&[f64::NAN, 0.0], &[1.0, 1.0]), "lower");
    assert_eq!(of(&[-f64::INFINITY], &[1.0]), "lower");
    assert_eq!(of(&[0.0], &[1e151]), "upper");
    assert_eq!(of(&[0.0, 0.0], &[1.0]), "upper");
    let error = Swarm::new(base, &[0.0, 3.0], &[1.0, 2.0]).unwrap_err();
    assert_eq!(error.to_string(), "upper: expected at least lower, 3.0 in coordinate 1, got 2.0");
    // Links are bounded by the swarm's size and by their number, but for a global swarm.
    for topology in [Topology::Ring, Topology::Random] {
        let linked =
            |particles, neighbours| PsoSettings { particles, neighbours, topology, ..base };
        assert!(linked(3000, 3000).validate().is_ok());
        assert!(linked(1, 1).validate().is_ok());
        assert!(linked(1_000_000, 10).validate().is_ok());
        for (particles, neighbours) in [(3000, 3001), (3000, 1_000_000), (1_000_000, 11)] {
            let error = linked(particles, neighbours).validate().unwrap_err();
            assert_eq!(error.argument, "neighbours", "{error}");
        }
    }
    assert!(PsoSettings { neighbours: 1_000_000, ..base }.validate().is_ok());
    // More than any memory holds.
    let huge = PsoSettings { particles: 1_000_000, ..base };
    let (lower, upper) = (vec![0.0; 4_000_000], vec![1.0; 4_000_000]);
    assert_eq!(Swarm::new(huge, &lower, &upper).unwrap_err().argument, "particles");
    // A refused reset leaves the swarm as it was.
    let mut swarm = swarm(base, 5.0, 2);
    let before = swarm.run(&mut Pointwise(sphere)).unwrap();
    assert!(swarm.reset(base, &[1.0], &[0.0]).is_err());
    assert_eq!(swarm.run(&mut Pointwise(sphere)).unwrap(), before);
}
