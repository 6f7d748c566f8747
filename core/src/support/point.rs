use super::Support;
use crate::{geometry::Point, kernel::Kernel};

/// A support that is its centre: the kernel as it stands.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct PointSupport;

impl<const D: usize> Support<D> for PointSupport {
    #[inline]
    fn feature(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> f32 {
        kernel.value(displacement_m)
    }

    #[inline]
    fn feature_gradient(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> Point<D> {
        kernel.gradient(displacement_m)
    }
}
