//! What a basis function is centred on: today a point; areas (Gaussian, rectangle) are further files of this folder.
//!
//! A support answers with the kernel convolved over itself, so that kernels and supports compose freely. To add one:
//! write its file, name it in the list below.

mod point;

pub use point::PointSupport;

use crate::{geometry::Point, kernel::Kernel};

/// A support's feature: its kernel, averaged over what the support covers.
pub trait Support<const D: usize> {
    /// The feature of a point displaced by `displacement_m` from the support's centre.
    fn feature(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> f32;

    /// Its derivative with respect to the point, per metre.
    fn feature_gradient(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> Point<D>;
}

macro_rules! supports {
    ($($name:literal => $support:ident),* $(,)?) => {
        /// The supports a map can be configured with.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum AnySupport {
            $(#[doc = concat!("See [`", stringify!($support), "`].")] $support($support)),*
        }

        impl AnySupport {
            /// The support's name, as a configuration spells it.
            #[must_use]
            pub const fn name(&self) -> &'static str {
                match self { $(Self::$support(_) => $name),* }
            }
        }

        impl<const D: usize> Support<D> for AnySupport {
            #[inline]
            fn feature(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> f32 {
                match self { $(Self::$support(support) => support.feature(kernel, displacement_m)),* }
            }

            #[inline]
            fn feature_gradient(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> Point<D> {
                match self { $(Self::$support(support) => support.feature_gradient(kernel, displacement_m)),* }
            }
        }
    };
}

supports! {
    "point" => PointSupport,
}
