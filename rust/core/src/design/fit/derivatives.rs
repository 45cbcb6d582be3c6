//! Derivatives of predicted points by the values, from the solution of a row.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::parameters::Parameter;
use super::prediction::{Predictor, Solution};
use crate::constant_curvature::{self, ConstantCurvature};
use crate::lie::{Pose, so3};
use crate::model::{Model, State};
use crate::robot::Robot;
use crate::rod::{self, Change, Rod};

impl Predictor<'_> {
    /// Derivatives by what the rod is made of: an adjoint pass for every number, or a forward pass for every value,
    /// whichever are fewer.
    pub(super) fn fill_by_rod(
        &self,
        rod: &Rod<'_>,
        at: &Solution<'_>,
        work: &rod::Scratch,
        jacobian: &mut DMatrix<f64>,
    ) {
        let changes = self.changes(rod, at);
        if changes.is_empty() {
            return;
        }
        // The factors of the solve serve all passes.
        let lengths = rod.robot().backbone().lengths();
        let sensitivity = rod.sensitivity(at.displacements, work);
        let marks = self.measured.marks(rod.robot());
        // A point on a disk moves by v + ω × arm.
        let arm = |disk: usize, tool: &Pose| at.state.frames[disk].rotation * tool.translation;
        // Forward: one pass per value.
        if jacobian.nrows() > changes.len() {
            for (column, change) in &changes {
                let mut whole = sensitivity.no_change();
                change.add_to(&mut whole, lengths);
                let moved = sensitivity.forward(&whole);
                for (j, (disk, tool)) in marks.iter().enumerate() {
                    let turned = moved.spins[*disk].cross(&arm(*disk, tool));
                    let velocity = moved.velocities[*disk] + turned;
                    jacobian.fixed_view_mut::<3, 1>(3 * j, *column).copy_from(&velocity);
                }
            }
            return;
        }
        // Adjoint: one pass per measured number, with the weight on its point.
        let mut weights = vec![Vector3::zeros(); at.state.frames.len()];
        let mut moments = weights.clone();
        for (j, (disk, tool)) in marks.iter().enumerate() {
            for (c, axis) in Matrix3::identity().column_iter().enumerate() {
                weights[*disk].copy_from(&axis);
                moments[*disk] = arm(*disk, tool).cross(&axis);
                let gradient = sensitivity.adjoint(&weights, &moments);
                for (column, change) in &changes {
                    jacobian[(3 * j + c, *column)] = change.dot(&gradient, lengths);
                }
            }
            (weights[*disk], moments[*disk]) = (Vector3::zeros(), Vector3::zeros());
        }
    }

    /// Changes of the rod that the values make, each with its column.
    fn changes(&self, rod: &Rod<'_>, at: &Solution<'_>) -> Vec<(usize, ByValue)> {
        let mut out = Vec::new();
        for (kind, range) in &self.parameters.blocks {
            for (k, column) in range.clone().enumerate() {
                let change = match kind {
                    Parameter::Base => continue,
                    Parameter::Offset => ByValue::Displacement(k, 1.0),
                    Parameter::Gain => ByValue::Displacement(k, finite(at.given[k])),
                    Parameter::Radius | Parameter::Azimuth => {
                        ByValue::Holes(k, hole_shift(*kind, rod.robot(), k))
                    }
                    Parameter::Stiffness => {
                        let stiffness = rod.robot().tendons()[k].stiffness();
                        ByValue::Stiffness(k, 1.0 / stiffness.unwrap_or(f64::INFINITY))
                    }
                    Parameter::PoissonRatio => ByValue::PoissonRatio,
                    Parameter::Rest => ByValue::Rest(k),
                };
                out.push((column, change));
            }
        }
        out
    }

    /// Derivatives by what the arcs are made of.
    pub(super) fn fill_by_arcs(
        &self,
        model: &ConstantCurvature<'_>,
        at: &Solution<'_>,
        work: &constant_curvature::Scratch,
        jacobian: &mut DMatrix<f64>,
    ) {
        let rates = model.arc_rates(at.displacements, work);
        let mut by_values = DMatrix::zeros(3 * work.arcs().len(), jacobian.ncols());
        for (kind, range) in &self.parameters.blocks {
            for (k, column) in range.clone().enumerate() {
                let by_value = match kind {
                    Parameter::Offset => rates.by_displacement(k),
                    Parameter::Gain => rates.by_displacement(k) * finite(at.given[k]),
                    Parameter::Radius | Parameter::Azimuth => {
                        rates.by_holes(k, hole_shift(*kind, model.robot(), k).xy())
                    }
                    // Arcs have no forces and are straight at rest.
                    _ => continue,
                };
                by_values.set_column(column, &by_value);
            }
        }
        for (j, (disk, tool)) in self.measured.marks(model.robot()).iter().enumerate() {
            let moved = rates.of_disk(*disk, tool).rows(0, 3) * &by_values;
            jacobian.rows_mut(3 * j, 3).copy_from(&moved);
        }
    }

    /// Derivatives by the shift and the turn of the base.
    pub(super) fn fill_by_base(
        &self,
        robot: &Robot,
        values: &DVector<f64>,
        state: &State,
        jacobian: &mut DMatrix<f64>,
    ) {
        let Some((_, range)) =
            self.parameters.blocks.iter().find(|(kind, _)| *kind == Parameter::Base)
        else {
            return;
        };
        let turn = so3::left_jacobian(&values.fixed_rows::<3>(range.start + 3).into());
        for (j, (disk, tool)) in self.measured.marks(robot).iter().enumerate() {
            let arm = state.frames[*disk].transform(&tool.translation) - robot.base().translation;
            let mut own = jacobian.fixed_view_mut::<3, 6>(3 * j, range.start);
            own.fixed_columns_mut::<3>(0).fill_with_identity();
            own.fixed_columns_mut::<3>(3).copy_from(&(-so3::hat(&arm) * turn));
        }
    }
}

