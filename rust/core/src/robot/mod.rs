//! Robots: checked once, immutable, their holes resolved.

mod backbone;
mod curve;
mod derived;
mod tendon;

use std::any::Any;
use std::sync::Arc;

use nalgebra::{Matrix4, Vector3};

pub use backbone::{Backbone, BackboneSpec};
pub(crate) use curve::Spline;
use derived::Derived;
pub use tendon::{PerDisk, Routing, Tendon};

use crate::error::{self, InvalidInput};
use crate::hashing::{Bits, hash_by_bits};
use crate::lie::{Pose, so3};

/// A tendon as the robot sees it: where it ends and which hole it passes on each disk.
///
/// ```
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let path = &robot.paths()[0];
/// assert_eq!(path.end(), 10);
/// assert!((path.length(&robot.rest_frames()) - 0.2).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// Azimuth of the hole on each disk 0..end \[rad\].
    pub azimuths: Vec<f64>,
    /// Place of the hole in the frame of each disk 0..end \[m\].
    pub holes: Vec<Vector3<f64>>,
    /// Length of the whole path in the robot's rest shape \[m\].
    pub rest_length: f64,
}

impl Path {
    /// Disk where the tendon terminates.
    #[must_use]
    pub fn end(&self) -> usize {
        self.holes.len() - 1
    }

    /// Places of the holes on the given disk frames, disk 0 first \[m\].
    pub fn points<'a>(&'a self, frames: &'a [Pose]) -> impl Iterator<Item = Vector3<f64>> + 'a {
        frames.iter().zip(&self.holes).map(|(frame, hole)| frame.transform(hole))
    }

    /// Length of the path through the given disk frames \[m\].
    #[must_use]
    pub fn length(&self, frames: &[Pose]) -> f64 {
        let mut points = self.points(frames);
        let Some(mut last) = points.next() else { return 0.0 };
        let mut length = 0.0;
        for point in points {
            length += (point - last).norm();
            last = point;
        }
        length
    }
}

/// A backbone with tendons, placed in the world.
///
/// ```
/// use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// let tendons = vec![Tendon::straight(0.0, 0.01)?, Tendon::straight(2.0, 0.01)?];
/// let robot = Robot::new(backbone, tendons, None, None, Some("finger".to_owned()))?;
/// assert_eq!(robot.tendon_names(), ["t0", "t1"]);
/// assert_eq!(robot.rest_frames().len(), 11);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Robot {
    backbone: Backbone,
    tendons: Vec<Tendon>,
    base: Pose,
    tool: Pose,
    name: Option<String>,
    tendon_names: Vec<String>,
    paths: Vec<Path>,
    derived: Derived,
}

impl Robot {
    /// Puts a robot together and resolves every hole. `base` places disk 0 in the world, `tool` the
    /// point beyond the tip disk that inverses speak of.
    ///
    /// # Errors
    /// `InvalidInput` naming the field: a tendon that ends at a disk that is not there, values per
    /// disk that do not fit its end, a hole outside the disk (when the disk radius is known), two
    /// tendons of one name, a `base` or `tool` that is not a rigid motion, an empty name.
    pub fn new(
        backbone: Backbone,
        tendons: Vec<Tendon>,
        base: Option<&Matrix4<f64>>,
        tool: Option<&Matrix4<f64>>,
        name: Option<String>,
    ) -> Result<Self, InvalidInput> {
        let base = base.map_or_else(|| Ok(Pose::identity()), |m| rigid_motion("base", m))?;
        let tool = tool.map_or_else(|| Ok(Pose::identity()), |m| rigid_motion("tool", m))?;
        if name.as_ref().is_some_and(|name| name.trim().is_empty()) {
            return Err(InvalidInput::new("name", "a name that is not empty", "''"));
        }
        let tendon_names = tendon_names(&tendons)?;
        let rest = rest_frames(&backbone);
        let paths = (tendons.iter().enumerate())
            .map(|(k, tendon)| {
                resolve(tendon, &backbone, &rest).map_err(|e| e.within(&format!("tendons[{k}]")))
            })
            .collect::<Result<Vec<_>, _>>()?;
        let derived = Derived::default();
        Ok(Self { backbone, tendons, base, tool, name, tendon_names, paths, derived })
    }

