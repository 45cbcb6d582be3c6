//! Displacements that bring the disks to given positions.

use std::sync::atomic::AtomicBool;

use nalgebra::{Vector2, Vector3};

use super::RodInverse;
use crate::error::InvalidInput;
use crate::inverse::Target;
use crate::inverse::batch::near_enough;
use crate::inverse::multistart::{Freedom, Multistart, SearchOptions};
use crate::inverse::position_goal::PositionGoal;
use crate::inverse::single::Inversion;
use crate::inverse::tension_problem::{TensionProblem, evaluate_answer};
use crate::lie::{Pose, so3};
use crate::model::State;
use crate::status::Status;

/// Starts at most: a sum of squares over the whole shape has few valleys.
const STARTS: usize = 24;
/// No subsegment is bent by more to begin with \[rad\].
const BEND: f64 = 1.0;
/// Most tendons.
const TENDONS: usize = 63;

impl RodInverse<'_> {
    /// Brings disks as near as possible to positions \[m\], world frame, one per disk from the first, or none: least
    /// sum of squared distances. First from a shape with its tensions, if given. Remaining freedom is not spent.
    ///
    /// # Errors
    /// `InvalidInput` for another number of positions than disks, none at all, one that is not finite or beyond
    /// a million lengths, and more than 63 tendons.
    pub fn solve_positions(
        &self,
        places: &[Option<Vector3<f64>>],
        start: Option<&State>,
        stop: Option<&AtomicBool>,
    ) -> Result<Inversion, InvalidInput> {
        let disks = self.robot.backbone().subsegments();
        if places.len() != disks {
            let expected = format!("{disks} places, one per disk from the first");
            return Err(InvalidInput::new("positions", expected, places.len()));
        }
        if places.iter().flatten().any(|place| !place.iter().all(|x| x.is_finite())) {
            return Err(InvalidInput::new("positions", "finite places [m]", "one that is not"));
        }
        if places.iter().all(Option::is_none) {
            return Err(InvalidInput::new("positions", "the place of one disk at least", "none"));
        }
        for place in places.iter().flatten() {
            near_enough("positions", self.robot, place)?;
        }
        match self.robot.tendons().len() {
            ..=7 => Ok(self.solve_for::<8>(places, start, stop)),
            8..=15 => Ok(self.solve_for::<16>(places, start, stop)),
            16..=31 => Ok(self.solve_for::<32>(places, start, stop)),
            32..=TENDONS => Ok(self.solve_for::<64>(places, start, stop)),
            more => {
                let expected = format!("a robot with at most {TENDONS} tendons");
                Err(InvalidInput::new("robot", expected, more))
            }
        }
    }

    /// [`Self::solve_positions`] for checked positions and at most R - 1 tendons.
    fn solve_for<const R: usize>(
        &self,
        places: &[Option<Vector3<f64>>],
        start: Option<&State>,
        stop: Option<&AtomicBool>,
    ) -> Inversion {
        let world = self.robot.base().inverse();
        let local: Vec<_> = places.iter().map(|p| p.map(|p| world.transform(&p))).collect();
        let known = local.iter().enumerate().filter_map(|(disk, place)| Some((disk, (*place)?)));
        let length = self.robot.backbone().total_length();
        let goal = PositionGoal::new(known.collect(), length, self.settings.position_tolerance);
        let lengths = self.rest.rest_lengths();
        // Start points: the shape that was given, then guesses.
        let mut problem =
            TensionProblem::new(self.equilibrium(stop), goal, lengths, &self.units, &self.ranges);
        let mut search = Multistart::<R> { stop, ..Multistart::default() };
        problem.rod.reset();
        let given = start.is_some_and(|state| problem.rod.start_from(state));
        let first: Vec<f64> =
            if given { self.unknowns(problem.rod.tensions()) } else { Vec::new() };
        let before = usize::from(given);
        let start_point = |k: usize, point: &mut Vec<f64>| match k.checked_sub(before) {
            None => point.clone_from(&first),
            Some(k) => self.positions_start(&local, k, point),
        };
        // Least squares from all of them, in contact from rest.
        let options =
            SearchOptions { freedom: Freedom::None, fall_back: false, ..self.options(STARTS) };
        let options = SearchOptions { starts: options.starts.min(self.settings.starts), ..options };
        let mut from_rest = self.rest_solves(stop);
        let found = match &mut from_rest {
            Some(from_rest) => {
                from_rest.search(&mut problem, &mut search, &self.space, options, start_point)
            }
            None => search.run(&mut problem, &self.space, options, start_point),
        };
        // Outcome, and the reason in a sentence.
        let answer =
            evaluate_answer(found, &mut problem, &mut search, |goal| (goal.errors().0, 0.0));
        let (most, mean, disk) = problem.goal.errors();
        let active = self.active_bounds(&search.point, &problem);
        let message = match answer.status {
            Status::Converged => from_rest.map_or("", |from_rest| from_rest.message()).to_owned(),
            Status::Infeasible => self.no_shape_message(&answer),
            status => {
                let how = if status == Status::Unreachable {
                    "the nearest shape"
                } else {
                    "stopped: the shape"
                };
                let active = if active.is_empty() {
                    active.join("")
                } else {
                    format!("; at its bound: {}", active.join(", "))
                };
                format!(
                    "{how} of {} starts is {most:.2e} m off at disk {}, {mean:.2e} m root mean square{active}",
                    found.starts,
                    disk + 1
                )
            }
        };
        let mut placed = Inversion {
            answer,
            displacements: vec![0.0; self.units.len()],
            tensions: vec![0.0; self.units.len()],
            message,
            state: problem.rod.state(),
        };
        problem.write_displacements(&mut placed.displacements);
        self.write_tensions_of(problem.rod.as_ref(), &mut placed.tensions);
        placed
    }

    /// Start k: arcs along the positions; a single arc to the last of them; random ones.
    fn positions_start(&self, places: &[Option<Vector3<f64>>], k: usize, point: &mut Vec<f64>) {
        if k == 0 {
            self.tensions_for_bends(&bends_along(places, self.robot.backbone().lengths()), point);
            return;
        }
        let last = places.iter().flatten().last().copied().unwrap_or_default();
        let target = Target::Position(self.robot.base().transform(&last));
        if k == 1 {
            let mut bends = Vec::new();
            self.single_arc(&target, &mut bends);
            self.tensions_for_bends(&bends, point);
        } else {
            self.random(k, point);
        }
    }
}

