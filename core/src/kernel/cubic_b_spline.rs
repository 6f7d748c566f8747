use nalgebra::SMatrix;

use super::{
    Kernel, node_by_node,
    quadrature::{HERMITE_7, LEGENDRE_2, LEGENDRE_5, mean},
};
use crate::{define::settings, geometry::Point, lattice::offsets, settings::SettingsError};

settings! {
    /// Settings of a [`CubicBSpline`]: none, since its width is the spacing.
    CubicBSplineSettings {}
}

impl CubicBSplineSettings {
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        Ok(())
    }

    pub(crate) fn build<const D: usize>(&self, spacing_m: f32) -> CubicBSpline<D> {
        CubicBSpline::new(spacing_m)
    }
}

/// Cubic B-spline: `k(d) = Πᵢ β(dᵢ/h) / β(0)`, β the cardinal cubic B-spline.
///
/// Zero for `|dᵢ| ≥ 2h`, so a stencil four supports wide truncates nothing; twice continuously differentiable; over a
/// whole lattice it sums to the constant `β(0)⁻ᴰ`. Scaled to 1 at its peak, so that a prior precision means the same for
/// every kernel. No exponential is evaluated.
///
/// Over a segment or a box it is a polynomial between the knots, which Gauss–Legendre nodes integrate exactly: five nodes
/// along each piece of a segment (in up to three dimensions), two along each piece of a box's side. Blurred, it never ends
/// and has no closed form worth its price: seven Gauss–Hermite nodes along each column of the covariance's root, absolute
/// error in the plane below 7e-4 for standard deviations up to 0.3 spacings and below 6e-3 up to 0.75, largest at the peak.
/// A blur wider than 0.85 spacings along an axis (error up to 4e-2, along a diagonal) counts as wholly cut off, so that no
/// settings take it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CubicBSpline<const D: usize> {
    per_spacing: f32,
    blur: Option<Blur<D>>,
}

/// `N(0, C)`, m², and the lower triangular root of `C`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Blur<const D: usize> {
    covariance: SMatrix<f32, D, D>,
    root: SMatrix<f32, D, D>,
}

impl<const D: usize> CubicBSpline<D> {
    /// The spline of a lattice whose supports are `spacing_m` metres apart.
    #[must_use]
    pub fn new(spacing_m: f32) -> Self {
        Self { per_spacing: 1.0 / spacing_m, blur: None }
    }
}

