use super::{Kernel, KernelParameters};
use crate::geometry::Point;

/// Cubic B-spline: `k(d) = Πᵢ β(dᵢ/h) / β(0)`, β the cardinal cubic B-spline.
///
/// Zero for `|dᵢ| ≥ 2h`, so a stencil four supports wide truncates nothing; twice continuously differentiable; over a
/// whole lattice it sums to the constant `β(0)⁻ᴰ`. Scaled to 1 at its peak, so that a prior precision means the same for
/// every kernel. No exponential is evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CubicBSpline<const D: usize> {
    per_spacing: f32,
}

impl<const D: usize> CubicBSpline<D> {
    /// The spline of a lattice whose supports are `spacing_m` metres apart.
    #[must_use]
    pub fn new(spacing_m: f32) -> Self {
        Self { per_spacing: 1.0 / spacing_m }
    }

    pub(super) fn from_parameters(parameters: &KernelParameters) -> Self {
        Self::new(parameters.spacing_m)
    }
}

/// `β(t)/β(0)`.
#[inline(always)]
fn beta(t: f32) -> f32 {
    let a = t.abs();
    if a < 1.0 {
        1.0 - a * a * (1.5 - 0.75 * a)
    } else if a < 2.0 {
        let rest = 2.0 - a;
        0.25 * rest * rest * rest
    } else {
        0.0
    }
}

/// `β′(t)/β(0)`.
#[inline(always)]
fn beta_slope(t: f32) -> f32 {
    let a = t.abs();
    if a < 1.0 {
        t * (2.25 * a - 3.0)
    } else if a < 2.0 {
        let rest = 2.0 - a;
        -0.75 * rest * rest * t.signum()
    } else {
        0.0
    }
}

impl<const D: usize> Kernel<D> for CubicBSpline<D> {
    #[inline]
    fn value(&self, displacement_m: &Point<D>) -> f32 {
        displacement_m.iter().map(|d| beta(d * self.per_spacing)).product()
    }

    #[inline]
    fn gradient(&self, displacement_m: &Point<D>) -> Point<D> {
        Point::from_fn(|axis, _| {
            let mut partial = self.per_spacing;
            for (i, d) in displacement_m.iter().enumerate() {
                let t = d * self.per_spacing;
                partial *= if i == axis { beta_slope(t) } else { beta(t) };
            }
            partial
        })
    }

    fn cut_off(&self, stencil: usize, spacing_m: f32) -> f32 {
        // The nearest point a stencil of S supports does not show to a support is S/2 spacings from it along one axis.
        beta(0.5 * stencil as f32 * spacing_m * self.per_spacing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cardinal cubic B-spline as what it is defined to be: a box convolved with itself three times, by quadrature.
    fn beta_by_convolution(t: f64) -> f64 {
        // β³(t) = ∫ β¹(s) β¹(t − s) ds, β¹ the hat; Simpson on pieces without a kink is exact for a cubic.
        let hat = |s: f64| (1.0 - s.abs()).max(0.0);
        let mut breaks: std::vec::Vec<f64> = [-1.0, 0.0, 1.0].iter().flat_map(|b| [*b, t - b]).collect();
        breaks.sort_by(f64::total_cmp);
        breaks
            .windows(2)
            .map(|w| {
                let f = |s: f64| hat(s) * hat(t - s);
                (w[1] - w[0]) / 6.0 * (f(w[0]) + 4.0 * f(0.5 * (w[0] + w[1])) + f(w[1]))
            })
            .sum()
    }

    #[test]
    fn is_the_convolution_of_four_boxes() {
        for i in -300..=300 {
            let t = i as f32 * 0.01;
            let exact = beta_by_convolution(f64::from(t)) / beta_by_convolution(0.0);
            assert!((f64::from(beta(t)) - exact).abs() < 3e-7, "t = {t}");
        }
    }

    #[test]
    fn sums_to_a_constant_over_a_lattice_in_two_and_three_dimensions() {
        fn sum<const D: usize>(at: Point<D>) -> f32 {
            let spline = CubicBSpline::<D>::new(0.5);
            let mut total = 0.0;
            for n in 0..7_usize.pow(D as u32) {
                let node = Point::<D>::from_fn(|axis, _| (n / 7_usize.pow(axis as u32) % 7) as f32 * 0.5 - 1.5);
                total += spline.value(&(at - node));
            }
            total
        }
        for i in 0..20 {
            let x = i as f32 * 0.025;
            assert!((sum::<2>([x, 0.3 - x].into()) - 2.25).abs() < 1e-5);
            assert!((sum::<3>([x, 0.1, 0.3 - x].into()) - 3.375).abs() < 1e-5);
        }
    }

    #[test]
    fn gradient_agrees_with_differences() {
        crate::kernel::test_support::gradient_agrees_with_differences(&CubicBSpline::<2>::new(0.5));
    }

    #[test]
    fn nothing_is_cut_off_at_four() {
        assert_eq!(CubicBSpline::<2>::new(0.5).cut_off(4, 0.5), 0.0);
        assert!(CubicBSpline::<2>::new(0.5).cut_off(2, 0.5) > 0.2);
    }
}
