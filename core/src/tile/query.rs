//! The one place where tiles become a continuous function.

use super::{TileIndex, Tiling};
use crate::{
    basis::Basis,
    geometry::Point,
    lattice::{MAX_STENCIL_NODES, Node, Stencil},
    map::{Map, Occupancy, OccupancyGradient, TileRef},
    posterior::{Pattern, PosteriorView, Row},
};

/// Whatever holds tiles: the mapper's store, a sample in shared memory, a file.
pub trait TileSource<const D: usize, const M: usize, const B: usize> {
    /// Mean and covariance of the tile of that index, if there is one.
    fn posterior(&self, index: &TileIndex<D>) -> Option<PosteriorView<'_, M, B>>;

    /// Shows every tile, in ascending order of index.
    fn for_each_tile(&self, visit: &mut dyn FnMut(&TileRef<'_, D>));
}

impl<const D: usize, const M: usize, const B: usize, T: TileSource<D, M, B> + ?Sized> TileSource<D, M, B> for &T {
    fn posterior(&self, index: &TileIndex<D>) -> Option<PosteriorView<'_, M, B>> {
        (**self).posterior(index)
    }

    fn for_each_tile(&self, visit: &mut dyn FnMut(&TileRef<'_, D>)) {
        (**self).for_each_tile(visit);
    }
}

/// A map that can be asked: how points become features, and tiles wherever they lie.
#[derive(Clone, Copy, Debug)]
pub struct MapView<'a, T, const D: usize, const M: usize, const B: usize> {
    /// How points become features.
    pub basis: &'a Basis<'a, D>,
    /// How space is cut into tiles.
    pub tiling: &'a Tiling<D>,
    /// Where the features of a stencil stand among a tile's weights.
    pub pattern: &'a Pattern,
    /// What a tile that does not exist answers: the prior.
    pub unobserved: PosteriorView<'a, M, B>,
    /// The tiles that do.
    pub tiles: T,
}

/// Most tiles whose regions hold one point: two along each axis.
const MAX_HOLDING: usize = 8;

/// The tiles that hold a stencil, as many as there are lattice positions for them, existing or not.
type Holding<'t, const D: usize, const M: usize, const B: usize> =
    heapless::Vec<(TileIndex<D>, usize, PosteriorView<'t, M, B>), MAX_HOLDING>;

/// No tile at all.
#[derive(Clone, Copy, Debug)]
struct NoTiles;

impl<const D: usize, const M: usize, const B: usize> TileSource<D, M, B> for NoTiles {
    fn posterior(&self, _: &TileIndex<D>) -> Option<PosteriorView<'_, M, B>> {
        None
    }

    fn for_each_tile(&self, _: &mut dyn FnMut(&TileRef<'_, D>)) {}
}

impl<T: TileSource<D, M, B>, const D: usize, const M: usize, const B: usize> MapView<'_, T, D, M, B> {
    /// What the map would say about a point, metres, if it had learned nothing.
    #[must_use]
    pub fn unobserved_at(&self, point_m: &Point<D>) -> Occupancy {
        let Self { basis, tiling, pattern, unobserved, .. } = *self;
        MapView { basis, tiling, pattern, unobserved, tiles: NoTiles }.occupancy(point_m)
    }

    /// The tiles that hold the stencil whose first node is given, each with the index of that node in it.
    #[inline]
    fn holding(&self, first: &Node<D>) -> Holding<'_, D, M, B> {
        let at = |index: TileIndex<D>| {
            let base = self.tiling.window(&index).index_of_whole(first, self.basis.lattice.stencil)?;
            Some((index, base, self.tiles.posterior(&index).unwrap_or(self.unobserved)))
        };
        self.tiling.holding(first).filter_map(at).collect()
    }

    /// The blend of the tiles that hold a point, from the point's stencil and its features.
    ///
    /// `m = Σ wᵢmᵢ`, `s² = Σ wᵢsᵢ²`, a tile that does not exist being the prior. The variance is an upper bound of the blend's;
    /// `Σ wᵢ²sᵢ²` would claim knowledge at the seams that is not there.
    #[inline]
    fn blend(&self, holding: &Holding<'_, D, M, B>, stencil: &Stencil<D>, values: &[f32], bias: f32) -> Occupancy {
        let (mut mean, mut variance) = (0.0, 0.0);
        for (index, first, tile) in holding {
            // Where only one position holds the point, its weight is one.
            let weight = if holding.len() == 1 { 1.0 } else { self.tiling.weight(index, stencil).0 };
            let moments = tile.moments(&Row { pattern: self.pattern, first: *first, values, bias });
            mean += weight * moments.mean;
            variance += weight * moments.variance;
        }
        Occupancy::from_moments(mean, variance)
    }
}

/// Points of one cell that are answered together: as many as fill a vector.
const LANES: usize = 8;

/// Fewest points that are worth a vector.
const FEWEST_LANES: usize = 3;

/// Points that are sorted by cell at once: few enough for a microcontroller's stack.
const WINDOW: usize = 64;

/// One of many points: its stencil, and which of the points it is.
type Placed<const D: usize> = (Stencil<D>, usize);

impl<T: TileSource<D, M, B>, const D: usize, const M: usize, const B: usize> MapView<'_, T, D, M, B> {
    /// Answers at most [`WINDOW`] points, cell by cell.
    #[inline(always)]
    fn answer_window(&self, points_m: &[Point<D>], answers: &mut [Occupancy]) {
        let mut placed: heapless::Vec<Placed<D>, WINDOW> = heapless::Vec::new();
        for (number, (point_m, answer)) in points_m.iter().zip(&mut *answers).enumerate() {
            match self.basis.lattice.stencil_at(point_m) {
                Some(stencil) => placed.extend([(stencil, number)]),
                None => *answer = Occupancy::UNKNOWN,
            }
        }
        placed.sort_unstable_by_key(|(stencil, number)| (stencil.first, *number));
        for of_one_cell in placed.chunk_by(|(one, _), (other, _)| one.first == other.first) {
            let holding = self.holding(&of_one_cell[0].0.first);
            for some in of_one_cell.chunks(LANES) {
                self.answer_cell(&holding, some, points_m, answers);
            }
        }
    }

