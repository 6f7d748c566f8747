use bhm_core::{
    lattice::MAX_NODE,
    profile::Capacities,
    settings::Settings,
    tile::{TileIndex, Tiling},
};
use serde::{Deserialize, Serialize};

use super::SnapshotError;
use crate::supports::Coded;

/// Widest tile, in supports a side, that is considered at all: far beyond any that is compiled, so that sizes cannot overflow.
const MAX_SIDE: usize = 1 << 12;

/// Longest name of a profile, bytes.
const MAX_NAME_BYTES: usize = 64;

/// Everything but the posteriors.
#[derive(Serialize, Deserialize)]
pub(super) struct Header {
    /// `M` and `B`.
    pub(super) shape: [u32; 2],
    pub(super) settings: Settings,
    pub(super) capacities: Capacities,
    /// Supports of their own that some nodes have.
    pub(super) supports: Option<Coded>,
    pub(super) profile: String,
    pub(super) path_m: Vec<[f32; 2]>,
    pub(super) scans: u64,
    pub(super) newest_stamp_ns: u64,
    /// Ascending by index.
    pub(super) tiles: Vec<TileKey>,
}

/// What a tile is besides its posterior.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct TileKey {
    pub(super) index: TileIndex<2>,
    pub(super) updates: u64,
    pub(super) touched_at: u64,
}

impl Header {
    /// Checks the values of the header before anything is built from them.
    ///
    /// # Errors
    /// The first value out of its range.
    pub(super) fn check(&self) -> Result<(), SnapshotError> {
        let tile = &self.settings.tile;
        let sides = tile.width.iter().chain(&tile.stride);
        for (name, expected, good) in [
            ("tile size", "at most 4096 supports a side", sides.clone().all(|side| *side <= MAX_SIDE)),
            ("stencil", "at most 4096 supports a side", tile.stencil <= MAX_SIDE),
            ("profile", "a name of at most 64 bytes", is_name(&self.profile)),
            ("path", "finite numbers", self.path_m.as_flattened().iter().all(|metres| metres.is_finite())),
            ("tiles", "each index once, in ascending order", self.tiles.is_sorted_by(|a, b| a.index < b.index)),
            ("tiles", "no tile touched after the last scan", self.tiles.iter().all(|t| t.touched_at <= self.scans)),
        ] {
            if !good {
                return Err(SnapshotError::HeaderValue { name, expected });
            }
        }
        Ok(())
    }

    /// Whether every tile is one that the tiling has.
    pub(super) fn check_indices(&self, tiling: &Tiling<2>) -> Result<(), SnapshotError> {
        let reachable = |index: &TileIndex<2>| {
            index.iter().zip(tiling.stride).zip(tiling.width).all(|((at, stride), width)| {
                (i64::from(*at) * stride as i64).abs() <= i64::from(MAX_NODE) + width as i64
            })
        };
        match self.tiles.iter().find(|tile| !reachable(&tile.index) || !tiling.contains(&tile.index)) {
            Some(tile) => Err(SnapshotError::Tile { index: tile.index, expected: "a place within the map's limits" }),
            None => Ok(()),
        }
    }
}

fn is_name(name: &str) -> bool {
    name.len() <= MAX_NAME_BYTES && !name.chars().any(char::is_control)
}
