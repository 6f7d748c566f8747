use core::fmt;

use super::{Tile, TileIndex, TileSource};
use crate::{
    map::TileRef,
    posterior::{Posterior, PosteriorView},
    storage::Storage,
};

/// Where evicted tiles go and come back from: the owner of the store, who may have more memory than it.
pub trait Archive<const D: usize, const M: usize, const B: usize> {
    /// Takes a tile that leaves the store; `false` if it is lost.
    fn keep(&mut self, tile: &Tile<D, M, B>) -> bool;

    /// Writes the tile of that index, if it was kept, into `tile`.
    fn bring_back(&mut self, index: &TileIndex<D>, tile: &mut Tile<D, M, B>) -> bool;
}

/// No archive: a tile that leaves the store is lost, and counted as such.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoArchive;

impl<const D: usize, const M: usize, const B: usize> Archive<D, M, B> for NoArchive {
    fn keep(&mut self, _: &Tile<D, M, B>) -> bool {
        false
    }

    fn bring_back(&mut self, _: &TileIndex<D>, _: &mut Tile<D, M, B>) -> bool {
        false
    }
}

/// Where a tile's index is found.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DirectoryEntry<const D: usize> {
    index: TileIndex<D>,
    slot: u32,
}

impl<const D: usize> DirectoryEntry<D> {
    /// Room for an entry, for a `static`; on a computer allocate it zeroed instead, which is the same value.
    pub const VACANT: Self = Self { index: [0; D], slot: 0 };
}

/// A fixed number of tiles in memory that is owned or lent, found by index in the time of a binary search.
#[derive(Debug)]
pub struct TileStore<'m, const D: usize, const M: usize, const B: usize> {
    tiles: Storage<'m, [Tile<D, M, B>]>,
    /// Sorted by index; one entry per resident tile.
    directory: Storage<'m, [DirectoryEntry<D>]>,
    slots: usize,
    resident: usize,
}

/// How a tile came to be in the store.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Claimed {
    /// The slot it is in.
    pub slot: usize,
    /// It began as the prior.
    pub created: bool,
    /// It came back from the archive.
    pub restored: bool,
    /// Another had to leave for it.
    pub evicted: bool,
    /// The one that left was not kept.
    pub lost: bool,
}

/// Every slot is taken.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileStoreFull {
    /// How many slots there are.
    pub slots: usize,
}

impl fmt::Display for TileStoreFull {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "all {} tile slots are taken", self.slots)
    }
}

impl core::error::Error for TileStoreFull {}

impl<'m, const D: usize, const M: usize, const B: usize> TileStore<'m, D, M, B> {
    /// An empty store; its capacity is the shorter of the two slices' lengths.
    #[must_use]
    pub fn new(
        tiles: impl Into<Storage<'m, [Tile<D, M, B>]>>,
        directory: impl Into<Storage<'m, [DirectoryEntry<D>]>>,
    ) -> Self {
        let (tiles, directory) = (tiles.into(), directory.into());
        let slots = tiles.len().min(directory.len()).min(u32::MAX as usize);
        Self { tiles, directory, slots, resident: 0 }
    }

    /// Number of slots.
    #[must_use]
    pub fn slots(&self) -> usize {
        self.slots
    }

    /// Number of tiles in them.
    #[must_use]
    pub fn resident(&self) -> usize {
        self.resident
    }