/// Bends of tangent arcs towards positions one after the other, in the base's frame; straight where none follows.
fn bends_along(places: &[Option<Vector3<f64>>], lengths: &[f64]) -> Vec<Vector2<f64>> {
    let mut frame = Pose::identity();
    let mut bends = Vec::with_capacity(places.len());
    for (i, length) in lengths.iter().enumerate() {
        // Towards the next known position, over all subsegments up to there.
        let next = places[i..].iter().position(Option::is_some);
        let bend = match next.and_then(|more| Some((more, places[i + more]?))) {
            None => Vector2::zeros(),
            Some((more, place)) => {
                let way: f64 = lengths[i..=i + more].iter().sum();
                let chord = frame.rotation.tr_mul(&(place - frame.translation));
                let across = chord.x.hypot(chord.y);
                let turn = (2.0 * across.atan2(chord.z) * length / way).min(BEND);
                let side = Vector2::new(chord.x, chord.y);
                if across > 0.0 { side * (turn / across) } else { side * 0.0 }
            }
        };
        let turn = Vector3::new(-bend.y, bend.x, 0.0);
        let chord = so3::left_jacobian(&turn) * Vector3::new(0.0, 0.0, *length);
        frame.translation += frame.rotation * chord;
        frame.rotation *= so3::exp(&turn);
        bends.push(bend);
    }
    bends
}
