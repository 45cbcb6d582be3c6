//! A solve that takes long ends when it is told to.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use tdcr::Status;
use tdcr::model::Model;
use tdcr::robot::{Robot, Routing, Tendon};
use tdcr::rod::{Plan, Rod, RodSettings, Scratch, TendonLaw};

use crate::common::robot;

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

#[test]
fn a_large_solve_ends_within_one_evaluation() {
    let robot = helix(200);
    let plan = Plan::new(&robot, RodSettings { elements: 80, ..Default::default() }).unwrap();
    let stop = Arc::new(AtomicBool::new(false));
    let rod = Rod::new(&robot, &plan).stopped_by(Arc::clone(&stop));
    let (report, waited) = thread::scope(|scope| {
        let solve = scope.spawn(|| rod.solve(&[-0.01], &mut Scratch::default()).unwrap());
        thread::sleep(Duration::from_millis(50));
        let begin = Instant::now();
        stop.store(true, Ordering::Relaxed);
        (solve.join().unwrap(), begin.elapsed())
    });
    println!("stopped {waited:?} after the flag was set");
    assert_eq!(report.status, Status::IterationLimit);
    assert!(waited < Duration::from_millis(500));
}
