//! Parameters of a fit as one vector of values: where they start, their scales, and the robot that has them.

use std::ops::Range;

use nalgebra::{DVector, Vector3};

use crate::error::InvalidInput;
use crate::lie::{Pose, so3};
use crate::robot::{Backbone, PerDisk, Robot, Routing, Tendon};

/// Kind of values that a fit estimates.
///
/// ```
/// use tdcr::design::Parameter;
///
/// assert_eq!(Parameter::ALL.map(Parameter::as_str)[5], "poisson_ratio");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Parameter {
    /// Length added to each displacement \[m\].
    Offset,
    /// Factor of each displacement.
    Gain,
    /// Radius of each straight tendon's holes \[m\].
    Radius,
    /// Azimuth of each straight tendon's holes \[rad\].
    Azimuth,
    /// Stiffness EA of each tendon \[N\].
    Stiffness,
    /// Poisson's ratio of the backbone.
    PoissonRatio,
    /// Curvature about x and y, added to the rest shape \[1/m\].
    Rest,
    /// Shift of the base \[m\], and its turn as a rotation vector \[rad\], world axes.
    Base,
}

impl Parameter {
    /// Every kind.
    pub const ALL: [Self; 8] = [
        Self::Offset,
        Self::Gain,
        Self::Radius,
        Self::Azimuth,
        Self::Stiffness,
        Self::PoissonRatio,
        Self::Rest,
        Self::Base,
    ];

    /// The name used in Python.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Offset => "offset",
            Self::Gain => "gain",
            Self::Radius => "radius",
            Self::Azimuth => "azimuth",
            Self::Stiffness => "stiffness",
            Self::PoissonRatio => "poisson_ratio",
            Self::Rest => "rest",
            Self::Base => "base",
        }
    }

    /// Number of values.
    fn count(self, robot: &Robot) -> usize {
        match self {
            Self::PoissonRatio => 1,
            Self::Rest => 2,
            Self::Base => 6,
            _ => robot.tendons().len(),
        }
    }

    /// Value k of a robot: start, unit, least and greatest. The unit moves points by about the robot's length.
    fn value(self, robot: &Robot, k: usize) -> Result<[f64; 4], InvalidInput> {
        const ANY: f64 = f64::INFINITY;
        let backbone = robot.backbone();
        let length = backbone.total_length();
        Ok(match self {
            Self::Offset => [0.0, length, -ANY, ANY],
            Self::Gain => [1.0, 1.0, 1e-3, 1e3],
            Self::Radius => {
                let radius = straight(robot, k)?.1;
                // Holes are in the disks.
                [radius, radius, 1e-6, backbone.spec().disk_radius.unwrap_or(ANY)]
            }
            Self::Azimuth => [straight(robot, k)?.0, 1.0, -ANY, ANY],
            Self::Stiffness => {
                let stiffness = robot.tendons()[k].stiffness().ok_or_else(|| {
                    let expected = "tendons with a stiffness [N] to fit it";
                    let got = format!("tendons[{k}] without one");
                    InvalidInput::new("parameters", expected, got)
                })?;
                [stiffness, stiffness, 1e-3, 1e12]
            }
            Self::PoissonRatio => [backbone.spec().poisson_ratio, 1.0, -0.99, 0.5],
            Self::Rest => [0.0, 1.0 / length, -ANY, ANY],
            Self::Base => [0.0, if k < 3 { length } else { 1.0 }, -ANY, ANY],
        })
    }
}

/// Azimuth and radius of a straight tendon.
fn straight(robot: &Robot, k: usize) -> Result<(f64, f64), InvalidInput> {
    let Routing::Angles { azimuth: PerDisk::Same(azimuth), radius: PerDisk::Same(radius) } =
        robot.tendons()[k].routing()
    else {
        let expected = "straight tendons to fit holes of";
        return Err(InvalidInput::new("parameters", expected, format!("tendons[{k}]")));
    };
    Ok((*azimuth, *radius))
}

/// Vector of values: its blocks by kind, start, units and bounds.
pub(super) struct Parameters<'r> {
    given: &'r Robot,
    pub(super) blocks: Vec<(Parameter, Range<usize>)>,
    pub(super) start: DVector<f64>,
    pub(super) units: DVector<f64>,
    lower: DVector<f64>,
    upper: DVector<f64>,
}

