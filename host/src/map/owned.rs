use bhm_core::{
    beam::Observation,
    geometry::Point,
    map::{Map, ModelledMap, Occupancy, TileRef, Viewed},
    mapper::{IntegrateReport, Link, Mapper, Memory, ObservationSlot, TouchedTile},
    posterior::{Posterior, PosteriorView, RowState, Scratch},
    profile::{Capacities, Profile},
    scan::{Scan, ScanRejected},
    settings::{Model, SettingsError},
    tile::{Archive, DirectoryEntry, MapView, Tile, TileIndex, TileSource, TileStore},
};

use pulp::Arch;

use super::{
    TileArchive, UnknownShape,
    vectorised::{Integrate, Learned, Vectorised},
    zeroed::{zeroed_box, zeroed_slice},
};
use crate::supports::{LearnedSupports, table_of};

/// The memory that a profile asks for, on the heap, without a map in it.
///
/// The settings must be usable: what is allocated is sized by them.
#[must_use]
pub fn memory_for<const M: usize, const B: usize>(
    profile: &Profile,
    supports: Option<&LearnedSupports>,
) -> Memory<'static, 2, M, B> {
    let Capacities { tiles, observations, rows, touched } = profile.capacities;
    Memory {
        tiles: zeroed_slice::<Tile<2, M, B>>(tiles).into(),
        directory: boxed(DirectoryEntry::VACANT, tiles).into(),
        prior: zeroed_box::<Posterior<M, B>>().into(),
        scratch: zeroed_box::<Scratch<M, B>>().into(),
        observations: boxed(ObservationSlot::VACANT, observations).into(),
        features: boxed(0.0, observations * profile.settings.stencil_nodes()).into(),
        links: boxed(Link::VACANT, observations << 2).into(),
        touched: boxed(TouchedTile::VACANT, touched).into(),
        rows: boxed(RowState::ZERO, rows).into(),
        supports: table_of(supports),
    }
}

fn boxed<T: Clone>(value: T, len: usize) -> Box<[T]> {
    vec![value; len].into_boxed_slice()
}

/// Bytes of a mapper's memory.
fn bytes_of<const M: usize, const B: usize>(memory: &Memory<'_, 2, M, B>) -> usize {
    let Memory { tiles, directory, prior, scratch, observations, features, links, touched, rows, supports: _ } = memory;
    size_of_val(&**tiles)
        + size_of_val(&**directory)
        + size_of_val(&**prior)
        + size_of_val(&**scratch)
        + size_of_val(&**observations)
        + size_of_val(&**features)
        + size_of_val(&**links)
        + size_of_val(&**touched)
        + size_of_val(&**rows)
}

/// A mapper that owns its memory, and an archive for the tiles that leave its store.
///
/// ```
/// use bhm_core::{geometry::Pose, map::Map, profile::INDOOR, scan::{Scan, ScanHeader}};
/// use bhm_host::map::OwnedMapper;
///
/// let mut map = OwnedMapper::<144, 40>::new(&INDOOR)?;
/// let header = ScanHeader {
///     map_from_sensor: Pose::new(0.0, 0.0, 0.0),
///     angle_min_rad: -0.5,
///     angle_increment_rad: 0.1,
///     range_max_m: 30.0,
///     ..ScanHeader::default()
/// };
/// map.integrate(&Scan { header, ranges_m: &[2.0; 11] }).unwrap();
/// assert!(map.occupancy(&[2.0, 0.0].into()).probability > 0.5, "a wall ahead");
/// # Ok::<(), bhm_core::settings::SettingsError>(())
/// ```
pub struct OwnedMapper<const M: usize, const B: usize> {
    mapper: Mapper<'static, 2, M, B>,
    archive: TileArchive<M, B>,
    supports: Option<LearnedSupports>,
    capacities: Capacities,
    bytes: usize,
}

impl<const M: usize, const B: usize> OwnedMapper<M, B> {
    /// An empty map with a profile's settings and capacities.
    ///
    /// # Errors
    /// Settings that contradict themselves or do not fit `M` and `B`.
    pub fn new(profile: &Profile) -> Result<Self, SettingsError> {
        Self::build(profile, None)
    }

    /// The same with supports of their own for some nodes.
    ///
    /// # Errors
    /// Also if the supports were learned on another lattice.
    pub fn with_supports(profile: &Profile, supports: Option<LearnedSupports>) -> Result<Self, UnknownShape> {
        supports.as_ref().map_or(Ok(()), |supports| supports.matches(&profile.settings))?;
        Ok(Self::build(profile, supports)?)
    }

    fn build(profile: &Profile, supports: Option<LearnedSupports>) -> Result<Self, SettingsError> {
        // Checked before anything is sized by it.
        profile.settings.model_with(table_of(supports.as_ref()))?.tiling.check(M, B)?;
        let memory = memory_for(profile, supports.as_ref());
        let bytes = bytes_of(&memory);
        let mapper = Mapper::new(profile.settings, memory)?;
        Ok(Self { mapper, archive: TileArchive::default(), supports, capacities: profile.capacities, bytes })
    }

