//! Robots of several constant-curvature segments: the forward model.

use nalgebra::{DMatrix, DVector, Matrix6xX, Vector2, Vector3};

use super::arc::Arc;
use super::kinematics::tip_derivative;
use crate::error::InvalidInput;
use crate::lie::Pose;
use crate::model::{Model, Report, State};
use crate::robot::Robot;
use crate::solve::least_squares::PseudoInverse;
use crate::status::Status;

/// How displacements reach the segments.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Coupling {
    /// Displacements are measured at the base; a tendon is shortened in every segment it runs through.
    #[default]
    Coupled,
    /// Each displacement is the part inside the segment where the tendon ends, as in the source.
    PerSegment,
}

impl Coupling {
    /// Both, in the order of their discriminants.
    pub const ALL: [Self; 2] = [Self::Coupled, Self::PerSegment];

    /// The name used in Python.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Coupled => "coupled",
            Self::PerSegment => "per_segment",
        }
    }
}

/// Choices of the constant-curvature model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ConstantCurvatureSettings {
    /// How displacements reach the segments.
    pub coupling: Coupling,
    /// The length of every segment is an unknown too; at least three tendons must end at each that has any.
    pub extensible: bool,
}

/// A segment: subsegments `first..last`, the disks where tendons end.
#[derive(Clone, Debug)]
pub(crate) struct Segment {
    first: usize,
    last: usize,
    /// Length at rest \[m\].
    pub(crate) rest_length: f64,
    /// Tendons that end at its tip.
    pub(crate) own: Vec<usize>,
}

impl Segment {
    /// Bending energy over half the squared angle \[J, or 1/m in units of EI\].
    pub(crate) fn stiffness(&self, robot: &Robot) -> f64 {
        let backbone = robot.backbone();
        let pieces = (self.first..).zip(&backbone.lengths()[self.first..self.last]);
        let sum: f64 = pieces.map(|(j, length)| backbone.bending_stiffness(j) * length).sum();
        sum / self.rest_length.powi(2)
    }
}

/// What the model knows of a robot before any displacement.
#[derive(Clone, Debug)]
pub struct Plan {
    segments: Vec<Segment>,
    settings: ConstantCurvatureSettings,
    /// Mean radius of all tendons: the scale that makes bending and elongation comparable.
    scale: f64,
    /// Displacements over unknowns, all tendons.
    matrix: DMatrix<f64>,
    /// Its inverse when every tendon counts.
    inverse: PseudoInverse,
}

/// Unknowns of a segment: two bends, and the elongation when it is extensible.
const fn unknowns(extensible: bool) -> usize {
    if extensible { 3 } else { 2 }
}

impl Plan {
    /// Prepares a robot.
    ///
    /// # Errors
    /// `InvalidInput` for a backbone that is bent at rest, a tendon whose azimuth or radius changes
    /// along its path, or an extensible segment with one or two tendons that end at its tip.
    pub fn new(robot: &Robot, settings: ConstantCurvatureSettings) -> Result<Self, InvalidInput> {
        check_straight(robot)?;
        let segments = segments(robot);
        if settings.extensible
            && let Some(short) = segments.iter().find(|s| (1..3).contains(&s.own.len()))
        {
            let expected = "at least three tendons that end at the tip of every driven segment";
            let got = format!("{} at disk {}", short.own.len(), short.last);
            return Err(InvalidInput::new("settings.extensible", expected, got));
        }
        let paths = robot.paths();
        let radii = paths.iter().map(|path| path.holes[0].norm());
        let scale = if paths.is_empty() { 1.0 } else { radii.sum::<f64>() / paths.len() as f64 };
        let width = unknowns(settings.extensible);
        let mut matrix = DMatrix::zeros(paths.len(), width * segments.len());
        for (k, path) in paths.iter().enumerate() {
            for (i, segment) in segments.iter().enumerate() {
                let through = match settings.coupling {
                    Coupling::Coupled => path.end() >= segment.last,
                    Coupling::PerSegment => path.end() == segment.last,
                };
                if through {
                    matrix[(k, width * i)] = -path.holes[0].x / scale;
                    matrix[(k, width * i + 1)] = -path.holes[0].y / scale;
                    if settings.extensible {
                        matrix[(k, width * i + 2)] = 1.0;
                    }
                }
            }
        }
        let inverse = PseudoInverse::new(&matrix);
        Ok(Self { segments, settings, scale, matrix, inverse })
    }

