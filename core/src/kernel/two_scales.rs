use nalgebra::SMatrix;

use super::{DEFAULT_SHAPE, Kernel, SquaredExponential};
use crate::{
    define::settings,
    geometry::Point,
    settings::{SettingsError, number},
};

settings! {
    /// Settings of [`TwoScales`].
    TwoScalesSettings {
        /// `g` of the narrow half in units of spacing², so that it scales with the lattice.
        shape: f32 = DEFAULT_SHAPE,
    }
}

impl TwoScalesSettings {
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        number::positive("kernel shape", self.shape)
    }

    pub(crate) fn build<const D: usize>(&self, spacing_m: f32) -> TwoScales<D> {
        TwoScales::new(self.shape * spacing_m * spacing_m)
    }
}

/// Half a squared exponential of shape `g`, half one of twice its length scale: the paper's "several kernels", as one
/// function on one lattice.
///
/// The narrow half resolves walls, the wide half carries belief into gaps. Its reach is the wide half's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoScales<const D: usize> {
    narrow: SquaredExponential<D>,
    wide: SquaredExponential<D>,
}

/// `g` of the wide half in units of the narrow half's: twice the length scale.
const WIDER: f32 = 4.0;

impl<const D: usize> TwoScales<D> {
    /// `g` of the narrow half, square metres.
    #[must_use]
    pub fn new(shape_m2: f32) -> Self {
        Self { narrow: SquaredExponential::isotropic(shape_m2), wide: SquaredExponential::isotropic(WIDER * shape_m2) }
    }
}

impl<const D: usize> Kernel<D> for TwoScales<D> {
    #[inline]
    fn value(&self, displacement_m: &Point<D>) -> f32 {
        0.5 * (self.narrow.value(displacement_m) + self.wide.value(displacement_m))
    }

    #[inline]
    fn gradient(&self, displacement_m: &Point<D>) -> Point<D> {
        (self.narrow.gradient(displacement_m) + self.wide.gradient(displacement_m)) * 0.5
    }

    #[inline]
    fn blurred(&self, covariance_m2: &SMatrix<f32, D, D>) -> Self {
        Self { narrow: self.narrow.blurred(covariance_m2), wide: self.wide.blurred(covariance_m2) }
    }

    #[inline]
    fn over_segment(&self, middle_m: &Point<D>, along_m: &Point<D>) -> f32 {
        0.5 * (self.narrow.over_segment(middle_m, along_m) + self.wide.over_segment(middle_m, along_m))
    }

    #[inline]
    fn over_box(&self, displacement_m: &Point<D>, sides_m: &Point<D>) -> f32 {
        0.5 * (self.narrow.over_box(displacement_m, sides_m) + self.wide.over_box(displacement_m, sides_m))
    }

    fn cut_off(&self, reach_m: f32) -> f32 {
        0.5 * (self.narrow.cut_off(reach_m) + self.wide.cut_off(reach_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradient_agrees_with_differences() {
        crate::kernel::test_support::gradient_agrees_with_differences(&TwoScales::<2>::new(0.15));
    }

    #[test]
    fn is_one_at_its_peak_and_the_mean_of_its_halves() {
        let kernel = TwoScales::<2>::new(0.15);
        assert_eq!(kernel.value(&Point::zeros()), 1.0);
        let exact = 0.5 * ((-0.25_f64 / 0.15).exp() + (-0.25_f64 / 0.6).exp());
        assert!((f64::from(kernel.value(&[0.3, 0.4].into())) - exact).abs() < 1e-6);
    }
}