    /// The resident tiles, in ascending order of index.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &Tile<D, M, B>> {
        self.directory[..self.resident].iter().map(|entry| &self.tiles[entry.slot as usize])
    }

    /// The tile in a slot.
    #[inline(always)]
    pub(crate) fn slot_mut(&mut self, slot: usize) -> &mut Tile<D, M, B> {
        &mut self.tiles[slot]
    }

    fn find(&self, index: &TileIndex<D>) -> Result<usize, usize> {
        self.directory[..self.resident].binary_search_by_key(index, |entry| entry.index)
    }

    /// The tile of that index, if it is resident.
    #[must_use]
    pub fn get(&self, index: &TileIndex<D>) -> Option<&Tile<D, M, B>> {
        self.find(index).ok().map(|at| &self.tiles[self.directory[at].slot as usize])
    }

    /// Puts a tile back into a free slot, or in the place of the one with its index.
    ///
    /// # Errors
    /// [`TileStoreFull`]; nothing is evicted by this.
    pub fn insert(&mut self, tile: &Tile<D, M, B>) -> Result<(), TileStoreFull> {
        let slot = match self.find(&tile.index) {
            Ok(at) => self.directory[at].slot as usize,
            Err(at) if self.resident < self.slots() => {
                let slot = self.resident;
                self.enter(at, tile.index, slot);
                slot
            }
            Err(_) => return Err(TileStoreFull { slots: self.slots() }),
        };
        self.tiles[slot].clone_from_in_place(tile);
        Ok(())
    }

    /// Finds the tile or makes room for it, evicting the least recently touched; `None` only if there is no slot at all.
    pub(crate) fn claim(
        &mut self,
        index: &TileIndex<D>,
        prior: &Posterior<M, B>,
        archive: &mut impl Archive<D, M, B>,
    ) -> Option<Claimed> {
        let mut claimed = Claimed::default();
        let at = match self.find(index) {
            Ok(at) => {
                claimed.slot = self.directory[at].slot as usize;
                return Some(claimed);
            }
            Err(at) => at,
        };
        if self.resident < self.slots() {
            // Slots fill in order and a slot freed by eviction is taken at once, so the next free one is always this.
            claimed.slot = self.resident;
            self.enter(at, *index, claimed.slot);
        } else {
            // Ties cannot depend on the slots' order: the directory is sorted by index, and the first least one wins.
            let oldest =
                (0..self.resident).min_by_key(|entry| self.tiles[self.directory[*entry].slot as usize].touched_at)?;
            claimed.slot = self.directory[oldest].slot as usize;
            claimed.evicted = true;
            claimed.lost = !archive.keep(&self.tiles[claimed.slot]);
            self.directory[oldest..self.resident].rotate_left(1);
            self.resident -= 1;
            let at = if oldest < at { at - 1 } else { at };
            self.enter(at, *index, claimed.slot);
        }
        let tile = &mut self.tiles[claimed.slot];
        claimed.restored = archive.bring_back(index, tile);
        if !claimed.restored {
            claimed.created = true;
            tile.index = *index;
            tile.updates = 0;
            tile.touched_at = 0;
            tile.posterior.copy_from(prior);
        }
        Some(claimed)
    }

    fn enter(&mut self, at: usize, index: TileIndex<D>, slot: usize) {
        self.directory[self.resident] = DirectoryEntry { index, slot: slot as u32 };
        self.resident += 1;
        self.directory[at..self.resident].rotate_right(1);
    }
}

impl<const D: usize, const M: usize, const B: usize> Tile<D, M, B> {
    /// The tile as every map shows it.
    #[must_use]
    pub fn as_ref(&self) -> TileRef<'_, D> {
        TileRef::new(self.index, self.updates, self.touched_at, &self.posterior.view())
    }

    /// Copies a tile field by field: assignment of the whole could pass through the stack.
    pub fn clone_from_in_place(&mut self, source: &Self) {
        self.index = source.index;
        self.updates = source.updates;
        self.touched_at = source.touched_at;
        self.posterior.copy_from(&source.posterior);
    }
}

impl<const D: usize, const M: usize, const B: usize> TileSource<D, M, B> for TileStore<'_, D, M, B> {
    fn posterior(&self, index: &TileIndex<D>) -> Option<PosteriorView<'_, M, B>> {
        self.get(index).map(|tile| tile.posterior.view())
    }

    fn for_each_tile(&self, visit: &mut dyn FnMut(&TileRef<'_, D>)) {
        self.iter().for_each(|tile| visit(&tile.as_ref()));
    }
}
