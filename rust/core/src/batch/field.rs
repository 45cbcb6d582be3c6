//! The fields of a batch, by name: the one list of them.

use crate::error::InvalidInput;
use crate::model::Model;
use crate::robot::Robot;

/// Field of a batch beside status, residual and iterations, which it always has.
///
/// ```
/// use tdcr::batch::Field;
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// assert_eq!(Field::named("tip")?, Field::Tip);
/// assert!(Field::named("tail").is_err());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// Frame of the tip disk.
    Tip,
    /// Frame of every disk.
    Frames,
    /// Centre of every disk \[m\].
    Positions,
    /// Rotation vector \[rad\] (and elongation) of every element.
    Strains,
    /// Holes of every tendon \[m\].
    TendonPoints,
    /// Length of every tendon \[m\].
    TendonLengths,
    /// Tension of every tendon.
    Tensions,
    /// Strain energy.
    Energy,
    /// Places where rows touch obstacles: no column, but a table of its own.
    Contacts,
}

impl Field {
    /// Every field.
    pub const ALL: [Self; 9] = [
        Self::Tip,
        Self::Frames,
        Self::Positions,
        Self::Strains,
        Self::TendonPoints,
        Self::TendonLengths,
        Self::Tensions,
        Self::Energy,
        Self::Contacts,
    ];

    /// Its name in Python.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Tip => "tip",
            Self::Frames => "frames",
            Self::Positions => "positions",
            Self::Strains => "strains",
            Self::TendonPoints => "tendon_points",
            Self::TendonLengths => "tendon_lengths",
            Self::Tensions => "tensions",
            Self::Energy => "energy",
            Self::Contacts => "contacts",
        }
    }

    /// The field of a name.
    ///
    /// # Errors
    /// `InvalidInput` for another name.
    pub fn named(name: &str) -> Result<Self, InvalidInput> {
        let known = Self::ALL.into_iter().find(|field| field.as_str() == name);
        known.ok_or_else(|| {
            let names = Self::ALL.map(Self::as_str).join(", ");
            InvalidInput::new("fields", format!("names of {names}"), format!("'{name}'"))
        })
    }
}

/// One column of a batch: a field, or the points of one tendon.
///
/// ```
/// use tdcr::batch::{Field, Key};
///
/// assert_eq!(Key::TendonPoints(2).field(), Field::TendonPoints);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// See [`Field::Tip`].
    Tip,
    /// See [`Field::Frames`].
    Frames,
    /// See [`Field::Positions`].
    Positions,
    /// See [`Field::Strains`].
    Strains,
    /// See [`Field::TendonPoints`]; which tendon.
    TendonPoints(usize),
    /// See [`Field::TendonLengths`].
    TendonLengths,
    /// See [`Field::Tensions`].
    Tensions,
    /// See [`Field::Energy`].
    Energy,
}

impl Key {
    /// Columns of the requested fields, each once.
    pub(super) fn of(fields: &[Field], robot: &Robot) -> Vec<Self> {
        let wanted = Field::ALL.into_iter().filter(|field| fields.contains(field));
        wanted
            .flat_map(|field| match field {
                Field::Tip => vec![Self::Tip],
                Field::Frames => vec![Self::Frames],
                Field::Positions => vec![Self::Positions],
                Field::Strains => vec![Self::Strains],
                Field::TendonPoints => (0..robot.paths().len()).map(Self::TendonPoints).collect(),
                Field::TendonLengths => vec![Self::TendonLengths],
                Field::Tensions => vec![Self::Tensions],
                Field::Energy => vec![Self::Energy],
                Field::Contacts => vec![],
            })
            .collect()
    }

    /// The field that the column belongs to.
    #[must_use]
    pub const fn field(self) -> Field {
        match self {
            Self::Tip => Field::Tip,
            Self::Frames => Field::Frames,
            Self::Positions => Field::Positions,
            Self::Strains => Field::Strains,
            Self::TendonPoints(_) => Field::TendonPoints,
            Self::TendonLengths => Field::TendonLengths,
            Self::Tensions => Field::Tensions,
            Self::Energy => Field::Energy,
        }
    }

    /// Shape of one row.
    pub(super) fn shape<M: Model>(self, model: &M) -> Vec<usize> {
        let robot = model.robot();
        let n = robot.backbone().subsegments();
        match self {
            Self::Tip => vec![4, 4],
            Self::Frames => vec![n + 1, 4, 4],
            Self::Positions => vec![n + 1, 3],
            Self::Strains => vec![n * model.elements(), model.strain_width()],
            Self::TendonPoints(k) => vec![robot.paths()[k].end() + 1, 3],
            Self::TendonLengths | Self::Tensions => vec![robot.paths().len()],
            Self::Energy => vec![],
        }
    }
}
