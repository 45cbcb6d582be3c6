//! A solve that takes long ends when it is told to.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use tdcr::Status;
use tdcr::model::Model;
use tdcr::obstacle::{Fault, Obstacle, SignedDistance};
use tdcr::robot::{Robot, Routing, Tendon};
use tdcr::rod::contact::{LoadedRod, Scratch as Loaded};
use tdcr::rod::{Plan, Rod, RodSettings, Scratch, TendonLaw};

use crate::common::{FREE, robot};
use crate::contact_common::{Case, V};

fn helix(n: usize) -> Robot {
    let routing = Routing::Helical { azimuth: 0.0, radius: 0.01, turns: 1.0 };
    robot(0.2, n, vec![Tendon::new(routing, None, None, None).unwrap()])
}

#[test]
fn a_flag_that_is_set_ends_every_kind_of_solve() {
    let robot = helix(20);
    for tendons in TendonLaw::ALL {
        let plan = Plan::new(&robot, RodSettings { tendons, ..Default::default() }).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let rod = Rod::new(&robot, &plan).stopped_by(Arc::clone(&stop));
        let mut work = Scratch::default();
        let free = rod.solve(&[-0.004], &mut work).unwrap();
        assert_eq!(free.status, Status::Converged);
        let frames = rod.state(&work).frames.clone();
        assert_eq!(frames, Rod::new(&robot, &plan).shape(&[-0.004]).unwrap().state.frames);
        stop.store(true, Ordering::Relaxed);
        for report in [rod.solve(&[-0.004], &mut work), rod.resume(&[-0.004], &mut work)] {
            assert_eq!(report.unwrap().status, Status::IterationLimit);
            assert_eq!(rod.message(&[-0.004], &work), "stopped before the end");
            // The last iterate, whole.
            assert_eq!(rod.state(&work).frames.len(), 21);
        }
        if tendons == TendonLaw::Sliding {
            let report = rod.solve_tensions(&[10.0], &mut work).unwrap();
            assert_eq!(report.status, Status::IterationLimit);
            assert_eq!(rod.message(&[], &work), "stopped before the end");
        }
        // The workspace of a stopped solve is as good as any.
        let again = Rod::new(&robot, &plan).solve(&[-0.004], &mut work).unwrap();
        assert_eq!(again, free);
    }
}

/// A flag that is set before the start leaves the rod at rest: not one evaluation moved it.
#[test]
fn a_large_solve_ends_within_one_evaluation() {
    let robot = helix(200);
    let plan = Plan::new(&robot, RodSettings { elements: 80, ..Default::default() }).unwrap();
    let rod = Rod::new(&robot, &plan).stopped_by(Arc::new(AtomicBool::new(true)));
    let mut work = Scratch::default();
    let report = rod.solve(&[-0.01], &mut work).unwrap();
    assert_eq!(report.status, Status::IterationLimit);
    let rest = Rod::new(&robot, &plan).shape(&[FREE]).unwrap();
    assert_eq!(rod.state(&work).frames, rest.state.frames);
}

/// An obstacle by a function counts how often it is asked and sets the flag on the way: what is asked after
/// that is no more than a step asks, of which the whole solve takes over ten.
#[test]
fn a_flag_that_is_set_on_the_way_ends_the_solve_within_one_step() {
    let mut case = Case::new(helix(20));
    let stop = Arc::new(AtomicBool::new(false));
    let (asked, when) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(usize::MAX)));
    let own = (Arc::clone(&stop), Arc::clone(&asked), Arc::clone(&when));
    let ball = move |x: &V| -> Result<(f64, V), Fault> {
        if own.1.fetch_add(1, Ordering::Relaxed) == own.2.load(Ordering::Relaxed) {
            own.0.store(true, Ordering::Relaxed);
        }
        let from = x - V::new(0.06, 0.0, 0.12);
        Ok((from.norm() - 0.03, from.normalize()))
    };
    case.obstacles.push(Obstacle::new(SignedDistance::new(Arc::new(ball)), false));
    let plan = case.plan();
    let scene = case.scene(&plan);
    let rod = LoadedRod::new(&case.robot, &plan, &scene).unwrap().stopped_by(Arc::clone(&stop));
    let solve = |at| {
        when.store(at, Ordering::Relaxed);
        asked.store(0, Ordering::Relaxed);
        stop.store(false, Ordering::Relaxed);
        let report = rod.solve(&[-0.01], &mut Loaded::default()).unwrap();
        (report, asked.load(Ordering::Relaxed))
    };
    let (whole, all) = solve(usize::MAX);
    assert_eq!(whole.status, Status::Converged);
    for share in 1..10 {
        let at = all * share / 10;
        let (report, asked) = solve(at);
        println!("{report:?} {} of {all} after {at}", asked - at);
        assert_eq!(report.status, Status::IterationLimit);
        assert!(report.iterations < whole.iterations && asked - at <= all / 10, "{at} {asked}");
    }
    // The scratch of one solve does not matter to the next.
    assert_eq!(solve(usize::MAX), (whole, all));
}
