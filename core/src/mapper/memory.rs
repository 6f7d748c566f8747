use crate::{
    beam::LabelledPlace,
    lattice::Node,
    posterior::{Entry, RowState, Scratch},
    settings::SettingsError,
    support::SupportTable,
    tile::{DirectoryEntry, Tile, TileIndex, TileStore},
};

/// All memory a mapper uses, lent by the caller: a `static` on a microcontroller, one zeroed allocation on a computer.
///
/// A capacity is the length of what was lent.
#[derive(Debug)]
pub struct Memory<'m, const M: usize, const B: usize> {
    /// Tile slots; what they hold is overwritten.
    pub tiles: &'m mut [Tile<M, B>],
    /// One per tile slot.
    pub directory: &'m mut [DirectoryEntry],
    /// Working memory, shared by all tiles.
    pub scratch: &'m mut Scratch<M, B>,
    /// Observations of one scan.
    pub places: &'m mut [LabelledPlace],
    /// The stencil of each; as many as places.
    pub firsts: &'m mut [Option<Node<2>>],
    /// Tiles that one scan may touch.
    pub touched: &'m mut [TileIndex<2>],
    /// Non-zeros of the rows of one scan in one tile: rows times `stencil²`.
    pub entries: &'m mut [Entry],
    /// Rows of one scan in one tile.
    pub states: &'m mut [RowState],
    /// Supports of their own for some nodes, as learned from a first pass over a log; read only.
    pub supports: SupportTable<'m, 2>,
}

/// The part of [`Memory`] that holds nothing from one scan to the next.
#[derive(Debug)]
pub struct Workspace<'m, const M: usize, const B: usize> {
    pub(super) scratch: &'m mut Scratch<M, B>,
    pub(super) places: &'m mut [LabelledPlace],
    pub(super) firsts: &'m mut [Option<Node<2>>],
    pub(super) touched: &'m mut [TileIndex<2>],
    pub(super) entries: &'m mut [Entry],
    pub(super) states: &'m mut [RowState],
}

impl<'m, const M: usize, const B: usize> Memory<'m, M, B> {
    pub(super) fn split(self) -> Result<(TileStore<'m, M, B>, Workspace<'m, M, B>), SettingsError> {
        let Self { tiles, directory, scratch, places, firsts, touched, entries, states, supports: _ } = self;
        let places_len = places.len().min(firsts.len());
        for (what, length) in [
            ("tiles", tiles.len().min(directory.len())),
            ("places", places_len),
            ("touched", touched.len()),
            ("entries", entries.len()),
            ("states", states.len()),
        ] {
            if length == 0 {
                return Err(SettingsError::NoMemory { what });
            }
        }
        let work = Workspace {
            scratch,
            places: &mut places[..places_len],
            firsts: &mut firsts[..places_len],
            touched,
            entries,
            states,
        };
        Ok((TileStore::new(tiles, directory), work))
    }
}
