//! Contacts of a robot with obstacles.

use nalgebra::Vector3;

/// Which point of a disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PointKind {
    /// The centre, or the body around it.
    Center,
    /// A tendon's hole.
    Hole,
    /// Opposite a tendon's hole.
    Mirror,
}

impl PointKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Center, Self::Hole, Self::Mirror];

    /// The name used in Python.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Center => "center",
            Self::Hole => "hole",
            Self::Mirror => "mirror",
        }
    }
}

/// A place where a robot touches an obstacle, in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// The disk.
    pub disk: usize,
    /// Which of its points.
    pub kind: PointKind,
    /// The tendon whose hole it is, or is opposite to.
    pub tendon: Option<usize>,
    /// Index of the obstacle.
    pub obstacle: usize,
    /// Place of the robot's point \[m\].
    pub point: Vector3<f64>,
    /// Unit normal of the obstacle, towards the robot.
    pub normal: Vector3<f64>,
    /// Distance left \[m\].
    pub gap: f64,
    /// Force on the robot, in the unit of the results.
    pub force: Vector3<f64>,
}
