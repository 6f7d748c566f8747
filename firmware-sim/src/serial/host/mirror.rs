use std::boxed::Box;
use std::collections::BTreeMap;
use std::vec::Vec;

use bhm_core::{
    map::TileRef,
    posterior::PosteriorView,
    tile::{TileIndex, TileSource},
};

use crate::counters::counters;
use crate::serial::{
    DirectoryPart, NewsFrame, TilePart,
    packed::{self, TileVersion, tile_floats},
};

counters! {
    /// What became of the tiles and directories that a device sent.
    MirrorCounters:
    /// Tiles that came whole.
    tiles_received,
    /// Parts of tiles that no tile has: beyond its end, cut numbers, more tiles than the device has.
    tile_parts_refused,
    /// Parts of tiles that had come already.
    tile_parts_repeated,
    /// Parts of tiles of which something before is missing.
    tile_parts_orphaned,
    /// Tiles that were begun and not ended.
    tiles_abandoned,
    /// Directories that came whole.
    directories_received,
    /// Parts of directories that contradict themselves or what the device said before.
    directory_parts_refused,
    /// Parts of directories that had come already, or of which something before is missing.
    directory_parts_orphaned,
    /// Directories that list tiles which did not come.
    directories_incomplete,
    /// Directories of which every tile was there, while newer ones were still to come.
    directories_behind,
}

/// A tile as the device sent it.
#[derive(Clone, Debug, PartialEq)]
pub struct MirroredTile<const M: usize, const B: usize> {
    /// Which, and how new.
    pub version: TileVersion,
    floats: Box<[f32]>,
}

impl<const M: usize, const B: usize> MirroredTile<M, B> {
    /// What queries need of it.
    #[must_use]
    pub fn view(&self) -> PosteriorView<'_, M, B> {
        // It is kept only once every number has come.
        packed::view_of(&self.floats).expect("as many numbers as a tile has")
    }
}

/// A tile that is being received.
#[derive(Debug)]
struct Arriving {
    version: TileVersion,
    floats: Vec<f32>,
}

/// A directory that is being received.
#[derive(Debug, Default)]
struct Listing {
    number: u64,
    tiles: Vec<TileVersion>,
}

/// What a directory that came whole says.
#[derive(Clone, Debug, PartialEq)]
pub struct Directory {
    /// The device's count of directories.
    pub number: u64,
    /// Tiles that are newer on the device: their turn comes.
    pub behind: u32,
    /// Tiles that it lists and that are not here.
    pub missing: Vec<TileIndex<2>>,
    /// What is worth knowing about the posterior.
    pub news: NewsFrame,
}

/// The resident tiles of a device, as far as they came.
#[derive(Debug)]
pub struct Mirror<const M: usize, const B: usize> {
    slots: usize,
    tiles: BTreeMap<TileIndex<2>, MirroredTile<M, B>>,
    arriving: Option<Arriving>,
    listing: Option<Listing>,
    /// The newest directory that came whole.
    directory: u64,
    pub(super) counters: MirrorCounters,
}

impl<const M: usize, const B: usize> Mirror<M, B> {
    pub(super) fn new() -> Self {
        Self {
            slots: 0,
            tiles: BTreeMap::new(),
            arriving: None,
            listing: None,
            directory: 0,
            counters: MirrorCounters::NONE,
        }
    }

    /// Forgets everything but the counts: another run of a device, with so many slots.
    pub(super) fn begin(&mut self, slots: usize) {
        *self = Self { slots, counters: self.counters, ..Self::new() };
    }

    /// The tiles, in ascending order of index. Together they are the device's posterior right after
    /// [`Event::Posterior`](super::Event::Posterior) only.
    pub fn tiles(&self) -> impl ExactSizeIterator<Item = &MirroredTile<M, B>> {
        self.tiles.values()
    }

    /// The newest directory that came whole; 0 before the first.
    #[must_use]
    pub fn directory(&self) -> u64 {
        self.directory
    }

