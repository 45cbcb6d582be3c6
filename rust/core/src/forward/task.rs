//! Work for any model, handed to it once the model is known.

use nalgebra::Matrix6xX;
use rayon::ThreadPool;

use super::load::{Load, Solution, solve_load};
use crate::batch::{Control, Field, Solved, chain_rows, chained_shape, solve_rows};
use crate::error::InvalidInput;
use crate::model::{Model, Shape, State};

/// Work that any model can do.
pub(super) trait Task {
    type Output;

    fn run<M: Model>(self, model: &M) -> Result<Self::Output, InvalidInput>;
}

/// One solve.
pub(super) struct SolveLoad<'a> {
    pub(super) load: Load,
    pub(super) start: Option<&'a State>,
}

impl Task for SolveLoad<'_> {
    type Output = Solution;

    fn run<M: Model>(self, model: &M) -> Result<Solution, InvalidInput> {
        solve_load(model, self.load, self.start)
    }
}

/// Rows of displacements and the fields wanted of them.
///
/// ```
/// use tdcr::batch::{Control, Field, Key, pool};
/// use tdcr::forward::{Forward, ModelSettings, Rows};
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let forward = Forward::new(&robot, ModelSettings::default())?;
/// let displacements = [0.0, 0.0, 0.0, -0.004, 0.002, 0.002];
/// let rows = Rows { displacements: &displacements, count: 2, fields: &[Field::Tip], warm: true };
/// let solved = forward.solve_rows(&rows, &*pool(Some(1))?, &Control::default())?;
/// assert_eq!(solved.unwrap_or_default().values(Key::Tip).map(<[f64]>::len), Some(2 * 16));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a> {
    /// Displacements, row after row (B x K) \[m\].
    pub displacements: &'a [f64],
    /// Number of rows.
    pub count: usize,
    /// Fields that the answer has.
    pub fields: &'a [Field],
    /// Start of every row: the answer of the row before ([`chain_rows`]), or rest ([`solve_rows`]).
    pub warm: bool,
}

/// Many solves.
pub(super) struct SolveRows<'a> {
    pub(super) rows: &'a Rows<'a>,
    pub(super) pool: &'a ThreadPool,
    pub(super) control: &'a Control,
}

impl Task for SolveRows<'_> {
    type Output = Option<Solved>;

    fn run<M: Model>(self, model: &M) -> Result<Option<Solved>, InvalidInput> {
        let Self { rows: &Rows { displacements, count, fields, warm }, pool, control } = self;
        let solve = if warm { chain_rows } else { solve_rows };
        solve(model, displacements, count, fields, pool, control)
    }
}

/// One row of a warm batch.
pub(super) struct ChainedShape<'a> {
    pub(super) displacements: &'a [f64],
    pub(super) row: usize,
}

impl Task for ChainedShape<'_> {
    type Output = Shape;

    fn run<M: Model>(self, model: &M) -> Result<Shape, InvalidInput> {
        chained_shape(model, self.displacements, self.row)
    }
}

/// Velocity of the tool by displacements, or the shape of a solve that did not converge.
pub(super) struct ToolJacobian<'a> {
    pub(super) displacements: &'a [f64],
    pub(super) start: Option<&'a State>,
}

impl Task for ToolJacobian<'_> {
    type Output = Result<Matrix6xX<f64>, Shape>;

    fn run<M: Model>(self, model: &M) -> Result<Self::Output, InvalidInput> {
        let Self { displacements, start } = self;
        model.robot().check_displacements(displacements)?;
        let mut work = M::Scratch::default();
        let columns = model.jacobian(displacements, start, &mut work)?;
        Ok(columns.map_err(|report| model.result(displacements, report, work)))
    }
}
