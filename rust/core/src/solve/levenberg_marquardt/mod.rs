//! Nonlinear least squares over a convex region, by Levenberg-Marquardt and Newton steps.
//!
//! `min |r(z)|^2 / 2` for `z` in a [`Region`](super::convex_region::Region). A step is the minimum of
//! the damped quadratic model under the region's linearised constraints, brought back into the region
//! where discs are round; every point is inside. Damping in proportion to the squared residual keeps
//! the quadratic convergence of Gauss-Newton at points that meet the target (N. Yamashita, M.
//! Fukushima, Computing Suppl. 15 (2001), doi:10.1007/978-3-7091-6217-0_18). The nearest point to a
//! target out of reach is polished with second derivatives, without which steps would shrink only
//! linearly there.

mod descent;
mod least_energy;
mod problem;

pub use descent::Scratch;
pub use problem::{Ending, Problem, Purpose, WITHIN};
