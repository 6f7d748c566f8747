use bhm_core::tile::{TileIndex, TileStore};

use super::packed::TileVersion;

/// What the host has of a resident tile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SentTile {
    /// Which tile, and how new the tile was when it was sent.
    sent: TileVersion,
    /// In which publication the tile was sent; 0 if in none.
    sent_in: u64,
    /// Whether the tile has to be sent.
    due: bool,
}

impl SentTile {
    /// An entry of no tile, for a `static`.
    pub const NONE: Self =
        Self { sent: TileVersion { index: [0; 2], updates: 0, touched_at: 0 }, sent_in: 0, due: false };
}

/// What the host has of the map: an entry for each resident tile, in ascending order of index, in lent memory.
#[derive(Debug)]
pub(super) struct SentTiles<'m> {
    entries: &'m mut [SentTile],
    resident: usize,
}

impl<'m> SentTiles<'m> {
    pub(super) fn new(entries: &'m mut [SentTile]) -> Self {
        Self { entries, resident: 0 }
    }

    /// How many tiles there is room for.
    pub(super) fn slots(&self) -> usize {
        self.entries.len()
    }

    fn entries(&self) -> &[SentTile] {
        &self.entries[..self.resident]
    }

    fn entries_mut(&mut self) -> &mut [SentTile] {
        &mut self.entries[..self.resident]
    }

    /// Looks which tiles are new, which have changed and which are gone; `false` if there are more than entries.
    pub(super) fn follow<const M: usize, const B: usize>(&mut self, store: &TileStore<'_, 2, M, B>) -> bool {
        let mut kept = 0;
        for at in 0..self.resident {
            let mut entry = self.entries[at];
            let Some(tile) = store.get(&entry.sent.index) else { continue };
            entry.due |= (tile.updates, tile.touched_at) != (entry.sent.updates, entry.sent.touched_at);
            self.entries[kept] = entry;
            kept += 1;
        }
        self.resident = kept;
        for tile in store.iter() {
            let Err(at) = self.entries().binary_search_by_key(&tile.index, |entry| entry.sent.index) else { continue };
            if self.resident == self.slots() {
                return false;
            }
            let sent = TileVersion { index: tile.index, ..TileVersion::default() };
            self.entries[self.resident] = SentTile { sent, sent_in: 0, due: true };
            self.resident += 1;
            self.entries[at..self.resident].rotate_right(1);
        }
        true
    }

    /// The tile that is to be sent next: of those due, the one that was sent longest ago.
    pub(super) fn next_due(&self) -> Option<TileIndex<2>> {
        let due = self.entries().iter().filter(|entry| entry.due);
        due.min_by_key(|entry| entry.sent_in).map(|entry| entry.sent.index)
    }

    /// Takes note that a tile was sent.
    pub(super) fn sent(&mut self, tile: TileVersion, publication: u64) {
        if let Some(entry) = self.entry(&tile.index) {
            *entry = SentTile { sent: tile, sent_in: publication, due: false };
        }
    }

    /// Tiles that have to be sent.
    pub(super) fn due(&self) -> usize {
        self.entries().iter().filter(|entry| entry.due).count()
    }

    /// What the other end must have by now, in ascending order of index.
    pub(super) fn known(&self) -> impl Iterator<Item = &TileVersion> {
        self.entries().iter().filter(|entry| entry.sent_in > 0).map(|entry| &entry.sent)
    }

    /// All have to be sent.
    pub(super) fn all_due(&mut self) {
        self.entries_mut().iter_mut().for_each(|entry| entry.due = true);
    }

    /// This one has to be sent, if it is still there.
    pub(super) fn make_due(&mut self, index: &TileIndex<2>) {
        if let Some(entry) = self.entry(index) {
            entry.due = true;
        }
    }

    fn entry(&mut self, index: &TileIndex<2>) -> Option<&mut SentTile> {
        let at = self.entries().binary_search_by_key(index, |entry| entry.sent.index).ok()?;
        self.entries_mut().get_mut(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn version(x: i32) -> TileVersion {
        TileVersion { index: [x, -x], updates: 1, touched_at: 1 }
    }

    /// Every tile has its turn, whatever the budget of a publication.
    #[test]
    fn of_those_due_the_tile_that_was_sent_longest_ago_is_next() {
        let mut entries: Vec<_> = [(1, 5, true), (2, 3, true), (3, 1, false), (4, 9, true), (5, 0, true)]
            .map(|(x, sent_in, due)| SentTile { sent: version(x), sent_in, due })
            .to_vec();
        let mut tiles = SentTiles { resident: entries.len(), entries: &mut entries };
        let mut order = Vec::new();
        for publication in 10.. {
            let Some(index) = tiles.next_due() else { break };
            order.push(index[0]);
            tiles.sent(version(index[0]), publication);
        }
        // The fifth was never sent, the third is not due.
        assert_eq!(order, [5, 2, 1, 4]);
        tiles.all_due();
        assert_eq!((tiles.due(), tiles.next_due()), (5, Some([3, -3])));
    }
}
