//! The one place where tiles become a continuous function.

use heapless::Vec;

use super::{TileIndex, Tiling};
use crate::{
    basis::{Basis, Features},
    geometry::Point,
    lattice::{MAX_STENCIL_NODES, Window},
    posterior::{Entry, PosteriorView, Prior},
    rule::logistic::{kappa, sigmoid},
};

/// Whatever holds tiles: the mapper's store, a sample in shared memory, a file.
pub trait TileSource<const M: usize, const B: usize> {
    /// Mean and covariance of the tile of that index, if there is one.
    fn posterior(&self, index: &TileIndex<2>) -> Option<PosteriorView<'_, M, B>>;
}

impl<const M: usize, const B: usize, T: TileSource<M, B> + ?Sized> TileSource<M, B> for &T {
    fn posterior(&self, index: &TileIndex<2>) -> Option<PosteriorView<'_, M, B>> {
        (**self).posterior(index)
    }
}

/// What the map says about a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Occupancy {
    /// Probability that the point is occupied: `σ(m/√(1 + πs²/8))`.
    pub probability: f32,
    /// `m`, mean of the log-odds.
    pub mean: f32,
    /// `s²`, variance of the log-odds: large where nothing was observed.
    pub variance: f32,
}

impl Occupancy {
    /// The answer where the lattice ends: nothing is known at all.
    pub const UNKNOWN: Self = Self { probability: 0.5, mean: 0.0, variance: f32::INFINITY };

    /// From the mean and the variance of the log-odds.
    #[must_use]
    pub fn from_moments(mean: f32, variance: f32) -> Self {
        Self { probability: sigmoid(kappa(variance) * mean), mean, variance }
    }

    /// The logit of [`probability`](Self::probability), exact where the probability itself rounds to 0 or 1.
    #[must_use]
    pub fn logit(&self) -> f32 {
        kappa(self.variance) * self.mean
    }
}

/// How the answer changes with the point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OccupancyGradient {
    /// What the map says at the point itself.
    pub occupancy: Occupancy,
    /// `∂p/∂x`, per metre.
    pub probability: Point<2>,
    /// `∂m/∂x`, per metre.
    pub mean: Point<2>,
    /// `∂s²/∂x`, per metre.
    pub variance: Point<2>,
}

impl OccupancyGradient {
    /// The answer where the lattice ends.
    pub(crate) const UNKNOWN: Self = {
        let zero = Point::<2>::new(0.0, 0.0);
        Self { occupancy: Occupancy::UNKNOWN, probability: zero, mean: zero, variance: zero }
    };

    /// From `m`, `s²`, `∂m` and `∂s²`.
    pub(crate) fn from_moments(mean: f32, variance: f32, mean_slope: Point<2>, variance_slope: Point<2>) -> Self {
        // p = σ(κm): ∂p = p(1 − p)(κ ∂m + m ∂κ), ∂κ = −(π/16) κ³ ∂s².
        let kappa = kappa(variance);
        let logit = kappa * mean;
        let slope = sigmoid(logit) * sigmoid(-logit);
        let narrowing = -core::f32::consts::PI / 16.0 * kappa * kappa * kappa * mean;
        Self {
            occupancy: Occupancy::from_moments(mean, variance),
            probability: (mean_slope * kappa + variance_slope * narrowing) * slope,
            mean: mean_slope,
            variance: variance_slope,
        }
    }
}

/// A map that can be asked: how points become features, and tiles wherever they lie.
#[derive(Clone, Copy, Debug)]
pub struct MapView<'a, T, const M: usize, const B: usize> {
    /// How points become features.
    pub basis: &'a Basis<'a, 2>,
    /// How the plane is cut into tiles.
    pub tiling: &'a Tiling<2>,
    /// What a tile that does not exist answers.
    pub prior: &'a Prior,
    /// The tiles that do.
    pub tiles: T,
}

type Row = Vec<Entry, MAX_STENCIL_NODES>;

