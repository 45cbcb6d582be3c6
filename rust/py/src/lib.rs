//! Python bindings of tdcr: convert, check, release the GIL, call the core, map errors.
//!
//! Nothing is computed here. The docstrings of the classes and functions are those of the Python
//! package; units stand in square brackets there, as in its guide.
// Python's docstrings carry [m] and numpydoc sections, which are no Rust links or headings.
#![allow(rustdoc::broken_intra_doc_links, clippy::doc_markdown)]
// pyo3 hands arguments over by value, and getters take self whether they look at it or not.
#![allow(clippy::needless_pass_by_value, clippy::unused_self)]

mod arguments;
mod backbone;
mod batch;
mod bounds;
mod cartesian;
mod choice;
mod constant_curvature;
mod contact;
mod convert;
mod design;
mod forward;
mod inverse;
mod inverse_batch;
mod jacobian;
mod loads;
mod long_call;
mod mesh;
mod obstacle;
mod planar;
mod planar_inverse;
mod pso;
mod pso_settings;
mod rebuild;
mod robot;
mod rod;
mod routing;
mod sensitivity;
mod settings;
mod shape;
mod signed_distance;
mod surroundings;
mod targets;
mod tendon;
mod volumes;

/// The compiled core; use the package `tdcr`.
#[pyo3::pymodule]
mod _core {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::backbone::Backbone;
    #[pymodule_export]
    use crate::batch::{_fields, _forward_batch};
    #[pymodule_export]
    use crate::bounds::Bounds;
    #[pymodule_export]
    use crate::cartesian::cartesian_path;
    #[pymodule_export]
    use crate::constant_curvature::{
        _arc_frames, _arc_from_displacements, _arc_jacobian, _displacements_from_arc,
    };
    #[pymodule_export]
    use crate::contact::Contact;
    #[pymodule_export]
    use crate::design::{_points_on_curve, _prebend, PrebendSettings};
    #[pymodule_export]
    use crate::forward::forward;
    #[pymodule_export]
    use crate::inverse::{_inverse, _inverse_places, _inverse_solutions};
    #[pymodule_export]
    use crate::inverse_batch::_inverse_batch;
    #[pymodule_export]
    use crate::jacobian::jacobian;
    #[pymodule_export]
    use crate::loads::Loads;
    #[pymodule_export]
    use crate::mesh::Mesh;
    #[pymodule_export]
    use crate::obstacle::{Obstacle, clearance};
    #[pymodule_export]
    use crate::planar::{
        _angle_at, _angle_coefficients, _angle_curve, _planar_cable_lengths, _planar_curve,
        _planar_platforms, _planar_trunk, _planar_turns, _two_section_batch, _two_section_nearest,
        _two_section_solutions,
    };
    #[pymodule_export]
    use crate::planar_inverse::{
        _planar_clearance, _planar_inverse_defaults, _planar_newton, _planar_newton_batch,
        _planar_swarm, _planar_swarm_batch,
    };
    #[pymodule_export]
    use crate::pso::_pso_minimize;
    #[pymodule_export]
    use crate::pso_settings::PsoSettings;
    #[pymodule_export]
    use crate::rebuild::_shape;
    #[pymodule_export]
    use crate::robot::Robot;
    #[pymodule_export]
    use crate::rod::{_chained_shape, RodSettings};
    #[pymodule_export]
    use crate::routing::{_routing, _routing_batch, RoutingSettings};
    #[pymodule_export]
    use crate::sensitivity::{Sensitivity, sensitivity};
    #[pymodule_export]
    use crate::settings::{
        _rust_defaults, ConstantCurvatureSettings, InverseSettings, LinkageSettings,
    };
    #[pymodule_export]
    use crate::shape::{_rotation_vector, Shape};
    #[pymodule_export]
    use crate::signed_distance::SignedDistance;
    #[pymodule_export]
    use crate::tendon::{_tendon, Tendon};
    #[pymodule_export]
    use crate::volumes::{Capsule, Cuboid, Cylinder, HalfSpace, Sphere};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
