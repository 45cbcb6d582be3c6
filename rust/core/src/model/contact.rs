//! Contacts of a robot with obstacles.

use nalgebra::Vector3;

/// Which point of a disk.
///
/// ```
/// use tdcr::PointKind;
///
/// assert_eq!(PointKind::ALL.map(PointKind::as_str), ["center", "hole", "mirror"]);
/// ```
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

/// Contact of a point of a robot with an obstacle, in the world.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::{Contact, PointKind};
///
/// let contact = Contact {
///     disk: 11,
///     kind: PointKind::Hole,
///     tendon: Some(0),
///     obstacle: 0,
///     point: Vector3::new(0.01, 0.0, 0.1),
///     normal: Vector3::x(),
///     gap: 0.0,
///     force: Vector3::x() * 0.4,
/// };
/// // Without friction a contact pushes along its normal.
/// assert!(contact.force.cross(&contact.normal).norm() < 1e-12);
/// ```
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
    /// Position of the robot's point \[m\].
    pub point: Vector3<f64>,
    /// Unit normal of the obstacle, towards the robot.
    pub normal: Vector3<f64>,
    /// Gap \[m\].
    pub gap: f64,
    /// Force on the robot, in the unit of the results.
    pub force: Vector3<f64>,
}
