//! Displacements that bring the disks to wanted places.

use std::sync::atomic::AtomicBool;

use nalgebra::{Vector2, Vector3};

use super::{RodInverse, ended};
use crate::error::InvalidInput;
use crate::inverse::Target;
use crate::inverse::batch::near_enough;
use crate::inverse::multistart::{Effort, Freedom, Search};
use crate::inverse::outcome::Answer;
use crate::inverse::position_goal::PlacesGoal;
use crate::inverse::tension_problem::Pull;
use crate::lie::{Pose, so3};
use crate::model::State;
use crate::status::Status;

/// Starts at most: a sum of squares over the whole shape has few valleys.
const STARTS: usize = 24;
/// No subsegment is bent by more to begin with \[rad\].
const BEND: f64 = 1.0;
/// Most tendons.
const TENDONS: usize = 63;

/// What was found for wanted places.
#[derive(Clone, Debug)]
pub struct Placed {
    /// How it ended; its distance is the largest of a disk.
    pub answer: Answer,
    /// Tendon displacements \[m\].
    pub displacements: Vec<f64>,
    /// Tensions, in the unit of the results.
    pub tensions: Vec<f64>,
    /// What stood in the way; empty when every place is met.
    pub message: String,
    /// The shape, where displacements do not say which it is.
    pub state: Option<State>,
}

impl RodInverse<'_> {
    /// Seeks what brings disks nearest to their places \[m\], world frame, one per disk from the first, or none: least
    /// sum of squared distances. First from a shape with its tensions, if given. Freedom that the places leave is not spent.
    ///
    /// # Errors
    /// `InvalidInput` for another number of places than disks, none at all, one that is not finite or further away than
    /// a million lengths, and more than 63 tendons.
    pub fn solve_places(
        &self,
        places: &[Option<Vector3<f64>>],
        start: Option<&State>,
        stop: Option<&AtomicBool>,
    ) -> Result<Placed, InvalidInput> {
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
            ..=7 => Ok(self.reach::<8>(places, start, stop)),
            8..=15 => Ok(self.reach::<16>(places, start, stop)),
            16..=31 => Ok(self.reach::<32>(places, start, stop)),
            32..=TENDONS => Ok(self.reach::<64>(places, start, stop)),
            more => {
                let expected = format!("a robot with at most {TENDONS} tendons");
                Err(InvalidInput::new("robot", expected, more))
            }
        }
    }

    fn reach<const R: usize>(
        &self,
        places: &[Option<Vector3<f64>>],
        start: Option<&State>,
        stop: Option<&AtomicBool>,
    ) -> Placed {
        let world = self.robot.base().inverse();
        let local: Vec<_> = places.iter().map(|p| p.map(|p| world.transform(&p))).collect();
        let known = local.iter().enumerate().filter_map(|(disk, place)| Some((disk, (*place)?)));
        let length = self.robot.backbone().total_length();
        let goal = PlacesGoal::new(known.collect(), length, self.settings.position_tolerance);
        let lengths = self.rest.rest_lengths();
        let mut pull = Pull::new(self.balance(stop), goal, lengths, &self.units, &self.ranges);
        let mut search = Search::<R> { stop, ..Search::default() };
        pull.rod.rest();
        let given = start.is_some_and(|state| pull.rod.begin(state));
        let first: Vec<f64> = if given { self.unknowns(pull.rod.tensions()) } else { Vec::new() };
        let before = usize::from(given);
        let begin = |k: usize, point: &mut Vec<f64>| match k.checked_sub(before) {
            None => point.clone_from(&first),
            Some(k) => self.begin_shape(&local, k, point),
        };
        let effort = Effort { freedom: Freedom::None, fall_back: false, ..self.effort(STARTS) };
        let effort = Effort { starts: effort.starts.min(self.settings.starts), ..effort };
        let mut rise = self.rise(stop);
        let found = match &mut rise {
            Some(rise) => rise.search(&mut pull, &mut search, &self.space, effort, begin),
            None => search.run(&mut pull, &self.space, effort, begin),
        };
        let answer = ended(found, &mut pull, &mut search, |goal| (goal.misses().0, 0.0));
        let (most, mean, disk) = pull.aim.misses();
        let held = self.held(&search.point, &pull);
        let message = match answer.status {
            Status::Converged => rise.map_or("", |rise| rise.message()).to_owned(),
            Status::Infeasible => self.shapeless(&answer),
            status => {
                let how = if status == Status::Unreachable {
                    "the nearest shape"
                } else {
                    "stopped: the shape"
                };
                let held = if held.is_empty() {
                    held.join("")
                } else {
                    format!("; at its bound: {}", held.join(", "))
                };
                format!(
                    "{how} of {} starts is {most:.2e} m off at disk {}, {mean:.2e} m root mean square{held}",
                    found.starts,
                    disk + 1
                )
            }
        };
        let mut placed = Placed {
            answer,
            displacements: vec![0.0; self.units.len()],
            tensions: vec![0.0; self.units.len()],
            message,
            state: pull.rod.state(),
        };
        pull.write_displacements(&mut placed.displacements);
        self.write_tensions_of(pull.rod.as_ref(), &mut placed.tensions);
        placed
    }

    /// The k-th start: arcs along the places; as for the tool at the last of them; random ones.
    fn begin_shape(&self, places: &[Option<Vector3<f64>>], k: usize, point: &mut Vec<f64>) {
        if k == 0 {
            self.towards(&along(places, self.robot.backbone().lengths()), point);
            return;
        }
        let last = places.iter().flatten().last().copied().unwrap_or_default();
        let target = Target::Position(self.robot.base().transform(&last));
        if k == 1 {
            let mut bends = Vec::new();
            self.single_arc(&target, &mut bends);
            self.towards(&bends, point);
        } else {
            self.random(k, point);
        }
    }
}

/// Bends of tangent arcs towards places one after the other, in the base's frame; straight where none follows.
fn along(places: &[Option<Vector3<f64>>], lengths: &[f64]) -> Vec<Vector2<f64>> {
    let mut frame = Pose::identity();
    let mut bends = Vec::with_capacity(places.len());
    for (i, length) in lengths.iter().enumerate() {
        // Towards the next place that is known, over all subsegments up to there.
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
