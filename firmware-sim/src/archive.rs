use bhm_core::tile::{Archive, Tile, TileIndex};

/// Keeps evicted tiles in memory that the caller lent: the slower, larger one that some microcontrollers have beside the
/// fast one of the map.
///
/// Full, it keeps no more, and the tiles that leave the map are lost and counted. A slot is found by looking at each.
#[derive(Debug)]
pub struct LentArchive<'m, const M: usize, const B: usize> {
    /// A tile that never learned anything is a free slot.
    slots: &'m mut [Tile<2, M, B>],
}

impl<'m, const M: usize, const B: usize> LentArchive<'m, M, B> {
    /// An archive in these slots, each of which must be vacant; none at all is an archive that keeps nothing.
    #[must_use]
    pub fn new(slots: &'m mut [Tile<2, M, B>]) -> Self {
        Self { slots }
    }

    fn find(&mut self, wanted: impl Fn(&Tile<2, M, B>) -> bool) -> Option<&mut Tile<2, M, B>> {
        self.slots.iter_mut().find(|slot| wanted(slot))
    }
}

impl<const M: usize, const B: usize> Archive<2, M, B> for LentArchive<'_, M, B> {
    fn keep(&mut self, tile: &Tile<2, M, B>) -> bool {
        // One that learned nothing begins anew as what it is.
        if tile.updates == 0 {
            return true;
        }
        let Some(free) = self.find(|slot| slot.updates == 0) else { return false };
        free.clone_from_in_place(tile);
        true
    }

    fn bring_back(&mut self, index: &TileIndex<2>, tile: &mut Tile<2, M, B>) -> bool {
        let Some(slot) = self.find(|slot| slot.updates > 0 && slot.index == *index) else { return false };
        tile.clone_from_in_place(slot);
        slot.updates = 0;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(x: i32, updates: u64) -> Tile<2, 4, 2> {
        let mut tile = Tile::VACANT;
        (tile.index, tile.updates) = ([x, -x], updates);
        tile.posterior.mean[0] = x as f32;
        tile
    }

    #[test]
    fn what_was_kept_comes_back_once_and_makes_room() {
        let mut slots = [Tile::VACANT; 2];
        let mut archive = LentArchive::new(&mut slots);
        assert!(archive.keep(&tile(1, 5)) && archive.keep(&tile(2, 6)));
        assert!(!archive.keep(&tile(3, 7)), "full");
        assert!(archive.keep(&tile(4, 0)), "nothing to keep");
        let mut back = Tile::VACANT;
        assert!(!archive.bring_back(&[3, -3], &mut back) && !archive.bring_back(&[4, -4], &mut back));
        assert!(archive.bring_back(&[1, -1], &mut back));
        assert_eq!(back, tile(1, 5));
        assert!(!archive.bring_back(&[1, -1], &mut back), "it is not there twice");
        assert!(archive.keep(&tile(3, 7)));
    }
}
