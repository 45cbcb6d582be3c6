//! Many targets on all cores, and paths.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::Vector3;
use rayon::ThreadPool;
use rayon::prelude::*;

use super::{Answer, InverseSettings, Target};
use crate::batch::Control;
use crate::error::InvalidInput;
use crate::model::State;
use crate::robot::Robot;

/// Answers, row by row.
///
/// ```
/// # use nalgebra::Vector3;
/// # use tdcr::constant_curvature::{ConstantCurvatureSettings, Plan};
/// # use tdcr::inverse::{Bounds, ConstantCurvatureInverse, InverseSettings, Target};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// # let plan = Plan::new(&robot, ConstantCurvatureSettings::default())?;
/// # let (bounds, settings) = (Bounds::default(), InverseSettings::default());
/// # let inverse = ConstantCurvatureInverse::new(&robot, &plan, &bounds, settings)?;
/// let tips = [0.5, 1.0].map(|angle: f64| {
///     Target::Position(tdcr::constant_curvature::Arc::new(angle / 0.2, 0.0, 0.2).frame(1.0).translation)
/// });
/// let (threads, control) = (tdcr::batch::pool(Some(1))?, tdcr::batch::Control::default());
/// let rows = tdcr::inverse::invert_rows(&inverse, &tips, &[], &threads, &control)?.unwrap_or_default();
/// assert_eq!(rows.displacements.len(), 2 * 3);
/// assert!((rows.displacements[0] + 0.01 * 0.5).abs() < 1e-8);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default)]
pub struct InverseRows {
    /// Displacements, one row per target \[m\].
    pub displacements: Vec<f64>,
    /// Tensions, likewise; NaN where the model knows no forces.
    pub tensions: Vec<f64>,
    /// Outcome of every row.
    pub answers: Vec<Answer>,
}

/// Rows of one job: unreachable targets take a thousand times as long as easy ones.
const ROWS_PER_JOB: usize = 8;

impl InverseRows {
    fn blank(rows: usize, tendons: usize) -> Self {
        let none = vec![f64::NAN; rows * tendons];
        Self { displacements: none.clone(), tensions: none, answers: vec![Answer::none(); rows] }
    }
}

/// Inverse of one model, as batches and paths use it.
///
/// ```
/// use tdcr::inverse::{Inverter, Target};
///
/// // Works with any model.
/// fn displacements<I: Inverter>(inverse: &I, target: &Target) -> Vec<f64> {
///     let mut scratch = inverse.buffers(None);
///     inverse.solve(target, None, &mut scratch);
///     let mut displacements = vec![0.0; inverse.robot().tendons().len()];
///     inverse.write_displacements(&scratch, &mut displacements);
///     displacements
/// }
/// # let _ = displacements::<tdcr::inverse::RodInverse<'_>>;
/// ```
pub trait Inverter: Sync {
    /// Start of a solve.
    type Start: Clone + Sync;
    /// Buffers of a solve, and what it found.
    type Scratch<'w>
    where
        Self: 'w;

    /// The robot it was prepared from.
    fn robot(&self) -> &Robot;

    /// The choices it was prepared with.
    fn settings(&self) -> &InverseSettings;

    /// Checks that a target is near enough for rounding to distinguish it from its neighbours.
    ///
    /// # Errors
    /// `InvalidInput` for one that is further from the base than a million times the robot's length and its tool's.
    fn check_target(&self, target: &Target) -> Result<(), InvalidInput> {
        near_enough("target", self.robot(), &target.position())
    }

    /// Start of a solve from displacements; its computation ends soon after the flag is set, if there is one.
    ///
    /// # Errors
    /// `InvalidInput` for displacements that do not fit the robot.
    fn start(
        &self,
        displacements: &[f64],
        stop: Option<&Arc<AtomicBool>>,
    ) -> Result<Self::Start, InvalidInput>;

    /// Buffers for this inverse; solves end before their next start when the flag is set, if there is one.
    fn buffers<'w>(&'w self, stop: Option<&'w AtomicBool>) -> Self::Scratch<'w>;

    /// Solves for unknowns that bring the tool to `target`; first from `start`, if given.
    fn solve(
        &self,
        target: &Target,
        start: Option<&Self::Start>,
        work: &mut Self::Scratch<'_>,
    ) -> Answer;