/// `β(t)/β(0)`.
#[inline(always)]
pub(crate) fn beta(t: f32) -> f32 {
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

/// β/β(0) at the `W` nodes around each of `L` points, `t` spacings behind the nearer of the two in their middle,
/// `0 ≤ t ≤ 1`: two inner pieces, two outer ones, and zeros.
#[inline(always)]
fn beta_along<const W: usize, const L: usize>(t: &[f32; L]) -> [[f32; L]; W] {
    let inner = |a: f32| 1.0 - a * a * (1.5 - 0.75 * a);
    let outer = |rest: f32| 0.25 * rest * rest * rest;
    let mut along = [[0.0; L]; W];
    // Plain loops: what the compiler makes vectors of.
    if let Some([first, second, third, fourth]) =
        along.get_mut((W / 2).saturating_sub(2)..).and_then(<[_]>::first_chunk_mut)
    {
        for (point, t) in t.iter().enumerate() {
            let t = t.clamp(0.0, 1.0);
            let rest = 1.0 - t;
            first[point] = outer(rest);
            second[point] = inner(t);
            third[point] = inner(rest);
            fourth[point] = outer(t);
        }
    }
    along
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

/// Widest blur, in spacings along an axis, whose quadrature can be trusted; a wider one counts as wholly cut off.
const WIDEST_BLUR: f32 = 0.85;

/// Where β is not one polynomial, in spacings.
const KNOTS: [f32; 5] = [-2.0, -1.0, 0.0, 1.0, 2.0];

/// The average of β/β(0) over `[low, high]`, in spacings: exact, and without the cancellation of an antiderivative.
#[inline]
fn beta_average(low: f32, high: f32) -> f32 {
    let width = high - low;
    if width <= 0.0 {
        return beta(low);
    }
    let mut sum = 0.0;
    for knots in KNOTS.windows(2) {
        let (from, to) = (knots[0].max(low), knots[1].min(high));
        if to > from {
            // Degree three: two nodes.
            sum += (to - from) * mean(LEGENDRE_2, |x| beta(0.5 * (from + to) + (to - from) * x));
        }
    }
    sum / width
}

impl<const D: usize> CubicBSpline<D> {
    #[inline]
    fn plain_value(&self, displacement_m: &Point<D>) -> f32 {
        displacement_m.iter().map(|d| beta(d * self.per_spacing)).product()
    }

    #[inline]
    fn plain_gradient(&self, displacement_m: &Point<D>) -> Point<D> {
        Point::from_fn(|axis, _| {
            let mut partial = self.per_spacing;
            for (i, d) in displacement_m.iter().enumerate() {
                let t = d * self.per_spacing;
                partial *= if i == axis { beta_slope(t) } else { beta(t) };
            }
            partial
        })
    }

    /// A product over axes: `W` splines along each instead of as many as the stencil has nodes.
    ///
    /// Axis by axis each product so far becomes `W` products, from the last to the first, so that none is overwritten before it
    /// is used.
    #[inline(always)]
    fn along_axes<const W: usize, const L: usize>(
        &self,
        from_first_m: &[Point<D>; L],
        spacing_m: f32,
        values: &mut [[f32; L]],
    ) {
        let mut products = 1;
        if let Some(first) = values.first_mut() {
            *first = [1.0; L];
        }
        let behind_m = (W / 2 - 1) as f32 * spacing_m;
        for axis in 0..D {
            let mut t = [0.0; L];
            for (t, from_first) in t.iter_mut().zip(from_first_m) {
                *t = (from_first[axis] - behind_m) * self.per_spacing;
            }
            let along: [[f32; L]; W] = beta_along(&t);
            for product in (0..products).rev() {
                let so_far = values[product];
                let Some(slots) = values.as_chunks_mut::<W>().0.get_mut(product) else { continue };
                for (slots, along) in slots.iter_mut().zip(&along) {
                    for ((slot, so_far), along) in slots.iter_mut().zip(&so_far).zip(along) {
                        *slot = so_far * along;
                    }
                }
            }
            products *= W;
        }
    }

    /// Piece by piece between the lattice lines through the support's neighbours, where the product of splines is one
    /// polynomial of degree `3D`.
    fn plain_over_segment(&self, middle_m: &Point<D>, along_m: &Point<D>) -> f32 {
        let (mut from, mut sum) = (-0.5_f32, 0.0);
        while from < 0.5 {
            let mut to = 0.5_f32;
            for axis in 0..D {
                for knot in KNOTS {
                    let crossing = (knot / self.per_spacing - middle_m[axis]) / along_m[axis];
                    // Not a number, or infinite, where the segment does not move along this axis.
                    if crossing > from && crossing < to {
                        to = crossing;
                    }
                }
            }
            let (middle, part) = (0.5 * (from + to), to - from);
            sum += part * mean(LEGENDRE_5, |x| self.plain_value(&(middle_m + along_m * (middle + part * x))));
            from = to;
        }
        sum
    }

    fn plain_over_box(&self, displacement_m: &Point<D>, sides_m: &Point<D>) -> f32 {
        displacement_m
            .iter()
            .zip(sides_m.iter())
            .map(|(d, side)| beta_average((d - 0.5 * side) * self.per_spacing, (d + 0.5 * side) * self.per_spacing))
            .product()
    }

    /// `Σ w f(d + L z)` over the nodes of the blur, or `f(d)` without one.
    #[inline]
    fn blur<T>(&self, displacement_m: &Point<D>, f: impl Fn(&Point<D>) -> T) -> T
    where
        T: core::ops::Mul<f32, Output = T> + core::ops::AddAssign,
    {
        let Some(blur) = &self.blur else { return f(displacement_m) };
        let mut sum = f(displacement_m) * 0.0;
        for node in offsets([HERMITE_7.len(); D]) {
            let z = Point::from_fn(|axis, _| HERMITE_7[node[axis]].0);
            let weight: f32 = node.iter().map(|n| HERMITE_7[*n].1).product();
            sum += f(&(displacement_m + blur.root * z)) * weight;
        }
        sum
    }
}

impl<const D: usize> Kernel<D> for CubicBSpline<D> {
    #[inline]
    fn value(&self, displacement_m: &Point<D>) -> f32 {
        self.blur(displacement_m, |d| self.plain_value(d))
    }

    #[inline]
    fn gradient(&self, displacement_m: &Point<D>) -> Point<D> {
        self.blur(displacement_m, |d| self.plain_gradient(d))
    }

    #[inline]
    fn over_lattice<const L: usize>(
        &self,
        from_first_m: &[Point<D>; L],
        spacing_m: f32,
        width: usize,
        values: &mut [[f32; L]],
    ) {
        if self.blur.is_some() || !matches!(width, 4 | 6 | 8) || values.len() != width.pow(D as u32) {
            return node_by_node(self, from_first_m, spacing_m, width, values);
        }
        match width {
            4 => self.along_axes::<4, L>(from_first_m, spacing_m, values),
            6 => self.along_axes::<6, L>(from_first_m, spacing_m, values),
            _ => self.along_axes::<8, L>(from_first_m, spacing_m, values),
        }
    }

    fn blurred(&self, covariance_m2: &SMatrix<f32, D, D>) -> Self {
        let covariance = self.blur.map_or(*covariance_m2, |blur| blur.covariance + covariance_m2);
        Self { blur: Some(Blur { covariance, root: root(&covariance) }), ..*self }
    }

    #[inline]
    fn over_segment(&self, middle_m: &Point<D>, along_m: &Point<D>) -> f32 {
        self.blur(middle_m, |d| self.plain_over_segment(d, along_m))
    }

    #[inline]
    fn over_box(&self, displacement_m: &Point<D>, sides_m: &Point<D>) -> f32 {
        self.blur(displacement_m, |d| self.plain_over_box(d, sides_m))
    }

    fn cut_off(&self, reach_m: f32) -> f32 {
        // Along the other axes the spline is at most 1, blurred or not.
        let plane = |axis: usize| {
            let deviation = self.blur.map_or(0.0, |blur| libm::sqrtf(blur.covariance[(axis, axis)]));
            // Wider, the nodes step over the spline, and this would not see what is cut off.
            if deviation * self.per_spacing > WIDEST_BLUR {
                return 1.0;
            }
            mean(HERMITE_7, |z| beta((reach_m + deviation * z) * self.per_spacing))
        };
        (0..D).map(plane).fold(0.0, |a: f32, b| if b > a || b.is_nan() { b } else { a })
    }
}

/// The lower triangular root of a positive semidefinite matrix (Cholesky); a direction without spread is a column of zeros.
fn root<const D: usize>(covariance: &SMatrix<f32, D, D>) -> SMatrix<f32, D, D> {
    let mut root = SMatrix::<f32, D, D>::zeros();
    for column in 0..D {
        let mut rest = covariance[(column, column)];
        for k in 0..column {
            rest -= root[(column, k)] * root[(column, k)];
        }
        // A rest of rounding size is none; NaN stays, and makes NaN features, which the posterior refuses.
        if rest <= f32::EPSILON * covariance[(column, column)] {
            continue;
        }
        root[(column, column)] = libm::sqrtf(rest);
        for row in column + 1..D {
            let mut entry = covariance[(row, column)];
            for k in 0..column {
                entry -= root[(row, k)] * root[(column, k)];
            }
            root[(row, column)] = entry / root[(column, column)];
        }
    }
    root
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
        let spline = CubicBSpline::<2>::new(0.5);
        crate::kernel::test_support::gradient_agrees_with_differences(&spline);
        let blur = SMatrix::from([[0.02, 0.01], [0.01, 0.03]]);
        crate::kernel::test_support::gradient_agrees_with_differences(&spline.blurred(&blur));
    }

    #[test]
    fn a_blur_that_the_quadrature_steps_over_is_not_taken_for_narrow() {
        for deviation in [0.9_f32, 2.0, 5.0, 100.0] {
            let blur = SMatrix::from_diagonal_element(deviation * deviation * 0.25);
            assert_eq!(CubicBSpline::<2>::new(0.5).blurred(&blur).cut_off(2.0), 1.0, "{deviation} spacings");
        }
    }

    #[test]
    fn nothing_is_cut_off_at_four() {
        assert_eq!(CubicBSpline::<2>::new(0.5).cut_off(1.0), 0.0);
        assert!(CubicBSpline::<2>::new(0.5).cut_off(0.5) > 0.2);
    }
}
