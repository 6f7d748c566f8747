use core::fmt;

use super::TileIndex;
use crate::lattice::{Lattice, Node, Stencil, Window};

/// How the lattice is cut into overlapping tiles.
///
/// Tile `t` holds the nodes `t·stride … t·stride + width − 1` along each axis. It learns from, and answers for, the points
/// whose whole stencil lies inside: a region `width − stencil + 1` cells wide. Neighbouring regions overlap by at least
/// one cell, in which queries blend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tiling<const D: usize> {
    /// The supports.
    pub lattice: Lattice<D>,
    /// Supports of a tile along each axis.
    pub width: [usize; D],
    /// Supports from one tile to the next along each axis (the *core* of a tile; `width − stride` is twice the halo).
    pub stride: [usize; D],
    /// How many tiles there are along each axis, from index 0; `None` for an unbounded plane.
    pub tiles: Option<[usize; D]>,
}

/// Most supports of a tile along an axis.
const MAX_WIDTH: usize = 1_024;

/// A tiling that cannot be.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TilingError {
    /// The stencil must be even, at least 2, no wider than a tile, and have at most
    /// [`MAX_STENCIL_NODES`](crate::lattice::MAX_STENCIL_NODES) nodes.
    Stencil {
        /// What it is.
        stencil: usize,
    },
    /// A tile wider than any memory holds, whose number of supports might not even be a number.
    Width {
        /// Supports along the axis.
        width: usize,
    },
    /// Neighbouring regions of whole stencils must overlap by one cell at least and by no more than a stride.
    Overlap {
        /// Supports of a tile along the axis.
        width: usize,
        /// Supports from one tile to the next.
        stride: usize,
    },
    /// The number of supports is not the capacity `M`.
    Supports {
        /// Supports of a tile.
        needed: usize,
        /// `M`.
        capacity: usize,
    },
    /// The band is wider than the capacity `B`.
    Band {
        /// The band the stencil needs.
        needed: usize,
        /// `B`.
        capacity: usize,
    },
}

impl fmt::Display for TilingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stencil { stencil } => write!(f, "a stencil of {stencil} is not even, or does not fit a tile"),
            Self::Width { width } => write!(f, "a tile of {width} supports along an axis, at most {MAX_WIDTH}"),
            Self::Overlap { width, stride } => {
                write!(f, "tiles {width} wide and {stride} apart do not overlap by one cell to one stride")
            }
            Self::Supports { needed, capacity } => write!(f, "a tile has {needed} supports, M is {capacity}"),
            Self::Band { needed, capacity } => write!(f, "the stencil needs a band of {needed}, B is {capacity}"),
        }
    }
}

impl core::error::Error for TilingError {}

impl<const D: usize> Tiling<D> {
    /// Checks the tiling against itself and against the capacities `M` and `B`.
    ///
    /// # Errors
    /// What [`TilingError`] names.
    pub fn check(&self, supports: usize, band: usize) -> Result<(), TilingError> {
        let stencil = self.lattice.stencil;
        let fits = self.width.iter().all(|width| stencil <= *width);
        let few = stencil <= crate::lattice::MAX_STENCIL_NODES
            && self.lattice.stencil_nodes() <= crate::lattice::MAX_STENCIL_NODES;
        if stencil < 2 || !stencil.is_multiple_of(2) || !fits || !few {
            return Err(TilingError::Stencil { stencil });
        }
        for (&width, &stride) in self.width.iter().zip(&self.stride) {
            if width > MAX_WIDTH {
                return Err(TilingError::Width { width });
            }
            let region = width - stencil + 1;
            if stride == 0 || stride >= region || region > 2 * stride {
                return Err(TilingError::Overlap { width, stride });
            }
        }
        let window = self.window(&[0; D]);
        if window.supports() != supports {
            return Err(TilingError::Supports { needed: window.supports(), capacity: supports });
        }
        if window.band(stencil) > band {
            return Err(TilingError::Band { needed: window.band(stencil), capacity: band });
        }
        Ok(())
    }

    /// The nodes of a tile.
    #[inline]
    #[must_use]
    pub fn window(&self, tile: &TileIndex<D>) -> Window<D> {
        let mut first = [0; D];
        for axis in 0..D {
            first[axis] = tile[axis] * self.stride[axis] as i32;
        }
        Window { first, width: self.width }
    }

    /// Whether the tiling has such a tile.
    #[inline]
    #[must_use]
    pub fn contains(&self, tile: &TileIndex<D>) -> bool {
        self.tiles.is_none_or(|tiles| tile.iter().zip(tiles).all(|(t, n)| *t >= 0 && (*t as usize) < n))
    }

