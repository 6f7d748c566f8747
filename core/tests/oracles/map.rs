//! A map with memory of its own, and an archive that keeps everything.

use std::collections::BTreeMap;

use bhm_core::{
    geometry::Point,
    mapper::{IntegrateReport, Mapper, Memory, ScanRejected},
    posterior::{RowState, Scratch},
    profile::{Capacities, Profile},
    scan::Scan,
    support::SupportTable,
    tile::{Archive, DirectoryEntry, Tile, TileIndex},
};

/// What leaves the store stays here until it is wanted again.
#[derive(Default)]
pub(crate) struct Shelf<const M: usize, const B: usize>(pub(crate) BTreeMap<TileIndex<2>, Box<Tile<M, B>>>);

impl<const M: usize, const B: usize> Archive<M, B> for Shelf<M, B> {
    fn keep(&mut self, tile: &Tile<M, B>) -> bool {
        self.0.insert(tile.index, Box::new(tile.clone())).is_none()
    }

    fn bring_back(&mut self, index: &TileIndex<2>, tile: &mut Tile<M, B>) -> bool {
        self.0.remove(index).map(|kept| tile.clone_from_in_place(&kept)).is_some()
    }
}

/// A mapper whose memory lives as long as the test program does.
pub(crate) struct Map<const M: usize, const B: usize> {
    mapper: Mapper<'static, M, B>,
    shelf: Shelf<M, B>,
}

impl<const M: usize, const B: usize> Map<M, B> {
    pub(crate) fn new(profile: &Profile) -> Self {
        let Capacities { tiles, points, rows, touched } = profile.capacities;
        let stencil = profile.settings.stencil;
        let memory = Memory {
            tiles: vec![Tile::VACANT; tiles].leak(),
            directory: vec![DirectoryEntry::default(); tiles].leak(),
            scratch: Box::leak(Box::new(Scratch::ZERO)),
            places: vec![Default::default(); points].leak(),
            firsts: vec![None; points].leak(),
            touched: vec![[0; 2]; touched].leak(),
            entries: vec![Default::default(); rows * stencil * stencil].leak(),
            states: vec![RowState::default(); rows].leak(),
            supports: SupportTable::EMPTY,
        };
        Self { mapper: Mapper::new(profile.settings, memory).expect("a usable profile"), shelf: Shelf::default() }
    }

    pub(crate) fn mapper(&self) -> &Mapper<'static, M, B> {
        &self.mapper
    }

    pub(crate) fn shelf(&self) -> &Shelf<M, B> {
        &self.shelf
    }

    /// Every tile, in the store or on the shelf, in ascending order of index.
    pub(crate) fn all_tiles(&self) -> Vec<&Tile<M, B>> {
        let mut tiles: Vec<_> = self.mapper.tiles().iter().chain(self.shelf.0.values().map(|tile| &**tile)).collect();
        tiles.sort_unstable_by_key(|tile| tile.index);
        tiles
    }

    pub(crate) fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected> {
        self.mapper.integrate(scan, &mut self.shelf)
    }

    pub(crate) fn integrate_points(&mut self, at_m: &[[f32; 2]], occupied: &[bool]) -> IntegrateReport {
        let points: Vec<_> = at_m.iter().map(|at| Point::<2>::from(*at)).collect();
        self.mapper.integrate_points(&points, occupied, &mut self.shelf).expect("points that fit")
    }
}
