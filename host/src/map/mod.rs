//! Maps in a computer's memory: a [`Mapper`](bhm_core::mapper::Mapper) that owns what it works in, and an archive for what its
//! store cannot hold.

mod any;
mod archive;
mod capacity;
mod digest;
mod owned;
mod vectorised;
mod zeroed;

pub use any::{AnyMap, UnknownShape, open, open_with, shape};
pub use archive::TileArchive;
pub(crate) use capacity::check as check_capacities;
pub use capacity::{CapacityError, MAX_TILE_BYTES};
pub use digest::{PosteriorDigest, posterior_digest};
pub use owned::{Everywhere, OwnedMapper, memory_for};
#[cfg(feature = "ipc")]
pub(crate) use vectorised::Vectorised;
pub use zeroed::zeroed_box;
