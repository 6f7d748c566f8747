use std::collections::BTreeMap;

use bhm_core::tile::{Archive, Tile, TileIndex};

/// Keeps evicted tiles on the heap until they are brought back.
///
/// A tile is either in the store or here. The place of a tile that went back is kept for its return, so that the archive
/// allocates once for every tile that was ever evicted, and not when a robot moves to and fro.
#[derive(Debug)]
pub struct TileArchive<const M: usize, const B: usize> {
    places: BTreeMap<TileIndex<2>, Place<M, B>>,
    len: usize,
}

#[derive(Debug)]
struct Place<const M: usize, const B: usize> {
    tile: Box<Tile<2, M, B>>,
    /// Whether the tile is here rather than in the store.
    here: bool,
}

impl<const M: usize, const B: usize> Default for TileArchive<M, B> {
    fn default() -> Self {
        Self { places: BTreeMap::new(), len: 0 }
    }
}

impl<const M: usize, const B: usize> TileArchive<M, B> {
    /// Number of tiles kept.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The tile of that index, if it is here.
    #[must_use]
    pub fn get(&self, index: &TileIndex<2>) -> Option<&Tile<2, M, B>> {
        self.places.get(index).filter(|place| place.here).map(|place| &*place.tile)
    }

    /// The tiles kept, in ascending order of index.
    pub fn iter(&self) -> impl Iterator<Item = &Tile<2, M, B>> {
        self.places.values().filter(|place| place.here).map(|place| &*place.tile)
    }
}

impl<const M: usize, const B: usize> Archive<2, M, B> for TileArchive<M, B> {
    fn keep(&mut self, tile: &Tile<2, M, B>) -> bool {
        let place =
            self.places.entry(tile.index).or_insert_with(|| Place { tile: super::zeroed::zeroed_box(), here: false });
        place.tile.clone_from_in_place(tile);
        self.len += usize::from(!place.here);
        place.here = true;
        true
    }

    fn bring_back(&mut self, index: &TileIndex<2>, tile: &mut Tile<2, M, B>) -> bool {
        let Some(place) = self.places.get_mut(index).filter(|place| place.here) else { return false };
        tile.clone_from_in_place(&place.tile);
        place.here = false;
        self.len -= 1;
        true
    }
}
