//! Integration tests of the core, one module per room.
#![allow(
    clippy::unwrap_used, // A test may stop where it fails.
    clippy::panic,
    clippy::cast_possible_truncation, // Random counts from random floats.
    clippy::cast_sign_loss,
    clippy::too_many_lines // A table of cases is one test.
)]

mod batch;
mod cartesian;
mod common;
mod constant_curvature;
mod constant_curvature_robot;
mod contact_common;
mod contact_derivatives;
mod contact_golden;
mod contact_invariances;
mod contact_loads;
mod contact_scenes;
mod design_prebend;
mod design_routing;
mod finger;
mod inverse;
mod inverse_bounds;
mod inverse_common;
mod inverse_contact;
mod inverse_rod;
mod lie;
mod linkage_bars;
mod linkage_chain;
mod linkage_drive;
mod linkage_random;
mod obstacle_meshes;
mod obstacles;
mod optimality;
mod planar_inverse;
mod planar_obstacles;
mod planar_swarm;
mod planar_trunk;
mod planar_two_section;
mod prism;
mod pso;
mod pso_rates;
mod robot;
mod rod_common;
mod rod_continuum;
mod rod_crossing;
mod rod_degenerate;
mod rod_golden;
mod rod_invariances;
mod rod_oracles;
mod rod_random;
mod rod_sensitivity;
mod rod_stopped;
mod solve;
mod solve_bounded;
mod solve_quadratic;

/// Every file beside this one is a module of this target: a forgotten one would never run.
#[test]
fn every_file_is_declared() {
    let here = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/rust");
    let declared = include_str!("main.rs");
    for entry in std::fs::read_dir(here).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let stem = name.strip_suffix(".rs").unwrap();
        assert!(stem == "main" || declared.contains(&format!("\nmod {stem};\n")), "{name}");
    }
}
