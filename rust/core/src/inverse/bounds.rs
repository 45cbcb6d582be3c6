//! Bounds of an inverse, and the region of unknowns inside them.

use std::f64::consts::{PI, TAU};

use nalgebra::DMatrix;

use crate::constant_curvature::Plan;
use crate::error::InvalidInput;
use crate::solve::convex_region::{Disc, Region};
use crate::solve::pseudo_inverse::null_space;

/// Lowest and highest values, one pair for all or one for each.
///
/// ```
/// use tdcr::inverse::Range;
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let range = Range::new("displacement", vec![-0.03], vec![0.01, 0.02, 0.03])?;
/// assert_eq!(range.at(1), (-0.03, 0.02));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Range {
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl Range {
    /// From lowest and highest values; a single one serves all. Infinite is no bound.
    ///
    /// # Errors
    /// `InvalidInput` for NaN, a lower bound above the upper one, or sequences of different lengths.
    pub fn new(argument: &str, lower: Vec<f64>, upper: Vec<f64>) -> Result<Self, InvalidInput> {
        let (few, many) = (lower.len().min(upper.len()), lower.len().max(upper.len()));
        if few == 0 || (few != 1 && few != many) {
            let got = format!("{} lower and {} upper ones", lower.len(), upper.len());
            let expected = "one bound for all or as many lower as upper bounds";
            return Err(InvalidInput::new(argument, expected, got));
        }
        let range = Self { lower, upper };
        for k in 0..many {
            let (lower, upper) = range.at(k);
            if lower.is_nan() || upper.is_nan() {
                return Err(InvalidInput::new(argument, "bounds that are numbers", "NaN"));
            }
            if lower > upper || lower == f64::INFINITY || upper == f64::NEG_INFINITY {
                let got = format!("[{lower:?}, {upper:?}]");
                return Err(InvalidInput::new(argument, "a lower bound below the upper", got));
            }
        }
        Ok(range)
    }

    /// The bounds of one.
    #[must_use]
    pub fn at(&self, k: usize) -> (f64, f64) {
        let of = |values: &[f64]| values.get(k).or(values.first()).copied();
        (of(&self.lower).unwrap_or(f64::NEG_INFINITY), of(&self.upper).unwrap_or(f64::INFINITY))
    }

    /// The values it was made of.
    #[must_use]
    pub fn values(&self) -> (&[f64], &[f64]) {
        (&self.lower, &self.upper)
    }

    pub(super) fn check(
        &self,
        argument: &str,
        count: usize,
        per: &str,
    ) -> Result<(), InvalidInput> {
        for length in [self.lower.len(), self.upper.len()] {
            if length != 1 && length != count {
                let expected = format!("1 or {count} values, one per {per}");
                return Err(InvalidInput::new(argument, expected, length));
            }
        }
        Ok(())
    }
}

/// Bounds of an inverse. What is `None` has the default.
///
/// ```
/// use tdcr::inverse::{Bounds, Range};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let pretension = Range::new("tension", vec![20.0], vec![2000.0])?;
/// let bounds = Bounds { tension: Some(pretension), ..Bounds::default() };
/// assert!(bounds.displacement.is_none());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Range of tendon displacements \[m\].
    pub displacement: Option<Range>,
    /// Range of tensions, where the model has some, in the unit of its results; 0 and more.
    pub tension: Option<Range>,
    /// Largest curvature of every segment \[1/m\].
    pub curvature: Option<Range>,
    /// Length of every extensible segment \[m\]; default half to twice the rest length.
    pub length: Option<Range>,
}

/// No segment turns further \[rad\]: beyond one turn an arc runs through itself.
const TURN: f64 = TAU;
/// Shortest and longest segment over its rest length, unless bounds say otherwise.
const STRETCH: (f64, f64) = (0.5, 2.0);

/// An arc that may turn by less than this is straight \[rad\].
const STRAIGHT: f64 = 1e-9;
/// No segment becomes shorter than this share of its rest length.
const SHORTEST: f64 = 1e-3;

