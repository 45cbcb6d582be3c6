//! Interface of every forward model: a solve into reusable buffers, and the whole result from it.

mod contact;
mod shape;
mod state;

use nalgebra::Matrix6xX;

use crate::error::InvalidInput;
use crate::robot::Robot;

pub use contact::{Contact, PointKind};
pub use shape::Shape;
pub use state::{Report, State};

/// A robot prepared for one forward model.
///
/// ```
/// use tdcr::constant_curvature::{ConstantCurvature, ConstantCurvatureSettings, Plan};
/// use tdcr::model::Model;
///
/// // Works with any model.
/// fn tip_height<M: Model>(model: &M, displacements: &[f64]) -> Result<f64, tdcr::InvalidInput> {
///     let mut scratch = M::Scratch::default();
///     model.solve(displacements, &mut scratch)?;
///     Ok(model.state(&scratch).frames.last().map_or(0.0, |tip| tip.translation.z))
/// }
/// # use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// # let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?;
/// # let tendons = [0.0, 2.1, 4.2].map(|azimuth| Tendon::straight(azimuth, 0.01));
/// # let tendons = tendons.into_iter().collect::<Result<Vec<_>, _>>()?;
/// # let robot = Robot::new(backbone, tendons, None, None, None)?;
/// let plan = Plan::new(&robot, ConstantCurvatureSettings::default())?;
/// let height = tip_height(&ConstantCurvature::new(&robot, &plan), &[0.0; 3])?;
/// assert!((height - 0.2).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
pub trait Model: Sync {
    /// Name used in Python and in messages.
    const NAME: &'static str;

    /// Buffers of a solve.
    type Scratch: Default + Send;

    /// The robot it was prepared from.
    fn robot(&self) -> &Robot;

    /// Numbers per element in a row of strains: 3, or 4 with the elongation.
    fn strain_width(&self) -> usize {
        3
    }

    /// Elements between two disks, each with a row of strains.
    fn elements(&self) -> usize {
        1
    }

    /// Solves for checked displacements \[m\]; see [`Robot::check_displacements`]. A solve that does
    /// not converge is a report, with the last iterate in the state.
    ///
    /// # Errors
    /// `InvalidInput` for displacements that the model does not take.
    fn solve(
        &self,
        displacements: &[f64],
        work: &mut Self::Scratch,
    ) -> Result<Report, InvalidInput>;

    /// Solves from the last solve of this model in `work`, where the model can
    /// start from that.
    ///
    /// # Errors
    /// As [`Model::solve`].
    fn resume(
        &self,
        displacements: &[f64],
        work: &mut Self::Scratch,
    ) -> Result<Report, InvalidInput> {
        self.solve(displacements, work)
    }

    /// Solves for displacements from an earlier shape of the same robot; a start that does not help is dropped.
    ///
    /// # Errors
    /// `InvalidInput` by default: a model without forces has nothing to start from.
    fn solve_from(
        &self,
        _start: &State,
        _displacements: &[f64],
        _work: &mut Self::Scratch,
    ) -> Result<Report, InvalidInput> {
        Err(rod_only("start", Self::NAME))
    }

    /// Solves for tensions, in the unit of the results.
    ///
    /// # Errors
    /// `InvalidInput` by default: a model without forces does not take tensions.
    fn solve_tensions(
        &self,
        _tensions: &[f64],
        _work: &mut Self::Scratch,
    ) -> Result<Report, InvalidInput> {
        Err(rod_only("tensions", Self::NAME))
    }

    /// Displacements that lead to a state \[m\].
    fn displacements(&self, state: &State) -> Vec<f64> {
        let lengths = state.tendon_lengths.iter().zip(self.robot().paths());
        lengths.map(|(length, path)| length - path.rest_length).collect()
    }

    /// Velocity of the tool point, then angular velocity, by displacements (6 x K, world axes), solved from rest
    /// or from an earlier shape; the report of a solve that did not converge instead.
    ///
    /// # Errors
    /// `InvalidInput` by default: a model without derivatives has none.
    fn jacobian(
        &self,
        _displacements: &[f64],
        _start: Option<&State>,
        _work: &mut Self::Scratch,
    ) -> Result<Result<Matrix6xX<f64>, Report>, InvalidInput> {
        Err(no_derivatives(Self::NAME))
    }

    /// The solved quantities of the last solve in `work`.
    fn state<'w>(&self, work: &'w Self::Scratch) -> &'w State;

    /// The buffers' quantities, taken out of them.
    fn take_state(&self, work: Self::Scratch) -> State;

    /// Reason why the last solve did not converge, in a sentence; empty when it did.
    fn message(&self, displacements: &[f64], work: &Self::Scratch) -> String;

    /// Solves once and builds the whole result.
    ///
    /// # Errors
    /// As [`Model::solve`], and for displacements that do not fit the robot.
    fn shape(&self, displacements: &[f64]) -> Result<Shape, InvalidInput> {
        self.robot().check_displacements(displacements)?;
        let mut work = Self::Scratch::default();
        let report = self.solve(displacements, &mut work)?;
        Ok(self.result(displacements, report, work))
    }

    /// The whole result of the last solve in `work`.
    fn result(&self, displacements: &[f64], report: Report, work: Self::Scratch) -> Shape {
        let message = self.message(displacements, &work);
        Shape { state: self.take_state(work), report, message }
    }
}

/// Error for an argument that models without forces do not take.
#[must_use]
pub fn rod_only(argument: &str, model: &str) -> InvalidInput {
    InvalidInput::new(
        argument,
        "none, or model \"rod\"",
        format!("{argument} for model \"{model}\""),
    )
}

/// Error for the Jacobian of a model that has none.
#[must_use]
pub fn no_derivatives(model: &str) -> InvalidInput {
    let expected = "a model with derivatives (\"rod\" or \"constant_curvature\")";
    InvalidInput::new("model", expected, format!("\"{model}\""))
}
