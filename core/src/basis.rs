//! The feature vector φ(x) of eq. (1): which supports a point sees and how strongly.
//!
//! Here lattice, kernel and support meet; the posterior sees only the numbers.

use heapless::Vec;

use crate::{
    geometry::Point,
    kernel::AnyKernel,
    lattice::{Lattice, MAX_STENCIL_NODES, Stencil, offsets},
    support::{AnySupport, Support},
};

/// Supports, their kernel, and the optional bias: everything that turns a point into features.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Basis<const D: usize> {
    /// Where the supports sit.
    pub lattice: Lattice<D>,
    /// How far each reaches.
    pub kernel: AnyKernel<D>,
    /// What each is centred on.
    pub support: AnySupport,
    /// What is subtracted from the constant feature 1, per unit of `Σₘ φₘ(x)`; `None` without bias. See [`Basis::new`].
    pub bias_coupling: Option<f32>,
}

/// φ(x): one value per node of the point's stencil, in the stencil's order, and the bias feature.
#[derive(Clone, Debug)]
pub struct Features<const D: usize> {
    /// The stencil the values belong to.
    pub stencil: Stencil<D>,
    /// `φₘ(x)` for the stencil's nodes.
    pub values: Vec<f32, MAX_STENCIL_NODES>,
    /// The bias feature; 0 without bias.
    pub bias: f32,
}

/// ∂φ/∂x, per metre, in the order of [`Features`].
#[derive(Clone, Debug)]
pub struct FeatureGradients<const D: usize> {
    /// `∂φₘ/∂x`.
    pub values: Vec<Point<D>, MAX_STENCIL_NODES>,
    /// The bias feature's.
    pub bias: Point<D>,
}

impl<const D: usize> Basis<D> {
    /// Composes a basis.
    ///
    /// With a bias the model is `f(x) = Σₘ wₘ φₘ(x) + b`. A lattice of bumps nearly spans the constant function, so that
    /// in these coordinates the information matrix is nearly singular along `(−c·1, 1)`, and `f32` loses the bias. The
    /// same model is therefore written as `f(x) = Σₘ w′ₘ φₘ(x) + b·r(x)` with `w′ₘ = wₘ + c·b` and
    /// `r(x) = 1 − c Σₘ φₘ(x)`: an exact change of variables for any `c`, and with `c` the reciprocal of the mean of
    /// `Σₘ φₘ`, `r` is the small ripple that the lattice cannot express (zero for a B-spline). What remains of the
    /// coupling stands in the prior.
    #[must_use]
    pub fn new(lattice: Lattice<D>, kernel: AnyKernel<D>, support: AnySupport, bias: bool) -> Self {
        let mut basis = Self { lattice, kernel, support, bias_coupling: None };
        if bias {
            const SAMPLES_A_SIDE: usize = 4;
            let mut sum = 0.0;
            for offset in offsets([SAMPLES_A_SIDE; D]) {
                let at = Point::from_fn(|axis, _| {
                    (offset[axis] as f32 + 0.5) / SAMPLES_A_SIDE as f32 * lattice.spacing_m + lattice.origin_m[axis]
                });
                sum += basis.features(&at).map_or(0.0, |features| features.values.iter().sum());
            }
            basis.bias_coupling = Some(SAMPLES_A_SIDE.pow(D as u32) as f32 / sum);
        }
        basis
    }

    /// φ(x); `None` where the lattice cannot place the point (see [`Lattice::stencil_at`]).
    #[inline]
    #[must_use]
    pub fn features(&self, point_m: &Point<D>) -> Option<Features<D>> {
        let stencil = self.lattice.stencil_at(point_m)?;
        let mut features = Features { stencil, values: Vec::new(), bias: 0.0 };
        for displacement in self.displacements(&stencil) {
            features.values.push(self.support.feature(&self.kernel, &displacement)).ok()?;
        }
        if let Some(coupling) = self.bias_coupling {
            features.bias = 1.0 - coupling * features.values.iter().sum::<f32>();
        }
        Some(features)
    }

    /// ∂φ/∂x at the point whose stencil is given.
    #[must_use]
    pub fn gradients(&self, stencil: &Stencil<D>) -> FeatureGradients<D> {
        let mut gradients = FeatureGradients { values: Vec::new(), bias: Point::zeros() };
        for displacement in self.displacements(stencil) {
            // A stencil larger than the capacity has no features, hence no gradients to ask for.
            let _ = gradients.values.push(self.support.feature_gradient(&self.kernel, &displacement));
        }
        if let Some(coupling) = self.bias_coupling {
            gradients.bias = gradients.values.iter().sum::<Point<D>>() * -coupling;
        }
        gradients
    }

    #[inline]
    fn displacements(&self, stencil: &Stencil<D>) -> impl Iterator<Item = Point<D>> {
        let (from_first_m, spacing_m) = (stencil.from_first_m, self.lattice.spacing_m);
        offsets([self.lattice.stencil; D])
            .map(move |offset| Point::from_fn(|axis, _| from_first_m[axis] - offset[axis] as f32 * spacing_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::{KernelChoice, KernelParameters};
    use crate::support::PointSupport;

    fn basis(kernel: KernelChoice, stencil: usize) -> Basis<2> {
        let parameters = KernelParameters { spacing_m: 0.5, shape_m2: 0.15 };
        let lattice = Lattice { origin_m: Point::zeros(), spacing_m: 0.5, stencil };
        Basis::new(lattice, kernel.build(&parameters), AnySupport::PointSupport(PointSupport), true)
    }

    #[test]
    fn the_bias_feature_is_what_the_lattice_cannot_express() {
        for i in 0..200 {
            let at = Point::<2>::new(i as f32 * 0.013, i as f32 * 0.027);
            let spline = basis(KernelChoice::CubicBSpline, 4).features(&at).unwrap();
            assert!(spline.bias.abs() < 1e-6);
            let exponential = basis(KernelChoice::SquaredExponential, 6).features(&at).unwrap();
            assert!(exponential.bias.abs() < 2e-2, "a ripple, not {}", exponential.bias);
        }
    }
}
