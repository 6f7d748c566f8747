//! The one façade: scans in, a report back, the map to be asked at any time.

mod memory;
mod report;
mod sorting;
mod work;

pub use memory::{Memory, StaticMemory};
pub use report::{IntegrateReport, ObservationTally};
pub use sorting::{Link, TouchedTile};
pub use work::ObservationSlot;

use sorting::Sorting;
use work::{Observed, Workspace};

use crate::{
    basis::Basis,
    beam::{BeamLimits, BeamRule, BeamTally, Observation, Ray},
    em,
    geometry::Place,
    lattice::Lattice,
    map::{Map, Viewed},
    posterior::{Posterior, RowError, Rows},
    scan::{ScanRejected, Sweep},
    settings::{Model, Settings, SettingsError},
    tile::{Archive, MapView, Tile, TileStore, TileStoreFull, Tiling},
};

/// A map that learns: settings, and the memory that it works in.
///
/// `D` is the dimension of space, `M` the number of supports of a tile and `B` the band, the latter two fixed by the settings'
/// tiling and checked against it.
#[derive(Debug)]
pub struct Mapper<'m, const D: usize, const M: usize, const B: usize> {
    settings: Settings<D>,
    model: Model<'m, D>,
    store: TileStore<'m, D, M, B>,
    work: Workspace<'m, D, M, B>,
    newest_stamp_ns: u64,
    scans: u64,
}

impl<'m, const D: usize, const M: usize, const B: usize> Mapper<'m, D, M, B> {
    /// An empty map.
    ///
    /// # Errors
    /// Settings that contradict themselves, or do not fit `M`, `B` or the memory.
    pub fn new(settings: Settings<D>, memory: Memory<'m, D, M, B>) -> Result<Self, SettingsError> {
        let model = settings.model_with(memory.supports.clone())?;
        model.tiling.check(M, B)?;
        let (store, mut work) = memory.split(&settings)?;
        model.prior.write(&mut work.prior, &mut work.scratch)?;
        Ok(Self { settings, model, store, work, newest_stamp_ns: 0, scans: 0 })
    }

    /// What the map was made with.
    #[must_use]
    pub fn settings(&self) -> &Settings<D> {
        &self.settings
    }

