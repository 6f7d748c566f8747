//! Everything that the program keeps, in static memory of a size known when it is compiled.

use bhm_core::{
    beam::LabelledPlace,
    lattice::Node,
    mapper::{Mapper, Memory},
    posterior::{Entry, RowState, Scratch},
    profile::{COMPACT, Profile},
    settings::SettingsError,
    support::SupportTable,
    tile::{DirectoryEntry, Tile, TileIndex},
};
use bhm_firmware_sim::serial::{LinkBuffers, ReceiveQueue, SentTile};
use static_cell::ConstStaticCell;

/// What the map is made with, and how much of everything there is.
pub const PROFILE: Profile = COMPACT;

/// Supports of a tile.
pub const M: usize = PROFILE.settings.tile_width[0] * PROFILE.settings.tile_width[1];

/// The band: the last node of a stencil comes so many after its first, and the first counts.
pub const B: usize = (PROFILE.settings.stencil - 1) * (PROFILE.settings.tile_width[1] + 1) + 1;

/// Bytes between interrupt and loop: the longest scan, and what a host may say beside it.
const QUEUE_BYTES: usize = 16_384;

const TILES: usize = PROFILE.capacities.tiles;
const PLACES: usize = PROFILE.capacities.points;
const ROWS: usize = PROFILE.capacities.rows;
const TOUCHED: usize = PROFILE.capacities.touched;
const ENTRIES: usize = ROWS * PROFILE.settings.stencil * PROFILE.settings.stencil;

/// Bytes of the map's state: tiles, and what one scan is worked on in.
pub const STATE_BYTES: usize = size_of::<Map>();

/// What a stated budget must hold; the linker checks flash, data and stack (see `build.rs`).
const STATE_BUDGET_BYTES: usize = 4_000_000;
const _: () = assert!(STATE_BYTES <= STATE_BUDGET_BYTES, "the map's state exceeds its budget");

/// The map's memory, array by array.
pub struct Map {
    tiles: [Tile<2, M, B>; TILES],
    directory: [DirectoryEntry; TILES],
    scratch: Scratch<M, B>,
    places: [LabelledPlace; PLACES],
    firsts: [Option<Node<2>>; PLACES],
    touched: [TileIndex<2>; TOUCHED],
    entries: [Entry; ENTRIES],
    states: [RowState; ROWS],
}

/// The link's memory.
pub struct Link {
    /// Frames and parts.
    pub buffers: LinkBuffers,
    /// What the host has.
    pub sent: [SentTile; TILES],
    /// What the interrupt received.
    pub queue: ReceiveQueue<QUEUE_BYTES>,
}

// All zero, or nearly: in `.bss`, which costs no flash.
static MAP: ConstStaticCell<Map> = ConstStaticCell::new(Map {
    tiles: [const { Tile::VACANT }; TILES],
    directory: [DirectoryEntry::VACANT; TILES],
    scratch: Scratch::ZERO,
    places: [LabelledPlace::VACANT; PLACES],
    firsts: [None; PLACES],
    touched: [[0, 0]; TOUCHED],
    entries: [Entry { index: 0, value: 0.0 }; ENTRIES],
    states: [RowState::ZERO; ROWS],
});

static LINK: ConstStaticCell<Link> =
    ConstStaticCell::new(Link { buffers: LinkBuffers::NEW, sent: [SentTile::NONE; TILES], queue: ReceiveQueue::new() });

/// The link's memory.
///
/// # Panics
/// If it was taken before.
pub fn link() -> &'static mut Link {
    LINK.take()
}

/// An empty map in its memory, with the profile's settings; its capacities are those of [`PROFILE`].
///
/// # Errors
/// If the profile contradicts itself, or needs tiles of another shape.
///
/// # Panics
/// If it was taken before.
pub fn mapper(profile: &Profile) -> Result<Mapper<'static, 2, M, B>, SettingsError> {
    let Map { tiles, directory, scratch, places, firsts, touched, entries, states } = MAP.take();
    let supports = SupportTable::EMPTY;
    let memory = Memory { tiles, directory, scratch, places, firsts, touched, entries, states, supports };
    Mapper::new(profile.settings, memory)
}
