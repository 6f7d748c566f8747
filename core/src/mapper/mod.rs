//! The one façade: scans in, a report back, the map to be asked at any time.

mod memory;
pub(crate) mod reading;
mod report;
mod touched;

pub use memory::{Memory, Workspace};
pub use report::{IntegrateReport, PointTally, ScanRejected};
pub use touched::Touched;

use reading::Reading;

use crate::{
    basis::Basis,
    beam::LabelledPlace,
    em,
    geometry::{Place, Point, PoseCovariance},
    posterior::{Prior, RowError, Rows},
    scan::Scan,
    settings::{Model, Settings, SettingsError},
    tile::{Archive, MapView, Occupancy, OccupancyGradient, Tile, TileStore, TileStoreFull, Tiling, entries_of},
};

/// A map that learns: settings, and the memory that the caller lent.
///
/// `M` is the number of supports of a tile and `B` the band, both fixed by the settings' tiling and checked against it.
#[derive(Debug)]
pub struct Mapper<'m, const M: usize, const B: usize> {
    settings: Settings,
    model: Model<'m>,
    store: TileStore<'m, M, B>,
    work: Workspace<'m, M, B>,
    newest_stamp_ns: u64,
    scans: u64,
}

impl<'m, const M: usize, const B: usize> Mapper<'m, M, B> {
    /// An empty map.
    ///
    /// # Errors
    /// Settings that contradict themselves, or do not fit `M`, `B` or the lent memory.
    pub fn new(settings: Settings, memory: Memory<'m, M, B>) -> Result<Self, SettingsError> {
        let model = settings.model_with(memory.supports)?;
        model.tiling.check(M, B)?;
        let (store, work) = memory.split()?;
        Ok(Self { settings, model, store, work, newest_stamp_ns: 0, scans: 0 })
    }

