//! What a basis function is centred on: a point, or an area that it averages the kernel over.
//!
//! A support answers with its kernel convolved over itself, so that kernels, supports and observations compose freely:
//! [`Basis`](crate::basis::Basis) blurs the kernel by what is uncertain about the observation, and asks the support for the
//! feature of a point or of a segment. To add one: write its file, with its settings, and name it in the list below.

mod gaussian;
mod point;
mod rectangle;
mod table;

pub use gaussian::{GaussianSettings, GaussianSupport};
pub use point::{PointSettings, PointSupport};
pub use rectangle::{RectangleSettings, RectangularSupport};
pub use table::{SupportTable, Supports, TableError};

use crate::{
    define::sum_type,
    geometry::Point,
    kernel::{
        Kernel,
        quadrature::{LEGENDRE_12, mean},
    },
    lattice::{displaced, offsets},
};

/// A support's feature: its kernel, averaged over what the support covers.
pub trait Support<const D: usize>: Sized {
    /// The support as plain numbers, for files and messages; those that it does not need are 0.
    fn numbers(&self) -> SupportNumbers;

    /// The support of which these are the [`numbers`](Self::numbers); `None` if there is no such support.
    fn from_numbers(numbers: &SupportNumbers) -> Option<Self>;

    /// The feature of a point displaced by `displacement_m` from the support's centre.
    fn feature(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> f32;

    /// Writes the features of `L` points of one cell, of a stencil `width` wide whose nodes all have this support; see [`Kernel::over_lattice`].
    #[inline]
    fn over_lattice<const L: usize>(
        &self,
        kernel: &impl Kernel<D>,
        from_first_m: &[Point<D>; L],
        spacing_m: f32,
        width: usize,
        values: &mut [[f32; L]],
    ) {
        for (slots, offset) in values.iter_mut().zip(offsets([width; D])) {
            *slots = from_first_m.map(|from_first| self.feature(kernel, &displaced(&from_first, offset, spacing_m)));
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

/// Most numbers that describe a support: a symmetric 3 × 3 matrix.
pub const MAX_NUMBERS: usize = 6;

/// A support as plain numbers.
pub type SupportNumbers = [f32; MAX_NUMBERS];

macro_rules! supports {
    ($($name:literal => $support:ident($settings:ty)),* $(,)?) => {
        sum_type! {
            /// What every support of a map can be configured as, each with its settings.
            "support" SupportSettings { $($name => $support($settings)),* }
        }

        /// A support in metres.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum AnySupport<const D: usize> {
            $(#[doc = concat!("See [`", stringify!($support), "`].")] $support($support<D>)),*
        }

        impl SupportSettings {
            /// The support at every node of a lattice whose supports are `spacing_m` metres apart.
            #[must_use]
            pub fn build<const D: usize>(&self, spacing_m: f32) -> AnySupport<D> {
                match self { $(Self::$support(settings) => AnySupport::$support(settings.build(spacing_m))),* }
            }
        }

        impl<const D: usize> AnySupport<D> {
            /// The support's name, as files and messages spell it.
            #[must_use]
            pub const fn name(&self) -> &'static str {
                match self { $(Self::$support(_) => $name),* }
            }

            /// The support of that name of which these are the [`numbers`](Self::numbers); `None` if there is no such support.
            #[must_use]
            pub fn with_numbers(name: &str, numbers: &SupportNumbers) -> Option<Self> {
                match name {
                    $($name => $support::from_numbers(numbers).map(Self::$support),)*
                    _ => None,
                }
            }

            /// The support as plain numbers, for files and messages.
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
            pub fn over_lattice<const L: usize>(
                &self,
                kernel: &impl Kernel<D>,
                from_first_m: &[Point<D>; L],
                spacing_m: f32,
                width: usize,
                values: &mut [[f32; L]],
            ) {
                match self {
                    $(Self::$support(support) => support.over_lattice(kernel, from_first_m, spacing_m, width, values)),*
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
    "point" => PointSupport(PointSettings),
    "gaussian" => GaussianSupport(GaussianSettings),
    "rectangle" => RectangularSupport(RectangleSettings),
}

impl<const D: usize> Default for AnySupport<D> {
    fn default() -> Self {
        Self::PointSupport(PointSupport)
    }
}