    /// Segments, base first.
    pub(crate) fn segments(&self) -> impl ExactSizeIterator<Item = &Segment> {
        self.segments.iter()
    }

    /// Number of segments.
    #[must_use]
    pub fn segment_count(&self) -> usize {
        self.segments.len()
    }

    /// A segment.
    pub(crate) fn segment(&self, i: usize) -> &Segment {
        &self.segments[i]
    }

    /// Unknowns per segment: its bending vector, and its length when it is extensible.
    #[must_use]
    pub fn width(&self) -> usize {
        unknowns(self.settings.extensible)
    }

    /// Change of each tendon's length by the bending vectors \[m/rad\] and the elongations of all
    /// segments, one row per tendon.
    pub(crate) fn by_unknown(&self, tendon: usize, unknown: usize) -> f64 {
        let entry = self.matrix[(tendon, unknown)];
        if unknown % self.width() < 2 { entry * self.scale } else { entry }
    }

    /// Tendons that count: not free, and not the only, released one of its segment.
    fn counted(&self, displacements: &[f64], counted: &mut Vec<bool>) {
        counted.clear();
        counted.extend(displacements.iter().map(|d| d.is_finite()));
        for segment in &self.segments {
            let mut active = segment.own.iter().filter(|k| counted[**k]);
            if let (Some(&only), None) = (active.next(), active.next())
                && displacements[only] > 0.0
            {
                counted[only] = false;
            }
        }
    }

    /// Makes the inverse over the tendons that count, unless it is at hand; columns of the others are
    /// zero.
    fn remember(&self, counted: &[bool], masked: &mut Option<Masked>) {
        let at_hand = masked.as_ref().is_some_and(|(pattern, _)| pattern == counted);
        if at_hand || counted.iter().all(|counts| *counts) {
            return;
        }
        let mut matrix = self.matrix.clone();
        for (k, _) in counted.iter().enumerate().filter(|(_, counts)| !**counts) {
            matrix.row_mut(k).fill(0.0);
        }
        *masked = Some((counted.to_vec(), PseudoInverse::new(&matrix).matrix));
    }

    /// The inverse over the tendons that count, after [`Plan::remember`].
    fn inverse_for<'a>(&'a self, counted: &[bool], masked: Option<&'a Masked>) -> &'a DMatrix<f64> {
        match masked {
            Some((pattern, inverse)) if pattern == counted => inverse,
            _ => &self.inverse.matrix,
        }
    }
}

/// A pattern of counted tendons and the inverse over them.
type Masked = (Vec<bool>, DMatrix<f64>);

/// Buffers of a solve.
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    state: State,
    /// The arc of every segment.
    arcs: Vec<Arc>,
    /// Displacement given minus displacement of the arcs, per tendon; 0 where it does not count.
    misfit: Vec<f64>,
    counted: Vec<bool>,
    /// The inverse for the last pattern of counted tendons that was not "all".
    masked: Option<Masked>,
}

impl Workspace {
    /// The arc of every segment, base first.
    #[must_use]
    pub fn arcs(&self) -> &[Arc] {
        &self.arcs
    }
}

/// The constant-curvature model of a robot, ready to solve.
#[derive(Clone, Debug)]
pub struct ConstantCurvature<'r> {
    robot: &'r Robot,
    plan: &'r Plan,
}

/// Share of a tendon's length by which displacements may miss the arcs without being called
/// inconsistent.
const CONSISTENT: f64 = 1e-9;

impl<'r> ConstantCurvature<'r> {
    /// Solves with a plan that was made of this robot.
    #[must_use]
    pub fn new(robot: &'r Robot, plan: &'r Plan) -> Self {
        Self { robot, plan }
    }

