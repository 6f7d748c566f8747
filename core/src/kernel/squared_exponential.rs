use nalgebra::SMatrix;

use super::{
    DEFAULT_SHAPE, Kernel, bell,
    quadrature::{LEGENDRE_5, LEGENDRE_12, mean},
};
use crate::{
    define::settings,
    geometry::Point,
    lattice::offsets,
    settings::{SettingsError, number},
};

settings! {
    /// Settings of a [`SquaredExponential`].
    SquaredExponentialSettings {
        /// The isotropic `g` of `G = g·I` (eq. 9) in units of spacing², so that it scales with the lattice.
        shape: f32 = DEFAULT_SHAPE,
    }
}

impl SquaredExponentialSettings {
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        number::positive("kernel shape", self.shape)
    }

    pub(crate) fn build<const D: usize>(&self, spacing_m: f32) -> SquaredExponential<D> {
        SquaredExponential::isotropic(self.shape * spacing_m * spacing_m)
    }
}

/// Squared exponential: `k(d) = exp(−dᵀ G⁻¹ d)`, eq. (9) of the paper.
///
/// `G` is in square metres; `G = g·I` with `g = 2ℓ²` for a length scale ℓ. It never ends, so a stencil cuts it off where
/// [`cut_off`](Kernel::cut_off) says.
///
/// Closed forms, relative error below 1e-4 where the value is above 1e-6 and absolute error below 1e-7 elsewhere:
///
/// * blurred by `C`: `|G|^½ |G′|^−½ exp(−dᵀ G′⁻¹ d)` with `G′ = G + 2C`. The paper's eq. (13) is printed with a factor that
///   tends to ½ as `C → 0`; this is the convolution.
/// * over a segment: `exp(−d⊥ᵀ G⁻¹ d⊥)` times an average of `exp(−t²)`, `d⊥` the displacement of the segment's line. The
///   paper's eq. (11) says there is no closed form.
/// * over a box, for diagonal `G`: a product over axes of averages of `exp(−t²)`. For any other `G`, twelve Gauss–Legendre
///   nodes along each axis but the last, along which it is a segment: relative error below 1e-4 for sides up to seven
///   widths, the width being the square root of the smallest eigenvalue of `G`; 6e-3 at ten.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SquaredExponential<const D: usize> {
    amplitude: f32,
    shape: SMatrix<f32, D, D>,
    shape_inverse: SMatrix<f32, D, D>,
    determinant: f32,
}

impl<const D: usize> SquaredExponential<D> {
    /// `G = g·I`, `g` in square metres.
    #[must_use]
    pub fn isotropic(shape_m2: f32) -> Self {
        let identity = SMatrix::identity();
        let determinant = (0..D).map(|_| shape_m2).product();
        Self { amplitude: 1.0, shape: identity * shape_m2, shape_inverse: identity * (1.0 / shape_m2), determinant }
    }

    /// Any symmetric positive definite `G`, square metres; `None` if it is not positive definite.
    #[must_use]
    pub fn with_shape(shape_m2: SMatrix<f32, D, D>) -> Option<Self> {
        let (shape_inverse, determinant) = invert(shape_m2)?;
        Some(Self { amplitude: 1.0, shape: shape_m2, shape_inverse, determinant })
    }
}

impl<const D: usize> Kernel<D> for SquaredExponential<D> {
    #[inline]
    fn value(&self, displacement_m: &Point<D>) -> f32 {
        self.amplitude * libm::expf(-displacement_m.dot(&(self.shape_inverse * displacement_m)))
    }

    #[inline]
    fn gradient(&self, displacement_m: &Point<D>) -> Point<D> {
        let pulled = self.shape_inverse * displacement_m;
        pulled * (-2.0 * self.amplitude * libm::expf(-displacement_m.dot(&pulled)))
    }

    #[inline]
    fn blurred(&self, covariance_m2: &SMatrix<f32, D, D>) -> Self {
        let shape = self.shape + covariance_m2 * 2.0;
        // What is no covariance gives NaN features, which the posterior refuses.
        let Some((shape_inverse, determinant)) = invert(shape) else { return Self { amplitude: f32::NAN, ..*self } };
        Self {
            amplitude: self.amplitude * libm::sqrtf(self.determinant / determinant),
            shape,
            shape_inverse,
            determinant,
        }
    }

    #[inline]
    fn over_segment(&self, middle_m: &Point<D>, along_m: &Point<D>) -> f32 {
        // In units in which the kernel is exp(−|t|²), the segment is `length` long.
        let pulled = self.shape_inverse * along_m;
        let length_squared = along_m.dot(&pulled);
        if length_squared < bell::SHORT * bell::SHORT {
            return mean(LEGENDRE_5, |x| self.value(&(middle_m + along_m * x)));
        }
        let length = libm::sqrtf(length_squared);
        // Both ends' positions along the line, each from its own end: from the middle of a long segment they would cancel.
        let high = (middle_m + along_m * 0.5).dot(&pulled) / length;
        let low = (middle_m - along_m * 0.5).dot(&pulled) / length;
        // d⊥ = d + τv, the line's nearest point to the support. Formed as B²/A − C it would lose all digits for segments of
        // tens of metres, and as a plain sum a few: the product is kept exactly.
        let nearest = -middle_m.dot(&pulled) / length_squared;
        let perpendicular = Point::from_fn(|axis, _| {
            let (product, rest) = two_product(nearest, along_m[axis]);
            (middle_m[axis] + product) + rest
        });
        self.value(&perpendicular) * bell::average(low, high)
    }

