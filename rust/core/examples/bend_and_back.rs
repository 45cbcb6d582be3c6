//! A trunk is bent by its tendons, and asked how to bring its tip to the same point again.

use tdcr::InvalidInput;
use tdcr::inverse::Target;
use tdcr::robot::{Backbone, BackboneSpec, Robot, Tendon};

fn main() -> Result<(), InvalidInput> {
    let backbone = Backbone::new(BackboneSpec::straight(0.2, 10))?; // 200 mm, 10 subsegments
    let azimuths = [0.0, 120.0, 240.0_f64];
    let tendons = azimuths.map(|azimuth| Tendon::straight(azimuth.to_radians(), 0.01));
    let tendons = tendons.into_iter().collect::<Result<_, _>>()?;
    let robot = Robot::new(backbone, tendons, None, None, None)?;
    let shape = robot.forward(&[-0.008, f64::INFINITY, f64::INFINITY])?; // pull one, let the others follow
    let tip = shape.state.frames[10].translation;
    let found = robot.inverse(&Target::point(tip)?)?;
    println!("tip at {tip:?} m, reached again with {:?} m", found.displacements);
    Ok(())
}
