use nalgebra::SMatrix;

use super::{Kernel, KernelParameters};
use crate::geometry::Point;

/// Squared exponential: `k(d) = exp(−dᵀ G⁻¹ d)`, eq. (9) of the paper.
///
/// `G` is in square metres; `G = g·I` with `g = 2ℓ²` for a length scale ℓ. It never ends, so a stencil cuts it off where
/// [`cut_off`](Kernel::cut_off) says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SquaredExponential<const D: usize> {
    shape_inverse: SMatrix<f32, D, D>,
}

impl<const D: usize> SquaredExponential<D> {
    /// `G = g·I`, `g` in square metres.
    #[must_use]
    pub fn isotropic(shape_m2: f32) -> Self {
        Self { shape_inverse: SMatrix::from_diagonal_element(1.0 / shape_m2) }
    }

    /// From the inverse of any symmetric positive definite `G`, per square metre.
    #[must_use]
    pub const fn from_inverse(shape_inverse_per_m2: SMatrix<f32, D, D>) -> Self {
        Self { shape_inverse: shape_inverse_per_m2 }
    }

    pub(super) fn from_parameters(parameters: &KernelParameters) -> Self {
        Self::isotropic(parameters.shape_m2)
    }
}

impl<const D: usize> Kernel<D> for SquaredExponential<D> {
    #[inline]
    fn value(&self, displacement_m: &Point<D>) -> f32 {
        libm::expf(-displacement_m.dot(&(self.shape_inverse * displacement_m)))
    }

    #[inline]
    fn gradient(&self, displacement_m: &Point<D>) -> Point<D> {
        let pulled = self.shape_inverse * displacement_m;
        pulled * (-2.0 * libm::expf(-displacement_m.dot(&pulled)))
    }

    fn cut_off(&self, stencil: usize, spacing_m: f32) -> f32 {
        // Outside its stencil a support is at least S/2 spacings away along one axis, the other axes being free: the
        // kernel's largest value on that plane is exp(−s²/Gᵢᵢ), since max over the plane of the quadratic form is s²/Gᵢᵢ.
        let Some(shape) = invert(self.shape_inverse) else { return 1.0 };
        let reach = 0.5 * stencil as f32 * spacing_m;
        (0..D).map(|axis| libm::expf(-reach * reach / shape[(axis, axis)])).fold(0.0, f32::max)
    }
}

/// Gauss–Jordan without pivoting, which a symmetric positive definite matrix does not need; `None` for any other.
fn invert<const D: usize>(mut a: SMatrix<f32, D, D>) -> Option<SMatrix<f32, D, D>> {
    let mut inverse = SMatrix::<f32, D, D>::identity();
    for pivot in 0..D {
        let p = a[(pivot, pivot)];
        if !(p > 0.0 && p.is_finite()) {
            return None;
        }
        for column in 0..D {
            a[(pivot, column)] /= p;
            inverse[(pivot, column)] /= p;
        }
        for row in (0..D).filter(|row| *row != pivot) {
            let factor = a[(row, pivot)];
            for column in 0..D {
                a[(row, column)] -= factor * a[(pivot, column)];
                inverse[(row, column)] -= factor * inverse[(pivot, column)];
            }
        }
    }
    Some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_equation_nine_with_a_full_matrix() {
        // G = [[0.3, 0.1], [0.1, 0.2]]; its inverse by hand is [[4, −2], [−2, 6]].
        let kernel = SquaredExponential::<2>::from_inverse(SMatrix::from([[4.0, -2.0], [-2.0, 6.0]]));
        for (x, y) in [(0.1_f64, 0.2_f64), (-0.3, 0.05), (0.0, 0.0)] {
            let exact = (-(4.0 * x * x - 4.0 * x * y + 6.0 * y * y)).exp();
            let got = kernel.value(&[x as f32, y as f32].into());
            assert!((f64::from(got) - exact).abs() < 1e-6);
        }
        // Along x the kernel reaches furthest: exp(−1/0.3) at one metre.
        assert!((kernel.cut_off(4, 0.5) - (-1.0_f32 / 0.3).exp()).abs() < 1e-6);
    }

    #[test]
    fn the_cut_off_is_stated_and_true() {
        let (g, h) = (0.15, 0.5);
        let kernel = SquaredExponential::<2>::isotropic(g);
        for stencil in [4, 6, 8] {
            let cut = kernel.cut_off(stencil, h);
            let reach = stencil as f32 * 0.5 * h;
            for i in 0..1_000 {
                let outside = [reach + i as f32 * 1e-3, (i as f32 - 500.0) * 2e-3].into();
                assert!(kernel.value(&outside) <= cut * (1.0 + 1e-6));
            }
        }
        assert!((kernel.cut_off(4, h) - 1.27e-3).abs() < 2e-5, "the figure the evidence states for S = 4");
    }

    #[test]
    fn gradient_agrees_with_differences() {
        let kernel = SquaredExponential::<2>::from_inverse(SMatrix::from([[4.0, -2.0], [-2.0, 6.0]]));
        crate::kernel::test_support::gradient_agrees_with_differences(&kernel);
    }
}