/// Displacement of a tendon that is not free: free ones have no slope.
fn finite(displacement: f64) -> f64 {
    if displacement.is_finite() { displacement } else { 0.0 }
}

/// Shift of the holes of a straight tendon by its radius or its azimuth.
fn hole_shift(kind: Parameter, robot: &Robot, k: usize) -> Vector3<f64> {
    let hole = robot.paths()[k].holes[0];
    match kind {
        Parameter::Azimuth => Vector3::new(-hole.y, hole.x, 0.0),
        _ => hole.normalize(),
    }
}

/// Change of a rod by a value.
enum ByValue {
    Displacement(usize, f64),
    Stiffness(usize, f64),
    Holes(usize, Vector3<f64>),
    PoissonRatio,
    Rest(usize),
}

impl ByValue {
    fn add_to(&self, change: &mut Change, lengths: &[f64]) {
        match *self {
            Self::Displacement(k, slope) => change.displacements[k] += slope,
            Self::Stiffness(k, slope) => change.stiffness[k] += slope,
            Self::Holes(k, shift) => change.holes[k].iter_mut().for_each(|own| *own += shift),
            Self::PoissonRatio => change.poisson_ratio += 1.0,
            Self::Rest(c) => {
                change.rest.iter_mut().zip(lengths).for_each(|(own, length)| own[c] += length);
            }
        }
    }

