//! Kernels: the correlation between a point and a support's centre.
//!
//! A kernel sees a displacement in metres and nothing else; it knows no lattice. Everything that a support or an
//! observation may cover asks a kernel for three averages, which compose freely: over a Gaussian ([`Kernel::blurred`]), a
//! line segment ([`Kernel::over_segment`]) and a box ([`Kernel::over_box`]). Each kernel answers in closed form where there
//! is one and else by quadrature, with the error its documentation states.
//!
//! To add one: write its file, with its settings, and name it in the list below.

mod bell;
mod cubic_b_spline;
pub(crate) mod quadrature;
mod squared_exponential;
mod two_scales;

pub(crate) use cubic_b_spline::beta;
pub use cubic_b_spline::{CubicBSpline, CubicBSplineSettings};
pub use quadrature::{Averaging, MAX_SAMPLES, sampled};
pub use squared_exponential::{SquaredExponential, SquaredExponentialSettings};
pub use two_scales::{TwoScales, TwoScalesSettings};

use nalgebra::SMatrix;

use crate::{
    define::sum_type,
    geometry::Point,
    lattice::{displaced, offsets},
};

/// A kernel `k(d)` of the displacement `d = x − x̃` from a support's centre to a point, with `k(0) = 1` until it is blurred.
///
/// A kernel of one's own, a cone that ends at its radius; what it is averaged over is left to one node in its middle:
///
/// ```
/// use bhm_core::{geometry::Point, kernel::Kernel};
/// use nalgebra::SMatrix;
///
/// #[derive(Clone, Copy)]
/// struct Cone {
///     radius_m: f32,
/// }
///
/// impl Kernel<2> for Cone {
///     fn value(&self, displacement_m: &Point<2>) -> f32 {
///         (1.0 - libm::sqrtf(displacement_m.dot(displacement_m)) / self.radius_m).max(0.0)
///     }
///
///     fn gradient(&self, displacement_m: &Point<2>) -> Point<2> {
///         let distance_m = libm::sqrtf(displacement_m.dot(displacement_m));
///         if distance_m == 0.0 || distance_m > self.radius_m {
///             return Point::<2>::zeros();
///         }
///         displacement_m * (-1.0 / (self.radius_m * distance_m))
///     }
///
///     fn blurred(&self, _: &SMatrix<f32, 2, 2>) -> Self {
///         *self
///     }
///
///     fn over_segment(&self, middle_m: &Point<2>, _: &Point<2>) -> f32 {
///         self.value(middle_m)
///     }
///
///     fn over_box(&self, displacement_m: &Point<2>, _: &Point<2>) -> f32 {
///         self.value(displacement_m)
///     }
///
///     fn cut_off(&self, reach_m: f32) -> f32 {
///         self.value(&[reach_m, 0.0].into())
///     }
/// }
///
/// let cone = Cone { radius_m: 1.0 };
/// let mut stencil = [[0.0]; 4];
/// cone.over_lattice(&[[0.5, 0.5].into()], 1.0, 2, &mut stencil);
/// assert!(stencil.iter().all(|[value]| (value - 0.292_893).abs() < 1e-6), "in the middle of four supports");
/// ```
pub trait Kernel<const D: usize>: Copy {
    /// `k(d)`.
    fn value(&self, displacement_m: &Point<D>) -> f32;

    /// `∂k/∂d`, per metre.
    fn gradient(&self, displacement_m: &Point<D>) -> Point<D>;

    /// Writes `k(d − spacing · offset)` for every offset of a stencil `width` wide, in lexicographic order, the last axis
    /// fastest, and for `L` points of one cell: what each has of a lattice of point supports. A kernel that is a product over
    /// axes does better than one by one.
    #[inline]
    fn over_lattice<const L: usize>(
        &self,
        from_first_m: &[Point<D>; L],
        spacing_m: f32,
        width: usize,
        values: &mut [[f32; L]],
    ) {
        node_by_node(self, from_first_m, spacing_m, width, values);
    }

    /// The kernel convolved with `N(0, C)`, `C` in m², positive semidefinite: `E[k(d + e)]`, `e ~ N(0, C)`.
    ///
    /// What a Gaussian support and an uncertain point have in common (eq. 13, corrected).
    #[must_use]
    fn blurred(&self, covariance_m2: &SMatrix<f32, D, D>) -> Self;

    /// The average over a line segment (eq. 11): `∫₀¹ k(d + (ζ − ½)v) dζ`, `d` the displacement of its middle and `v` the
    /// segment itself, metres. A segment of no length is a point.
    fn over_segment(&self, middle_m: &Point<D>, along_m: &Point<D>) -> f32;

    /// The average over a box (eq. 14), `d` the displacement from its centre and its sides along the axes, metres; a side
    /// of 0 is a point along that axis.
    fn over_box(&self, displacement_m: &Point<D>, sides_m: &Point<D>) -> f32;

    /// `∂/∂d` of [`over_box`](Self::over_box), per metre: the difference of the averages over opposite faces.
    ///
    /// Sides must be positive; in `f32` a side loses digits as it gets shorter than a hundredth of the kernel's width.
    fn over_box_gradient(&self, displacement_m: &Point<D>, sides_m: &Point<D>) -> Point<D> {
        Point::from_fn(|axis, _| {
            let mut face = *sides_m;
            face[axis] = 0.0;
            let mut step = Point::zeros();
            step[axis] = 0.5 * sides_m[axis];
            let (ahead, behind) = (displacement_m + step, displacement_m - step);
            (self.over_box(&ahead, &face) - self.over_box(&behind, &face)) / sides_m[axis]
        })
    }

