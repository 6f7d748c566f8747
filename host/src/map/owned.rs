use std::ptr::NonNull;

use bhm_core::{
    beam::LabelledPlace,
    geometry::Point,
    lattice::Node,
    mapper::{IntegrateReport, Mapper, Memory, ScanRejected},
    posterior::{Entry, Posterior, PosteriorView, RowState, Scratch},
    profile::{Capacities, Profile},
    scan::Scan,
    settings::{Model, SettingsError},
    tile::{Archive, DirectoryEntry, MapView, Tile, TileIndex, TileSource, TileStore},
};

use super::{TileArchive, UnknownShape};
use crate::supports::{LearnedSupports, table_of};

/// A value that is plain numbers: all-zero bytes are valid.
///
/// # Safety
/// The type must be made of integers, floating-point numbers and arrays of them only.
unsafe trait PlainNumbers {}

// SAFETY: a tile is integers, floats and arrays of floats; its own documentation says that zero is a vacant tile.
unsafe impl<const M: usize, const B: usize> PlainNumbers for Tile<M, B> {}
// SAFETY: a posterior is floats and arrays of floats.
unsafe impl<const M: usize, const B: usize> PlainNumbers for Posterior<M, B> {}
// SAFETY: scratch is floats and arrays of floats.
unsafe impl<const M: usize, const B: usize> PlainNumbers for Scratch<M, B> {}

/// Zeroed memory of a tile, a posterior or scratch: nothing large crosses the stack.
#[expect(private_bounds, reason = "the trait is this module's own list of types that may be zeroed")]
#[must_use]
pub fn zeroed_box<T: PlainNumbers>() -> Box<T> {
    // SAFETY: the bytes are zero, which `PlainNumbers` says is a value of T.
    unsafe { Box::<T>::new_zeroed().assume_init() }
}

fn zeroed_slice<T: PlainNumbers>(len: usize) -> Box<[T]> {
    // SAFETY: the bytes are zero, which `PlainNumbers` says is a value of T.
    unsafe { Box::<[T]>::new_zeroed_slice(len).assume_init() }
}

/// What a mapper works in. Allocated zeroed and in place: nothing large crosses the stack, and memory that is never
/// touched is never committed.
struct Storage<const M: usize, const B: usize> {
    tiles: Box<[Tile<M, B>]>,
    directory: Vec<DirectoryEntry>,
    scratch: Box<Scratch<M, B>>,
    places: Vec<LabelledPlace>,
    firsts: Vec<Option<Node<2>>>,
    touched: Vec<TileIndex<2>>,
    entries: Vec<Entry>,
    states: Vec<RowState>,
}

impl<const M: usize, const B: usize> Storage<M, B> {
    fn new(capacities: &Capacities, stencil: usize) -> Self {
        let Capacities { tiles, points, rows, touched } = *capacities;
        Self {
            tiles: zeroed_slice(tiles),
            directory: vec![DirectoryEntry::default(); tiles],
            scratch: zeroed_box(),
            places: vec![LabelledPlace::default(); points],
            firsts: vec![None; points],
            touched: vec![[0; 2]; touched],
            entries: vec![Entry::default(); rows * stencil * stencil],
            states: vec![RowState::default(); rows],
        }
    }

    fn lend(&mut self, supports: Option<&'static LearnedSupports>) -> Memory<'_, M, B> {
        Memory {
            tiles: &mut self.tiles,
            directory: &mut self.directory,
            scratch: &mut self.scratch,
            places: &mut self.places,
            firsts: &mut self.firsts,
            touched: &mut self.touched,
            entries: &mut self.entries,
            states: &mut self.states,
            supports: table_of(supports),
        }
    }

    fn bytes(&self) -> usize {
        size_of_val(&*self.tiles)
            + size_of_val(&*self.directory)
            + size_of_val(&*self.scratch)
            + size_of_val(&*self.places)
            + size_of_val(&*self.firsts)
            + size_of_val(&*self.touched)
            + size_of_val(&*self.entries)
            + size_of_val(&*self.states)
    }
}

/// A mapper together with its memory, and an archive for the tiles that leave its store.
pub struct OwnedMapper<const M: usize, const B: usize> {
    /// Borrows from `storage`, whatever its lifetime says; never handed out with that lifetime.
    mapper: Mapper<'static, M, B>,
    archive: TileArchive<M, B>,
    storage: NonNull<Storage<M, B>>,
    supports: Option<&'static LearnedSupports>,
    model: Model<'static>,
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
    pub fn with_supports(profile: &Profile, supports: Option<&'static LearnedSupports>) -> Result<Self, UnknownShape> {
        supports.map_or(Ok(()), |supports| supports.matches(&profile.settings))?;
        Ok(Self::build(profile, supports)?)
    }

