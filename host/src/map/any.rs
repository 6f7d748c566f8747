use std::io;

use bhm_core::{
    beam::Observation,
    map::ModelledMap,
    mapper::IntegrateReport,
    profile::{Capacities, Profile},
    scan::{Scan, ScanRejected},
    settings::{Settings, SettingsError},
    shape::{self, NotCompiled, ShapeVisitor},
    tile::TileIndex,
};

use super::{CapacityError, OwnedMapper, PosteriorDigest, posterior_digest};
use crate::{
    snapshot::{self, Extras},
    supports::{LearnedSupports, SupportsError},
};

/// A map of any compiled shape, for programs that learn its shape at run time; it answers for archived tiles too.
pub trait AnyMap: ModelledMap<2> + Send {
    /// What it was made with.
    fn settings(&self) -> &Settings;

    /// The supports of their own that some nodes have.
    fn supports(&self) -> Option<&LearnedSupports>;

    /// How much memory it was given.
    fn capacities(&self) -> &Capacities;

    /// Learns a scan.
    ///
    /// # Errors
    /// If the scan as a whole is not usable.
    fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected>;

    /// Learns labelled observations.
    ///
    /// # Errors
    /// If there are more than the map's memory holds.
    fn integrate_observations(&mut self, observations: &[Observation<2>]) -> Result<IntegrateReport, ScanRejected>;

    /// Tiles in the store and in the archive.
    fn tile_counts(&self) -> (usize, usize);

    /// Bytes allocated at the start, and bytes of one tile.
    fn bytes(&self) -> (usize, usize);

    /// Scans integrated since the map began, and the newest stamp, nanoseconds.
    fn progress(&self) -> (u64, u64);

    /// What distinguishes what it has learned from what another map has, bit for bit.
    fn digest(&self) -> PosteriorDigest;

    /// The same of these tiles alone, in ascending order of index; those that the map does not have are left out.
    fn digest_of(&self, tiles: &[TileIndex<2>]) -> PosteriorDigest;

    /// Writes it in the format of [`snapshot`]; [`snapshot::save`] writes a file.
    ///
    /// # Errors
    /// If `to` cannot be written to.
    fn write_snapshot(&self, extras: &Extras, to: &mut dyn io::Write) -> io::Result<()>;
}

impl<const M: usize, const B: usize> AnyMap for OwnedMapper<M, B> {
    fn settings(&self) -> &Settings {
        self.mapper().settings()
    }

    fn supports(&self) -> Option<&LearnedSupports> {
        self.supports()
    }

    fn capacities(&self) -> &Capacities {
        self.capacities()
    }

    fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected> {
        self.integrate(scan)
    }

    fn integrate_observations(&mut self, observations: &[Observation<2>]) -> Result<IntegrateReport, ScanRejected> {
        self.integrate_observations(observations)
    }

    fn tile_counts(&self) -> (usize, usize) {
        (self.mapper().tiles().resident(), self.archive().len())
    }

    fn bytes(&self) -> (usize, usize) {
        (self.bytes(), size_of::<bhm_core::tile::Tile<2, M, B>>())
    }

    fn progress(&self) -> (u64, u64) {
        (self.mapper().scans(), self.mapper().newest_stamp_ns())
    }

    fn digest(&self) -> PosteriorDigest {
        posterior_digest(self.all_tiles().into_iter().map(|tile| (tile.index, tile.posterior.view())))
    }

    fn digest_of(&self, tiles: &[TileIndex<2>]) -> PosteriorDigest {
        let tile = |index: &TileIndex<2>| {
            self.mapper().tiles().get(index).or_else(|| self.archive().get(index)).map(|tile| tile.posterior.view())
        };
        posterior_digest(tiles.iter().filter_map(|index| Some((*index, tile(index)?))))
    }

    fn write_snapshot(&self, extras: &Extras, to: &mut dyn io::Write) -> io::Result<()> {
        snapshot::write(self, extras, to)
    }
}

/// Why a map could not be opened.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnknownShape {
    /// The settings contradict themselves.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// Learned supports that are not this map's.
    #[error(transparent)]
    Supports(#[from] SupportsError),
    /// More memory than a map may ask for.
    #[error(transparent)]
    Capacity(#[from] CapacityError),
    /// No program was compiled for tiles of this shape.
    #[error(transparent)]
    Shape(#[from] NotCompiled),
}

/// Supports and band of the profile's tiles, if its settings and capacities make sense.
///
/// # Errors
/// Settings that contradict themselves, or ask for too much memory.
pub fn shape(profile: &Profile) -> Result<(usize, usize), UnknownShape> {
    profile.settings.model()?;
    let shape = (profile.settings.supports(), profile.settings.band());
    super::capacity::check(&profile.capacities, shape)?;
    Ok(shape)
}

/// An empty map of the profile's shape.
///
/// # Errors
/// Settings that contradict themselves, need a shape that is not compiled in, or ask for too much memory.
pub fn open(profile: &Profile) -> Result<Box<dyn AnyMap>, UnknownShape> {
    open_with(profile, None)
}

/// An empty map of the profile's shape, with supports of their own for some nodes.
///
/// # Errors
/// As [`open`]; also if the supports were learned on another lattice, or reach beyond the stencil.
pub fn open_with(profile: &Profile, supports: Option<LearnedSupports>) -> Result<Box<dyn AnyMap>, UnknownShape> {
    shape::visit(shape(profile)?, Open { profile, supports })?
}

struct Open<'a> {
    profile: &'a Profile,
    supports: Option<LearnedSupports>,
}

impl ShapeVisitor for Open<'_> {
    type Output = Result<Box<dyn AnyMap>, UnknownShape>;

    fn visit<const M: usize, const B: usize>(self) -> Self::Output {
        Ok(Box::new(OwnedMapper::<M, B>::with_supports(self.profile, self.supports)?))
    }
}
