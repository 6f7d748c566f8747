use super::{Support, SupportNumbers};
use crate::{define::settings, geometry::Point, kernel::Kernel, settings::SettingsError};

settings! {
    /// Settings of a [`PointSupport`]: none.
    PointSettings {}
}

impl PointSettings {
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        Ok(())
    }

    pub(crate) fn build<const D: usize>(&self, _: f32) -> PointSupport<D> {
        PointSupport
    }
}

/// A support that is its centre: the kernel as it stands.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct PointSupport<const D: usize>;

impl<const D: usize> Support<D> for PointSupport<D> {
    fn numbers(&self) -> SupportNumbers {
        SupportNumbers::default()
    }

    fn from_numbers(_: &SupportNumbers) -> Option<Self> {
        Some(Self)
    }

    #[inline]
    fn feature(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> f32 {
        kernel.value(displacement_m)
    }

    #[inline]
    fn over_lattice<const L: usize>(
        &self,
        kernel: &impl Kernel<D>,
        from_first_m: &[Point<D>; L],
        spacing_m: f32,
        width: usize,
        values: &mut [[f32; L]],
    ) {
        kernel.over_lattice(from_first_m, spacing_m, width, values);
    }

    #[inline]
    fn feature_gradient(&self, kernel: &impl Kernel<D>, displacement_m: &Point<D>) -> Point<D> {
        kernel.gradient(displacement_m)
    }

    #[inline]
    fn segment_feature(&self, kernel: &impl Kernel<D>, middle_m: &Point<D>, along_m: &Point<D>) -> f32 {
        kernel.over_segment(middle_m, along_m)
    }

    fn cut_off(&self, kernel: &impl Kernel<D>, reach_m: f32) -> f32 {
        kernel.cut_off(reach_m)
    }
}
