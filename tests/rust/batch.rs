//! Batches: every row kept, in order, the same on any number of threads.

use std::sync::atomic::Ordering;

use tdcr::Status;
use tdcr::batch::{Control, Field, Key, chain_rows, chained_shape, pool, solve_rows};
use tdcr::linkage::{Linkage, LinkageSettings, Plan};
use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
use tdcr::rod::{self, Rod, RodSettings};

const ALL: &[Field] = &Field::ALL;

fn robot() -> Robot {
    let backbone = Backbone::new(BackboneSpec::straight(0.2, 5)).unwrap();
    let tendons = [0.0, 2.0].map(|azimuth| Tendon::straight(azimuth, 0.01).unwrap()).to_vec();
    Robot::new(backbone, tendons, None, None, None).unwrap()
}

/// 1001 rows, most fine, every seventh out of reach.
fn rows() -> Vec<f64> {
    (0..1001)
        .flat_map(|i| {
            let pull = 1e-5 * f64::from(i);
            [if i % 7 == 0 { -0.19 } else { -pull }, -0.5 * pull]
        })
        .collect()
}

#[test]
fn rows_equal_single_solves_on_any_number_of_threads() {
    let robot = robot();
    let plan = Plan::new(&robot).unwrap();
    let model = Linkage::new(&robot, &plan, LinkageSettings::default()).unwrap();
    let rows = rows();
    let solve = |threads| {
        let control = Control::default();
        let pool = pool(Some(threads)).unwrap();
        let columns = solve_rows(&model, &rows, 1001, ALL, &pool, &control).unwrap().unwrap();
        assert_eq!(control.done.load(Ordering::Relaxed), 1001);
        columns
    };
    let (one, four) = (solve(1), solve(4));
    for key in [Key::Frames, Key::TendonPoints(1), Key::Energy] {
        assert_eq!(one.values(key), four.values(key));
    }
    assert_eq!(one.reports, four.reports);
    let of = |key| one.values(key).unwrap();
    for i in 0..1001 {
        let shape = model.shape(&rows[2 * i..2 * i + 2]).unwrap();
        assert_eq!(shape.report, one.reports[i]);
        assert_eq!(shape.report.status == Status::Infeasible, i % 7 == 0);
        let tip = shape.state.frames[5];
        assert_eq!(of(Key::Tip)[16 * i..16 * i + 16], tip.to_row_major());
        assert_eq!(of(Key::Frames)[16 * (6 * i + 5)..16 * (6 * i + 6)], tip.to_row_major());
        assert_eq!(
            &of(Key::Positions)[3 * (6 * i + 5)..3 * (6 * i + 6)],
            tip.translation.as_slice()
        );
        assert_eq!(&of(Key::Strains)[15 * i + 12..15 * i + 15], shape.state.strains[4].as_slice());
        assert_eq!(of(Key::TendonLengths)[2 * i..2 * i + 2], shape.state.tendon_lengths);
        assert_eq!(of(Key::Energy)[i], shape.state.energy);
        let last = shape.tendon_points(&robot, 1)[5];
        assert_eq!(&of(Key::TendonPoints(1))[3 * (6 * i + 5)..3 * (6 * i + 6)], last.as_slice());
        assert!(of(Key::Tensions)[2 * i].is_nan());
    }
}

#[test]
fn chains_start_from_rest_every_64_rows_and_where_the_row_before_is_of_no_use() {
    let robot = robot();
    let settings = RodSettings { elements: 2, ..Default::default() };
    let plan = rod::Plan::new(&robot, settings).unwrap();
    let model = Rod::new(&robot, &plan);
    // A tendon is let go in row 100 and taken up again in row 110; nothing follows row 30.
    let rows: Vec<f64> = (0..200)
        .flat_map(|i| {
            let pull = 5e-5 * f64::from(i);
            let first = if i == 30 { 0.25 } else { pull };
            [-first, if (100..110).contains(&i) { f64::INFINITY } else { -0.8 * pull }]
        })
        .collect();
    let keys = [Field::Frames, Field::Strains, Field::Tensions];
    let warm = |threads| {
        let pool = pool(Some(threads)).unwrap();
        chain_rows(&model, &rows, 200, &keys, &pool, &Control::default()).unwrap().unwrap()
    };
    let (one, three) = (warm(1), warm(3));
    let pool = pool(Some(2)).unwrap();
    let cold = solve_rows(&model, &rows, 200, &keys, &pool, &Control::default());
    let cold = cold.unwrap().unwrap();
    assert_eq!(one.reports, three.reports);
    let part = |key, solved: &tdcr::batch::Solved, i: usize| {
        let values = solved.values(key).unwrap();
        let width = values.len() / 200;
        values[i * width..(i + 1) * width].to_vec()
    };
    let (mut steps, mut steps_cold) = (0, 0);
    for i in 0..200 {
        let shape = chained_shape(&model, &rows, i).unwrap();
        assert_eq!(shape.report, one.reports[i]);
        assert_eq!(part(Key::Tensions, &one, i), shape.state.tensions);
        assert_eq!(part(Key::Strains, &one, i).len(), 3 * 2 * 5);
        let frames = part(Key::Frames, &one, i);
        assert_eq!(frames, part(Key::Frames, &three, i));
        assert_eq!(cold.reports[i].status == Status::Converged, i != 30);
        assert_eq!(one.reports[i].status, cold.reports[i].status);
        let off = frames.iter().zip(part(Key::Frames, &cold, i)).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-10, "row {i}");
        if [0, 31, 64, 128, 192].contains(&i) {
            assert_eq!(one.reports[i], cold.reports[i]);
            assert_eq!(frames, part(Key::Frames, &cold, i));
        }
        steps += one.reports[i].iterations;
        steps_cold += cold.reports[i].iterations;
    }
    assert!(5 * steps < 4 * steps_cold, "{steps} steps warm, {steps_cold} cold");
}

