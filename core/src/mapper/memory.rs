use super::{
    sorting::{Link, TouchedTile},
    work::{ObservationSlot, Workspace},
};
use crate::{
    posterior::{Posterior, RowState, Scratch},
    settings::{Settings, SettingsError},
    storage::Storage,
    support::SupportTable,
    tile::{DirectoryEntry, Tile, TileStore},
};

/// All memory a mapper uses, owned or lent: a [`StaticMemory`] on a microcontroller, zeroed allocations on a computer.
///
/// A capacity is the length of what is given.
#[derive(Debug)]
pub struct Memory<'m, const D: usize, const M: usize, const B: usize> {
    /// Tile slots; what they hold is overwritten.
    pub tiles: Storage<'m, [Tile<D, M, B>]>,
    /// One per tile slot.
    pub directory: Storage<'m, [DirectoryEntry<D>]>,
    /// What is believed of a tile before any scan, shared by all tiles.
    pub prior: Storage<'m, Posterior<M, B>>,
    /// Working memory, shared by all tiles.
    pub scratch: Storage<'m, Scratch<M, B>>,
    /// Observations of one scan.
    pub observations: Storage<'m, [ObservationSlot<D>]>,
    /// Their features: as many for each observation as a stencil has nodes.
    pub features: Storage<'m, [f32]>,
    /// In which tiles observations lie: `2ᴰ` for each observation.
    pub links: Storage<'m, [Link]>,
    /// Tiles that one scan may touch.
    pub touched: Storage<'m, [TouchedTile<D>]>,
    /// Rows of one scan in one tile.
    pub rows: Storage<'m, [RowState]>,
    /// Supports of their own for some nodes, as learned from a first pass over a log; read only.
    pub supports: SupportTable<'m, D>,
}

impl<'m, const D: usize, const M: usize, const B: usize> Memory<'m, D, M, B> {
    /// The store, and what one scan is worked on in.
    pub(super) fn split(
        self,
        settings: &Settings<D>,
    ) -> Result<(TileStore<'m, D, M, B>, Workspace<'m, D, M, B>), SettingsError> {
        let Self { tiles, directory, prior, scratch, observations, features, links, touched, rows, supports: _ } = self;
        let capacity = observations.len().min(features.len() / settings.stencil_nodes()).min(links.len() >> D);
        for (what, length) in [
            ("tiles", tiles.len().min(directory.len())),
            ("observations", capacity),
            ("touched tiles", touched.len()),
            ("rows", rows.len()),
        ] {
            if length == 0 {
                return Err(SettingsError::NoMemory { what });
            }
        }
        let work = Workspace { prior, scratch, observations, features, links, touched, rows, capacity };
        Ok((TileStore::new(tiles, directory), work))
    }
}

/// A mapper's memory of a size known when the program is compiled, for a `static`: all of it zero, so that it costs no flash.
///
/// [`static_memory!`](crate::static_memory) gives the type that fits a profile of the plane.
///
/// ```
/// use bhm_core::{geometry::Pose, map::Map, mapper::Mapper, profile::COMPACT, scan::{Scan, ScanHeader}, tile::NoArchive};
///
/// // On a microcontroller: a `static` in a cell that is taken once.
/// let mut memory = Box::new(<bhm_core::static_memory!(COMPACT)>::ZERO);
/// let mut mapper = Mapper::new(COMPACT.settings, memory.lend())?;
///
/// let header = ScanHeader {
///     map_from_sensor: Pose::new(0.0, 0.0, 0.0),
///     angle_min_rad: -0.5,
///     angle_increment_rad: 0.1,
///     range_max_m: 30.0,
///     ..ScanHeader::default()
/// };
/// mapper.integrate(&Scan { header, ranges_m: &[2.0; 11] }, &mut NoArchive).unwrap();
/// assert!(mapper.view().occupancy(&[2.0, 0.0].into()).probability > 0.5, "a wall ahead");
/// # Ok::<(), bhm_core::settings::SettingsError>(())
/// ```
#[derive(Debug)]
pub struct StaticMemory<
    const D: usize,
    const M: usize,
    const B: usize,
    const TILES: usize,
    const OBSERVATIONS: usize,
    const NODES: usize,
    const CORNERS: usize,
    const TOUCHED: usize,
    const ROWS: usize,
> {
    tiles: [Tile<D, M, B>; TILES],
    directory: [DirectoryEntry<D>; TILES],
    prior: Posterior<M, B>,
    scratch: Scratch<M, B>,
    observations: [ObservationSlot<D>; OBSERVATIONS],
    features: [[f32; NODES]; OBSERVATIONS],
    links: [[Link; CORNERS]; OBSERVATIONS],
    touched: [TouchedTile<D>; TOUCHED],
    rows: [RowState; ROWS],
}

impl<
    const D: usize,
    const M: usize,
    const B: usize,
    const TILES: usize,
    const OBSERVATIONS: usize,
    const NODES: usize,
    const CORNERS: usize,
    const TOUCHED: usize,
    const ROWS: usize,
> StaticMemory<D, M, B, TILES, OBSERVATIONS, NODES, CORNERS, TOUCHED, ROWS>
{
    /// Memory without a map.
    pub const ZERO: Self = Self {
        tiles: [const { Tile::VACANT }; TILES],
        directory: [DirectoryEntry::VACANT; TILES],
        prior: Posterior::ZERO,
        scratch: Scratch::ZERO,
        observations: [ObservationSlot::VACANT; OBSERVATIONS],
        features: [[0.0; NODES]; OBSERVATIONS],
        links: [[Link::VACANT; CORNERS]; OBSERVATIONS],
        touched: [TouchedTile::VACANT; TOUCHED],
        rows: [RowState::ZERO; ROWS],
    };

    /// The memory as a mapper takes it, without supports of their own for any node.
    pub fn lend(&mut self) -> Memory<'_, D, M, B> {
        let Self { tiles, directory, prior, scratch, observations, features, links, touched, rows } = self;
        Memory {
            tiles: Storage::Lent(tiles),
            directory: Storage::Lent(directory),
            prior: Storage::Lent(prior),
            scratch: Storage::Lent(scratch),
            observations: Storage::Lent(observations),
            features: Storage::Lent(features.as_flattened_mut()),
            links: Storage::Lent(links.as_flattened_mut()),
            touched: Storage::Lent(touched),
            rows: Storage::Lent(rows),
            supports: SupportTable::EMPTY,
        }
    }
}

/// The type of [`StaticMemory`](crate::mapper::StaticMemory) that fits a profile, which must be a constant.
#[macro_export]
macro_rules! static_memory {
    ($profile:expr) => {
        $crate::mapper::StaticMemory<
            2,
            { $profile.settings.supports() },
            { $profile.settings.band() },
            { $profile.capacities.tiles },
            { $profile.capacities.observations },
            { $profile.settings.stencil_nodes() },
            4,
            { $profile.capacities.touched },
            { $profile.capacities.rows },
        >
    };
}
