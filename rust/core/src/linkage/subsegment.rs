//! One subsegment of the chain: which linkage it is, and its pose.

use nalgebra::{Matrix3, Vector3};

use super::four_bar::FourBar;
use super::pose::Pose;
use super::seven_bar::{Hole, Point, SevenBar, linear_bend};
use crate::solve::sqp::{self, Ending, Problem, Settings, Solution};

/// Linkage of one subsegment and its pulls; equal problems have equal poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum SubsegmentProblem {
    /// No tendon pulls: straight, by definition.
    Straight,
    /// One tendon whose azimuth is the same on both disks.
    Planar(Hole),
    /// One tendon whose azimuth changes; the second hole carries none and only spans the disk.
    Spatial([Hole; 2]),
    /// Two tendons.
    Pair([Hole; 2]),
}

/// Pose of the upper disk in the frame of the lower one, for a unit subsegment.
#[derive(Clone, Copy, Debug)]
pub(super) struct SubsegmentPose {
    pub(super) rotation: Matrix3<f64>,
    pub(super) rotation_vector: Vector3<f64>,
    pub(super) link: Vector3<f64>,
    pub(super) ending: Ending,
    pub(super) residual: f64,
    pub(super) iterations: usize,
}

/// Rounding of the bound on the bend: closer to it the answer would have half its digits.
pub(super) const BEND_MARGIN: f64 = 1e-12;

/// Why a subsegment cannot follow its tendons, known before it is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Infeasibility {
    /// Half the norm of `(c, s)`, which is the sine of half the bend, reaches 1.
    Bend,
    /// A hole (0 or 1) whose tendon piece would have no length.
    Piece(usize),
}

impl SubsegmentProblem {
    /// The holes that carry a tendon.
    fn driven_holes(&self) -> &[Hole] {
        match self {
            Self::Straight => &[],
            Self::Planar(hole) => std::slice::from_ref(hole),
            Self::Spatial(holes) => &holes[..1],
            Self::Pair(holes) => holes,
        }
    }

    /// The bound of the exact answer, where there is one (Ashwin & Ghosal, eq. 8, for one tendon;
    /// `docs/linkage.md` for two), and the length of the pieces.
    pub(super) fn infeasibility(&self) -> Option<Infeasibility> {
        if let Some(hole) = self.driven_holes().iter().position(|hole| hole.pull >= hole.rest) {
            return Some(Infeasibility::Piece(hole));
        }
        let bound = match self {
            Self::Planar(hole) if hole.is_alike() => Some(0.5 * hole.pull / hole.upper.norm()),
            Self::Pair(holes) if holes.iter().all(Hole::is_alike) => {
                let (c, s) = linear_bend(&holes.each_ref().map(|hole| (hole.upper, hole.pull)));
                Some(0.5 * (c * c + s * s).sqrt())
            }
            _ => None,
        };
        // Written so that a NaN counts as out of reach.
        let within = |half: f64| half < 1.0 - BEND_MARGIN;
        bound.is_some_and(|half| !within(half)).then_some(Infeasibility::Bend)
    }

    /// Solves the linkage.
    pub(super) fn solve(&self, settings: &Settings) -> SubsegmentPose {
        match self {
            Self::Straight => SubsegmentPose::new(&Pose::straight(), Ending::Converged, 0.0, 0),
            Self::Planar(hole) => {
                let found = solve_four_bar(hole, settings);
                let azimuth = hole.upper / hole.upper.norm();
                let (sin, cos) = found.point.link.sin_cos();
                let link = azimuth * sin + Vector3::z() * cos;
                let turn = Vector3::new(-azimuth.y, azimuth.x, 0.0) * found.point.disk;
                SubsegmentPose::from_solution(&Pose::new(&link, &turn), &found)
            }
            Self::Spatial(holes) => {
                let found = solve_seven_bar::<1>(holes, settings, None);
                SubsegmentPose::from_solution(&found.point.pose, &found)
            }
            Self::Pair(holes) => {
                let found = solve_seven_bar::<2>(holes, settings, None);
                SubsegmentPose::from_solution(&found.point.pose, &found)
            }
        }
    }

    /// Pose with which the chain continues where there is no answer: that of the start.
    pub(super) fn fallback_pose(&self) -> SubsegmentPose {
        let pose = match self {
            Self::Straight => Pose::straight(),
            Self::Planar(hole) => {
                let bend = FourBar::new(hole).start();
                Pose::from_bend(bend.disk, hole.upper.y.atan2(hole.upper.x))
            }
            Self::Spatial(holes) => SevenBar::<1>::new(holes).start(),
            Self::Pair(holes) => SevenBar::<2>::new(holes).start(),
        };
        SubsegmentPose::new(&pose, Ending::Infeasible, self.violation(&pose), 0)
    }

