//! What the tests share: trunks of one stretch, solved as linkages with the default settings, and the mark of slow tests.

use nalgebra::Vector3;
use tdcr::linkage::{Linkage, LinkageSettings, Plan};
use tdcr::model::Model;
use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};
use tdcr::{InvalidInput, Shape};

pub(crate) const FREE: f64 = f64::INFINITY;

pub(crate) fn robot(length: f64, n: usize, tendons: Vec<Tendon>) -> Robot {
    let backbone = Backbone::new(BackboneSpec::straight(length, n)).unwrap();
    Robot::new(backbone, tendons, None, None, None).unwrap()
}

pub(crate) fn straight(azimuths: &[f64], radius: f64) -> Vec<Tendon> {
    azimuths.iter().map(|azimuth| Tendon::straight(*azimuth, radius).unwrap()).collect()
}

pub(crate) fn try_solve(robot: &Robot, displacements: &[f64]) -> Result<Shape, InvalidInput> {
    let plan = Plan::new(robot)?;
    Linkage::new(robot, &plan, LinkageSettings::default())?.shape(displacements)
}

pub(crate) fn solve(robot: &Robot, displacements: &[f64]) -> Shape {
    try_solve(robot, displacements).unwrap()
}

pub(crate) fn tip(shape: &Shape) -> Vector3<f64> {
    shape.state.frames.last().unwrap().translation
}

/// Marks tests that take more than a second: `make quick` skips what lies in a module `slow`.
macro_rules! slow {
    ($($test:ident),+ $(,)?) => {
        mod slow {
            $(
                #[test]
                fn $test() {
                    super::$test();
                }
            )+
        }
    };
}
pub(crate) use slow;
