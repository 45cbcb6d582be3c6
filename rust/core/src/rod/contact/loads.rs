//! Weight and dead loads.

use nalgebra::Vector3;

use crate::error::InvalidInput;
use crate::robot::Robot;

/// Loads on a robot, in the world's axes; all of them keep their direction.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::rod::contact::Loads;
///
/// // One newton to the side at the tip, and disks of 2 g under gravity.
/// let loads = Loads { tip_force: Vector3::x(), disk_mass: 2e-3, ..Loads::default() };
/// assert!(loads.validate().is_ok());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Loads {
    /// Acceleration of gravity \[m/s²\].
    pub gravity: Vector3<f64>,
    /// Density of the backbone \[kg/m³\].
    pub backbone_density: f64,
    /// Mass of every disk but the base \[kg\].
    pub disk_mass: f64,
    /// Force on the tip disk's centre \[N\].
    pub tip_force: Vector3<f64>,
    /// Moment on the tip disk \[N m\].
    pub tip_moment: Vector3<f64>,
    /// Forces on the disks' centres, disk 0 first, or none \[N\].
    pub disk_forces: Vec<Vector3<f64>>,
}

impl Default for Loads {
    fn default() -> Self {
        Self {
            gravity: Vector3::new(0.0, 0.0, -9.81),
            backbone_density: 0.0,
            disk_mass: 0.0,
            tip_force: Vector3::zeros(),
            tip_moment: Vector3::zeros(),
            disk_forces: Vec::new(),
        }
    }
}

impl Loads {
    /// Checks the values.
    ///
    /// # Errors
    /// `InvalidInput` for numbers that are not finite and negative masses.
    pub fn validate(&self) -> Result<(), InvalidInput> {
        let vectors = [
            ("gravity", self.gravity),
            ("tip_force", self.tip_force),
            ("tip_moment", self.tip_moment),
        ];
        for (name, vector) in vectors {
            check(name, &vector)?;
        }
        for (i, force) in self.disk_forces.iter().enumerate() {
            check(&format!("disk_forces[{i}]"), force)?;
        }
        for (name, value) in
            [("backbone_density", self.backbone_density), ("disk_mass", self.disk_mass)]
        {
            if !(value.is_finite() && value >= 0.0) {
                return Err(InvalidInput::new(name, "0 or more", format!("{value:?}")));
            }
        }
        Ok(())
    }

    /// Force on each disk's centre, and the moment on the tip. The weight of a subsegment goes to its two
    /// disks in halves.
    ///
    /// # Errors
    /// As [`Self::validate`], and for another number of disk forces than disks or a backbone without Young's
    /// modulus, whose results have no newtons.
    pub fn forces(&self, robot: &Robot) -> Result<(Vec<Vector3<f64>>, Vector3<f64>), InvalidInput> {
        let backbone = robot.backbone();
        if !backbone.has_stiffness() {
            let expected = "Young's modulus and diameter of the backbone (loads are in newtons)";
            return Err(InvalidInput::new("youngs_modulus", expected, "none"));
        }
        self.validate()?;
        let n = backbone.subsegments();
        if !(self.disk_forces.is_empty() || self.disk_forces.len() == n + 1) {
            let expected = format!("{} forces, one per disk", n + 1);
            return Err(InvalidInput::new("disk_forces", expected, self.disk_forces.len()));
        }
        let mut forces = self.disk_forces.clone();
        forces.resize(n + 1, Vector3::zeros());
        for i in 0..n {
            let area = backbone.area(i).unwrap_or(0.0);
            let half = self.gravity * (0.5 * self.backbone_density * area * backbone.lengths()[i]);
            forces[i] += half;
            forces[i + 1] += half + self.gravity * self.disk_mass;
        }
        forces[n] += self.tip_force;
        Ok((forces, self.tip_moment))
    }
}

fn check(name: &str, vector: &Vector3<f64>) -> Result<(), InvalidInput> {
    if vector.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    let got = format!("({}, {}, {})", vector.x, vector.y, vector.z);
    Err(InvalidInput::new(name, "three finite numbers", got))
}
