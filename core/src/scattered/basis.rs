use heapless::Vec;
use nalgebra::SMatrix;

use crate::{
    geometry::{Place, Point},
    kernel::{AnyKernel, Averaging, Kernel, quadrature::sampled},
    posterior::Entry,
    support::AnySupport,
};

/// A support and where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScatteredSupport<const D: usize> {
    /// Its centre, metres.
    pub centre_m: Point<D>,
    /// What it covers around its centre.
    pub support: AnySupport<D>,
}

/// Supports and their kernel: what turns a place into a dense row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScatteredBasis<'s, const D: usize> {
    /// How far each reaches.
    pub kernel: AnyKernel<D>,
    /// Where each is, in the order in which weights are counted.
    pub supports: &'s [ScatteredSupport<D>],
    /// How features are averaged along a segment.
    pub segments: Averaging,
}

impl<const D: usize> ScatteredBasis<'_, D> {
    /// φ of a place, the features that are not zero; supports beyond the `M`-th are not asked.
    #[must_use]
    pub fn row<const M: usize>(&self, place: &Place<D>, spread_m2: Option<&SMatrix<f32, D, D>>) -> Vec<Entry, M> {
        let kernel = spread_m2.map_or(self.kernel, |spread_m2| self.kernel.blurred(spread_m2));
        let middle_m = place.middle_m();
        self.entries(|ScatteredSupport { centre_m, support }| {
            let displacement = middle_m - centre_m;
            match place {
                Place::Point(_) => support.feature(&kernel, &displacement),
                Place::Segment { from_m, to_m } => {
                    let along = to_m - from_m;
                    match self.segments {
                        Averaging::Exact => support.segment_feature(&kernel, &displacement, &along),
                        Averaging::Samples(count) => {
                            sampled(count, |x| support.feature(&kernel, &(displacement + along * x)))
                        }
                    }
                }
            }
        })
    }

    /// ∂φ/∂xᵢ of a point, per metre, as a row.
    #[must_use]
    pub fn slope_row<const M: usize>(&self, point_m: &Point<D>, axis: usize) -> Vec<Entry, M> {
        self.entries(|ScatteredSupport { centre_m, support }| {
            support.feature_gradient(&self.kernel, &(point_m - centre_m))[axis]
        })
    }

    fn entries<const M: usize>(&self, value: impl Fn(&ScatteredSupport<D>) -> f32) -> Vec<Entry, M> {
        let values = self.supports.iter().take(M).map(value).zip(0..);
        values.filter(|(value, _)| *value != 0.0).map(|(value, index)| Entry { index, value }).collect()
    }
}
