//! Elasticity of an element: the energy of its strain, `½ (w − w_rest)·K (w − w_rest) + ½ EA (ℓ/m) ε²`.
//!
//! All that the rod asks of its material is asked here, component by component of the unknowns x (w, or w and ε):
//! another term of the energy, or another stiffness by axis or subsegment, changes this file.

use crate::robot::Backbone;

/// Stiffness and rest strain of one element, in the plan's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Elasticity {
    /// Diagonal of K by the unknowns: bending, bending, torsion, elongation.
    stiffness: [f64; 4],
    /// Rest strain \[rad\], and no elongation.
    rest: [f64; 4],
}

/// Relative changes of what the stiffness of an element is made of, at constant EI and EA, or a gradient by them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StiffnessChange {
    /// Relative change of the element's length.
    pub(super) length: f64,
    /// Relative change of 1 + ν.
    pub(super) shear: f64,
}

impl Elasticity {
    /// Elasticity of an element of a rest length \[m\], one of `elements` of a backbone's subsegment.
    pub(super) fn new(
        backbone: &Backbone,
        subsegment: usize,
        length: f64,
        elements: f64,
        unit: f64,
    ) -> Self {
        let poisson = backbone.spec().poisson_ratio;
        let bending = backbone.bending_stiffness(subsegment) / (length * unit);
        let axial = backbone.axial_stiffness(subsegment).map_or(0.0, |ea| ea * length / unit);
        let rest = backbone.rest(subsegment) / elements;
        Self {
            stiffness: [bending, bending, bending / (1.0 + poisson), axial],
            rest: [rest.x, rest.y, rest.z, 0.0],
        }
    }

    /// Rest strain of every unknown.
    #[inline(always)]
    pub(super) fn rest(&self) -> &[f64; 4] {
        &self.rest
    }

    /// Scale of an element's stiffness: EI m/ℓ.
    #[inline(always)]
    pub(super) fn bending(&self) -> f64 {
        self.stiffness[0]
    }

    /// Metric of the strains: second derivative of the energy at rest by component `c` twice.
    #[inline(always)]
    pub(super) fn stiffness(&self, c: usize) -> f64 {
        self.stiffness[c]
    }

    /// Second derivative of the energy at rest by two components.
    #[inline(always)]
    pub(super) fn rest_hessian(&self, a: usize, b: usize) -> f64 {
        if a == b { self.stiffness[a] } else { 0.0 }
    }

    /// Compliance: strain that a moment (or force) on component `c` causes by itself.
    #[inline(always)]
    pub(super) fn strain_under(&self, c: usize, moment: f64) -> f64 {
        moment / self.stiffness[c]
    }

    /// Adds the energy of an element at its strain to a sum.
    #[inline(always)]
    pub(super) fn add_energy(&self, strain: &[f64], sum: &mut f64) {
        for (c, strain) in strain.iter().enumerate() {
            let off = strain - self.rest[c];
            *sum += 0.5 * self.stiffness[c] * off * off;
        }
    }

    /// Gradient of the energy: moment of component `c` at its strain.
    #[inline(always)]
    pub(super) fn moment(&self, c: usize, strain: f64) -> f64 {
        self.stiffness[c] * (strain - self.rest[c])
    }

    /// Writes gradient and Hessian of the energy of the element whose unknowns begin at `first` of a subsegment
    /// with `size` of them. The Hessian is zero before.
    #[inline(always)]
    pub(super) fn differentiate<const D: usize>(
        &self,
        strains: &[f64],
        first: usize,
        size: usize,
        gradient: &mut [f64],
        hessian: &mut [f64],
    ) {
        for c in 0..D {
            let k = first + c;
            gradient[k] = self.moment(c, strains[k]);
            hessian[k * (size + 1)] = self.stiffness[c];
        }
    }

    /// Rate of the gradient of the energy by a change of the rest strain in component `c`, negated.
    #[inline(always)]
    pub(super) fn moment_by_rest(&self, c: usize, rest: f64) -> f64 {
        self.stiffness[c] * rest
    }

    /// Rate of the gradient of the energy in component `c` by a change of the stiffness.
    #[inline(always)]
    pub(super) fn moment_by_stiffness(&self, c: usize, strain: f64, by: StiffnessChange) -> f64 {
        let moment = self.moment(c, strain);
        match c {
            2 => moment * (-by.length - by.shear),
            3 => moment * by.length,
            _ => moment * -by.length,
        }
    }

    /// Adjoint of [`Self::moment_by_stiffness`]: subtracts its product with a weight from a gradient.
    #[inline(always)]
    pub(super) fn subtract_weighted_moment(
        &self,
        c: usize,
        strain: f64,
        weight: f64,
        out: &mut StiffnessChange,
    ) {
        let moment = weight * self.stiffness[c] * (strain - self.rest[c]);
        out.length += if c == 3 { -moment } else { moment };
        if c == 2 {
            out.shear += moment;
        }
    }

    /// Rest strain of component `c` at which a gradient that is not zero becomes zero.
    #[inline(always)]
    pub(super) fn balanced_rest(&self, c: usize, gradient: f64) -> f64 {
        gradient / self.stiffness[c] + self.rest[c]
    }

    /// Gradient of component `c` once its rest strain is another one.
    #[inline(always)]
    pub(super) fn with_rest(&self, c: usize, gradient: f64, rest: f64) -> f64 {
        gradient + self.stiffness[c] * (self.rest[c] - rest)
    }
}