#[test]
fn fields_that_were_not_wanted_are_empty() {
    let robot = robot();
    let plan = Plan::new(&robot).unwrap();
    let model = Linkage::new(&robot, &plan, LinkageSettings::default()).unwrap();
    let pool = pool(None).unwrap();
    let columns = solve_rows(&model, &rows(), 1001, &[Field::Energy], &pool, &Control::default());
    let columns = columns.unwrap().unwrap();
    assert_eq!(columns.columns.len(), 1);
    assert!(columns.values(Key::Tip).is_none());
    assert_eq!(columns.values(Key::Energy).unwrap().len(), 1001);
}

#[test]
fn bad_rows_are_named_and_the_first_one_wins() {
    let robot = robot();
    let plan = Plan::new(&robot).unwrap();
    let model = Linkage::new(&robot, &plan, LinkageSettings::default()).unwrap();
    let mut bad = rows();
    bad[2 * 900] = f64::NAN;
    bad[2 * 77 + 1] = f64::NEG_INFINITY;
    let pool = pool(Some(2)).unwrap();
    let error = solve_rows(&model, &bad, 1001, ALL, &pool, &Control::default()).unwrap_err();
    assert_eq!(error.argument, "displacements");
    assert!(error.got.ends_with("in row 77") && error.got.contains("'t1'"), "{error}");
    // Refused by the model, not by the check of the numbers.
    let backbone = Backbone::new(BackboneSpec::straight(0.2, 5)).unwrap();
    let twins = vec![Tendon::straight(0.0, 0.01).unwrap(); 2];
    let robot = Robot::new(backbone, twins, None, None, None).unwrap();
    let plan = Plan::new(&robot).unwrap();
    let model = Linkage::new(&robot, &plan, LinkageSettings::default()).unwrap();
    let mut rows = vec![0.0; 400];
    rows[2 * 150] = -0.001;
    rows[2 * 150 + 1] = -0.001;
    rows[2 * 60] = -0.001;
    rows[2 * 60 + 1] = -0.001;
    let error = solve_rows(&model, &rows, 200, ALL, &pool, &Control::default()).unwrap_err();
    assert!(error.got.ends_with("in row 60"), "{error}");
}

#[test]
fn a_stopped_batch_returns_nothing() {
    let robot = robot();
    let plan = Plan::new(&robot).unwrap();
    let model = Linkage::new(&robot, &plan, LinkageSettings::default()).unwrap();
    let control = Control::default();
    control.stop.store(true, Ordering::Relaxed);
    let pool = pool(Some(2)).unwrap();
    assert!(solve_rows(&model, &rows(), 1001, ALL, &pool, &control).unwrap().is_none());
}

#[test]
fn empty_batches_and_robots_without_tendons_are_fine() {
    let robot = robot();
    let plan = Plan::new(&robot).unwrap();
    let model = Linkage::new(&robot, &plan, LinkageSettings::default()).unwrap();
    let pool = pool(Some(2)).unwrap();
    let columns = solve_rows(&model, &[], 0, ALL, &pool, &Control::default()).unwrap().unwrap();
    assert!(columns.values(Key::Tip).unwrap().is_empty() && columns.reports.is_empty());
    let backbone = Backbone::new(BackboneSpec::straight(0.2, 5)).unwrap();
    let bare = Robot::new(backbone, vec![], None, None, None).unwrap();
    let plan = Plan::new(&bare).unwrap();
    let model = Linkage::new(&bare, &plan, LinkageSettings::default()).unwrap();
    let columns = solve_rows(&model, &[], 3, ALL, &pool, &Control::default()).unwrap().unwrap();
    assert_eq!(columns.values(Key::Tip).unwrap().len(), 48);
    assert!(pool.current_num_threads() == 2 && tdcr::batch::pool(Some(0)).is_err());
}

#[test]
fn fields_go_by_their_names() {
    for field in Field::ALL {
        assert_eq!(Field::named(field.as_str()), Ok(field));
    }
    let error = Field::named("shape").unwrap_err();
    assert_eq!(error.argument, "fields");
    assert!(error.expected.contains("tendon_points") && error.got == "'shape'");
}
