//! Maps in a computer's memory: a [`Mapper`](bhm_core::mapper::Mapper) that owns what it works in, and an archive for what
//! its store cannot hold.

mod any;
mod archive;
mod owned;

pub use any::{AnyMap, UnknownShape, open};
pub use archive::TileArchive;
pub use owned::{Everywhere, OwnedMapper};