    /// The functions that follow from the settings.
    #[must_use]
    pub fn model(&self) -> &Model<'m, D> {
        &self.model
    }

    /// How points become features.
    #[must_use]
    pub fn basis(&self) -> &Basis<'m, D> {
        &self.model.basis
    }

    /// How space is cut into tiles.
    #[must_use]
    pub fn tiling(&self) -> &Tiling<D> {
        &self.model.tiling
    }

    /// What is believed of a tile where nothing was observed.
    #[must_use]
    pub fn prior(&self) -> &Posterior<M, B> {
        &self.work.prior
    }

    /// The resident tiles.
    #[must_use]
    pub fn tiles(&self) -> &TileStore<'m, D, M, B> {
        &self.store
    }

    /// Stamp of the newest scan that was integrated, nanoseconds; 0 before the first.
    #[must_use]
    pub fn newest_stamp_ns(&self) -> u64 {
        self.newest_stamp_ns
    }

    /// Scans (or batches of observations) integrated since the map began.
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
    pub fn restore_tile(&mut self, tile: &Tile<D, M, B>) -> Result<(), TileStoreFull> {
        self.store.insert(tile)
    }

    /// The map as queries see it.
    #[must_use]
    pub fn view(&self) -> MapView<'_, &TileStore<'m, D, M, B>, D, M, B> {
        self.model.view(&self.work.prior, &self.store)
    }

    /// Learns a sweep of a range sensor, such as a [`Scan`](crate::scan::Scan).
    ///
    /// Beams that cannot be used are dropped one by one and counted. If the observations of the sweep exceed the memory, every
    /// second beam is used (then every fourth, …), so that what is dropped is spread over all directions.
    ///
    /// # Errors
    /// [`ScanRejected`] if the sweep as a whole is not usable; the map is then unchanged.
    #[inline(always)]
    pub fn integrate(
        &mut self,
        sweep: &impl Sweep<D>,
        archive: &mut impl Archive<D, M, B>,
    ) -> Result<IntegrateReport, ScanRejected> {
        let Settings { limits, beam, spacing_m, .. } = self.settings;
        let lattice = self.model.basis.lattice;
        sweep.check(|position_m| lattice.stencil_at(position_m).is_some())?;
        if sweep.stamp_ns() < self.newest_stamp_ns {
            return Err(ScanRejected::StampWentBack { stamp_ns: sweep.stamp_ns(), newest_ns: self.newest_stamp_ns });
        }
        let every = thinning(sweep, &limits, self.work.capacity, |ray, room| {
            let mut count = 0;
            beam.observe(ray, spacing_m, |observation| {
                whole_rows(&lattice, &observation, |_| {
                    count += 1;
                    count <= room
                })
            });
            count
        });
        let mut beams = BeamTally::default();
        let read = |observed: &mut Observed<'_, D>, model: &Model<'_, D>| {
            for ray in sweep.rays(&limits) {
                if every.is_none_or(|every| ray.number % every != 0) {
                    beams.over_capacity += 1;
                    continue;
                }
                beams.count(&ray.reading);
                beam.observe(&ray, spacing_m, |observation| {
                    whole_rows(&lattice, &observation, |piece| {
                        observed.push(&piece, sweep.covariance_at(&piece.place.middle_m()), model);
                        true
                    })
                });
            }
        };
        self.newest_stamp_ns = sweep.stamp_ns();
        let report = self.learn(read, archive);
        Ok(IntegrateReport { beams, ..report })
    }

    /// Learns labelled points or segments, for data that was prepared elsewhere.
    ///
    /// Those that are not finite or off the lattice are dropped and counted. Segments must not leave a cell of the lattice
    /// (see [`Lattice::cut`]).
    ///
    /// # Errors
    /// [`ScanRejected::TooManyObservations`] if they exceed the memory; the map is then unchanged.
    #[inline(always)]
    pub fn integrate_observations(
        &mut self,
        observations: &[Observation<D>],
        archive: &mut impl Archive<D, M, B>,
    ) -> Result<IntegrateReport, ScanRejected> {
        let capacity = self.work.capacity;
        if observations.len() > capacity {
            return Err(ScanRejected::TooManyObservations { observations: observations.len(), capacity });
        }
        let read = |observed: &mut Observed<'_, D>, model: &Model<'_, D>| {
            for observation in observations {
                observed.push(observation, None, model);
            }
        };
        Ok(self.learn(read, archive))
    }

    /// Reads observations, then learns them tile by tile.
    #[inline(always)]
    fn learn(
        &mut self,
        read: impl FnOnce(&mut Observed<'_, D>, &Model<'_, D>),
        archive: &mut impl Archive<D, M, B>,
    ) -> IntegrateReport {
        self.scans += 1;
        let Model { basis, tiling, pattern, .. } = &self.model;
        let Workspace { prior, scratch, observations, features, links, touched, rows, .. } = &mut self.work;
        let (slots, sorting) = (&mut **observations, Sorting::new(touched, links));
        let mut observed = Observed { slots, features, sorting, len: 0, tally: ObservationTally::default() };
        read(&mut observed, &self.model);
        let Observed { slots, features, sorting, tally, .. } = observed;
        let mut report = IntegrateReport { observations: tally, ..IntegrateReport::default() };
        for (index, numbers) in sorting.tiles() {
            let window = tiling.window(index);
            let mut rows = Rows::new(pattern, features, rows);
            for number in numbers {
                let ObservationSlot { first, bias, occupied } = slots[number];
                let Some(base) = window.index_of_whole(&first, basis.lattice.stencil) else { continue };
                match rows.push::<M, B>(number, base, bias, occupied) {
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
        report
    }
}

impl<const D: usize, const M: usize, const B: usize> Viewed<D> for Mapper<'_, D, M, B> {
    fn as_map(&self) -> impl Map<D> + '_ {
        self.view()
    }
}

/// Hands an observation to `each` in pieces that are rows of one stencil, until `each` answers `false`: a segment is cut where
/// it enters another cell, so that nothing of it falls outside the band.
#[inline(always)]
fn whole_rows<const D: usize>(
    lattice: &Lattice<D>,
    observation: &Observation<D>,
    mut each: impl FnMut(Observation<D>) -> bool,
) -> bool {
    match observation.place {
        Place::Point(_) => each(*observation),
        Place::Segment { from_m, to_m } => lattice
            .cut(from_m, to_m)
            .all(|(from_m, to_m)| each(Observation { place: Place::Segment { from_m, to_m }, ..*observation })),
    }
}

/// Every how many rays one is used, so that observations number at most `capacity`: 1, 2, 4, …; `None` if not even the first
/// ray's fit. `count` says how many observations a ray gives, and may stop counting beyond the room that is left.
#[inline(always)]
fn thinning<const D: usize>(
    sweep: &impl Sweep<D>,
    limits: &BeamLimits,
    capacity: usize,
    count: impl Fn(&Ray<D>, usize) -> usize,
) -> Option<usize> {
    let mut every = 1;
    loop {
        let mut room = Some(capacity);
        for ray in sweep.rays(limits).filter(|ray| ray.number % every == 0) {
            room = room.and_then(|room| room.checked_sub(count(&ray, room)));
            if room.is_none() {
                break;
            }
        }
        if room.is_some() {
            return Some(every);
        }
        if every >= sweep.beams() {
            return None;
        }
        every *= 2;
    }
}
