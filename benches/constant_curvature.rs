//! The constant-curvature model's hot paths. Every bench checks its answer first.
//!
//! `frames`: three segments with ten frames each, arcs given. `robot`: displacements of nine coupled
//! tendons to all disk frames. `mapping`: one segment's displacements to its arc.
#![allow(missing_docs, clippy::unwrap_used)] // criterion's macros; a bench may stop on a bad answer.

use std::f64::consts::{PI, TAU};
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use tdcr::constant_curvature::{
    Arc, ConstantCurvature, ConstantCurvatureSettings, Length, Mapping, Plan, Scratch,
    displacements, frames, tip_derivative,
};
use tdcr::lie::Pose;
use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, PerDisk, Robot, Routing, Tendon};

fn arcs() -> [Arc; 3] {
    [Arc::new(8.0, 0.3, 0.06), Arc::new(5.0, -2.0, 0.0625), Arc::new(12.0, 1.0, 0.064)]
}

fn robot() -> Robot {
    let mut spec = BackboneSpec::straight(0.2, 1);
    spec.length = vec![0.06, 0.0625, 0.064];
    spec.subsegments = vec![10; 3];
    let tendon = |k: usize| {
        let azimuth = TAU * (k % 3) as f64 / 3.0 + (k / 3) as f64 * PI / 4.0;
        let (azimuth, radius) = (PerDisk::Same(azimuth), PerDisk::Same(0.0045));
        let end = 10 * (k / 3 + 1);
        Tendon::new(Routing::Angles { azimuth, radius }, Some(end), None, None).unwrap()
    };
    let backbone = Backbone::new(spec).unwrap();
    Robot::new(backbone, (0..9).map(tendon).collect(), None, None, None).unwrap()
}

fn benches(c: &mut Criterion) {
    let mut group = c.benchmark_group("constant_curvature");
    let arcs = arcs();
    let tip = arcs.iter().fold(Pose::identity(), |frame, arc| frame.compose(&arc.frame(1.0)));
    let mut along = Vec::with_capacity(30);
    frames(&Pose::identity(), &arcs, 10, &mut along);
    assert!(along.len() == 30 && (along[29].translation - tip.translation).amax() < 1e-15);
    group.bench_function("frames/3_segments_of_10", |b| {
        b.iter(|| frames(&Pose::identity(), black_box(&arcs), 10, &mut along));
    });
    group.bench_function("tip_derivative/3_segments", |b| {
        b.iter(|| tip_derivative(&Pose::identity(), &Pose::identity(), black_box(&arcs)));
    });

    let robot = robot();
    let plan = Plan::new(&robot, ConstantCurvatureSettings::default()).unwrap();
    let model = ConstantCurvature::new(&robot, &plan);
    let given: Vec<f64> = displacements(&plan, &arcs).iter().copied().collect();
    let mut work = Scratch::default();
    model.solve(&given, &mut work).unwrap();
    assert!((model.state(&work).frames[30].translation - tip.translation).amax() < 1e-14);
    group.bench_function("robot/9_tendons_30_disks", |b| {
        b.iter(|| model.solve(black_box(&given), &mut work));
    });

    let azimuths = (0..3).map(|k| TAU * f64::from(k) / 3.0).collect();
    let mapping = Mapping::new(azimuths, vec![0.008], 0.1).unwrap();
    let fit = mapping.fit(&[-0.002, -0.002, 0.004], Length::Known(0.1)).unwrap();
    assert!((fit.arc.kappa() - 5.0).abs() < 1e-13);
    group.bench_function("mapping/3_tendons", |b| {
        b.iter(|| mapping.fit(black_box(&[-0.002, -0.002, 0.004]), Length::Known(0.1)));
    });
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