    /// The lattice positions of tiles that hold the whole stencil whose first node is given, whether such tiles exist or
    /// not: one or two along each axis.
    #[inline]
    pub fn holding(&self, first: &Node<D>) -> impl Iterator<Item = TileIndex<D>> {
        let mut low = [0; D];
        let mut count = [1; D];
        for axis in 0..D {
            let (stride, region) = (self.stride[axis] as i32, self.region(axis) as i32);
            let high = first[axis].div_euclid(stride);
            // The neighbour below still holds it while its region reaches this far.
            let two = first[axis] - (high - 1) * stride < region;
            low[axis] = high - i32::from(two);
            count[axis] = 1 + usize::from(two);
        }
        crate::lattice::offsets(count).map(move |offset| {
            let mut tile = low;
            for axis in 0..D {
                tile[axis] += offset[axis] as i32;
            }
            tile
        })
    }

    /// The weight of a tile in the blend at a point, and its derivative by the point, per metre.
    ///
    /// A product over axes of a quintic smoothstep of the distance to the edge of the tile's region, in units of the
    /// overlap. Neighbours' weights are mirror images and `s(t) + s(1 − t) = 1`, so that over all lattice positions of
    /// tiles they sum to one without being divided by their sum.
    #[inline]
    #[must_use]
    pub fn weight(&self, tile: &TileIndex<D>, stencil: &Stencil<D>) -> (f32, crate::geometry::Point<D>) {
        let spacing_m = self.lattice.spacing_m;
        let below = (self.lattice.stencil / 2 - 1) as f32;
        let mut values = [0.0; D];
        let mut slopes = [0.0; D];
        for axis in 0..D {
            let region = self.region(axis);
            let overlap = (region - self.stride[axis]) as f32;
            let into = (stencil.first[axis] - tile[axis] * self.stride[axis] as i32) as f32
                + (stencil.from_first_m[axis] / spacing_m - below);
            let left = region as f32 - into;
            let (edge, outwards) = if into < left { (into, 1.0) } else { (left, -1.0) };
            let t = (edge / overlap).clamp(0.0, 1.0);
            values[axis] = t * t * t * (t * (6.0 * t - 15.0) + 10.0);
            slopes[axis] = outwards * 30.0 * t * t * (t - 1.0) * (t - 1.0) / (overlap * spacing_m);
        }
        let gradient = crate::geometry::Point::from_fn(|axis, _| {
            (0..D).map(|other| if other == axis { slopes[other] } else { values[other] }).product()
        });
        (values.iter().product(), gradient)
    }

    /// Cells along an axis for which a tile holds the whole stencil.
    #[inline]
    const fn region(&self, axis: usize) -> usize {
        self.width[axis] - self.lattice.stencil + 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    fn tiling(width: usize, stride: usize, stencil: usize) -> Tiling<2> {
        let lattice = Lattice { origin_m: Point::zeros(), spacing_m: 0.5, stencil };
        Tiling { lattice, width: [width; 2], stride: [stride; 2], tiles: None }
    }

    #[test]
    fn holding_is_what_a_search_over_all_tiles_finds() {
        for tiling in [tiling(12, 8, 4), tiling(14, 8, 6), tiling(12, 6, 4), tiling(16, 12, 4)] {
            for x in -40..40 {
                for y in [-17, 0, 5] {
                    let mut found: std::vec::Vec<_> = tiling.holding(&[x, y]).collect();
                    let mut naive: std::vec::Vec<_> = (-15..15)
                        .flat_map(|i| (-15..15).map(move |j| [i, j]))
                        .filter(|t| tiling.window(t).index_of_whole(&[x, y], tiling.lattice.stencil).is_some())
                        .collect();
                    found.sort_unstable();
                    naive.sort_unstable();
                    assert_eq!(found, naive, "at {x}, {y} of {tiling:?}");
                }
            }
        }
    }

    #[test]
    fn weights_sum_to_one_and_their_gradients_to_zero() {
        for tiling in [tiling(12, 8, 4), tiling(14, 8, 6), tiling(12, 6, 4)] {
            for i in 0..2_000 {
                let point = Point::<2>::new(i as f32 * 0.0137 - 9.0, 5.0 - i as f32 * 0.0091);
                let stencil = tiling.lattice.stencil_at(&point).unwrap();
                let (mut sum, mut gradient) = (0.0, Point::<2>::zeros());
                for tile in tiling.holding(&stencil.first) {
                    let (weight, slope) = tiling.weight(&tile, &stencil);
                    sum += weight;
                    gradient += slope;
                }
                assert!(
                    (sum - 1.0).abs() < 1e-5 && gradient.iter().all(|d| d.abs() < 1e-3),
                    "{sum} {gradient} at {point}"
                );
            }
        }
    }

    #[test]
    fn impossible_tilings_are_refused_with_the_reason() {
        assert_eq!(tiling(12, 8, 4).check(144, 40), Ok(()));
        assert_eq!(tiling(12, 8, 4).check(144, 39), Err(TilingError::Band { needed: 40, capacity: 39 }));
        assert_eq!(tiling(12, 8, 4).check(100, 40), Err(TilingError::Supports { needed: 144, capacity: 100 }));
        assert_eq!(tiling(12, 9, 4).check(144, 40), Err(TilingError::Overlap { width: 12, stride: 9 }));
        assert_eq!(tiling(12, 8, 5).check(144, 40), Err(TilingError::Stencil { stencil: 5 }));
    }
}
