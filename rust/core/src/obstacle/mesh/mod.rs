//! The inside of a closed surface of triangles.

mod check;
mod query;
mod surface;

use std::hash::Hasher;
use std::sync::Arc;

use nalgebra::Vector3;

use super::{Fault, Near, Solid, move_pose, tightest_first};
use crate::error::InvalidInput;
use crate::hashing::Bits;
use crate::lie::Pose;
use surface::Surface;

/// The inside of a closed surface of triangles. Clones share the triangles.
///
/// ```
/// use nalgebra::Vector3;
/// use tdcr::obstacle::Mesh;
///
/// # fn main() -> Result<(), tdcr::InvalidInput> {
/// // A tetrahedron, its faces counter-clockwise from outside.
/// let vertices = [Vector3::zeros(), Vector3::x() * 0.1, Vector3::y() * 0.1, Vector3::z() * 0.1];
/// let mesh = Mesh::new(&vertices, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])?;
/// assert_eq!(mesh.vertices().len(), 4);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Mesh {
    surface: Arc<Surface>,
    pose: Pose,
}

impl Mesh {
    /// From vertices \[m\] and faces, three vertex numbers each, counter-clockwise seen from outside.
    ///
    /// A surface that is inside out as a whole (its volume is negative) is turned; [`Mesh::faces`] then
    /// gives the turned ones. Whether the surface cuts through itself is not checked.
    ///
    /// # Errors
    /// `InvalidInput` naming `vertices` or `faces`: nothing there, a number that is not finite, a vertex
    /// that does not exist, a triangle without area, a surface that is not closed (names the first edge
    /// that has not two faces), faces that turn different ways (names the edge), surfaces that touch in a
    /// single vertex, no volume.
    pub fn new(vertices: &[Vector3<f64>], faces: &[[usize; 3]]) -> Result<Self, InvalidInput> {
        let surface = Arc::new(Surface::new(vertices, faces)?);
        Ok(Self { surface, pose: Pose::identity() })
    }

    /// Its vertices where they are now \[m\].
    #[must_use]
    pub fn vertices(&self) -> Vec<Vector3<f64>> {
        self.surface.vertices.iter().map(|vertex| self.pose.transform(vertex)).collect()
    }

    /// Its faces, counter-clockwise seen from outside.
    #[must_use]
    pub fn faces(&self) -> &[[usize; 3]] {
        &self.surface.faces
    }

    fn local(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.pose.rotation.tr_mul(&(x - self.pose.translation))
    }
}

impl Solid for Mesh {
    fn transform(&self, pose: &Pose) -> Self {
        Self { surface: self.surface.clone(), pose: move_pose(pose, &self.pose) }
    }

    fn hash_bits<H: Hasher>(&self, bits: &mut Bits<'_, H>) {
        bits.vectors(&self.surface.vertices);
        for face in &self.surface.faces {
            bits.counts(face);
        }
        bits.floats(self.pose.rotation.as_slice());
        bits.floats(self.pose.translation.as_slice());
    }

    fn near(&self, x: &Vector3<f64>) -> Result<Near, Fault> {
        Ok(self.surface.near(&self.local(x)).rotate(&self.pose.rotation))
    }

    fn constraints(
        &self,
        x: &Vector3<f64>,
        reach: f64,
        inside: bool,
        out: &mut Vec<Near>,
    ) -> Result<(), Fault> {
        let start = out.len();
        self.surface.constraints(&self.local(x), reach, inside, out);
        for entry in &mut out[start..] {
            *entry = entry.rotate(&self.pose.rotation);
        }
        tightest_first(&mut out[start..]);
        Ok(())
    }
}

impl PartialEq for Mesh {
    fn eq(&self, other: &Self) -> bool {
        let same = Arc::ptr_eq(&self.surface, &other.surface)
            || (self.surface.vertices == other.surface.vertices
                && self.surface.faces == other.surface.faces);
        same && self.pose == other.pose
    }
}