    /// Largest relative error of a tendon piece at a pose.
    fn violation(&self, pose: &Pose) -> f64 {
        let error = |hole: &Hole| {
            let piece = (pose.link + pose.rotation() * hole.upper - hole.lower).norm();
            (piece - (hole.rest - hole.pull)).abs() / hole.rest
        };
        self.driven_holes().iter().map(error).fold(0.0, f64::max)
    }
}

impl SubsegmentPose {
    fn new(pose: &Pose, ending: Ending, residual: f64, iterations: usize) -> Self {
        Self {
            rotation: pose.rotation(),
            rotation_vector: pose.rotation_vector(),
            link: pose.link,
            ending,
            residual,
            iterations,
        }
    }

    fn from_solution<P, const M: usize>(pose: &Pose, found: &Solution<P, M>) -> Self {
        let residual = found.violation.max(found.stationarity);
        Self::new(pose, found.ending, residual, found.iterations)
    }
}

/// The four-bar linkage from its own start.
#[must_use]
pub fn solve_four_bar(hole: &Hole, settings: &Settings) -> Solution<super::four_bar::Bend, 1> {
    let problem = FourBar::new(hole);
    if problem.is_tiny() {
        return Solution::without_iterations(problem.start());
    }
    let found = sqp::minimize(&problem, problem.start(), settings);
    if found.ending == Ending::Converged {
        return found;
    }
    continuation_in_pull(found, settings, |share, from| {
        let problem = FourBar::new(&Hole { pull: share * hole.pull, ..*hole });
        (problem, from.unwrap_or_else(|| problem.start()))
    })
}

/// The seven-bar linkage with tendons in its first `M` holes, from `start` or its own. A start that
/// does not converge (on the mirror branch, say) falls back to its own.
#[must_use]
pub fn solve_seven_bar<const M: usize>(
    holes: &[Hole; 2],
    settings: &Settings,
    start: Option<Pose>,
) -> Solution<Point, M> {
    let problem = SevenBar::<M>::new(holes);
    let own = problem.point(problem.start());
    if problem.is_tiny() {
        return Solution::without_iterations(own);
    }
    let mut found = sqp::minimize(&problem, start.map_or(own, |p| problem.point(p)), settings);
    if start.is_some() && found.ending != Ending::Converged {
        let spent = found.iterations;
        found = sqp::minimize(&problem, own, settings);
        found.iterations += spent;
    }
    if found.ending == Ending::Converged {
        return found;
    }
    let mut found = continuation_in_pull(found, settings, |share, from| {
        let pulled = holes.map(|hole| Hole { pull: share * hole.pull, ..hole });
        let problem = SevenBar::<M>::new(&pulled);
        let pose = from.map_or_else(|| problem.start(), |point: Point| point.pose);
        (problem, problem.point(pose))
    });
    // Out of reach from one start is not out of reach: other starts follow.
    for (bend, towards) in OTHER_STARTS {
        if found.ending == Ending::Converged {
            break;
        }
        let start = problem.point(Pose::from_bend(bend, towards * std::f64::consts::PI));
        let other = sqp::minimize(&problem, start, settings);
        let iterations = found.iterations + other.iterations;
        let better = if other.ending == Ending::Converged { other } else { found };
        found = Solution { iterations, ..better };
    }
    found
}

/// Bends \[rad\] and where they point \[half turns\], tried before a pull is called out of reach.
const OTHER_STARTS: [(f64, f64); 12] = [
    (0.5, 0.0),
    (0.5, 0.5),
    (0.5, 1.0),
    (0.5, -0.5),
    (1.5, 0.25),
    (1.5, 0.75),
    (1.5, -0.75),
    (1.5, -0.25),
    (2.5, 0.0),
    (2.5, 0.5),
    (2.5, 1.0),
    (2.5, -0.5),
];

/// Steps of the fallback along the pull.
const STEPS: usize = 8;

/// Continuation along the pull in equal steps, each from the last answer, after one solve from the start failed.
fn continuation_in_pull<const N: usize, const M: usize, P: Problem<N, M>>(
    found: Solution<P::Point, M>,
    settings: &Settings,
    at: impl Fn(f64, Option<P::Point>) -> (P, P::Point),
) -> Solution<P::Point, M> {
    let mut iterations = found.iterations;
    let mut from = None;
    for step in 1..=STEPS {
        let (problem, start) = at(step as f64 / STEPS as f64, from);
        let mut next = sqp::minimize(&problem, start, settings);
        iterations += next.iterations;
        if step == STEPS || next.ending != Ending::Converged {
            next.iterations = iterations;
            // A failure on the way says nothing about the whole pull: keep the first one's.
            let done = step == STEPS && next.ending == Ending::Converged;
            return if done { next } else { Solution { iterations, ..found } };
        }
        from = Some(next.point);
    }
    found
}