/// Region of the unknowns, and the box of swarms.
#[derive(Clone, Debug)]
pub(super) struct SearchSpace {
    pub(super) region: Region,
    /// The box of swarms, beyond which descents may lead.
    pub(super) lower: Vec<f64>,
    pub(super) upper: Vec<f64>,
}

/// The region of the unknowns of `ArcProblem`, and where random starts are drawn.
#[derive(Clone, Debug)]
pub(super) struct ArcSpace {
    /// Swarms turn no segment by more than half a turn.
    pub(super) search: SearchSpace,
    /// Per segment.
    pub(super) draws: Vec<SegmentRange>,
    /// Freedoms that the tendons have and the bounds leave.
    pub(super) freedoms: usize,
    /// Lowest and highest displacement of every tendon \[m\].
    ranges: Vec<(f64, f64)>,
    /// Names of the bounds and of the discs of the region, for messages.
    labels: (Vec<String>, Vec<String>),
}

/// Ranges from which a segment's unknowns are drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct SegmentRange {
    /// Largest angle \[rad\].
    pub(super) widest: f64,
    /// Shortest and longest length over the rest length.
    pub(super) shortest: f64,
    pub(super) longest: f64,
}

impl ArcSpace {
    pub(super) fn new(
        plan: &Plan,
        bounds: &Bounds,
        names: &[String],
    ) -> Result<Self, InvalidInput> {
        bounds.check(plan, names.len())?;
        let (width, size) = (plan.width(), plan.width() * plan.segment_count());
        let draws: Vec<SegmentRange> =
            (0..plan.segment_count()).map(|i| bounds.segment_range(plan, i)).collect();
        let ranges: Vec<_> = (0..names.len()).map(|k| bounds.displacements(plan, k)).collect();
        let sides = draws.iter().flat_map(|draw| {
            let widest = draw.widest.min(PI);
            let sides = [(-widest, widest), (-widest, widest), (draw.shortest, draw.longest)];
            sides.into_iter().take(width)
        });
        let (lower, upper) = sides.unzip();
        let mut space = Self {
            search: SearchSpace { region: Region::new(size), lower, upper },
            draws,
            freedoms: 0,
            ranges,
            labels: (Vec::new(), Vec::new()),
        };
        space.add_equations(plan);
        for i in 0..plan.segment_count() {
            space.bound_length(plan, bounds, i);
            space.bound_turn(plan, bounds, i);
        }
        space.bound_displacements(plan, names);
        Ok(space)
    }

    /// Adds an equation for every direction that is no freedom: moved by no tendon, straight, or with equal bounds.
    fn add_equations(&mut self, plan: &Plan) {
        let (width, size) = (plan.width(), self.search.region.size());
        let mut equations: Vec<(Vec<f64>, f64)> = Vec::new();
        for direction in plan.unactuated_directions() {
            let normal: Vec<f64> = (0..size).map(|j| direction[j] * plan.unit(j)).collect();
            let at_rest = (0..size).map(|j| normal[j] * rest(plan, j)).sum();
            equations.push((normal, at_rest));
        }
        for (i, draw) in self.draws.iter().enumerate() {
            if draw.widest <= STRAIGHT {
                equations.push((unit(size, width * i), 0.0));
                equations.push((unit(size, width * i + 1), 0.0));
            }
            if width == 3 && draw.shortest == draw.longest {
                equations.push((unit(size, width * i + 2), draw.longest));
            }
        }
        for (k, (_, upper)) in self.ranges.iter().enumerate().filter(|(_, (l, u))| l == u) {
            let (row, at_rest) = displacement(plan, k);
            equations.push((row, upper + at_rest));
        }
        let matrix = DMatrix::from_fn(equations.len(), size, |row, j| equations[row].0[j]);
        self.freedoms = null_space(&matrix).len();
        for (normal, value) in &equations {
            self.search.region.add_equation(normal, *value);
        }
    }

