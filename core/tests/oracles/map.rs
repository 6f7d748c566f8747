//! A map with memory of its own, and an archive that keeps everything.

use std::collections::BTreeMap;

use bhm_core::{
    beam::Observation,
    mapper::{IntegrateReport, Link, Mapper, Memory, ObservationSlot, TouchedTile},
    posterior::{Posterior, RowState, Scratch},
    profile::{Capacities, Profile},
    scan::{Scan, ScanRejected},
    storage::Storage::Lent,
    support::SupportTable,
    tile::{Archive, DirectoryEntry, Tile, TileIndex},
};

/// What leaves the store stays here until it is wanted again.
#[derive(Default)]
pub(crate) struct Shelf<const M: usize, const B: usize>(pub(crate) BTreeMap<TileIndex<2>, Box<Tile<2, M, B>>>);

impl<const M: usize, const B: usize> Archive<2, M, B> for Shelf<M, B> {
    fn keep(&mut self, tile: &Tile<2, M, B>) -> bool {
        self.0.insert(tile.index, Box::new(tile.clone())).is_none()
    }

    fn bring_back(&mut self, index: &TileIndex<2>, tile: &mut Tile<2, M, B>) -> bool {
        self.0.remove(index).map(|kept| tile.clone_from_in_place(&kept)).is_some()
    }
}

/// A mapper whose memory lives as long as the test program does.
pub(crate) struct TestMap<const M: usize, const B: usize> {
    mapper: Mapper<'static, 2, M, B>,
    shelf: Shelf<M, B>,
}

impl<const M: usize, const B: usize> TestMap<M, B> {
    pub(crate) fn new(profile: &Profile) -> Self {
        let Capacities { tiles, observations, rows, touched } = profile.capacities;
        let memory = Memory {
            tiles: Lent(vec![Tile::VACANT; tiles].leak()),
            directory: Lent(vec![DirectoryEntry::VACANT; tiles].leak()),
            prior: Lent(Box::leak(Box::new(Posterior::ZERO))),
            scratch: Lent(Box::leak(Box::new(Scratch::ZERO))),
            observations: Lent(vec![ObservationSlot::VACANT; observations].leak()),
            features: Lent(vec![0.0; observations * profile.settings.stencil_nodes()].leak()),
            links: Lent(vec![Link::VACANT; observations * 4].leak()),
            touched: Lent(vec![TouchedTile::VACANT; touched].leak()),
            rows: Lent(vec![RowState::ZERO; rows].leak()),
            supports: SupportTable::EMPTY,
        };
        Self { mapper: Mapper::new(profile.settings, memory).expect("a usable profile"), shelf: Shelf::default() }
    }

    pub(crate) fn mapper(&self) -> &Mapper<'static, 2, M, B> {
        &self.mapper
    }

    pub(crate) fn shelf(&self) -> &Shelf<M, B> {
        &self.shelf
    }

    /// Every tile, in the store or on the shelf, in ascending order of index.
    pub(crate) fn all_tiles(&self) -> Vec<&Tile<2, M, B>> {
        let mut tiles: Vec<_> = self.mapper.tiles().iter().chain(self.shelf.0.values().map(|tile| &**tile)).collect();
        tiles.sort_unstable_by_key(|tile| tile.index);
        tiles
    }

    pub(crate) fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected> {
        self.mapper.integrate(scan, &mut self.shelf)
    }

    pub(crate) fn integrate_observations(&mut self, observations: &[Observation<2>]) -> IntegrateReport {
        self.mapper.integrate_observations(observations, &mut self.shelf).expect("observations that fit")
    }
}