    /// The mapper.
    #[must_use]
    pub fn mapper(&self) -> &Mapper<'static, 2, M, B> {
        &self.mapper
    }

    /// The tiles that left the store.
    #[must_use]
    pub fn archive(&self) -> &TileArchive<M, B> {
        &self.archive
    }

    /// How much memory it was given.
    #[must_use]
    pub fn capacities(&self) -> &Capacities {
        &self.capacities
    }

    /// The supports of their own that some nodes have.
    #[must_use]
    pub fn supports(&self) -> Option<&LearnedSupports> {
        self.supports.as_ref()
    }

    /// Every tile, resident or archived, in ascending order of index.
    #[must_use]
    pub fn all_tiles(&self) -> Vec<&Tile<2, M, B>> {
        Everywhere { store: self.mapper.tiles(), archive: &self.archive }.tiles()
    }

    /// Bytes allocated at the start: everything but the archive.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// Every tile, resident or archived, as one map.
    #[must_use]
    pub fn view(&self) -> MapView<'_, Everywhere<'_, M, B>, 2, M, B> {
        let Self { mapper, archive, .. } = self;
        mapper.model().view(mapper.prior(), Everywhere { store: mapper.tiles(), archive })
    }

    /// Learns a scan; see [`Mapper::integrate`].
    ///
    /// # Errors
    /// If the scan as a whole is not usable.
    pub fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected> {
        let Self { mapper, archive, .. } = self;
        Arch::new().dispatch(Integrate { mapper, archive, learned: Learned::Scan(scan) })
    }

    /// Learns labelled observations; see [`Mapper::integrate_observations`].
    ///
    /// # Errors
    /// If there are more than the memory holds.
    pub fn integrate_observations(&mut self, observations: &[Observation<2>]) -> Result<IntegrateReport, ScanRejected> {
        let Self { mapper, archive, .. } = self;
        Arch::new().dispatch(Integrate { mapper, archive, learned: Learned::Observations(observations) })
    }

    /// Continues a saved map, whose tiles are then restored one by one.
    pub fn resume(&mut self, scans: u64, newest_stamp_ns: u64) {
        self.mapper.resume(scans, newest_stamp_ns);
    }

    /// Puts a saved tile back: into the store while it has room, else into the archive.
    pub fn restore_tile(&mut self, tile: &Tile<2, M, B>) {
        if self.mapper.restore_tile(tile).is_err() {
            self.archive.keep(tile);
        }
    }
}

impl<const M: usize, const B: usize> ModelledMap<2> for OwnedMapper<M, B> {
    fn model(&self) -> &Model<'_, 2> {
        self.mapper.model()
    }

    fn unobserved_at(&self, point_m: &Point<2>) -> Occupancy {
        self.view().unobserved_at(point_m)
    }
}

impl<const M: usize, const B: usize> Viewed<2> for OwnedMapper<M, B> {
    fn as_map(&self) -> impl Map<2> + '_ {
        Vectorised(self.view())
    }
}

/// Tiles wherever they are: in the store or in the archive.
#[derive(Clone, Copy, Debug)]
pub struct Everywhere<'a, const M: usize, const B: usize> {
    store: &'a TileStore<'static, 2, M, B>,
    archive: &'a TileArchive<M, B>,
}

impl<'a, const M: usize, const B: usize> Everywhere<'a, M, B> {
    /// In ascending order of index.
    fn tiles(self) -> Vec<&'a Tile<2, M, B>> {
        let mut tiles: Vec<_> = self.store.iter().chain(self.archive.iter()).collect();
        tiles.sort_unstable_by_key(|tile| tile.index);
        tiles
    }
}

impl<const M: usize, const B: usize> TileSource<2, M, B> for Everywhere<'_, M, B> {
    fn posterior(&self, index: &TileIndex<2>) -> Option<PosteriorView<'_, M, B>> {
        self.store.get(index).or_else(|| self.archive.get(index)).map(|tile| tile.posterior.view())
    }

    fn for_each_tile(&self, visit: &mut dyn FnMut(&TileRef<'_, 2>)) {
        self.tiles().into_iter().for_each(|tile| visit(&tile.as_ref()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bhm_core::profile::COMPACT;

    #[test]
    fn tiles_are_shown_in_order_wherever_they_are() {
        let profile = Profile { capacities: Capacities { tiles: 7, ..COMPACT.capacities }, ..COMPACT };
        let mut map = OwnedMapper::<144, 40>::new(&profile).unwrap();
        let mut state = 1_u32;
        for scan in 1..=60 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let at = [(state >> 20) as f32 % 16.0 - 8.0, (state >> 26) as f32 % 16.0 - 8.0];
            map.integrate_observations(&[Observation::at_point(at.into(), true)]).unwrap();
            let mut shown = Vec::new();
            map.for_each_tile(&mut |tile| shown.push((tile.index, tile.updates, tile.touched_at, tile.mean.to_vec())));
            let tiles = map.mapper().tiles().iter().chain(map.archive().iter());
            let mut expected: Vec<_> =
                tiles.map(|tile| (tile.index, tile.updates, tile.touched_at, tile.posterior.mean.to_vec())).collect();
            expected.sort_unstable_by_key(|tile| tile.0);
            assert_eq!(shown, expected, "after {scan} scans");
        }
        let resident: Vec<_> = map.mapper().tiles().iter().map(|tile| tile.index).collect();
        let archived: Vec<_> = map.archive().iter().map(|tile| tile.index).collect();
        assert!(archived.iter().any(|index| *index < resident[0]) && archived.iter().any(|index| *index > resident[0]));
        assert!(archived.iter().any(|index| *index > resident[resident.len() - 1]), "{resident:?} {archived:?}");
    }
}