    fn bound_length(&mut self, plan: &Plan, bounds: &Bounds, i: usize) {
        let draw = self.draws[i];
        if plan.width() == 2 || draw.shortest == draw.longest {
            return;
        }
        let mut normal = unit(self.search.region.size(), 3 * i + 2);
        if self.search.region.add_bound(&normal, bounds.longest(plan, i)) {
            self.labels.0.push(format!("longest segment {i}"));
        }
        normal[3 * i + 2] = -1.0;
        if self.search.region.add_bound(&normal, -draw.shortest) {
            self.labels.0.push(format!("shortest segment {i}"));
        }
    }

    fn bound_turn(&mut self, plan: &Plan, bounds: &Bounds, i: usize) {
        let first = plan.width() * i;
        if self.draws[i].widest <= STRAIGHT {
            return;
        }
        let radius = bounds.largest_curvature(i) * plan.segment(i).rest_length;
        let scale = (plan.width() == 3).then_some(first + 2);
        // Without stretch the smaller of two circles is all there is.
        if radius < if scale.is_some() { f64::INFINITY } else { TURN } {
            self.search.region.add_disc(Disc { first, radius, scale });
            self.labels.1.push(format!("curvature of segment {i}"));
            if scale.is_none() {
                return;
            }
        }
        self.search.region.add_disc(Disc { first, radius: TURN, scale: None });
        self.labels.1.push(format!("full turn of segment {i}"));
    }

    fn bound_displacements(&mut self, plan: &Plan, names: &[String]) {
        for (k, (lower, upper)) in self.ranges.iter().enumerate().filter(|(_, (l, u))| l < u) {
            let (mut row, at_rest) = displacement(plan, k);
            if self.search.region.add_bound(&row, upper + at_rest) {
                self.labels.0.push(format!("release of '{}'", names[k]));
            }
            for entry in &mut row {
                *entry = -*entry;
            }
            if self.search.region.add_bound(&row, -lower - at_rest) {
                self.labels.0.push(format!("pull of '{}'", names[k]));
            }
        }
    }

    /// Names of the bounds that are active at a point.
    pub(super) fn active_bounds(&self, point: &[f64]) -> Vec<&str> {
        let (bounds, discs) = self.search.region.active_at(point, 1e-9);
        let bounds = bounds.into_iter().map(|k| self.labels.0[k].as_str());
        bounds.chain(discs.into_iter().map(|k| self.labels.1[k].as_str())).collect()
    }

    /// Writes the displacements of a point. Rounding leaves none outside its bounds: a released lone tendon
    /// would leave its segment straight.
    pub(super) fn write_displacements(&self, plan: &Plan, point: &[f64], place: &mut [f64]) {
        for (k, displacement) in place.iter_mut().enumerate() {
            let value = point
                .iter()
                .enumerate()
                .fold(0.0, |sum, (j, value)| sum + plan.by_unknown(k, j) * (value - rest(plan, j)));
            let (lower, upper) = self.ranges[k];
            *displacement = value.max(lower).min(upper);
        }
    }
}

impl Bounds {
    fn check(&self, plan: &Plan, tendons: usize) -> Result<(), InvalidInput> {
        let count = plan.segment_count();
        for (argument, range, count, per) in [
            ("bounds.displacement", &self.displacement, tendons, "tendon"),
            ("bounds.curvature", &self.curvature, count, "segment"),
            ("bounds.length", &self.length, count, "segment"),
        ] {
            range.as_ref().map_or(Ok(()), |range| range.check(argument, count, per))?;
        }
        if self.tension.is_some() {
            let expected = "no bounds on tension: constant curvature knows no forces";
            return Err(InvalidInput::new("bounds.tension", expected, "bounds"));
        }
        if let Some(range) = &self.curvature
            && (0..count).any(|i| range.at(i).0 > 0.0)
        {
            let expected = "no lower bounds above zero: a region with holes is none";
            return Err(InvalidInput::new("bounds.curvature", expected, "one"));
        }
        let Some(range) = &self.length else { return Ok(()) };
        if plan.width() == 2 {
            let expected = "no bounds on length unless settings.extensible";
            return Err(InvalidInput::new("bounds.length", expected, "bounds"));
        }
        let short = (0..count).find(|i| range.at(*i).1 < SHORTEST * plan.segment(*i).rest_length);
        short.map_or(Ok(()), |i| {
            let least = SHORTEST * plan.segment(i).rest_length;
            let expected = format!("upper bounds of {least} m or more for segment {i}");
            Err(InvalidInput::new("bounds.length", expected, format!("{:?}", range.at(i).1)))
        })
    }