    /// Fits the arcs; returns whether every segment keeps a length.
    fn fit(&self, displacements: &[f64], work: &mut Workspace) -> bool {
        let plan = self.plan;
        let width = unknowns(plan.settings.extensible);
        plan.counted(displacements, &mut work.counted);
        plan.remember(&work.counted, &mut work.masked);
        let inverse = plan.inverse_for(&work.counted, work.masked.as_ref());
        work.arcs.clear();
        let mut sound = true;
        for (i, segment) in plan.segments.iter().enumerate() {
            let unknown = |row: usize| {
                let counted = work.counted.iter().zip(displacements).enumerate();
                counted.fold(0.0, |sum, (k, (counts, displacement))| {
                    if *counts { sum + inverse[(width * i + row, k)] * displacement } else { sum }
                })
            };
            let bend = Vector2::new(unknown(0), unknown(1)) / plan.scale;
            let elongation = if plan.settings.extensible { unknown(2) } else { 0.0 };
            let length = segment.rest_length + elongation;
            sound &= length > 0.0;
            work.arcs.push(Arc { bend, length });
        }
        sound
    }

    /// Places the disks, and measures tendons along their arcs.
    fn place(&self, displacements: &[f64], work: &mut Workspace) {
        let Workspace { state, arcs, misfit, counted, .. } = work;
        state.clear();
        let mut base = *self.robot.base();
        state.frames.push(base);
        let lengths = self.robot.backbone().lengths();
        for (segment, arc) in self.plan.segments.iter().zip(arcs.iter()) {
            let mut frame = base;
            let mut last: Option<(f64, Pose, Vector3<f64>)> = None;
            for length in &lengths[segment.first..segment.last] {
                let share = length / segment.rest_length;
                // Steps of equal length along one arc are one motion.
                let (step, turn) = match last {
                    Some((same, step, turn)) if same == share => (step, turn),
                    _ => (arc.frame(share), arc.rotation(share)),
                };
                last = Some((share, step, turn));
                frame = frame.compose(&step);
                state.frames.push(frame);
                state.strains.push(turn);
                if self.plan.settings.extensible {
                    state.elongations.push(arc.length / segment.rest_length - 1.0);
                }
            }
            base = base.compose(&arc.frame(1.0));
            // The segment ends at s = ell exactly, whatever the steps round to.
            if let Some(last) = state.frames.last_mut() {
                *last = base;
            }
        }
        misfit.clear();
        for (k, path) in self.robot.paths().iter().enumerate() {
            let (mut whole, mut own) = (0.0, 0.0);
            for (segment, arc) in self.plan.segments.iter().zip(arcs.iter()) {
                if path.end() >= segment.last {
                    let bend = arc.bend.x * path.holes[0].x + arc.bend.y * path.holes[0].y;
                    own = (arc.length - segment.rest_length) - bend;
                    whole += own;
                }
            }
            state.tendon_lengths.push(path.rest_length + whole);
            let fitted = match self.plan.settings.coupling {
                Coupling::Coupled => whole,
                Coupling::PerSegment => own,
            };
            misfit.push(if counted[k] { displacements[k] - fitted } else { 0.0 });
        }
        state.tensions.resize(displacements.len(), f64::NAN);
        let backbone = self.robot.backbone();
        state.energy =
            state.strains.iter().enumerate().map(|(i, w)| backbone.strain_energy(i, w)).sum();
    }

    /// Velocity of the tool (translation, then rotation, world axes) per metre of displacement, (6, K),
    /// at the arcs of the last solve. Tendons that do not count have zero columns.
    #[must_use]
    pub fn jacobian(&self, displacements: &[f64], work: &mut Workspace) -> Matrix6xX<f64> {
        self.fit(displacements, work);
        let width = unknowns(self.plan.settings.extensible);
        let by_arcs = tip_derivative(self.robot.base(), self.robot.tool(), &work.arcs);
        let mut by_unknowns = Matrix6xX::zeros(width * work.arcs.len());
        for i in 0..work.arcs.len() {
            for j in 0..width {
                let scale = if j < 2 { 1.0 / self.plan.scale } else { 1.0 };
                by_unknowns
                    .column_mut(width * i + j)
                    .copy_from(&(by_arcs.column(3 * i + j) * scale));
            }
        }
        by_unknowns * self.plan.inverse_for(&work.counted, work.masked.as_ref())
    }
}

