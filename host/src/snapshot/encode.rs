use std::io::{self, Write};

use super::{
    Extras, FILE_KIND,
    header::{Header, TileKey},
    record,
};
use crate::{map::OwnedMapper, supports::Coded};

/// Writes a map in the format of this module.
pub(crate) fn write<const M: usize, const B: usize>(
    map: &OwnedMapper<M, B>,
    extras: &Extras,
    to: &mut dyn Write,
) -> io::Result<()> {
    let mapper = map.mapper();
    let tiles = map.all_tiles();
    let header = Header {
        shape: [M as u32, B as u32],
        settings: *mapper.settings(),
        capacities: *map.capacities(),
        supports: map.supports().map(Coded::of),
        profile: extras.profile.clone(),
        path_m: extras.path_m.clone(),
        scans: mapper.scans(),
        newest_stamp_ns: mapper.newest_stamp_ns(),
        tiles: tiles
            .iter()
            .map(|tile| TileKey { index: tile.index, updates: tile.updates, touched_at: tile.touched_at })
            .collect(),
    };
    let header = postcard::to_allocvec(&header).map_err(io::Error::other)?;
    let header_bytes = u32::try_from(header.len()).map_err(io::Error::other)?.to_le_bytes();
    let contents_bytes = header_bytes.len() + header.len() + tiles.len() * record::record_bytes(M, B);
    FILE_KIND.write(contents_bytes, to, |to| {
        to.write_all(&header_bytes)?;
        to.write_all(&header)?;
        tiles.iter().try_for_each(|tile| record::write(&tile.posterior, to))
    })
}
