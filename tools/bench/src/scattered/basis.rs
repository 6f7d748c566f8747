use bhm_core::{
    geometry::{Place, Point},
    kernel::{AnyKernel, Averaging, Kernel, sampled},
    support::AnySupport,
};
use nalgebra::Matrix2;

/// A support and where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScatteredSupport {
    /// Its centre, metres.
    pub centre_m: Point<2>,
    /// What it covers around its centre.
    pub support: AnySupport<2>,
}

/// Supports and their kernel: what turns a place into a dense row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScatteredBasis<'s> {
    /// Correlation between a point and a support's centre.
    pub kernel: AnyKernel<2>,
    /// Where each support is, in the order in which weights are counted.
    pub supports: &'s [ScatteredSupport],
    /// How features are averaged along a segment.
    pub segments: Averaging,
}

impl ScatteredBasis<'_> {
    /// φ of a place, one feature for each support.
    pub fn features(&self, place: &Place<2>, spread_m2: Option<&Matrix2<f32>>) -> impl Iterator<Item = f32> {
        let kernel = spread_m2.map_or(self.kernel, |spread_m2| self.kernel.blurred(spread_m2));
        let middle_m = place.middle_m();
        let segments = self.segments;
        let place = *place;
        self.supports.iter().map(move |ScatteredSupport { centre_m, support }: &ScatteredSupport| {
            let displacement = middle_m - centre_m;
            match place {
                Place::Point(_) => support.feature(&kernel, &displacement),
                Place::Segment { from_m, to_m } => {
                    let along = to_m - from_m;
                    match segments {
                        Averaging::Exact => support.segment_feature(&kernel, &displacement, &along),
                        Averaging::Samples(count) => {
                            sampled(count, |x| support.feature(&kernel, &(displacement + along * x)))
                        }
                    }
                }
            }
        })
    }
}