    /// Largest curvature of a segment \[1/m\].
    fn largest_curvature(&self, i: usize) -> f64 {
        self.curvature.as_ref().map_or(f64::INFINITY, |range| range.at(i).1)
    }

    /// Longest length of a segment over its rest length.
    fn longest(&self, plan: &Plan, i: usize) -> f64 {
        let rest = plan.segment(i).rest_length;
        self.length.as_ref().map_or(STRETCH.1, |range| range.at(i).1 / rest)
    }

    fn segment_range(&self, plan: &Plan, i: usize) -> SegmentRange {
        let rest = plan.segment(i).rest_length;
        let (shortest, longest) = match &self.length {
            Some(range) => ((range.at(i).0 / rest).max(SHORTEST), self.longest(plan, i)),
            None if plan.width() == 3 => STRETCH,
            None => (1.0, 1.0),
        };
        let widest = TURN.min(self.largest_curvature(i) * rest * longest);
        // Without an upper bound, starts are drawn up to twice the default one.
        let longest = longest.min(2.0 * STRETCH.1 * shortest.max(1.0));
        SegmentRange { widest, shortest, longest }
    }

    /// Checks them for a rod.
    pub(super) fn check_rod(&self, tendons: usize) -> Result<(), InvalidInput> {
        for (argument, range) in
            [("bounds.displacement", &self.displacement), ("bounds.tension", &self.tension)]
        {
            range.as_ref().map_or(Ok(()), |range| range.check(argument, tendons, "tendon"))?;
        }
        for (argument, range) in
            [("bounds.curvature", &self.curvature), ("bounds.length", &self.length)]
        {
            if range.is_some() {
                let expected = "none for model \"rod\" (bounds on displacement and tension)";
                return Err(InvalidInput::new(argument, expected, "bounds"));
            }
        }
        let Some(range) = &self.tension else { return Ok(()) };
        (0..tendons).find(|k| range.at(*k).1 < 0.0).map_or(Ok(()), |k| {
            let expected = "upper bounds of 0 or more: tendons only pull";
            Err(InvalidInput::new("bounds.tension", expected, format!("{:?}", range.at(k).1)))
        })
    }

    /// Lowest and highest displacement that is asked for \[m\].
    pub(super) fn displacement_of(&self, k: usize) -> (f64, f64) {
        let free = (f64::NEG_INFINITY, f64::INFINITY);
        self.displacement.as_ref().map_or(free, |range| range.at(k))
    }

    /// Lowest and highest displacement of a tendon \[m\].
    fn displacements(&self, plan: &Plan, k: usize) -> (f64, f64) {
        let (lower, upper) = self.displacement_of(k);
        // The only tendon of a segment cannot push: released, it does not count.
        let lone = plan.segments().any(|segment| segment.own == [k]);
        (lower, if lone { upper.min(0.0) } else { upper })
    }
}

/// Value of an unknown at rest.
pub(super) fn rest(plan: &Plan, unknown: usize) -> f64 {
    if unknown % plan.width() == 2 { 1.0 } else { 0.0 }
}

fn unit(size: usize, k: usize) -> Vec<f64> {
    let mut normal = vec![0.0; size];
    normal[k] = 1.0;
    normal
}

/// A tendon's displacement by the unknowns, and what that row is at rest.
fn displacement(plan: &Plan, k: usize) -> (Vec<f64>, f64) {
    let size = plan.width() * plan.segment_count();
    let row: Vec<f64> = (0..size).map(|j| plan.by_unknown(k, j)).collect();
    let at_rest = (0..size).map(|j| row[j] * rest(plan, j)).sum();
    (row, at_rest)
}