    /// Answers at most [`LANES`] points of one cell, which the tiles given hold.
    #[inline(always)]
    fn answer_cell(
        &self,
        holding: &Holding<'_, D, M, B>,
        placed: &[Placed<D>],
        points_m: &[Point<D>],
        answers: &mut [Occupancy],
    ) {
        let nodes = self.pattern.len().min(MAX_STENCIL_NODES);
        // The bias is the rare case: its covariances stand beside the band.
        if placed.len() < FEWEST_LANES || self.basis.bias_coupling.is_some() {
            let mut values = [0.0; MAX_STENCIL_NODES];
            let values = &mut values[..nodes];
            for (stencil, number) in placed {
                let bias = self.basis.write_features_at(stencil, &points_m[*number].into(), None, values);
                answers[*number] = self.blend(holding, stencil, values, bias);
            }
            return;
        }
        let mut features = [[0.0; LANES]; MAX_STENCIL_NODES];
        let features = &mut features[..nodes];
        // Lanes without a point repeat the first.
        let from_first_m = core::array::from_fn(|lane| placed.get(lane).unwrap_or(&placed[0]).0.from_first_m);
        self.basis.write_features_of_points(&self.basis.kernel, &placed[0].0.first, &from_first_m, features);
        let (mut means, mut variances) = ([0.0; LANES], [0.0; LANES]);
        for (index, first, tile) in holding {
            let moments = tile.moments_of_many(self.pattern, *first, features);
            for (lane, (stencil, _)) in placed.iter().enumerate() {
                let weight = if holding.len() == 1 { 1.0 } else { self.tiling.weight(index, stencil).0 };
                means[lane] += weight * moments[lane].mean;
                variances[lane] += weight * moments[lane].variance;
            }
        }
        for (lane, (_, number)) in placed.iter().enumerate() {
            answers[*number] = Occupancy::from_moments(means[lane], variances[lane]);
        }
    }
}

impl<T: TileSource<D, M, B>, const D: usize, const M: usize, const B: usize> Map<D> for MapView<'_, T, D, M, B> {
    fn occupancy(&self, point_m: &Point<D>) -> Occupancy {
        let mut values = [0.0; MAX_STENCIL_NODES];
        let values = &mut values[..self.pattern.len().min(MAX_STENCIL_NODES)];
        let placed = self.basis.write_features(&(*point_m).into(), None, values);
        placed.map_or(Occupancy::UNKNOWN, |(stencil, bias)| {
            self.blend(&self.holding(&stencil.first), &stencil, values, bias)
        })
    }

    #[inline(always)]
    fn occupancies(&self, points_m: &[Point<D>], answers: &mut [Occupancy]) {
        for (points_m, answers) in points_m.chunks(WINDOW).zip(answers.chunks_mut(WINDOW)) {
            self.answer_window(points_m, answers);
        }
    }

    fn gradient(&self, point_m: &Point<D>) -> OccupancyGradient<D> {
        let mut total = OccupancyGradient::UNKNOWN;
        let Some(features) = self.basis.features(point_m) else { return total };
        let (stencil, bias) = (&features.stencil, features.bias);
        let slopes = self.basis.gradients(stencil);
        let mut along = [[0.0; MAX_STENCIL_NODES]; D];
        for (axis, along) in along.iter_mut().enumerate() {
            for (slot, slope) in along.iter_mut().zip(&slopes.values) {
                *slot = slope[axis];
            }
        }
        let nodes = features.values.len();
        let (mut mean, mut variance) = (0.0, 0.0);
        for (index, first, tile) in self.holding(&stencil.first) {
            let (weight, weight_slope) = self.tiling.weight(&index, stencil);
            let row = Row { pattern: self.pattern, first, values: &features.values, bias };
            let slope_row = |axis: usize| row.with(&along[axis][..nodes], slopes.bias[axis]);
            let moments = tile.moments(&row);
            mean += weight * moments.mean;
            variance += weight * moments.variance;
            for axis in 0..D {
                let d = slope_row(axis);
                total.mean[axis] += weight * tile.mean_of(&d) + weight_slope[axis] * moments.mean;
                total.variance[axis] += weight * 2.0 * tile.bilinear(&d, &row) + weight_slope[axis] * moments.variance;
            }
        }
        OccupancyGradient::from_moments(mean, variance, total.mean, total.variance)
    }

    fn spacing_m(&self) -> f32 {
        self.basis.lattice.spacing_m
    }

    fn for_each_tile(&self, visit: &mut dyn FnMut(&TileRef<'_, D>)) {
        self.tiles.for_each_tile(visit);
    }
}