    /// The largest value the kernel takes at a distance of `reach_m` along one axis, whatever the others are: what is cut
    /// off by a stencil that ends there. Zero for a kernel that ends inside its stencil.
    fn cut_off(&self, reach_m: f32) -> f32;
}

/// [`Kernel::over_lattice`] without what a kernel may know better.
#[inline]
fn node_by_node<const D: usize, const L: usize>(
    kernel: &impl Kernel<D>,
    from_first_m: &[Point<D>; L],
    spacing_m: f32,
    width: usize,
    values: &mut [[f32; L]],
) {
    for (slots, offset) in values.iter_mut().zip(offsets([width; D])) {
        *slots = from_first_m.map(|from_first_m| kernel.value(&displaced(&from_first_m, offset, spacing_m)));
    }
}

/// g = 0.6 h²: the paper's 0.15 m² at its 0.5 m.
const DEFAULT_SHAPE: f32 = 0.6;

macro_rules! kernels {
    ($($name:literal => $kernel:ident($settings:ty)),* $(,)?) => {
        sum_type! {
            /// The kernels a map can be configured with, each with its settings.
            "kernel" KernelSettings { $($name => $kernel($settings)),* }
        }

        /// A kernel in metres, built from its settings for a lattice.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum AnyKernel<const D: usize> {
            $(#[doc = concat!("See [`", stringify!($kernel), "`].")] $kernel($kernel<D>)),*
        }

        impl KernelSettings {
            /// The kernel for a lattice whose supports are `spacing_m` metres apart.
            #[must_use]
            pub fn build<const D: usize>(&self, spacing_m: f32) -> AnyKernel<D> {
                match self { $(Self::$kernel(settings) => AnyKernel::$kernel(settings.build(spacing_m))),* }
            }
        }

        impl<const D: usize> Kernel<D> for AnyKernel<D> {
            #[inline]
            fn value(&self, displacement_m: &Point<D>) -> f32 {
                match self { $(Self::$kernel(kernel) => kernel.value(displacement_m)),* }
            }

            #[inline]
            fn gradient(&self, displacement_m: &Point<D>) -> Point<D> {
                match self { $(Self::$kernel(kernel) => kernel.gradient(displacement_m)),* }
            }

            #[inline]
            fn over_lattice<const L: usize>(
                &self,
                from_first_m: &[Point<D>; L],
                spacing_m: f32,
                width: usize,
                values: &mut [[f32; L]],
            ) {
                match self { $(Self::$kernel(kernel) => kernel.over_lattice(from_first_m, spacing_m, width, values)),* }
            }

            #[inline]
            fn blurred(&self, covariance_m2: &SMatrix<f32, D, D>) -> Self {
                match self { $(Self::$kernel(kernel) => Self::$kernel(kernel.blurred(covariance_m2))),* }
            }

            #[inline]
            fn over_segment(&self, middle_m: &Point<D>, along_m: &Point<D>) -> f32 {
                match self { $(Self::$kernel(kernel) => kernel.over_segment(middle_m, along_m)),* }
            }

            #[inline]
            fn over_box(&self, displacement_m: &Point<D>, sides_m: &Point<D>) -> f32 {
                match self { $(Self::$kernel(kernel) => kernel.over_box(displacement_m, sides_m)),* }
            }

            fn cut_off(&self, reach_m: f32) -> f32 {
                match self { $(Self::$kernel(kernel) => kernel.cut_off(reach_m)),* }
            }
        }
    };
}

kernels! {
    "cubic-b-spline" => CubicBSpline(CubicBSplineSettings),
    "squared-exponential" => SquaredExponential(SquaredExponentialSettings),
    "two-scales" => TwoScales(TwoScalesSettings),
}

#[cfg(test)]
mod test_support {
    use super::Kernel;
    use crate::geometry::Point;

    /// The conformance every kernel earns with one line: its closed-form gradients against central differences.
    pub(super) fn gradient_agrees_with_differences(kernel: &impl Kernel<2>) {
        let sides = Point::<2>::new(0.4, 0.7);
        agrees(|at| kernel.value(at), |at| kernel.gradient(at));
        agrees(|at| kernel.over_box(at, &sides), |at| kernel.over_box_gradient(at, &sides));
    }

    fn agrees(value: impl Fn(&Point<2>) -> f32, gradient: impl Fn(&Point<2>) -> Point<2>) {
        let step = 1e-2_f32;
        for i in -15..=15 {
            for j in -15..=15 {
                let at = Point::<2>::new(i as f32 * 0.061, j as f32 * 0.057);
                let gradient = gradient(&at);
                for axis in 0..2 {
                    let mut e = Point::<2>::zeros();
                    e[axis] = step;
                    // Richardson: fourth order, so that the step can stay large against f32 rounding.
                    let d = |s: f32| (value(&(at + e * s)) - value(&(at - e * s))) / (2.0 * step * s);
                    let difference = (4.0 * d(1.0) - d(2.0)) / 3.0;
                    assert!((gradient[axis] - difference).abs() < 5e-3, "at {at:?}: {gradient:?} against {difference}");
                }
            }
        }
    }
}