impl<T: TileSource<M, B>, const M: usize, const B: usize> MapView<'_, T, M, B> {
    /// What the map says about a point.
    ///
    /// The tiles whose region holds the point are blended: `m = Σ wᵢmᵢ`, `s² = Σ wᵢsᵢ²`, a tile that does not exist being
    /// the prior. The variance is an upper bound of the blend's; `Σ wᵢ²sᵢ²` would claim knowledge at the seams that is not
    /// there. A point that is not finite, or off the lattice, is [`Occupancy::UNKNOWN`].
    #[must_use]
    pub fn occupancy(&self, point_m: &Point<2>) -> Occupancy {
        let Some(features) = self.basis.features(point_m) else { return Occupancy::UNKNOWN };
        let prior_variance = self.prior.variance(features.values.iter().copied(), features.bias);
        let (mut mean, mut variance) = (0.0, 0.0);
        for index in self.tiling.holding(&features.stencil.first) {
            let (weight, _) = self.tiling.weight(&index, &features.stencil);
            match self.tiles.posterior(&index) {
                Some(tile) => {
                    let row: Row =
                        entries_of(&features, &self.tiling.window(&index), self.basis.lattice.stencil).collect();
                    let moments = tile.moments(&row, features.bias);
                    mean += weight * moments.mean;
                    variance += weight * moments.variance;
                }
                None => variance += weight * prior_variance,
            }
        }
        Occupancy::from_moments(mean, variance)
    }

    /// What the map says about a point and how that changes with it, in closed form, the blend's weights included.
    ///
    /// Zero where the answer is [`Occupancy::UNKNOWN`].
    #[must_use]
    pub fn gradient(&self, point_m: &Point<2>) -> OccupancyGradient {
        let mut total = OccupancyGradient::UNKNOWN;
        let Some(features) = self.basis.features(point_m) else { return total };
        let slopes = self.basis.gradients(&features.stencil);
        let (mut mean, mut variance) = (0.0, 0.0);
        for index in self.tiling.holding(&features.stencil.first) {
            let (weight, weight_slope) = self.tiling.weight(&index, &features.stencil);
            let row: Row = entries_of(&features, &self.tiling.window(&index), self.basis.lattice.stencil).collect();
            let slope_row = |axis: usize| -> Row {
                row.iter().zip(&slopes.values).map(|(e, d)| Entry { index: e.index, value: d[axis] }).collect()
            };
            match self.tiles.posterior(&index) {
                Some(tile) => {
                    let moments = tile.moments(&row, features.bias);
                    mean += weight * moments.mean;
                    variance += weight * moments.variance;
                    for axis in 0..2 {
                        let d = slope_row(axis);
                        total.mean[axis] +=
                            weight * tile.mean_of(&d, slopes.bias[axis]) + weight_slope[axis] * moments.mean;
                        total.variance[axis] +=
                            weight * 2.0 * tile.bilinear(&d, slopes.bias[axis], &row, features.bias)
                                + weight_slope[axis] * moments.variance;
                    }
                }
                None => {
                    let prior_variance = self.prior.variance(features.values.iter().copied(), features.bias);
                    variance += weight * prior_variance;
                    for axis in 0..2 {
                        let d = slope_row(axis);
                        total.variance[axis] +=
                            weight * 2.0 * self.prior.bilinear(&d, slopes.bias[axis], &row, features.bias)
                                + weight_slope[axis] * prior_variance;
                    }
                }
            }
        }
        OccupancyGradient::from_moments(mean, variance, total.mean, total.variance)
    }
}

/// The features as entries of one tile, whose window holds the stencil whole (else: no entries).
#[inline(always)]
pub(crate) fn entries_of<const D: usize>(
    features: &Features<D>,
    window: &Window<D>,
    stencil: usize,
) -> impl Iterator<Item = Entry> {
    let base = window.index_of_whole(&features.stencil.first, stencil);
    let strides = window.strides();
    let values = if base.is_some() { features.values.as_slice() } else { &[] };
    crate::lattice::offsets([stencil; D]).zip(values).map(move |(offset, value)| {
        let index = base.unwrap_or(0) + offset.iter().zip(strides).map(|(o, stride)| o * stride).sum::<usize>();
        Entry { index: index as u32, value: *value }
    })
}