    /// Copy of the robot with another backbone.
    ///
    /// # Errors
    /// As [`Robot::new`], where the tendons do not fit it.
    pub fn with_backbone(&self, backbone: Backbone) -> Result<Self, InvalidInput> {
        let new = Self::new(backbone, self.tendons.clone(), None, None, self.name.clone())?;
        Ok(Self { base: self.base, tool: self.tool, ..new })
    }

    /// Copy of the robot with other tendons.
    ///
    /// # Errors
    /// As [`Robot::new`], where they do not fit it.
    pub fn with_tendons(&self, tendons: Vec<Tendon>) -> Result<Self, InvalidInput> {
        let new = Self::new(self.backbone.clone(), tendons, None, None, self.name.clone())?;
        Ok(Self { base: self.base, tool: self.tool, ..new })
    }

    /// Its backbone.
    #[must_use]
    pub fn backbone(&self) -> &Backbone {
        &self.backbone
    }

    /// Its tendons as they were described.
    #[must_use]
    pub fn tendons(&self) -> &[Tendon] {
        &self.tendons
    }

    /// Its tendons as routed through the disks.
    #[must_use]
    pub fn paths(&self) -> &[Path] {
        &self.paths
    }

    /// Names of the tendons: their own, or "t0", "t1", ... by place.
    #[must_use]
    pub fn tendon_names(&self) -> &[String] {
        &self.tendon_names
    }

    /// Disk 0 in the world.
    #[must_use]
    pub fn base(&self) -> &Pose {
        &self.base
    }

    /// The tool point in the frame of the tip disk.
    #[must_use]
    pub fn tool(&self) -> &Pose {
        &self.tool
    }

    /// Its name, if it has one.
    #[must_use]
    pub fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// Value that a higher room derives from this robot, made from its default on first use and kept with it.
    pub(crate) fn derived<T: Any + Default + Send + Sync>(&self) -> Arc<T> {
        self.derived.get()
    }

    /// Disk frames at rest, in the world; subsegments are arcs of constant strain.
    #[must_use]
    pub fn rest_frames(&self) -> Vec<Pose> {
        rest_frames(&self.backbone).iter().map(|frame| self.base.compose(frame)).collect()
    }

    /// Checks tendon displacements: one per tendon, finite or `inf` for a free tendon.
    ///
    /// # Errors
    /// `InvalidInput` for another number of values, NaN or -inf.
    pub fn check_displacements(&self, displacements: &[f64]) -> Result<(), InvalidInput> {
        if displacements.len() != self.tendons.len() {
            let expected = format!("{} values, one per tendon", self.tendons.len());
            return Err(InvalidInput::new("displacements", expected, displacements.len()));
        }
        let bad = displacements.iter().position(|d| d.is_nan() || *d == f64::NEG_INFINITY);
        bad.map_or(Ok(()), |k| {
            let expected = "finite numbers [m], or inf for a free tendon";
            let got = format!("{:?} for tendon '{}'", displacements[k], self.tendon_names[k]);
            Err(InvalidInput::new("displacements", expected, got))
        })
    }
}

impl PartialEq for Robot {
    fn eq(&self, other: &Self) -> bool {
        self.backbone == other.backbone
            && self.tendons == other.tendons
            && self.base == other.base
            && self.tool == other.tool
            && self.name == other.name
    }
}

hash_by_bits!(Robot, |robot, bits| {
    std::hash::Hash::hash(&robot.backbone, bits.0);
    std::hash::Hash::hash(&robot.tendons, bits.0);
    for pose in [&robot.base, &robot.tool] {
        bits.floats(pose.rotation.as_slice());
        bits.floats(pose.translation.as_slice());
    }
    bits.text(robot.name.as_deref());
});