impl<'r> Parameters<'r> {
    pub(super) fn new(given: &'r Robot, kinds: &[Parameter]) -> Result<Self, InvalidInput> {
        let (mut blocks, mut values) = (Vec::new(), Vec::new());
        for &kind in kinds {
            let first = values.len();
            for k in 0..kind.count(given) {
                values.push(kind.value(given, k)?);
            }
            blocks.push((kind, first..values.len()));
        }
        let column = |c: usize| DVector::from_iterator(values.len(), values.iter().map(|v| v[c]));
        let [start, units, lower, upper] = [0, 1, 2, 3].map(column);
        Ok(Self { given, blocks, start, units, lower, upper })
    }

    pub(super) fn len(&self) -> usize {
        self.start.len()
    }

    /// Values of a kind, if it is estimated.
    pub(super) fn of<'v>(&self, kind: Parameter, values: &'v DVector<f64>) -> Option<&'v [f64]> {
        let (_, range) = self.blocks.iter().find(|(own, _)| *own == kind)?;
        Some(&values.as_slice()[range.clone()])
    }

    /// Values that a robot can have, after a scaled step.
    pub(super) fn step(&self, values: &DVector<f64>, step: &DVector<f64>) -> DVector<f64> {
        (values + step.component_mul(&self.units)).sup(&self.lower).inf(&self.upper)
    }

    /// Kinds with a value as small or as great as a robot can have.
    pub(super) fn at_bounds(&self, values: &DVector<f64>) -> Vec<Parameter> {
        let bound = |i: usize| values[i] <= self.lower[i] || values[i] >= self.upper[i];
        let blocks = self.blocks.iter().filter(|(_, range)| range.clone().any(bound));
        blocks.map(|(kind, _)| *kind).collect()
    }

    /// Displacements of the model from those of a measured row.
    pub(super) fn displacements(&self, values: &DVector<f64>, given: &[f64]) -> Vec<f64> {
        let mut out = given.to_vec();
        if let Some(gain) = self.of(Parameter::Gain, values) {
            out.iter_mut().zip(gain).for_each(|(own, gain)| *own *= gain);
        }
        if let Some(offset) = self.of(Parameter::Offset, values) {
            out.iter_mut().zip(offset).for_each(|(own, offset)| *own += offset);
        }
        out
    }

    /// The robot with the values.
    pub(super) fn robot(&self, values: &DVector<f64>) -> Result<Robot, InvalidInput> {
        let given = self.given;
        let base = self.of(Parameter::Base, values).map_or(*given.base(), |base| Pose {
            rotation: so3::exp(&Vector3::from_column_slice(&base[3..])) * given.base().rotation,
            translation: given.base().translation + Vector3::from_column_slice(&base[..3]),
        });
        let tendons = (0..given.tendons().len()).map(|k| self.tendon(values, k));
        Robot::new(
            self.backbone(values)?,
            tendons.collect::<Result<_, _>>()?,
            Some(&base.to_matrix()),
            Some(&given.tool().to_matrix()),
            given.name().map(str::to_owned),
        )
    }

    fn backbone(&self, values: &DVector<f64>) -> Result<Backbone, InvalidInput> {
        let given = self.given.backbone();
        let mut spec = given.spec().clone();
        if let Some(ratio) = self.of(Parameter::PoissonRatio, values) {
            spec.poisson_ratio = ratio[0];
        }
        if let Some(bend) = self.of(Parameter::Rest, values) {
            let rest = given.lengths().iter().enumerate().map(|(i, length)| {
                given.rest(i) + Vector3::new(length * bend[0], length * bend[1], 0.0)
            });
            spec.rest = Some(rest.collect());
        }
        Backbone::new(spec)
    }

    fn tendon(&self, values: &DVector<f64>, k: usize) -> Result<Tendon, InvalidInput> {
        let given = &self.given.tendons()[k];
        let mut routing = given.routing().clone();
        if let Routing::Angles { azimuth, radius } = &mut routing {
            if let Some(azimuths) = self.of(Parameter::Azimuth, values) {
                *azimuth = PerDisk::Same(azimuths[k]);
            }
            if let Some(radii) = self.of(Parameter::Radius, values) {
                *radius = PerDisk::Same(radii[k]);
            }
        }
        let stiffness = self.of(Parameter::Stiffness, values).map(|stiffness| stiffness[k]);
        let name = given.name().map(str::to_owned);
        Tendon::new(routing, given.end(), stiffness.or(given.stiffness()), name)
    }
}
