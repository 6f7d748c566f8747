//! How far a support's say reaches: the correlation between a point and a support's centre.
//!
//! A kernel sees a displacement in metres and nothing else; it knows no lattice. To add one: write its file, name it in
//! the list at [`kernels!`](self) below.

mod cubic_b_spline;
mod squared_exponential;

pub use cubic_b_spline::CubicBSpline;
pub use squared_exponential::SquaredExponential;

use crate::geometry::Point;

/// A kernel `k(d)` with `k(0) = 1`, of the displacement `d = x − x̃` from a support's centre to a point.
pub trait Kernel<const D: usize> {
    /// `k(d)`.
    fn value(&self, displacement_m: &Point<D>) -> f32;

    /// `∂k/∂d`, per metre.
    fn gradient(&self, displacement_m: &Point<D>) -> Point<D>;

    /// The largest value the kernel takes where a stencil of `stencil` supports a side, `spacing_m` apart, no longer
    /// sees it: what is cut off. Zero for a kernel that ends inside its stencil.
    fn cut_off(&self, stencil: usize, spacing_m: f32) -> f32;
}

/// What a kernel is made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KernelParameters {
    /// Distance between neighbouring supports, metres.
    pub spacing_m: f32,
    /// The isotropic shape `g` of `G = g·I` (eq. 9), square metres; ignored by kernels whose width is their spacing.
    pub shape_m2: f32,
}

macro_rules! kernels {
    ($($name:literal => $kernel:ident),* $(,)?) => {
        /// The kernels a map can be configured with.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum AnyKernel<const D: usize> {
            $(#[doc = concat!("See [`", stringify!($kernel), "`].")] $kernel($kernel<D>)),*
        }

        /// Names of [`AnyKernel`]'s variants, as a configuration spells them.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum KernelChoice {
            $(#[doc = concat!("See [`", stringify!($kernel), "`].")] $kernel),*
        }

        impl KernelChoice {
            /// Every kernel there is.
            pub const ALL: &'static [Self] = &[$(Self::$kernel),*];

            /// The kernel's name.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$kernel => $name),* }
            }

            /// The kernel itself.
            #[must_use]
            pub fn build<const D: usize>(self, parameters: &KernelParameters) -> AnyKernel<D> {
                match self { $(Self::$kernel => AnyKernel::$kernel($kernel::from_parameters(parameters))),* }
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

            fn cut_off(&self, stencil: usize, spacing_m: f32) -> f32 {
                match self { $(Self::$kernel(kernel) => kernel.cut_off(stencil, spacing_m)),* }
            }
        }
    };
}

kernels! {
    "cubic-b-spline" => CubicBSpline,
    "squared-exponential" => SquaredExponential,
}

#[cfg(test)]
mod test_support {
    use super::Kernel;
    use crate::geometry::Point;

    /// The conformance every kernel earns with one line: its closed-form gradient against central differences.
    pub(super) fn gradient_agrees_with_differences(kernel: &impl Kernel<2>) {
        let step = 1e-2_f32;
        for i in -15..=15 {
            for j in -15..=15 {
                let at = Point::<2>::new(i as f32 * 0.061, j as f32 * 0.057);
                let gradient = kernel.gradient(&at);
                for axis in 0..2 {
                    let mut e = Point::<2>::zeros();
                    e[axis] = step;
                    // Richardson: fourth order, so that the step can stay large against f32 rounding.
                    let d = |s: f32| (kernel.value(&(at + e * s)) - kernel.value(&(at - e * s))) / (2.0 * step * s);
                    let difference = (4.0 * d(1.0) - d(2.0)) / 3.0;
                    assert!((gradient[axis] - difference).abs() < 5e-3, "at {at:?}: {gradient:?} against {difference}");
                }
            }
        }
    }
}
