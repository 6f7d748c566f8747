use std::collections::BTreeMap;

use bhm_core::tile::{Archive, Tile, TileIndex};

/// Keeps evicted tiles on the heap until they are brought back.
///
/// A tile is either in the store or here. Boxes of tiles that went back are used again, so that a robot that moves to and
/// fro allocates nothing.
#[derive(Debug)]
pub struct TileArchive<const M: usize, const B: usize> {
    tiles: BTreeMap<TileIndex<2>, Box<Tile<M, B>>>,
    spare: Vec<Box<Tile<M, B>>>,
}

impl<const M: usize, const B: usize> Default for TileArchive<M, B> {
    fn default() -> Self {
        Self { tiles: BTreeMap::new(), spare: Vec::new() }
    }
}

impl<const M: usize, const B: usize> TileArchive<M, B> {
    /// Number of tiles kept.
    #[must_use]
    pub fn len(&self) -> usize {
        self.tiles.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.tiles.is_empty()
    }

    /// The tile of that index, if it is here.
    #[must_use]
    pub fn get(&self, index: &TileIndex<2>) -> Option<&Tile<M, B>> {
        self.tiles.get(index).map(|tile| &**tile)
    }

    /// The tiles kept, in ascending order of index.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &Tile<M, B>> {
        self.tiles.values().map(|tile| &**tile)
    }
}

impl<const M: usize, const B: usize> Archive<M, B> for TileArchive<M, B> {
    fn keep(&mut self, tile: &Tile<M, B>) -> bool {
        let mut kept = self.spare.pop().unwrap_or_else(super::owned::zeroed_box);
        kept.clone_from_in_place(tile);
        self.tiles.insert(tile.index, kept);
        true
    }

    fn bring_back(&mut self, index: &TileIndex<2>, tile: &mut Tile<M, B>) -> bool {
        let Some(kept) = self.tiles.remove(index) else { return false };
        tile.clone_from_in_place(&kept);
        self.spare.push(kept);
        true
    }
}