/// Disk frames of the unactuated backbone in the base frame.
fn rest_frames(backbone: &Backbone) -> Vec<Pose> {
    if backbone.is_straight() {
        let along = |s: &f64| Pose { translation: Vector3::new(0.0, 0.0, *s), ..Pose::identity() };
        return backbone.arc_lengths().iter().map(along).collect();
    }
    let mut frame = Pose::identity();
    let mut frames = vec![frame];
    for (i, &length) in backbone.lengths().iter().enumerate() {
        let rest = backbone.rest(i);
        frame = frame.compose(&Pose {
            rotation: so3::exp(&rest),
            translation: so3::left_jacobian(&rest).column(2) * length,
        });
        frames.push(frame);
    }
    frames
}

fn resolve(tendon: &Tendon, backbone: &Backbone, rest: &[Pose]) -> Result<Path, InvalidInput> {
    let n = backbone.subsegments();
    let end = tendon.end().unwrap_or(n);
    if end > n {
        return Err(InvalidInput::new("end", format!("a disk from 1 to {n} (the tip)"), end));
    }
    tendon.check_counts(Some(end))?;
    let (azimuths, radii) = tendon.resolve(end, backbone.arc_lengths());
    if let Some(disk_radius) = backbone.spec().disk_radius
        && let Some(radius) = radii.iter().find(|radius| **radius > disk_radius)
    {
        let expected = format!("a hole inside the disk (disk_radius = {disk_radius} m)");
        return Err(InvalidInput::new("radius", expected, radius));
    }
    let holes = (azimuths.iter().zip(&radii))
        .map(|(azimuth, radius)| Vector3::new(radius * azimuth.cos(), radius * azimuth.sin(), 0.0))
        .collect();
    let mut path = Path { azimuths, holes, rest_length: 0.0 };
    path.rest_length = path.length(rest);
    Ok(path)
}

fn tendon_names(tendons: &[Tendon]) -> Result<Vec<String>, InvalidInput> {
    let names: Vec<String> = (tendons.iter().enumerate())
        .map(|(k, tendon)| tendon.name().map_or_else(|| format!("t{k}"), str::to_owned))
        .collect();
    for (k, name) in names.iter().enumerate() {
        if let Some(first) = names[..k].iter().position(|other| other == name) {
            let expected = format!("a name of its own (tendons[{first}] has this one)");
            return Err(InvalidInput::new(format!("tendons[{k}].name"), expected, name));
        }
    }
    Ok(names)
}

/// A 4x4 homogeneous matrix as a rigid motion.
///
/// # Errors
/// `InvalidInput` when an entry is not finite, the last row is not (0, 0, 0, 1), or the upper left
/// block is no rotation.
pub fn rigid_motion(argument: &str, matrix: &Matrix4<f64>) -> Result<Pose, InvalidInput> {
    if let Some(entry) = matrix.iter().find(|entry| !entry.is_finite()) {
        return Err(InvalidInput::new(argument, "finite entries", entry));
    }
    let last = matrix.row(3);
    if (last[0], last[1], last[2], last[3]) != (0.0, 0.0, 0.0, 1.0) {
        let got = format!("({}, {}, {}, {})", last[0], last[1], last[2], last[3]);
        return Err(InvalidInput::new(argument, "a last row (0, 0, 0, 1)", got));
    }
    // + 0.0: no negative zeros, so that equal poses have equal bits.
    let rotation = matrix.fixed_view::<3, 3>(0, 0).map(|entry| entry + 0.0);
    let translation = matrix.fixed_view::<3, 1>(0, 3).map(|entry| entry + 0.0);
    error::rotation(argument, "a rotation in the upper left 3x3", &rotation)?;
    Ok(Pose { rotation, translation })
}
