//! Python bindings of tdcr: convert, check, release the GIL, call the core, map errors.
//!
//! Nothing is computed here. The docstrings of the classes and functions are those of the Python
//! package; units stand in square brackets there, as in its guide.
// Python's docstrings carry [m] and numpydoc sections, which are no Rust links or headings.
#![allow(rustdoc::broken_intra_doc_links, clippy::doc_markdown)]
// pyo3 hands arguments over by value, and getters take self whether they look at it or not.
#![allow(clippy::needless_pass_by_value, clippy::unused_self)]

mod constant_curvature;
mod convert;
mod design;
mod forward;
mod inverse;
mod planar;
mod pso;
mod robot;
mod scene;
mod settings;

/// The compiled core; use the package `tdcr`.
#[pyo3::pymodule]
mod _core {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::constant_curvature::{
        _arc_frames, _arc_from_displacements, _arc_jacobian, _displacements_from_arc,
    };
    #[pymodule_export]
    use crate::design::fit::_fit;
    #[pymodule_export]
    use crate::design::prebend::{_points_on_curve, _prebend};
    #[pymodule_export]
    use crate::design::routing::{_routing, _routing_batch};
    #[pymodule_export]
    use crate::forward::batch::{_chained_shape, _fields, _forward_batch};
    #[pymodule_export]
    use crate::forward::forward;
    #[pymodule_export]
    use crate::forward::jacobian::jacobian;
    #[pymodule_export]
    use crate::forward::sensitivity::{Sensitivity, sensitivity};
    #[pymodule_export]
    use crate::forward::shape::Shape;
    #[pymodule_export]
    use crate::forward::shape_parts::{_rotation_vector, _shape};
    #[pymodule_export]
    use crate::inverse::batch::_inverse_batch;
    #[pymodule_export]
    use crate::inverse::cartesian_path::cartesian_path;
    #[pymodule_export]
    use crate::inverse::{_inverse, _inverse_solutions};
    #[pymodule_export]
    use crate::planar::inverse::{
        _planar_clearance, _planar_inverse_defaults, _planar_newton, _planar_newton_batch,
        _planar_swarm, _planar_swarm_batch,
    };
    #[pymodule_export]
    use crate::planar::trunk::{
        _angle_at, _angle_coefficients, _angle_curve, _planar_cable_lengths, _planar_curve,
        _planar_platforms, _planar_trunk, _planar_turns, _two_section_batch, _two_section_nearest,
        _two_section_solutions,
    };
    #[pymodule_export]
    use crate::pso::_pso_minimize;
    #[pymodule_export]
    use crate::robot::Robot;
    #[pymodule_export]
    use crate::robot::backbone::Backbone;
    #[pymodule_export]
    use crate::robot::tendon::{_tendon, Tendon};
    #[pymodule_export]
    use crate::scene::contact::Contact;
    #[pymodule_export]
    use crate::scene::loads::Loads;
    #[pymodule_export]
    use crate::scene::obstacle::{Obstacle, clearance};
    #[pymodule_export]
    use crate::scene::signed_distance::SignedDistance;
    #[pymodule_export]
    use crate::settings::_rust_defaults;
    #[pymodule_export]
    use crate::settings::bounds::Bounds;
    #[pymodule_export]
    use crate::settings::constant_curvature::ConstantCurvatureSettings;
    #[pymodule_export]
    use crate::settings::inverse::InverseSettings;
    #[pymodule_export]
    use crate::settings::linkage::LinkageSettings;
    #[pymodule_export]
    use crate::settings::prebend::PrebendSettings;
    #[pymodule_export]
    use crate::settings::pso::PsoSettings;
    #[pymodule_export]
    use crate::settings::rod::RodSettings;
    #[pymodule_export]
    use crate::settings::routing::RoutingSettings;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        crate::scene::shapes::add_shapes(module)?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
