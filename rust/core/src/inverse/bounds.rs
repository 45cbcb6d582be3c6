//! What an inverse may use, and the region of unknowns it leaves.

use std::f64::consts::{PI, TAU};

use crate::constant_curvature::Plan;
use crate::error::InvalidInput;
use crate::solve::region::{Disc, Region};

/// Lowest and highest values, one pair for all or one for each.
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

    fn check(&self, argument: &str, count: usize, per: &str) -> Result<(), InvalidInput> {
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
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Of tendon displacements \[m\].
    pub displacement: Option<Range>,
    /// Largest curvature of every segment \[1/m\].
    pub curvature: Option<Range>,
    /// Length of every extensible segment \[m\]; default half to twice the rest length.
    pub length: Option<Range>,
}

/// No segment turns further \[rad\]: beyond one turn an arc runs through itself.
const TURN: f64 = TAU;
/// Shortest and longest segment over its rest length, unless bounds say otherwise.
const STRETCH: (f64, f64) = (0.5, 2.0);

/// The region of the unknowns of `Chain`, and where random starts are drawn.
#[derive(Clone, Debug)]
pub(super) struct Reach {
    pub(super) region: Region,
    /// The box of swarms: that of the region, but for turns beyond half a one, to which descents may
    /// lead.
    pub(super) lower: Vec<f64>,
    pub(super) upper: Vec<f64>,
    /// Largest angle \[rad\], shortest and longest length over the rest length, per segment.
    pub(super) draws: Vec<(f64, f64, f64)>,
    /// Freedoms of the arcs that the tendons have.
    pub(super) freedoms: usize,
    /// What the bounds and the discs of the region hold back.
    labels: (Vec<String>, Vec<String>),
}

impl Reach {
    pub(super) fn new(plan: &Plan, bounds: &Bounds, tendons: usize) -> Result<Self, InvalidInput> {
        let (width, count) = (plan.width(), plan.segment_count());
        let size = width * count;
        if let Some(range) = &bounds.displacement {
            range.check("bounds.displacement", tendons, "tendon")?;
        }
        for (argument, range) in
            [("bounds.curvature", &bounds.curvature), ("bounds.length", &bounds.length)]
        {
            range.as_ref().map_or(Ok(()), |r| r.check(argument, count, "segment"))?;
        }
        if width == 2 && bounds.length.is_some() {
            let expected = "no bounds on length unless settings.extensible";
            return Err(InvalidInput::new("bounds.length", expected, "bounds"));
        }
        if let Some(range) = &bounds.curvature
            && (0..count).any(|i| range.at(i).0 > 0.0)
        {
            let expected = "no lower bounds above zero: a region with holes is none";
            return Err(InvalidInput::new("bounds.curvature", expected, "one"));
        }
        if let Some(range) = &bounds.length
            && (0..count).any(|i| range.at(i).1 <= 0.0)
        {
            let expected = "upper bounds above zero [m]";
            return Err(InvalidInput::new("bounds.length", expected, "one that is not"));
        }
        let mut region = Region::new(size);
        for direction in plan.unmoved() {
            let normal: Vec<f64> = (0..size).map(|j| direction[j] * plan.unit(j)).collect();
            let at_rest = (0..size).map(|j| normal[j] * rest(plan, j)).sum();
            region.equate(&normal, at_rest);
        }
        let mut labels = (Vec::new(), Vec::new());
        let mut draws = Vec::with_capacity(count);
        for (i, segment) in plan.segments().enumerate() {
            let rest = segment.rest_length;
            let (shortest, longest) = match &bounds.length {
                Some(range) => (range.at(i).0.max(1e-3 * rest) / rest, range.at(i).1 / rest),
                None => STRETCH,
            };
            let curvature = bounds.curvature.as_ref().map_or(f64::INFINITY, |range| range.at(i).1);
            let first = width * i;
            let mut widest = TURN;
            if width == 3 {
                let mut normal = vec![0.0; size];
                normal[first + 2] = 1.0;
                if region.bound(&normal, longest) {
                    labels.0.push(format!("longest segment {i}"));
                }
                normal[first + 2] = -1.0;
                if region.bound(&normal, -shortest) {
                    labels.0.push(format!("shortest segment {i}"));
                }
                if curvature < f64::INFINITY {
                    let scale = Some(first + 2);
                    region.add_disc(Disc { first, radius: curvature * rest, scale });
                    labels.1.push(format!("curvature of segment {i}"));
                }
                widest = widest.min(curvature * rest * longest);
                region.add_disc(Disc { first, radius: TURN, scale: None });
                labels.1.push(format!("full turn of segment {i}"));
            } else {
                widest = widest.min(curvature * rest);
                region.add_disc(Disc { first, radius: widest, scale: None });
                let what = if widest < TURN { "curvature" } else { "full turn" };
                labels.1.push(format!("{what} of segment {i}"));
            }
            // Without an upper bound, starts are drawn up to twice the default one.
            draws.push((widest, shortest, longest.min(2.0 * STRETCH.1 * shortest.max(1.0))));
        }
        bound_displacements(plan, bounds, tendons, &mut region, &mut labels.0);
        let sides = draws.iter().flat_map(|&(widest, shortest, longest)| {
            let widest = widest.min(PI);
            [(-widest, widest), (-widest, widest), (shortest, longest)].into_iter().take(width)
        });
        let (lower, upper) = sides.unzip();
        Ok(Self { region, lower, upper, draws, freedoms: size - plan.unmoved().len(), labels })
    }

    /// The bounds that hold a point back.
    pub(super) fn holding(&self, point: &[f64]) -> Vec<&str> {
        let (bounds, discs) = self.region.at_edge(point, 1e-9);
        let bounds = bounds.into_iter().map(|k| self.labels.0[k].as_str());
        bounds.chain(discs.into_iter().map(|k| self.labels.1[k].as_str())).collect()
    }
}

/// Value of an unknown at rest.
pub(super) fn rest(plan: &Plan, unknown: usize) -> f64 {
    if unknown % plan.width() == 2 { 1.0 } else { 0.0 }
}

fn bound_displacements(
    plan: &Plan,
    bounds: &Bounds,
    tendons: usize,
    region: &mut Region,
    labels: &mut Vec<String>,
) {
    let size = plan.width() * plan.segment_count();
    for k in 0..tendons {
        let (lower, mut upper) =
            bounds.displacement.as_ref().map_or((f64::NEG_INFINITY, f64::INFINITY), |r| r.at(k));
        // The only tendon of a segment cannot push: released, it does not count.
        if plan.segments().any(|segment| segment.own == [k]) {
            upper = upper.min(0.0);
        }
        let mut row: Vec<f64> = (0..size).map(|j| plan.by_unknown(k, j)).collect();
        let at_rest: f64 = (0..size).map(|j| row[j] * rest(plan, j)).sum();
        if region.bound(&row, upper + at_rest) {
            labels.push(format!("release of tendon {k}"));
        }
        for entry in &mut row {
            *entry = -*entry;
        }
        if region.bound(&row, -lower - at_rest) {
            labels.push(format!("pull of tendon {k}"));
        }
    }
}
