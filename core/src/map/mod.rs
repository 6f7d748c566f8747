//! What a map answers, wherever it lies: in a mapper, in a file, in shared memory.
//!
//! [`Map`] is the one surface that planners, viewers and exporters use. Who implements it answers for a point and for its
//! gradient; rasters and ray casts follow.

mod grid;
mod ray_cast;

pub use grid::Grid;
pub use ray_cast::RayCast;

use crate::{
    geometry::Point,
    posterior::PosteriorView,
    rule::logistic::{kappa, sigmoid},
    settings::Model,
    tile::TileIndex,
};

/// A map that can be asked.
///
/// ```
/// use bhm_core::{geometry::Point, map::{Map, Occupancy}};
///
/// /// A wall along the y axis, seen from both sides.
/// struct Wall;
///
/// # use bhm_core::map::{OccupancyGradient, TileRef};
/// impl Map<2> for Wall {
///     fn occupancy(&self, point_m: &Point<2>) -> Occupancy {
///         Occupancy::from_moments(4.0 - 20.0 * point_m.x.abs(), 1.0)
///     }
///     // …
///     # fn gradient(&self, _: &Point<2>) -> OccupancyGradient<2> { OccupancyGradient::UNKNOWN }
///     # fn spacing_m(&self) -> f32 { 0.25 }
///     # fn for_each_tile(&self, _: &mut dyn FnMut(&TileRef<'_, 2>)) {}
/// }
///
/// let points = [[-1.0, 0.0].into(), [0.0, 0.0].into(), [1.0, 3.0].into()];
/// let mut answers = [Occupancy::UNKNOWN; 3];
/// Wall.occupancies(&points, &mut answers);
/// assert!(answers[1].probability > 0.9 && answers[2].probability < 0.1);
///
/// let seen = Wall.cast_ray(&[-2.0, 0.0].into(), &[1.0, 0.0].into(), 10.0, 0.5);
/// assert!((seen.first_m.unwrap() - 1.8).abs() < 0.01);
/// ```
pub trait Map<const D: usize> {
    /// What the map says about a point, metres.
    ///
    /// A point that is not finite, or beyond the lattice, is [`Occupancy::UNKNOWN`].
    fn occupancy(&self, point_m: &Point<D>) -> Occupancy;

    /// What the map says about a point, metres, and how that changes with the point, in closed form; zero where the answer is
    /// [`Occupancy::UNKNOWN`].
    fn gradient(&self, point_m: &Point<D>) -> OccupancyGradient<D>;

    /// Distance between neighbouring supports, metres: the finest detail that the map holds.
    fn spacing_m(&self) -> f32;