    /// Slope along this change, from the gradient.
    fn dot(&self, gradient: &Change, lengths: &[f64]) -> f64 {
        match *self {
            Self::Displacement(k, slope) => gradient.displacements[k] * slope,
            Self::Stiffness(k, slope) => gradient.stiffness[k] * slope,
            Self::Holes(k, shift) => gradient.holes[k].iter().sum::<Vector3<f64>>().dot(&shift),
            Self::PoissonRatio => gradient.poisson_ratio,
            Self::Rest(c) => gradient.rest.iter().zip(lengths).map(|(own, l)| own[c] * l).sum(),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // A test may stop where it fails.
mod tests {
    use std::f64::consts::TAU;
    use std::sync::atomic::Ordering;

    use nalgebra::Matrix4;

    use super::{DVector, Parameter, Predictor, Robot, Vector3};
    use crate::batch::{Control, pool};
    use crate::constant_curvature::{ConstantCurvatureSettings, Coupling};
    use crate::design::fit::parameters::Parameters;
    use crate::design::{FitSettings, Measured, fit};
    use crate::forward::ModelSettings;
    use crate::robot::{Backbone, BackboneSpec, PerDisk, Routing, Tendon};
    use crate::rod::{RodSettings, TendonLaw};

    const BASE: Matrix4<f64> = Matrix4::new(
        0.0, 0.0, 1.0, 0.1, //
        1.0, 0.0, 0.0, 0.2, //
        0.0, 1.0, 0.0, 0.3, //
        0.0, 0.0, 0.0, 1.0,
    );

    fn tool_frame() -> Matrix4<f64> {
        Matrix4::new_translation(&Vector3::new(0.01, 0.02, 0.03))
    }

    fn spec() -> BackboneSpec {
        BackboneSpec { poisson_ratio: 0.3, ..BackboneSpec::straight(0.2, 8) }
    }

    fn trunk() -> Robot {
        let backbone =
            BackboneSpec { rest: Some(vec![Vector3::new(0.01, 0.02, 0.005); 8]), ..spec() };
        let tendons = [0.1, 2.0].map(|azimuth| Tendon::straight(azimuth, 0.01).unwrap());
        let (backbone, tool) = (Backbone::new(backbone).unwrap(), tool_frame());
        Robot::new(backbone, tendons.to_vec(), Some(&BASE), Some(&tool), None).unwrap()
    }

    /// A wire with tendons that stretch, one winding.
    fn elastic() -> Robot {
        let wire =
            BackboneSpec { youngs_modulus: Some(60e9), diameter: Some(vec![0.001]), ..spec() };
        let straight = Routing::Angles { azimuth: PerDisk::Same(0.1), radius: PerDisk::Same(0.01) };
        let winding = Routing::Helical { azimuth: 2.0, radius: 0.01, turns: 0.3 };
        let tendons = vec![
            Tendon::new(straight, None, Some(900.0), None).unwrap(),
            Tendon::new(winding, Some(6), Some(1500.0), None).unwrap(),
        ];
        Robot::new(Backbone::new(wire).unwrap(), tendons, None, None, None).unwrap()
    }

    /// Two segments of three tendons each.
    fn segments() -> Robot {
        let backbone = BackboneSpec { length: vec![0.06, 0.07], subsegments: vec![3, 4], ..spec() };
        let tendons = (0..6).map(|k| {
            let azimuth = PerDisk::Same(0.5 * f64::from(k / 3) + TAU / 3.0 * f64::from(k % 3));
            let radius = PerDisk::Same(0.005 + 0.0003 * f64::from(k));
            let end = if k < 3 { 3 } else { 7 };
            Tendon::new(Routing::Angles { azimuth, radius }, Some(end), None, None).unwrap()
        });
        let (backbone, tool) = (Backbone::new(backbone).unwrap(), tool_frame());
        Robot::new(backbone, tendons.collect(), Some(&BASE), Some(&tool), None).unwrap()
    }

    /// Rows whose measured points are all at the origin.
    fn at_origin(robot: &Robot, displacements: &[f64], points: usize) -> Measured {
        let rows = displacements.len() / robot.tendons().len();
        Measured {
            displacements: displacements.to_vec(),
            points: vec![Vector3::zeros(); rows * points],
            held_out: vec![false; rows],
        }
    }

    /// Compares derivatives with central differences of the residuals, at the robot's own values but for a turned base.
    fn compare(robot: &Robot, model: ModelSettings, kinds: &[Parameter], measured: &Measured) {
        let (pool, control) = (pool(Some(2)).unwrap(), Control::default());
        let parameters = Parameters::new(robot, kinds).unwrap();
        let predictor = Predictor { parameters, measured, model, pool: &pool, control: &control };
        let parameters = &predictor.parameters;
        let chosen: Vec<usize> = (0..measured.held_out.len()).collect();
        let mut values = parameters.start.clone();
        if kinds.last() == Some(&Parameter::Base) {
            let turn = parameters.len() - 3;
            values.rows_mut(turn, 3).copy_from_slice(&[0.3, -0.4, 0.5]);
        }
        let rows = predictor.rows(&values, &chosen, true).unwrap();
        for p in 0..parameters.len() {
            let mut step = DVector::zeros(parameters.len());
            step[p] = 1e-5 * parameters.units[p];
            let side =
                |step: DVector<f64>| predictor.rows(&(&values + step), &chosen, false).unwrap();
            let (ahead, behind) = (side(step.clone()), side(-step));
            for (i, row) in rows.iter().enumerate() {
                assert!(row.solved && ahead[i].solved && behind[i].solved);
                let slopes = (&behind[i].residual - &ahead[i].residual) / 2e-5;
                for (exact, slope) in row.jacobian.column(p).iter().zip(slopes.iter()) {
                    let near = (exact - slope).abs() <= (1e-5 * slope.abs()).max(1e-6);
                    assert!(near, "value {p}, row {i}: {exact} is not {slope}");
                }
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_predictions() {
        use Parameter::{Azimuth, Base, Gain, Offset, PoissonRatio, Radius, Rest};
        let robot = trunk();
        let kinds = [Offset, Gain, Radius, Azimuth, PoissonRatio, Rest, Base];
        for points in [1, 9] {
            let measured = at_origin(&robot, &[-0.004, -0.003, -0.006, f64::INFINITY], points);
            compare(&robot, ModelSettings::Rod(RodSettings::default()), &kinds, &measured);
        }
    }

    #[test]
    fn derivatives_by_the_stiffness_of_tendons() {
        let robot = elastic();
        let given = [-0.004, -0.003, -0.006, f64::INFINITY, 0.001, -0.006];
        let measured = at_origin(&robot, &given, 9);
        let kinds = [Parameter::Stiffness, Parameter::Offset];
        for tendons in [TendonLaw::Sliding, TendonLaw::Proportional] {
            let settings = RodSettings { tendons, ..RodSettings::default() };
            // By forward passes and by adjoint ones.
            compare(&robot, ModelSettings::Rod(settings), &kinds, &measured);
            let tips = at_origin(&robot, &given, 1);
            compare(&robot, ModelSettings::Rod(settings), &kinds, &tips);
        }
    }

    #[test]
    fn derivatives_of_constant_curvature_are_exact() {
        use Parameter::{Azimuth, Base, Gain, Offset, Radius};
        let robot = segments();
        // Of no arcs, so that the misfit counts too; a free tendon.
        let given = [
            [-0.002, 0.001, 0.0015, 0.001, -0.002, 0.0004],
            [0.001, f64::INFINITY, -0.001, -0.0015, 0.001, 0.002],
        ]
        .concat();
        for coupling in Coupling::ALL {
            for extensible in [false, true] {
                let model = ModelSettings::ConstantCurvature(ConstantCurvatureSettings {
                    coupling,
                    extensible,
                });
                // With two tendons left, the length of the first segment is one of least norm.
                for points in [1, 8] {
                    let measured = at_origin(&robot, &given, points);
                    compare(&robot, model, &[Offset, Gain, Radius, Azimuth, Base], &measured);
                }
            }
        }
    }

    /// Points of a known trunk, its gains off by some per cent.
    fn measured_by_gains(robot: &Robot) -> Measured {
        let given: Vec<f64> = (0..80).map(|k| -0.001 - 0.0001 * f64::from(k * 37 % 80)).collect();
        let mut measured = at_origin(robot, &given, 1);
        let (pool, control) = (pool(None).unwrap(), Control::default());
        let points = {
            let parameters = Parameters::new(robot, &[Parameter::Gain]).unwrap();
            let model = ModelSettings::Rod(RodSettings::default());
            let predictor = Predictor {
                parameters,
                measured: &measured,
                model,
                pool: &pool,
                control: &control,
            };
            let rows =
                predictor.rows(&DVector::from_vec(vec![1.05, 0.97]), &[0, 1, 2, 3, 4, 5, 6], false);
            rows.unwrap()
                .iter()
                .map(|row| -Vector3::from_column_slice(row.residual.as_slice()))
                .collect()
        };
        measured.displacements.truncate(14);
        measured.held_out.truncate(7);
        measured.held_out[3] = true;
        measured.points = points;
        measured
    }

    #[test]
    fn fits_are_the_same_on_any_number_of_threads_and_can_be_stopped() {
        let robot = trunk();
        let measured = measured_by_gains(&robot);
        let settings = FitSettings::default();
        let run = |threads, control: &Control| {
            let pool = pool(Some(threads)).unwrap();
            fit(&robot, &measured, &[Parameter::Gain], &settings, &pool, control).unwrap()
        };
        let [one, two] = [1, 2].map(|threads| run(threads, &Control::default()).unwrap());
        assert_eq!(one.parameters, two.parameters);
        assert_eq!(one.standard_errors, two.standard_errors);
        assert_eq!(one.residuals, two.residuals);
        assert!(one.converged && (one.parameters[0].1[0] - 1.05).abs() < 1e-9);
        let control = Control::default();
        control.stop.store(true, Ordering::Relaxed);
        assert!(run(1, &control).is_none());
    }
}