    /// What the map was made with.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// How points become features.
    #[must_use]
    pub fn basis(&self) -> &Basis<'m, 2> {
        &self.model.basis
    }

    /// How the plane is cut into tiles.
    #[must_use]
    pub fn tiling(&self) -> &Tiling<2> {
        &self.model.tiling
    }

    /// What is believed where nothing was observed.
    #[must_use]
    pub fn prior(&self) -> &Prior {
        &self.model.prior
    }

    /// The resident tiles.
    #[must_use]
    pub fn tiles(&self) -> &TileStore<'m, M, B> {
        &self.store
    }

    /// Stamp of the newest scan that was integrated, nanoseconds; 0 before the first.
    #[must_use]
    pub fn newest_stamp_ns(&self) -> u64 {
        self.newest_stamp_ns
    }

    /// Scans (or batches of points) integrated since the map began.
    #[must_use]
    pub fn scans(&self) -> u64 {
        self.scans
    }

    /// Continues a saved map: its counters, before its tiles are put back with [`restore_tile`](Self::restore_tile).
    pub fn resume(&mut self, scans: u64, newest_stamp_ns: u64) {
        self.scans = scans;
        self.newest_stamp_ns = newest_stamp_ns;
    }

    /// Puts a saved tile back into a free slot.
    ///
    /// # Errors
    /// [`TileStoreFull`]; hand the rest to the archive instead.
    pub fn restore_tile(&mut self, tile: &Tile<M, B>) -> Result<(), TileStoreFull> {
        self.store.insert(tile)
    }

    /// The map as queries see it.
    #[must_use]
    pub fn view(&self) -> MapView<'_, &TileStore<'m, M, B>, M, B> {
        self.model.view(&self.store)
    }

    /// What the map says about a point.
    #[must_use]
    pub fn occupancy(&self, point_m: &Point<2>) -> Occupancy {
        self.view().occupancy(point_m)
    }

    /// How that changes with the point.
    #[must_use]
    pub fn gradient(&self, point_m: &Point<2>) -> OccupancyGradient {
        self.view().gradient(point_m)
    }

    /// Learns a scan.
    ///
    /// Beams that cannot be used are dropped one by one and counted. If the observations of the scan exceed the lent
    /// memory, every second beam is used (then every fourth, …), so that what is dropped is spread over all directions.
    ///
    /// # Errors
    /// [`ScanRejected`] if the scan as a whole is not usable; the map is then unchanged.
    #[inline(always)]
    pub fn integrate(
        &mut self,
        scan: &Scan<'_>,
        archive: &mut impl Archive<M, B>,
    ) -> Result<IntegrateReport, ScanRejected> {
        let lattice = &self.model.basis.lattice;
        reading::check(scan, self.newest_stamp_ns, |position| lattice.stencil_at(position).is_some())?;
        let reading = Reading { limits: &self.settings.limits, rule: &self.model.beam, cut: Some(lattice) };
        let (observed, beams) = reading.read(scan, self.work.places);
        let mut report = IntegrateReport { beams, ..IntegrateReport::default() };
        self.newest_stamp_ns = scan.stamp_ns;
        let uncertainty = scan.pose_covariance.map(|covariance| (scan.map_from_sensor.position(), covariance));
        self.learn(observed, uncertainty, archive, &mut report);
        Ok(report)
    }

    /// Learns labelled points, for data that was prepared elsewhere.
    ///
    /// Points that are not finite or off the lattice are dropped and counted.
    ///
    /// # Errors
    /// [`ScanRejected::LabelsMissing`] if the slices differ in length, [`ScanRejected::TooManyPoints`] if they exceed the
    /// lent memory; the map is then unchanged.
    #[inline(always)]
    pub fn integrate_points(
        &mut self,
        points_m: &[Point<2>],
        occupied: &[bool],
        archive: &mut impl Archive<M, B>,
    ) -> Result<IntegrateReport, ScanRejected> {
        if points_m.len() != occupied.len() {
            return Err(ScanRejected::LabelsMissing { points: points_m.len(), labels: occupied.len() });
        }
        if points_m.len() > self.work.places.len() {
            return Err(ScanRejected::TooManyPoints { points: points_m.len(), capacity: self.work.places.len() });
        }
        for (slot, (point, occupied)) in self.work.places.iter_mut().zip(points_m.iter().zip(occupied)) {
            *slot = LabelledPlace { place: Place::Point(*point), occupied: *occupied };
        }
        let mut report = IntegrateReport::default();
        self.learn(points_m.len(), None, archive, &mut report);
        Ok(report)
    }

    /// Learns the first `count` places of the buffer, tile by tile. With an uncertain pose, given as where the sensor
    /// stands and its covariance, every place means the points around it as well.
    #[inline(always)]
    fn learn(
        &mut self,
        count: usize,
        uncertainty: Option<(Point<2>, PoseCovariance)>,
        archive: &mut impl Archive<M, B>,
        report: &mut IntegrateReport,
    ) {
        self.scans += 1;
        let Model { basis, tiling, prior, .. } = &self.model;
        let Workspace { scratch, places, firsts, touched, entries, states } = &mut self.work;
        let places = &places[..count];
        let widening = |place: &LabelledPlace| {
            uncertainty
                .map(|(sensor_m, covariance)| basis.widening(&covariance.at(&(place.place.middle_m() - sensor_m))))
        };
        let mut touched = Touched::new(touched);
        for (first, place) in firsts.iter_mut().zip(places) {
            let stencil = basis.lattice.stencil_at(&place.place.middle_m());
            *first = stencil.map(|stencil| stencil.first);
            let Some(stencil) = stencil else {
                report.points.unplaceable += 1;
                continue;
            };
            let (mut tiles, mut missed) = (0, 0);
            for tile in tiling.holding(&stencil.first).filter(|tile| tiling.contains(tile)) {
                tiles += 1;
                missed += u32::from(!touched.insert(tile));
            }
            report.points.outside += u32::from(tiles == 0);
            report.points.over_capacity += u32::from(missed > 0);
            report.points.used += u32::from(tiles > missed);
            report.points.narrowed +=
                u32::from(tiles > missed && widening(place).is_some_and(|(_, narrowed)| narrowed));
        }
        for index in touched.as_slice() {
            let window = tiling.window(index);
            let stencil = basis.lattice.stencil;
            let mut rows = Rows::new(entries, states);
            for (first, place) in firsts.iter().zip(places) {
                let Some(first) = first else { continue };
                if window.index_of_whole(first, stencil).is_none() {
                    continue;
                }
                let spread = widening(place).map(|(spread, _)| spread);
                let Some(features) = basis.features_of(&place.place, spread.as_ref()) else { continue };
                let entries = entries_of(&features, &window, stencil);
                match rows.push::<M, B>(entries, features.bias, place.occupied) {
                    Ok(()) => report.rows += 1,
                    Err(RowError::Full) => report.rows_over_capacity += 1,
                    Err(_) => report.rows_refused += 1,
                }
            }
            let Some(claimed) = self.store.claim(index, prior, archive) else { continue };
            report.count(&claimed);
            let tile = self.store.slot_mut(claimed.slot);
            tile.touched_at = self.scans;
            if self.settings.forgetting < 1.0 && !claimed.created {
                let forgotten = tile.posterior.discount(prior, self.settings.forgetting, scratch);
                report.tiles_failed += u32::from(forgotten.is_err());
            }
            match em::update(&mut tile.posterior, &mut rows, &self.settings.rule, self.settings.passes, scratch) {
                Ok(update) => {
                    tile.updates += 1;
                    report.passes += update.passes;
                    report.safeguards += update.safeguards;
                    report.conditioned += update.conditioned;
                    report.objective += update.objective;
                }
                Err(_) => report.tiles_failed += 1,
            }
        }
    }
}
