//! Constant-curvature data of a robot, independent of the displacements.

use nalgebra::{DMatrix, DVector};

use super::arc::Arc;
use crate::error::InvalidInput;
use crate::robot::Robot;
use crate::solve::pseudo_inverse::{PseudoInverse, null_space};

/// Coupling between displacements and segments.
///
/// ```
/// use tdcr::constant_curvature::{ConstantCurvatureSettings, Coupling};
///
/// let settings = ConstantCurvatureSettings { coupling: Coupling::PerSegment, extensible: false };
/// assert_eq!(settings.coupling.as_str(), "per_segment");
/// ```
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

    /// Whether a tendon's displacement knows of a segment.
    pub(super) const fn joins(self, end: usize, segment: &Segment) -> bool {
        match self {
            Self::Coupled => end >= segment.last,
            Self::PerSegment => end == segment.last,
        }
    }

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
///
/// ```
/// use tdcr::constant_curvature::{ConstantCurvatureSettings, Plan};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let settings = ConstantCurvatureSettings { extensible: true, ..Default::default() };
/// assert_eq!(Plan::new(&robot, settings)?.width(), 3);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ConstantCurvatureSettings {
    /// Coupling between displacements and segments.
    pub coupling: Coupling,
    /// The length of every segment is an unknown too; at least three tendons must end at each that has any.
    pub extensible: bool,
}

/// A segment: subsegments `first..last`, the disks where tendons end.
#[derive(Clone, Debug)]
pub(crate) struct Segment {
    pub(super) first: usize,
    pub(super) last: usize,
    /// Length at rest \[m\].
    pub(crate) rest_length: f64,
    /// Tendons that end at its tip.
    pub(crate) own: Vec<usize>,
}

impl Segment {
    /// Its subsegments.
    pub(crate) fn range(&self) -> std::ops::Range<usize> {
        self.first..self.last
    }

    /// Bending energy over half the squared angle \[J, or 1/m in units of EI\].
    pub(crate) fn stiffness(&self, robot: &Robot) -> f64 {
        let backbone = robot.backbone();
        let pieces = (self.first..).zip(&backbone.lengths()[self.first..self.last]);
        let sum: f64 = pieces.map(|(j, length)| backbone.bending_stiffness(j) * length).sum();
        sum / self.rest_length.powi(2)
    }
}

/// Constant-curvature data of a robot, independent of the displacements.
///
/// ```
/// use tdcr::constant_curvature::{Arc, ConstantCurvatureSettings, Plan, displacements};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, ConstantCurvatureSettings::default())?;
/// assert_eq!((plan.segment_count(), plan.width()), (1, 2));
/// let pulls = displacements(&plan, &[Arc::new(5.0, 0.0, 0.2)]);
/// assert!((pulls[0] + 0.01 * 5.0 * 0.2).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Plan {
    pub(super) segments: Vec<Segment>,
    pub(crate) settings: ConstantCurvatureSettings,
    /// Mean radius of all tendons: the scale that makes bending and elongation comparable.
    pub(super) scale: f64,
    /// Displacements over unknowns, all tendons.
    pub(super) matrix: DMatrix<f64>,
    /// Its inverse when every tendon counts.
    inverse: PseudoInverse,
    unactuated_directions: Vec<DVector<f64>>,
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
                if settings.coupling.joins(path.end(), segment) {
                    matrix[(k, width * i)] = -path.holes[0].x / scale;
                    matrix[(k, width * i + 1)] = -path.holes[0].y / scale;
                    if settings.extensible {
                        matrix[(k, width * i + 2)] = 1.0;
                    }
                }
            }
        }
        let inverse = PseudoInverse::new(&matrix);
        let unactuated_directions = null_space(&matrix);
        Ok(Self { segments, settings, scale, matrix, inverse, unactuated_directions })
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

    /// Unknowns of the matrix per unit of a bending vector \[rad\], or of a length over the
    /// rest length, is \[m\].
    pub(crate) fn unit(&self, unknown: usize) -> f64 {
        let bends = unknown % self.width() < 2;
        if bends { self.scale } else { self.segments[unknown / self.width()].rest_length }
    }

    /// Change of a tendon's length by a bending vector, or by a length over the rest length \[m\].
    pub(crate) fn by_unknown(&self, tendon: usize, unknown: usize) -> f64 {
        self.matrix[(tendon, unknown)] * self.unit(unknown)
    }

    /// Directions of the matrix's unknowns that no tendon moves; the forward model leaves them at rest.
    pub(crate) fn unactuated_directions(&self) -> &[DVector<f64>] {
        &self.unactuated_directions
    }

    /// Tendons that count: not free, and not the only, released one of its segment.
    pub(super) fn mark_active_tendons(&self, displacements: &[f64], active: &mut Vec<bool>) {
        active.clear();
        active.extend(displacements.iter().map(|d| d.is_finite()));
        for segment in &self.segments {
            let mut own = segment.own.iter().filter(|k| active[**k]);
            if let (Some(&only), None) = (own.next(), own.next())
                && displacements[only] > 0.0
            {
                active[only] = false;
            }
        }
    }

    /// Computes the inverse over the tendons that count, unless it is cached; columns of the others are
    /// zero.
    pub(super) fn cache_inverse(&self, active: &[bool], masked: &mut Option<MaskedInverse>) {
        let at_hand = masked.as_ref().is_some_and(|(pattern, _)| pattern == active);
        if at_hand || active.iter().all(|counts| *counts) {
            return;
        }
        let mut matrix = self.matrix.clone();
        for (k, _) in active.iter().enumerate().filter(|(_, counts)| !**counts) {
            matrix.row_mut(k).fill(0.0);
        }
        *masked = Some((active.to_vec(), PseudoInverse::new(&matrix).matrix));
    }

    /// The inverse over the tendons that count, after [`Plan::cache_inverse`].
    pub(super) fn inverse_for<'a>(
        &'a self,
        active: &[bool],
        masked: Option<&'a MaskedInverse>,
    ) -> &'a DMatrix<f64> {
        match masked {
            Some((pattern, inverse)) if pattern == active => inverse,
            _ => &self.inverse.matrix,
        }
    }
}

/// A pattern of counted tendons and the inverse over them.
pub(super) type MaskedInverse = (Vec<bool>, DMatrix<f64>);

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
