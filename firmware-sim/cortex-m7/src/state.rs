//! Everything that the program keeps, in static memory of a size known when it is compiled.

use bhm_core::{
    mapper::Mapper,
    profile::{COMPACT, Profile},
    settings::SettingsError,
    static_memory,
};
use bhm_firmware_sim::serial::{LinkBuffers, ReceiveQueue, SentTile};
use static_cell::ConstStaticCell;

/// What the map is made with, and how much of everything there is.
pub const PROFILE: Profile = COMPACT;

/// Supports of a tile.
pub const M: usize = PROFILE.settings.supports();

/// The band of a tile.
pub const B: usize = PROFILE.settings.band();

/// Bytes between interrupt and loop: the longest scan, and what a host may say beside it.
const QUEUE_BYTES: usize = 16_384;

/// The map's memory: tiles, and what one scan is worked on in.
type Memory = static_memory!(PROFILE);

/// Bytes of the map's state.
pub const STATE_BYTES: usize = size_of::<Memory>();

/// What a stated budget must hold; the linker checks flash, data and stack (see `build.rs`).
const STATE_BUDGET_BYTES: usize = 4_000_000;
const _: () = assert!(STATE_BYTES <= STATE_BUDGET_BYTES, "the map's state exceeds its budget");

/// The link's memory.
pub struct Link {
    /// Frames and parts.
    pub buffers: LinkBuffers,
    /// What the host has.
    pub sent: [SentTile; PROFILE.capacities.tiles],
    /// What the interrupt received.
    pub queue: ReceiveQueue<QUEUE_BYTES>,
}

// All zero, or nearly: in `.bss`, which costs no flash.
static MAP: ConstStaticCell<Memory> = ConstStaticCell::new(Memory::ZERO);

static LINK: ConstStaticCell<Link> = ConstStaticCell::new(Link {
    buffers: LinkBuffers::NEW,
    sent: [SentTile::NONE; PROFILE.capacities.tiles],
    queue: ReceiveQueue::new(),
});

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
    Mapper::new(profile.settings, MAP.take().lend())
}
