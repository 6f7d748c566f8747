//! What a basis function is centred on: a point, or an area that it averages the kernel over.
//!
//! A support answers with its kernel convolved over itself, so that kernels, supports and observations compose freely:
//! [`Basis`](crate::basis::Basis) blurs the kernel by what is uncertain about the observation, and asks the support for the
//! feature of a point or of a segment. To add one: write its file, name it in the list below.

mod gaussian;
mod point;
mod rectangle;
mod table;

pub use gaussian::GaussianSupport;
pub use point::PointSupport;
pub use rectangle::RectangularSupport;
pub use table::{SupportTable, Supports, TableError};

use crate::{
    geometry::Point,
    kernel::{
        Averaging, Kernel,
        quadrature::{LEGENDRE_12, mean},
    },
    lattice::offsets,
};

/// A support's feature: its kernel, averaged over what the support covers.
pub trait Support<const D: usize>: Sized {
    /// The support that a configuration describes, the same at every node.
    fn from_parameters(parameters: &SupportParameters) -> Self;

    /// The support as plain numbers, for files and messages; those that it does not need are 0.
    fn numbers(&self) -> SupportNumbers;

    /// The support of which these are the [`numbers`](Self::numbers); `None` if there is no such support.
    fn from_numbers(numbers: &SupportNumbers) -> Option<Self>;

    /// The feature of a point displaced by `displacement_m` from the support's centre.
    fn feature(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> f32;

    /// The features of a stencil `width` wide whose nodes all have this support; see [`Kernel::over_lattice`].
    #[inline]
    fn over_lattice(
        &self,
        kernel: &impl Kernel<D>,
        from_first_m: &Point<D>,
        spacing_m: f32,
        width: usize,
        mut each: impl FnMut(f32),
    ) {
        for offset in offsets([width; D]) {
            let displacement = Point::from_fn(|axis, _| from_first_m[axis] - offset[axis] as f32 * spacing_m);
            each(self.feature(kernel, &displacement));
        }
    }

    /// Its derivative with respect to the point, per metre.
    fn feature_gradient(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> Point<D>;

    /// The average of the feature over a segment, `∫₀¹ feature(d + (ζ − ½)v) dζ`.
    ///
    /// Where a support knows no closed form: twelve Gauss–Legendre nodes. Of a squared exponential their relative error is
    /// below 1e-4 for segments up to seven widths `√G`, of a B-spline their absolute error below 3e-5 up to two spacings.
    fn segment_feature(&self, kernel: &impl Kernel<D>, middle_m: &Point<D>, along_m: &Point<D>) -> f32 {
        mean(LEGENDRE_12, |x| self.feature(kernel, &(middle_m + along_m * x)))
    }

    /// The largest feature at a distance of `reach_m` along one axis: what a stencil that ends there cuts off.
    fn cut_off(&self, kernel: &impl Kernel<D>, reach_m: f32) -> f32;
}

/// What a support is made from, where every node has the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SupportParameters {
    /// Distance between neighbouring supports, metres.
    pub spacing_m: f32,
    /// How large the area is, in spacings: what it means is the support's to say. Ignored by a point.
    pub size: f32,
    /// How the kernel is averaged over the area, where there is a choice.
    pub averaging: Averaging,
}

/// Most numbers that describe a support: a symmetric 3 × 3 matrix.
pub const MAX_NUMBERS: usize = 6;

/// A support as plain numbers.
pub type SupportNumbers = [f32; MAX_NUMBERS];

macro_rules! supports {
    ($($name:literal => $support:ident),* $(,)?) => {
        /// The supports there are.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum AnySupport<const D: usize> {
            $(#[doc = concat!("See [`", stringify!($support), "`].")] $support($support<D>)),*
        }

        /// Names of [`AnySupport`]'s variants, as a configuration spells them.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum SupportChoice {
            $(#[doc = concat!("See [`", stringify!($support), "`].")] $support),*
        }

        impl SupportChoice {
            /// Every support there is.
            pub const ALL: &'static [Self] = &[$(Self::$support),*];

            /// The support's name.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$support => $name),* }
            }

            /// The support itself.
            #[must_use]
            pub fn build<const D: usize>(self, parameters: &SupportParameters) -> AnySupport<D> {
                match self { $(Self::$support => AnySupport::$support($support::from_parameters(parameters))),* }
            }

            /// The support of which these are the numbers; `None` if there is no such support.
            #[must_use]
            pub fn with_numbers<const D: usize>(self, numbers: &SupportNumbers) -> Option<AnySupport<D>> {
                match self { $(Self::$support => $support::from_numbers(numbers).map(AnySupport::$support)),* }
            }
        }

        impl<const D: usize> AnySupport<D> {
            /// Which it is.
            #[must_use]
            pub const fn choice(&self) -> SupportChoice {
                match self { $(Self::$support(_) => SupportChoice::$support),* }
            }

            /// It as plain numbers, for files and messages.
            #[must_use]
            pub fn numbers(&self) -> SupportNumbers {
                match self { $(Self::$support(support) => support.numbers()),* }
            }

            /// See [`Support::feature`].
            #[inline]
            #[must_use]
            pub fn feature(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> f32 {
                match self { $(Self::$support(support) => support.feature(kernel, displacement_m)),* }
            }

            /// See [`Support::over_lattice`].
            #[inline]
            pub fn over_lattice(
                &self,
                kernel: &impl Kernel<D>,
                from_first_m: &Point<D>,
                spacing_m: f32,
                width: usize,
                each: impl FnMut(f32),
            ) {
                match self {
                    $(Self::$support(support) => support.over_lattice(kernel, from_first_m, spacing_m, width, each)),*
                }
            }

            /// See [`Support::feature_gradient`].
            #[inline]
            #[must_use]
            pub fn feature_gradient(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> Point<D> {
                match self { $(Self::$support(support) => support.feature_gradient(kernel, displacement_m)),* }
            }

            /// See [`Support::segment_feature`].
            #[inline]
            #[must_use]
            pub fn segment_feature(&self, kernel: &impl Kernel<D>, middle_m: &Point<D>, along_m: &Point<D>) -> f32 {
                match self { $(Self::$support(support) => support.segment_feature(kernel, middle_m, along_m)),* }
            }

            /// See [`Support::cut_off`].
            #[must_use]
            pub fn cut_off(&self, kernel: &impl Kernel<D>, reach_m: f32) -> f32 {
                match self { $(Self::$support(support) => support.cut_off(kernel, reach_m)),* }
            }
        }
    };
}

supports! {
    "point" => PointSupport,
    "gaussian" => GaussianSupport,
    "rectangle" => RectangularSupport,
}

impl<const D: usize> Default for AnySupport<D> {
    fn default() -> Self {
        Self::PointSupport(PointSupport)
    }
}