    /// Takes a part of a tile.
    pub(super) fn take_part(&mut self, part: &TilePart<'_>) {
        let TilePart { index, updates, touched_at, from, floats } = *part;
        let version = TileVersion { index, updates, touched_at };
        let (floats, cut) = packed::floats(floats.0);
        let (from, count) = (from as usize, floats.len());
        // As many tiles as the device has may be listed, and as many others may have come since.
        let room = self.tiles.contains_key(&index) || self.tiles.len() < 2 * self.slots;
        if cut || count == 0 || from.saturating_add(count) > tile_floats::<M, B>() || !room {
            self.counters.tile_parts_refused += 1;
            return;
        }
        let ours = self.arriving.as_mut().filter(|arriving| arriving.version == version);
        match ours {
            Some(arriving) if from == arriving.floats.len() => arriving.floats.extend(floats),
            Some(arriving) if from + count <= arriving.floats.len() => {
                self.counters.tile_parts_repeated += 1;
                return;
            }
            _ if from == 0 => {
                self.abandon();
                let mut numbers = Vec::with_capacity(tile_floats::<M, B>());
                numbers.extend(floats);
                self.arriving = Some(Arriving { version, floats: numbers });
            }
            _ if self.tiles.get(&index).is_some_and(|tile| tile.version == version) => {
                self.counters.tile_parts_repeated += 1;
                return;
            }
            _ => {
                self.counters.tile_parts_orphaned += 1;
                self.abandon();
                return;
            }
        }
        if self.arriving.as_ref().is_some_and(|arriving| arriving.floats.len() == tile_floats::<M, B>())
            && let Some(Arriving { version, floats }) = self.arriving.take()
        {
            self.counters.tiles_received += 1;
            self.tiles.insert(version.index, MirroredTile { version, floats: floats.into() });
        }
    }

    fn abandon(&mut self) {
        self.counters.tiles_abandoned += u64::from(self.arriving.take().is_some());
    }

    /// Takes a part of a directory; the directory, if that was its last.
    pub(super) fn take_directory(&mut self, part: &DirectoryPart<'_>) -> Option<Directory> {
        let DirectoryPart { number, listed, from, behind, tiles, news, .. } = *part;
        let (listed, from) = (listed as usize, from as usize);
        let Some(tiles) = packed::tile_versions(tiles.0) else {
            self.counters.directory_parts_refused += 1;
            return None;
        };
        if from == 0 {
            self.listing = Some(Listing { number, tiles: Vec::new() });
        }
        let Some(listing) =
            self.listing.as_mut().filter(|listing| (listing.number, listing.tiles.len()) == (number, from))
        else {
            self.counters.directory_parts_orphaned += 1;
            return None;
        };
        listing.tiles.extend(tiles);
        let ascend = listing.tiles.is_sorted_by(|a, b| a.index < b.index);
        // A part with nothing in it would never lead to an end.
        let empty = listing.tiles.len() == from && listed > 0;
        if !ascend || empty || number <= self.directory || listed > self.slots || listing.tiles.len() > listed {
            // The one that is known already is no contradiction.
            *if number <= self.directory {
                &mut self.counters.directory_parts_orphaned
            } else {
                &mut self.counters.directory_parts_refused
            } += 1;
            self.listing = None;
            return None;
        }
        if listing.tiles.len() < listed {
            return None;
        }
        let listing = self.listing.take()?;
        Some(self.compare(listing, behind, news))
    }

    /// Compares what is here with a directory, and drops what it does not list.
    fn compare(&mut self, Listing { number, tiles: listed }: Listing, behind: u32, news: NewsFrame) -> Directory {
        // What has been begun would have ended before its directory.
        self.abandon();
        self.tiles.retain(|index, _| listed.binary_search_by_key(index, |tile| tile.index).is_ok());
        let here = |tile: &TileVersion| self.tiles.get(&tile.index).is_some_and(|have| have.version == *tile);
        let missing: Vec<_> = listed.iter().filter(|tile| !here(tile)).map(|tile| tile.index).collect();
        self.directory = number;
        self.counters.directories_received += 1;
        self.counters.directories_incomplete += u64::from(!missing.is_empty());
        self.counters.directories_behind += u64::from(missing.is_empty() && behind > 0);
        Directory { number, behind, missing, news }
    }
}

impl<const M: usize, const B: usize> TileSource<2, M, B> for Mirror<M, B> {
    fn posterior(&self, index: &TileIndex<2>) -> Option<PosteriorView<'_, M, B>> {
        self.tiles.get(index).map(MirroredTile::view)
    }

    fn for_each_tile(&self, visit: &mut dyn FnMut(&TileRef<'_, 2>)) {
        for tile in self.tiles.values() {
            let TileVersion { index, updates, touched_at } = tile.version;
            visit(&TileRef::new(index, updates, touched_at, &tile.view()));
        }
    }
}
