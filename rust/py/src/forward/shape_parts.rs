//! Parts of a `Shape`, as pickle, files and tables keep them.

use nalgebra::{Matrix3, Vector3};
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use tdcr::Status;
use tdcr::forward::Solution;
use tdcr::lie::Pose;
use tdcr::model::{Report, State};

use crate::convert::arrays::{float_array, matrix4, values, wrong_shape};
use crate::forward::model_choice::model_settings;
use crate::forward::shape::Shape;
use crate::robot::Robot;
use crate::scene::Surroundings;
use crate::scene::contact::Contact;

/// Rebuilds a pickled shape.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // The fields of a result, flat.
pub(crate) fn _shape(
    robot: &Bound<'_, Robot>,
    model: &str,
    settings: &Bound<'_, PyAny>,
    displacements: &Bound<'_, PyAny>,
    frames: &Bound<'_, PyAny>,
    strains: &Bound<'_, PyAny>,
    tendon_lengths: &Bound<'_, PyAny>,
    tensions: &Bound<'_, PyAny>,
    energy: f64,
    outcome: (String, String, f64, usize),
    around: (Bound<'_, PyAny>, Option<Bound<'_, PyAny>>, Vec<Bound<'_, Contact>>),
) -> PyResult<Shape> {
    // Numbers of tendons.
    let list = |name: &str, value: &Bound<'_, PyAny>| -> PyResult<Vec<f64>> {
        Ok(values(&float_array(name, value)?)?.to_vec())
    };
    // Frames of the disks.
    let frames = float_array("frames", frames)?;
    if frames.shape().len() != 3 || frames.shape()[1..] != [4, 4] {
        return Err(wrong_shape("frames", "shape (n + 1, 4, 4)", frames.shape()));
    }
    let frames = (values(&frames)?.chunks_exact(16))
        .map(|m| Pose {
            rotation: Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]),
            translation: Vector3::new(m[3], m[7], m[11]),
        })
        .collect();
    // Strains of the elements, with their elongations where the rod has them.
    let strains = float_array("strains", strains)?;
    let width = match strains.shape() {
        [_, width @ (3 | 4)] => *width,
        shape => return Err(wrong_shape("strains", "shape (n, 3 or 4)", shape)),
    };
    let rows = values(&strains)?.chunks_exact(width);
    // Obstacles, loads and contacts.
    let (obstacles, loads, contacts) = around;
    let around = Surroundings::new(robot.py(), Some(&obstacles), loads.as_ref())?;
    let state = State {
        contacts: contacts.iter().map(|contact| contact.get().0).collect(),
        frames,
        strains: rows.clone().map(|row| Vector3::new(row[0], row[1], row[2])).collect(),
        elongations: if width == 4 { rows.map(|row| row[3]).collect() } else { Vec::new() },
        tendon_lengths: list("tendon_lengths", tendon_lengths)?,
        tensions: list("tensions", tensions)?,
        energy,
    };
    // Status of the solve.
    let (name, message, residual, iterations) = outcome;
    let known = Status::ALL.into_iter().find(|status| status.as_str() == name);
    let status = known.unwrap_or(Status::NumericalError);
    let shape = tdcr::Shape { state, report: Report { status, residual, iterations }, message };
    let settings = model_settings(model, Some(settings))?;
    let displacements = list("displacements", displacements)?;
    check_sizes(&robot.get().0, &shape.state, &displacements)?;
    Ok(Shape::new(robot.get().clone(), settings, Solution { displacements, shape }).among(around))
}

/// Refuses a state that is not one of the robot: its tendons' holes are looked up by disk.
fn check_sizes(robot: &tdcr::robot::Robot, state: &State, displacements: &[f64]) -> PyResult<()> {
    let (disks, tendons) = (robot.backbone().subsegments() + 1, robot.paths().len());
    for (name, expected, got) in [
        ("frames", disks, state.frames.len()),
        ("tendon_lengths", tendons, state.tendon_lengths.len()),
        ("tensions", tendons, state.tensions.len()),
        ("displacements", tendons, displacements.len()),
    ] {
        if got != expected {
            let wanted = format!("{expected} rows, as the robot has");
            return Err(wrong_shape(name, &wanted, &[got]));
        }
    }
    Ok(())
}

/// Rotation vector of a frame's rotation, for tables.
///
/// Parameters
/// ----------
/// frame : array_like, shape (4, 4)
///
/// Returns
/// -------
/// tuple of float
///     Axis times angle [rad], of length 0 to pi.
#[pyfunction]
pub(crate) fn _rotation_vector(frame: &Bound<'_, PyAny>) -> PyResult<(f64, f64, f64)> {
    let matrix = matrix4("frame", frame)?;
    let vector = tdcr::lie::so3::log(&matrix.fixed_view::<3, 3>(0, 0).into_owned());
    Ok((vector.x, vector.y, vector.z))
}
