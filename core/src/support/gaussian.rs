use nalgebra::SMatrix;

use super::{MAX_NUMBERS, Support, SupportNumbers};
use crate::{
    define::settings,
    geometry::Point,
    kernel::Kernel,
    settings::{SettingsError, number},
};

settings! {
    /// Settings of a [`GaussianSupport`] that is the same at every node.
    GaussianSettings {
        /// Standard deviation along every axis, in spacings.
        size: f32 = 1.0,
    }
}

impl GaussianSettings {
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        number::support_size(self.size)
    }

    pub(crate) fn build<const D: usize>(&self, spacing_m: f32) -> GaussianSupport<D> {
        let deviation_m = self.size * spacing_m;
        GaussianSupport { covariance_m2: SMatrix::from_diagonal_element(deviation_m * deviation_m) }
    }
}

/// A support spread as `N(m, S)` around its node (eq. 13, corrected): the kernel blurred by `S`.
///
/// Of a squared exponential that is another one, with `G′ = G + 2S`, against points and segments alike. `S → 0` is the
/// point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaussianSupport<const D: usize> {
    covariance_m2: SMatrix<f32, D, D>,
}

impl<const D: usize> GaussianSupport<D> {
    /// From `S`, square metres; `None` unless it is finite, symmetric and, up to rounding, positive semidefinite.
    #[must_use]
    pub fn new(covariance_m2: SMatrix<f32, D, D>) -> Option<Self> {
        let s = &covariance_m2;
        let finite = s.iter().all(|x| x.is_finite());
        // Positive semidefinite for D = 2; in more dimensions a necessary condition, and a kernel blurred by less answers NaN.
        let bounded = (0..D).all(|i| {
            (0..D).all(|j| {
                let product = s[(i, i)] * s[(j, j)];
                s[(i, j)] == s[(j, i)] && s[(i, j)] * s[(i, j)] <= product * (1.0 + 1e-4)
            })
        });
        let positive = (0..D).all(|i| s[(i, i)] >= 0.0);
        (finite && bounded && positive).then_some(Self { covariance_m2 })
    }

    /// `S`, square metres.
    #[must_use]
    pub const fn covariance_m2(&self) -> &SMatrix<f32, D, D> {
        &self.covariance_m2
    }
}

/// Where a symmetric matrix's upper half stands among the numbers, row by row.
fn upper<const D: usize>() -> impl Iterator<Item = (usize, usize)> {
    (0..D).flat_map(|i| (i..D).map(move |j| (i, j))).take(MAX_NUMBERS)
}

impl<const D: usize> Support<D> for GaussianSupport<D> {
    fn numbers(&self) -> SupportNumbers {
        let mut numbers = SupportNumbers::default();
        for (number, at) in numbers.iter_mut().zip(upper::<D>()) {
            *number = self.covariance_m2[at];
        }
        numbers
    }

    fn from_numbers(numbers: &SupportNumbers) -> Option<Self> {
        let mut covariance_m2 = SMatrix::zeros();
        for (number, (i, j)) in numbers.iter().zip(upper::<D>()) {
            covariance_m2[(i, j)] = *number;
            covariance_m2[(j, i)] = *number;
        }
        Self::new(covariance_m2)
    }

    #[inline]
    fn feature(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> f32 {
        kernel.blurred(&self.covariance_m2).value(displacement_m)
    }

    #[inline]
    fn over_lattice<const L: usize>(
        &self,
        kernel: &impl Kernel<D>,
        from_first_m: &[Point<D>; L],
        spacing_m: f32,
        width: usize,
        values: &mut [[f32; L]],
    ) {
        // Blurred once, not node by node.
        kernel.blurred(&self.covariance_m2).over_lattice(from_first_m, spacing_m, width, values);
    }

    #[inline]
    fn feature_gradient(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> Point<D> {
        kernel.blurred(&self.covariance_m2).gradient(displacement_m)
    }

    #[inline]
    fn segment_feature(&self, kernel: &impl Kernel<D>, middle_m: &Point<D>, along_m: &Point<D>) -> f32 {
        kernel.blurred(&self.covariance_m2).over_segment(middle_m, along_m)
    }

    fn cut_off(&self, kernel: &impl Kernel<D>, reach_m: f32) -> f32 {
        kernel.blurred(&self.covariance_m2).cut_off(reach_m)
    }
}