impl Model for ConstantCurvature<'_> {
    type Workspace = Workspace;

    fn robot(&self) -> &Robot {
        self.robot
    }

    fn strain_width(&self) -> usize {
        if self.plan.settings.extensible { 4 } else { 3 }
    }

    fn solve(&self, displacements: &[f64], work: &mut Workspace) -> Result<Report, InvalidInput> {
        let sound = self.fit(displacements, work);
        self.place(displacements, work);
        let paths = self.robot.paths().iter();
        let residual = (work.misfit.iter().zip(paths))
            .fold(0.0_f64, |largest, (off, path)| largest.max(off.abs() / path.rest_length));
        let status = if sound { Status::Converged } else { Status::Infeasible };
        Ok(Report { status, residual, iterations: 0 })
    }

    fn state<'w>(&self, work: &'w Workspace) -> &'w State {
        &work.state
    }

    fn take_state(&self, work: Workspace) -> State {
        work.state
    }

    fn message(&self, _: &[f64], work: &Workspace) -> String {
        if let Some(i) = work.arcs.iter().position(|arc| arc.length <= 0.0) {
            return format!("the displacements leave segment {i} no length");
        }
        let names = self.robot.tendon_names();
        let off: Vec<String> = (work.misfit.iter().zip(self.robot.paths()).zip(names))
            .filter(|((off, path), _)| off.abs() > CONSISTENT * path.rest_length)
            .map(|((off, _), name)| format!("'{name}' by {off:+.6} m"))
            .collect();
        if off.is_empty() {
            return String::new();
        }
        format!("no arcs have these displacements; off the least-squares ones: {}", off.join(", "))
    }
}

fn check_straight(robot: &Robot) -> Result<(), InvalidInput> {
    if !robot.backbone().is_straight() {
        let expected = "a backbone that is straight at rest for model \"constant_curvature\"";
        return Err(InvalidInput::new("robot.backbone.rest", expected, "a pre-bent one"));
    }
    let winding =
        (robot.paths().iter()).position(|path| path.holes.iter().any(|h| *h != path.holes[0]));
    winding.map_or(Ok(()), |k| {
        let expected = "one azimuth and radius along the tendon for model \"constant_curvature\" \
                        (model \"linkage\" takes any routing)";
        let got = "a routing that changes from disk to disk";
        Err(InvalidInput::new(format!("robot.tendons[{k}]"), expected, got))
    })
}

/// Segments end where tendons do; a rest without tendons beyond the last end stays straight.
fn segments(robot: &Robot) -> Vec<Segment> {
    let n = robot.backbone().subsegments();
    let mut ends: Vec<usize> = robot.paths().iter().map(crate::robot::Path::end).collect();
    ends.push(n);
    ends.sort_unstable();
    ends.dedup();
    let positions = robot.backbone().arc_lengths();
    let mut first = 0;
    ends.into_iter()
        .map(|last| {
            let paths = robot.paths().iter().enumerate();
            let own = paths.filter(|(_, path)| path.end() == last).map(|(k, _)| k).collect();
            let rest_length = positions[last] - positions[first];
            let segment = Segment { first, last, rest_length, own };
            first = last;
            segment
        })
        .collect()
}

/// The displacements that give a robot these arcs, one per segment \[m\].
#[must_use]
pub fn displacements(plan: &Plan, arcs: &[Arc]) -> DVector<f64> {
    let width = unknowns(plan.settings.extensible);
    let mut unknown = DVector::zeros(plan.matrix.ncols());
    for (i, (arc, segment)) in arcs.iter().zip(&plan.segments).enumerate() {
        unknown[width * i] = arc.bend.x * plan.scale;
        unknown[width * i + 1] = arc.bend.y * plan.scale;
        if plan.settings.extensible {
            unknown[width * i + 2] = arc.length - segment.rest_length;
        }
    }
    &plan.matrix * unknown
}
