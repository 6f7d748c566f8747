//! Many maps, one function: overlapping tiles, each with a posterior of its own, in memory that is lent or owned.

mod query;
mod store;
mod tiling;

pub use query::{MapView, TileSource};
pub use store::{Archive, Claimed, DirectoryEntry, NoArchive, TileStore, TileStoreFull};
pub use tiling::{Tiling, TilingError};

use crate::posterior::Posterior;

/// Which tile: its place in the grid of tiles.
pub type TileIndex<const D: usize> = [i32; D];

/// One tile. All-zero bytes are a vacant tile.
#[repr(C)]
#[derive(Clone, Debug, PartialEq)]
pub struct Tile<const D: usize, const M: usize, const B: usize> {
    /// Its place in the grid of tiles.
    pub index: TileIndex<D>,
    /// Number of updates it has learned from since the map began; 0 is a vacant tile.
    pub updates: u64,
    /// The mapper's scan count when it was last touched: what eviction and publication go by.
    pub touched_at: u64,
    /// What it has learned.
    pub posterior: Posterior<M, B>,
}

impl<const D: usize, const M: usize, const B: usize> Tile<D, M, B> {
    /// A free slot, for a `static`; on a computer allocate slots zeroed instead, which is the same value.
    pub const VACANT: Self = Self { index: [0; D], updates: 0, touched_at: 0, posterior: Posterior::ZERO };
}