    /// Solves again from the point where the last solve in `work` ended, as along a path.
    fn follow(&self, target: &Target, work: &mut Self::Scratch<'_>) -> Answer;

    /// Writes the displacements of the last solve in `work` \[m\].
    fn write_displacements(&self, work: &Self::Scratch<'_>, place: &mut [f64]);

    /// Writes its tensions, in the unit of the results; untouched where the model has no forces.
    fn write_tensions(&self, work: &Self::Scratch<'_>, place: &mut [f64]);

    /// Shape that the last solve in `work` found, where displacements do not determine it.
    fn state(&self, _work: &mut Self::Scratch<'_>) -> Option<State> {
        None
    }

    /// Reason why the last solve in `work` did not converge, in a sentence; empty when it did.
    fn message(&self, answer: &Answer, work: &Self::Scratch<'_>) -> String;
}

/// Largest distance of a target from the base, in lengths of the robot and its tool: beyond it rounding decides.
const FARTHEST: f64 = 1e6;

/// Checks a target position.
///
/// # Errors
/// `InvalidInput` for one that is too far from the base.
pub(super) fn near_enough(
    argument: &str,
    robot: &Robot,
    place: &Vector3<f64>,
) -> Result<(), InvalidInput> {
    let far = FARTHEST * (robot.backbone().total_length() + robot.tool().translation.norm());
    if (place - robot.base().translation).norm() <= far {
        return Ok(());
    }
    let expected = format!(
        "a place within {far:.3e} m of the base, {FARTHEST:.0e} times the robot's length and its tool's"
    );
    Err(InvalidInput::new(argument, expected, format!("{:?}", place.as_slice())))
}

/// Checks displacements to start from, one row of every tendon's after the other.
///
/// # Errors
/// `InvalidInput` that names the row, if there are several.
fn check_starts(robot: &Robot, starts: &[f64]) -> Result<(), InvalidInput> {
    let count = robot.tendons().len().max(1);
    for (row, own) in starts.chunks(count).enumerate() {
        robot.check_displacements(own).map_err(|error| {
            let one = starts.len() == count;
            let argument = if one { "start".to_owned() } else { format!("start[{row}]") };
            InvalidInput { argument, ..error }
        })?;
    }
    Ok(())
}

/// Solves every target on `pool`, each as alone, from displacements (`starts`: one row for all targets, one per
/// target, or none \[m\]). Returns `None` when it was stopped.
///
/// # Errors
/// `InvalidInput` for starts that do not fit the robot, naming the row.
pub fn invert_rows<I: Inverter>(
    inverse: &I,
    targets: &[Target],
    starts: &[f64],
    pool: &ThreadPool,
    control: &Control,
) -> Result<Option<InverseRows>, InvalidInput> {
    check_starts(inverse.robot(), starts)?;
    let count = inverse.robot().tendons().len();
    let mut rows = InverseRows::blank(targets.len(), count);
    let InverseRows { displacements, tensions, answers } = &mut rows;
    // One start for all targets, or one per target.
    let width = (ROWS_PER_JOB * count).max(1);
    let begin = |own: &[f64]| inverse.start(own, Some(&control.stop));
    pool.install(|| {
        let all =
            (!starts.is_empty() && starts.len() == count).then(|| begin(starts)).transpose()?;
        // Jobs of a few rows, with one set of buffers per thread.
        (targets.par_chunks(ROWS_PER_JOB))
            .zip(answers.par_chunks_mut(ROWS_PER_JOB))
            .zip(displacements.par_chunks_mut(width))
            .zip(tensions.par_chunks_mut(width))
            .enumerate()
            .try_for_each_init(
                || inverse.buffers(Some(&control.stop)),
                |work, (job, (((targets, answers), displacements), tensions))| {
                    for (i, (target, answer)) in targets.iter().zip(answers).enumerate() {
                        if control.stop.load(Ordering::Relaxed) {
                            return Ok(());
                        }
                        // The row's start and its solve, as if it were alone.
                        let each = starts.chunks_exact(count.max(1)).nth(ROWS_PER_JOB * job + i);
                        let each = each.filter(|_| all.is_none()).map(begin).transpose()?;
                        *answer = inverse.solve(target, each.as_ref().or(all.as_ref()), work);
                        // Its displacements and tensions.
                        let own = i * count..(i + 1) * count;
                        inverse.write_displacements(work, &mut displacements[own.clone()]);
                        inverse.write_tensions(work, &mut tensions[own]);
                        control.done.fetch_add(1, Ordering::Relaxed);
                    }
                    Ok(())
                },
            )
    })?;
    Ok((!control.stop.load(Ordering::Relaxed)).then_some(rows))
}

/// Solves targets one after the other, each from the answer of the one before, the first from displacements, if
/// given \[m\]. Returns `None` when it was stopped.
///
/// # Errors
/// `InvalidInput` for a start that does not fit the robot.
pub fn invert_path<I: Inverter>(
    inverse: &I,
    targets: &[Target],
    start: Option<&[f64]>,
    control: &Control,
) -> Result<Option<InverseRows>, InvalidInput> {
    check_starts(inverse.robot(), start.unwrap_or_default())?;
    let start = start.map(|own| inverse.start(own, Some(&control.stop))).transpose()?;
    let count = inverse.robot().tendons().len();
    let mut rows = InverseRows::blank(targets.len(), count);
    let mut work = inverse.buffers(Some(&control.stop));
    for (i, target) in targets.iter().enumerate() {
        if control.stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        rows.answers[i] = if i == 0 {
            inverse.solve(target, start.as_ref(), &mut work)
        } else {
            inverse.follow(target, &mut work)
        };
        let own = i * count..(i + 1) * count;
        inverse.write_displacements(&work, &mut rows.displacements[own.clone()]);
        inverse.write_tensions(&work, &mut rows.tensions[own]);
        control.done.fetch_add(1, Ordering::Relaxed);
    }
    Ok(Some(rows))
}
