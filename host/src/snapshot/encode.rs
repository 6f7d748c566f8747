use std::io::{self, Write};

use super::{
    CHECKSUM_BYTES, Extras, MAGIC, PREFIX_BYTES, VERSION,
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
    let length = PREFIX_BYTES + header.len() + tiles.len() * record::record_bytes(M, B) + CHECKSUM_BYTES;

    let mut to = Checksummed { to, hasher: crc32fast::Hasher::new() };
    to.write_all(&MAGIC)?;
    to.write_all(&VERSION.to_le_bytes())?;
    to.write_all(&(length as u64).to_le_bytes())?;
    to.write_all(&u32::try_from(header.len()).map_err(io::Error::other)?.to_le_bytes())?;
    to.write_all(&header)?;
    for tile in tiles {
        record::write(&tile.posterior, &mut to)?;
    }
    let Checksummed { to, hasher } = to;
    to.write_all(&hasher.finalize().to_le_bytes())
}

/// Passes bytes on and keeps their checksum.
struct Checksummed<'a> {
    to: &'a mut dyn Write,
    hasher: crc32fast::Hasher,
}

impl Write for Checksummed<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.to.write(bytes)?;
        self.hasher.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}