    /// Shows every tile, in ascending order of index.
    fn for_each_tile(&self, visit: &mut dyn FnMut(&TileRef<'_, D>));

    /// Indices of every tile, ascending.
    #[cfg(feature = "alloc")]
    fn tile_indices(&self) -> alloc::vec::Vec<TileIndex<D>> {
        let mut indices = alloc::vec::Vec::new();
        self.for_each_tile(&mut |tile| indices.push(tile.index));
        indices
    }

    /// What the map says about many points, metres, answer by answer; what has no counterpart in the other slice is left as it
    /// is.
    ///
    /// Points of one cell of the lattice that follow each other share the search for tiles and what is read of them.
    fn occupancies(&self, points_m: &[Point<D>], answers: &mut [Occupancy]) {
        for (point_m, answer) in points_m.iter().zip(answers) {
            *answer = self.occupancy(point_m);
        }
    }

    /// What the map says about the centre of every cell of a grid, in the grid's order; cells beyond the answers' length are
    /// left out.
    fn raster(&self, grid: &Grid<D>, answers: &mut [Occupancy]) {
        grid::raster(self, grid, answers);
    }

    /// Follows a ray of `range_max_m` metres from a point, in metres, along a unit vector: the first place where the
    /// probability exceeds `threshold`, and the expected distance at which the ray ends.
    fn cast_ray(&self, origin_m: &Point<D>, direction: &Point<D>, range_max_m: f32, threshold: f32) -> RayCast {
        ray_cast::cast(self, origin_m, direction, range_max_m, threshold)
    }
}

/// A map that also tells what made it: what it says where nothing was observed, and what its tiles cover.
pub trait ModelledMap<const D: usize>: Map<D> {
    /// The functions that follow from the map's settings.
    fn model(&self) -> &Model<'_, D>;

    /// What the map would say about a point, metres, if it had learned nothing.
    fn unobserved_at(&self, point_m: &Point<D>) -> Occupancy;
}

/// Whatever answers through a map that it can show, such as a [`MapView`](crate::tile::MapView) of tiles that it holds: it is a
/// [`Map`] itself.
pub trait Viewed<const D: usize> {
    /// The map that answers.
    fn as_map(&self) -> impl Map<D> + '_;
}

impl<const D: usize, T: Viewed<D>> Map<D> for T {
    fn occupancy(&self, point_m: &Point<D>) -> Occupancy {
        self.as_map().occupancy(point_m)
    }

    fn gradient(&self, point_m: &Point<D>) -> OccupancyGradient<D> {
        self.as_map().gradient(point_m)
    }

    fn spacing_m(&self) -> f32 {
        self.as_map().spacing_m()
    }

    fn for_each_tile(&self, visit: &mut dyn FnMut(&TileRef<'_, D>)) {
        self.as_map().for_each_tile(visit);
    }

    fn occupancies(&self, points_m: &[Point<D>], answers: &mut [Occupancy]) {
        self.as_map().occupancies(points_m, answers);
    }
}

/// What the map says about a point.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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

    /// From mean and variance of the log-odds.
    #[inline]
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
pub struct OccupancyGradient<const D: usize> {
    /// What the map says about the point itself.
    pub occupancy: Occupancy,
    /// `∂p/∂x`, per metre.
    pub probability: Point<D>,
    /// `∂m/∂x`, per metre.
    pub mean: Point<D>,
    /// `∂s²/∂x`, per metre.
    pub variance: Point<D>,
}

impl<const D: usize> OccupancyGradient<D> {
    /// The answer where the lattice ends.
    pub const UNKNOWN: Self = {
        let zero = Point::from_array_storage(nalgebra::ArrayStorage([[0.0; D]]));
        Self { occupancy: Occupancy::UNKNOWN, probability: zero, mean: zero, variance: zero }
    };

    /// From `m`, `s²`, `∂m` and `∂s²`.
    #[must_use]
    pub fn from_moments(mean: f32, variance: f32, mean_slope: Point<D>, variance_slope: Point<D>) -> Self {
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

/// A tile as every map shows it, whatever its shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileRef<'a, const D: usize> {
    /// Its place in the grid of tiles.
    pub index: TileIndex<D>,
    /// Number of updates it has learned from.
    pub updates: u64,
    /// The mapper's scan count when it was last touched.
    pub touched_at: u64,
    /// `μ` of its `M` weights.
    pub mean: &'a [f32],
    /// The upper band of `Σ`, row by row, `B` entries a row: `[i·B + j]` is the entry `(i, i + j)`.
    pub covariance: &'a [f32],
    /// `Σ` between the bias and each weight.
    pub border_covariance: &'a [f32],
    /// `Σ` of the bias; 1 without bias.
    pub bias_covariance: f32,
    /// `μ` of the bias; 0 without bias.
    pub bias_mean: f32,
}

impl<'a, const D: usize> TileRef<'a, D> {
    /// A tile of any shape.
    #[must_use]
    pub fn new<const M: usize, const B: usize>(
        index: TileIndex<D>,
        updates: u64,
        touched_at: u64,
        posterior: &PosteriorView<'a, M, B>,
    ) -> Self {
        let PosteriorView { mean, covariance, border_covariance, bias_covariance, bias_mean } = *posterior;
        let covariance = covariance.as_flattened();
        Self { index, updates, touched_at, mean, covariance, border_covariance, bias_covariance, bias_mean }
    }
}