    #[inline]
    fn over_box(&self, displacement_m: &Point<D>, sides_m: &Point<D>) -> f32 {
        let diagonal = (0..D).all(|i| (0..D).all(|j| i == j || self.shape[(i, j)] == 0.0));
        if diagonal {
            let mut product = self.amplitude;
            for axis in 0..D {
                let per_metre = libm::sqrtf(self.shape_inverse[(axis, axis)]);
                let half = 0.5 * sides_m[axis];
                let ends = [displacement_m[axis] - half, displacement_m[axis] + half];
                product *= bell::average(ends[0] * per_metre, ends[1] * per_metre);
            }
            return product;
        }
        let mut along = Point::zeros();
        along[D - 1] = sides_m[D - 1];
        let mut nodes = [LEGENDRE_12.len(); D];
        nodes[D - 1] = 1;
        let mut sum = 0.0;
        for node in offsets(nodes) {
            let (mut at, mut weight) = (*displacement_m, 1.0);
            for axis in 0..D - 1 {
                let (x, w) = LEGENDRE_12[node[axis]];
                at[axis] += x * sides_m[axis];
                weight *= w;
            }
            sum += weight * self.over_segment(&at, &along);
        }
        sum
    }

    fn cut_off(&self, reach_m: f32) -> f32 {
        // The kernel's largest value on a plane at a distance s along one axis, the other axes being free, is exp(−s²/Gᵢᵢ):
        // the minimum of the quadratic form there is s²/Gᵢᵢ.
        let plane = |axis| self.amplitude * libm::expf(-reach_m * reach_m / self.shape[(axis, axis)]);
        (0..D).map(plane).fold(0.0, |a: f32, b| if b > a || b.is_nan() { b } else { a })
    }
}

/// `a·b` as an unevaluated sum of two numbers, exactly, without a fused multiply–add (Dekker 1971).
#[inline]
fn two_product(a: f32, b: f32) -> (f32, f32) {
    let split = |x: f32| {
        let high = x * 4_097.0;
        let high = high - (high - x);
        (high, x - high)
    };
    let product = a * b;
    let ((a_high, a_low), (b_high, b_low)) = (split(a), split(b));
    let rest = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
    (product, rest)
}

/// The inverse and the determinant, by Gauss–Jordan without pivoting, which a symmetric positive definite matrix does not
/// need; `None` for any other.
#[inline]
fn invert<const D: usize>(mut a: SMatrix<f32, D, D>) -> Option<(SMatrix<f32, D, D>, f32)> {
    let mut inverse = SMatrix::<f32, D, D>::identity();
    let mut determinant = 1.0;
    for pivot in 0..D {
        let p = a[(pivot, pivot)];
        if !(p > 0.0 && p.is_finite()) {
            return None;
        }
        determinant *= p;
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
    Some((inverse, determinant))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn full() -> SquaredExponential<2> {
        SquaredExponential::with_shape(SMatrix::from([[0.3, 0.1], [0.1, 0.2]])).unwrap()
    }

    #[test]
    fn is_equation_nine_with_a_full_matrix() {
        // The inverse of [[0.3, 0.1], [0.1, 0.2]] by hand is [[4, −2], [−2, 6]].
        let kernel = full();
        for (x, y) in [(0.1_f64, 0.2_f64), (-0.3, 0.05), (0.0, 0.0)] {
            let exact = (-(4.0 * x * x - 4.0 * x * y + 6.0 * y * y)).exp();
            let got = kernel.value(&[x as f32, y as f32].into());
            assert!((f64::from(got) - exact).abs() < 1e-6);
        }
        // Along x the kernel reaches furthest: exp(−1/0.3) at one metre.
        assert!((kernel.cut_off(1.0) - (-1.0_f32 / 0.3).exp()).abs() < 1e-6);
    }

    #[test]
    fn what_is_not_positive_definite_is_no_shape_and_no_blur() {
        assert!(SquaredExponential::<2>::with_shape(SMatrix::from([[0.1, 0.2], [0.2, 0.1]])).is_none());
        let blurred = full().blurred(&SMatrix::from_diagonal_element(f32::NAN));
        assert!(blurred.value(&Point::zeros()).is_nan() && blurred.cut_off(1.0).is_nan());
    }

    #[test]
    fn the_cut_off_is_stated_and_true() {
        let (g, h) = (0.15, 0.5);
        let kernel = SquaredExponential::<2>::isotropic(g);
        for stencil in [4, 6, 8] {
            let reach = stencil as f32 * 0.5 * h;
            let cut = kernel.cut_off(reach);
            for i in 0..1_000 {
                let outside = [reach + i as f32 * 1e-3, (i as f32 - 500.0) * 2e-3].into();
                assert!(kernel.value(&outside) <= cut * (1.0 + 1e-6));
            }
        }
        assert!((kernel.cut_off(2.0 * h) - 1.27e-3).abs() < 2e-5, "the figure the evidence states for S = 4");
    }

    #[test]
    fn gradient_agrees_with_differences() {
        crate::kernel::test_support::gradient_agrees_with_differences(&full());
    }

    #[test]
    fn a_product_is_kept_exactly() {
        for i in 1..10_000 {
            let (a, b) = (1.0 / i as f32, 77.7 - i as f32 * 0.013);
            let (product, rest) = two_product(a, b);
            assert_eq!(f64::from(product) + f64::from(rest), f64::from(a) * f64::from(b));
        }
    }
}