    fn build(profile: &Profile, supports: Option<&'static LearnedSupports>) -> Result<Self, SettingsError> {
        // Checked before anything is sized by it.
        let model = profile.settings.model_with(table_of(supports))?;
        let storage = Box::new(Storage::new(&profile.capacities, profile.settings.stencil));
        let bytes = storage.bytes();
        let storage = NonNull::from(Box::leak(storage));
        // SAFETY: the storage was just leaked, so this is the only borrow of it; it lives until `drop`, which happens after
        // the last use of the mapper, and no method hands the mapper out with the lifetime 'static.
        let memory = unsafe { (*storage.as_ptr()).lend(supports) };
        match Mapper::new(profile.settings, memory) {
            Ok(mapper) => Ok(Self {
                mapper,
                archive: TileArchive::default(),
                storage,
                supports,
                model,
                capacities: profile.capacities,
                bytes,
            }),
            Err(error) => {
                // SAFETY: leaked above, and the mapper that borrowed it does not exist.
                drop(unsafe { Box::from_raw(storage.as_ptr()) });
                Err(error)
            }
        }
    }

    /// The mapper.
    #[must_use]
    pub fn mapper<'a>(&'a self) -> &'a Mapper<'a, M, B> {
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
    pub fn supports(&self) -> Option<&'static LearnedSupports> {
        self.supports
    }

    /// The functions that queries use.
    #[must_use]
    pub fn model(&self) -> Model<'static> {
        self.model
    }

    /// Every tile, resident or archived, in ascending order of index.
    #[must_use]
    pub fn all_tiles(&self) -> Vec<&Tile<M, B>> {
        let mut tiles: Vec<_> = self.mapper.tiles().iter().chain(self.archive.iter()).collect();
        tiles.sort_unstable_by_key(|tile| tile.index);
        tiles
    }

    /// Bytes allocated at the start: everything but the archive.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// Every tile, resident or archived, as one map.
    #[must_use]
    pub fn view(&self) -> MapView<'_, Everywhere<'_, M, B>, M, B> {
        let tiles = Everywhere { store: self.mapper.tiles(), archive: &self.archive };
        MapView { basis: self.mapper.basis(), tiling: self.mapper.tiling(), prior: self.mapper.prior(), tiles }
    }

    /// Learns a scan; see [`Mapper::integrate`].
    ///
    /// # Errors
    /// If the scan as a whole is not usable.
    pub fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected> {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { integrate_avx2(&mut self.mapper, scan, &mut self.archive) };
        }
        self.mapper.integrate(scan, &mut self.archive)
    }

    /// Learns labelled points; see [`Mapper::integrate_points`].
    ///
    /// # Errors
    /// If they do not fit the lent memory, or labels are missing.
    pub fn integrate_points(
        &mut self,
        points_m: &[Point<2>],
        occupied: &[bool],
    ) -> Result<IntegrateReport, ScanRejected> {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { integrate_points_avx2(&mut self.mapper, points_m, occupied, &mut self.archive) };
        }
        self.mapper.integrate_points(points_m, occupied, &mut self.archive)
    }

    /// Continues a saved map: counters, and every tile, those that do not fit the store going to the archive.
    pub fn resume<'t>(&mut self, scans: u64, newest_stamp_ns: u64, tiles: impl IntoIterator<Item = &'t Tile<M, B>>) {
        self.mapper.resume(scans, newest_stamp_ns);
        for tile in tiles {
            self.restore_tile(tile);
        }
    }

    /// Puts a saved tile back: into the store while it has room, else into the archive.
    pub fn restore_tile(&mut self, tile: &Tile<M, B>) {
        if self.mapper.restore_tile(tile).is_err() {
            self.archive.keep(tile);
        }
    }
}

impl<const M: usize, const B: usize> Drop for OwnedMapper<M, B> {
    fn drop(&mut self) {
        // SAFETY: leaked in `new`; the mapper that borrows it has no destructor and is not used again.
        drop(unsafe { Box::from_raw(self.storage.as_ptr()) });
    }
}

// SAFETY: the storage is reached through the mapper alone, which this value owns.
unsafe impl<const M: usize, const B: usize> Send for OwnedMapper<M, B> {}

/// The same inlined core, compiled for wider vectors. No fused multiply–add: the results are the same bit for bit.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn integrate_avx2<const M: usize, const B: usize>(
    mapper: &mut Mapper<'_, M, B>,
    scan: &Scan<'_>,
    archive: &mut TileArchive<M, B>,
) -> Result<IntegrateReport, ScanRejected> {
    mapper.integrate(scan, archive)
}

/// See [`integrate_avx2`].
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn integrate_points_avx2<const M: usize, const B: usize>(
    mapper: &mut Mapper<'_, M, B>,
    points_m: &[Point<2>],
    occupied: &[bool],
    archive: &mut TileArchive<M, B>,
) -> Result<IntegrateReport, ScanRejected> {
    mapper.integrate_points(points_m, occupied, archive)
}

/// Tiles wherever they are: in the store or in the archive.
#[derive(Clone, Copy, Debug)]
pub struct Everywhere<'a, const M: usize, const B: usize> {
    store: &'a TileStore<'a, M, B>,
    archive: &'a TileArchive<M, B>,
}

impl<const M: usize, const B: usize> TileSource<M, B> for Everywhere<'_, M, B> {
    fn posterior(&self, index: &TileIndex<2>) -> Option<PosteriorView<'_, M, B>> {
        self.store.get(index).or_else(|| self.archive.get(index)).map(|tile| tile.posterior.view())
    }
}
