use std::cmp::Reverse;

use bhm_core::{
    profile::Profile,
    shape::{self, ShapeVisitor},
};

use super::{Extras, FILE_KIND, Snapshot, SnapshotError, header::Header, record};
use crate::{
    map::{OwnedMapper, UnknownShape, check_capacities, zeroed_box},
    supports::Coded,
};

/// Reads a map from the bytes of a map file.
///
/// # Errors
/// What [`SnapshotError`] names; no bytes make this panic, or allocate much more than a map of the stated capacities takes.
pub fn decode(bytes: &[u8]) -> Result<Snapshot, SnapshotError> {
    let contents = FILE_KIND.contents(bytes)?;
    let no_room = || SnapshotError::HeaderValue { name: "length", expected: "one that fits the file" };
    let (header_bytes, contents) = contents.split_first_chunk().ok_or_else(no_room)?;
    let header_bytes = u32::from_le_bytes(*header_bytes) as usize;
    let (header, records) = contents.split_at_checked(header_bytes).ok_or_else(no_room)?;
    let (header, rest) = postcard::take_from_bytes::<Header>(header)
        .map_err(|error| SnapshotError::Header { reason: error.to_string() })?;
    if !rest.is_empty() {
        return Err(no_room());
    }
    header.check()?;
    build(header, records)
}

/// Builds the map of a header whose values are plausible, if there is one of its shape.
fn build(header: Header, records: &[u8]) -> Result<Snapshot, SnapshotError> {
    let model = header.settings.model().map_err(UnknownShape::from)?;
    let shape = (header.settings.supports(), header.settings.band());
    if (header.shape[0] as usize, header.shape[1] as usize) != shape {
        return Err(SnapshotError::HeaderValue { name: "shape", expected: "that of the settings" });
    }
    header.check_indices(&model.tiling)?;
    check_capacities(&header.capacities, shape).map_err(UnknownShape::from)?;
    // Each record is as long as a key is small: this bounds the number of tiles by the length of the file.
    if header.tiles.len().checked_mul(record::record_bytes(shape.0, shape.1)) != Some(records.len()) {
        return Err(SnapshotError::HeaderValue {
            name: "number of tiles",
            expected: "that of the records that follow",
        });
    }
    shape::visit(shape, Restore { header, records }).map_err(UnknownShape::from)?
}

struct Restore<'a> {
    header: Header,
    records: &'a [u8],
}

impl ShapeVisitor for Restore<'_> {
    type Output = Result<Snapshot, SnapshotError>;

    fn visit<const M: usize, const B: usize>(self) -> Self::Output {
        restore::<M, B>(self.header, self.records)
    }
}

fn restore<const M: usize, const B: usize>(header: Header, records: &[u8]) -> Result<Snapshot, SnapshotError> {
    let Header { settings, capacities, supports, profile, path_m, scans, newest_stamp_ns, tiles, .. } = header;
    let named = Profile { name: "", purpose: "", settings, capacities };
    let supports = supports.map(Coded::supports).transpose().map_err(UnknownShape::from)?;
    let mut map = OwnedMapper::<M, B>::with_supports(&named, supports)?;
    map.resume(scans, newest_stamp_ns);
    let mut keyed: Vec<_> = tiles.iter().zip(records.chunks_exact(record::record_bytes(M, B))).collect();
    // The store evicts the least recently touched, the lowest index first: what it held are the last in that order.
    keyed.sort_unstable_by_key(|(key, _)| Reverse((key.touched_at, key.index)));
    let mut tile = zeroed_box::<bhm_core::tile::Tile<2, M, B>>();
    for (key, record) in keyed {
        (tile.index, tile.updates, tile.touched_at) = (key.index, key.updates, key.touched_at);
        record::read(record, &mut tile.posterior)
            .map_err(|expected| SnapshotError::Tile { index: key.index, expected })?;
        map.restore_tile(&tile);
    }
    Ok(Snapshot { map: Box::new(map), extras: Extras { profile, path_m } })
}
