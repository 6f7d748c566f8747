//! Maps whose supports lie anywhere, in a computer's memory: for experiments with where supports should be.

use std::ptr::NonNull;

use bhm_core::{
    beam::LabelledPlace,
    geometry::Point,
    mapper::{IntegrateReport, ScanRejected},
    posterior::{Entry, Posterior, RowState, Scratch},
    scan::Scan,
    scattered::{ScatteredMapper, ScatteredMemory, ScatteredSupport},
    settings::{Settings, SettingsError},
    tile::{Occupancy, OccupancyGradient},
};

use super::owned::zeroed_box;

/// Most supports that a map is compiled for.
pub const MAX_SCATTERED: usize = 512;

/// A map with supports anywhere, for programs that learn their number at run time.
pub trait ScatteredMap: Send {
    /// How many supports it has.
    fn supports(&self) -> usize;

    /// Learns a scan.
    ///
    /// # Errors
    /// If the scan as a whole is not usable.
    fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected>;

    /// What the map says about a point.
    fn occupancy(&self, point_m: &Point<2>) -> Occupancy;

    /// How that changes with the point.
    fn gradient(&self, point_m: &Point<2>) -> OccupancyGradient;
}

/// What such a mapper works in.
struct Storage<const M: usize> {
    supports: Vec<ScatteredSupport<2>>,
    posterior: Box<Posterior<M, M>>,
    scratch: Box<Scratch<M, M>>,
    places: Vec<LabelledPlace>,
    entries: Vec<Entry>,
    states: Vec<RowState>,
}

/// A [`ScatteredMapper`] together with its memory.
pub struct OwnedScattered<const M: usize> {
    /// Borrows from `storage`, whatever its lifetime says; never handed out with that lifetime.
    mapper: ScatteredMapper<'static, M>,
    storage: NonNull<Storage<M>>,
    supports: usize,
}

impl<const M: usize> OwnedScattered<M> {
    /// An empty map with room for so many observations of a scan.
    ///
    /// # Errors
    /// As [`ScatteredMapper::new`].
    pub fn new(
        settings: Settings,
        supports: Vec<ScatteredSupport<2>>,
        observations: usize,
    ) -> Result<Self, SettingsError> {
        let count = supports.len();
        let storage = Box::new(Storage {
            supports,
            posterior: zeroed_box(),
            scratch: zeroed_box(),
            places: vec![LabelledPlace::default(); observations],
            entries: vec![Entry::default(); observations * M],
            states: vec![RowState::default(); observations],
        });
        let storage = NonNull::from(Box::leak(storage));
        // SAFETY: the storage was just leaked, so this is the only borrow of it; it lives until `drop`, which happens after
        // the last use of the mapper, and no method hands the mapper out with the lifetime 'static.
        let Storage { supports, posterior, scratch, places, entries, states } = unsafe { &mut *storage.as_ptr() };
        let memory = ScatteredMemory { supports, posterior, scratch, places, entries, states };
        match ScatteredMapper::new(settings, memory) {
            Ok(mapper) => Ok(Self { mapper, storage, supports: count }),
            Err(error) => {
                // SAFETY: leaked above, and the mapper that borrowed it does not exist.
                drop(unsafe { Box::from_raw(storage.as_ptr()) });
                Err(error)
            }
        }
    }
}

impl<const M: usize> ScatteredMap for OwnedScattered<M> {
    fn supports(&self) -> usize {
        self.supports
    }

    fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected> {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { integrate_avx2(&mut self.mapper, scan) };
        }
        self.mapper.integrate(scan)
    }

    fn occupancy(&self, point_m: &Point<2>) -> Occupancy {
        self.mapper.occupancy(point_m)
    }

    fn gradient(&self, point_m: &Point<2>) -> OccupancyGradient {
        self.mapper.gradient(point_m)
    }
}

impl<const M: usize> Drop for OwnedScattered<M> {
    fn drop(&mut self) {
        // SAFETY: leaked in `new`; the mapper that borrows it has no destructor and is not used again.
        drop(unsafe { Box::from_raw(self.storage.as_ptr()) });
    }
}

// SAFETY: the storage is reached through the mapper alone, which this value owns.
unsafe impl<const M: usize> Send for OwnedScattered<M> {}

/// The same inlined core, compiled for wider vectors. No fused multiply–add: the results are the same bit for bit.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn integrate_avx2<const M: usize>(
    mapper: &mut ScatteredMapper<'_, M>,
    scan: &Scan<'_>,
) -> Result<IntegrateReport, ScanRejected> {
    mapper.integrate(scan)
}

/// An empty map with these supports, of the smallest compiled capacity that holds them.
///
/// # Errors
/// Settings that contradict themselves, no support, or more than [`MAX_SCATTERED`].
pub fn open_scattered(
    settings: Settings,
    supports: Vec<ScatteredSupport<2>>,
    observations: usize,
) -> Result<Box<dyn ScatteredMap>, SettingsError> {
    if supports.len() <= 256 {
        Ok(Box::new(OwnedScattered::<256>::new(settings, supports, observations)?))
    } else {
        Ok(Box::new(OwnedScattered::<MAX_SCATTERED>::new(settings, supports, observations)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Scene;
    use bhm_core::{kernel::KernelChoice, profile::COMPACT, support::AnySupport};

    #[test]
    fn a_capacity_does_not_change_what_is_learned() {
        let settings = Settings { spacing_m: 2.0, ..COMPACT.settings }.with_kernel(KernelChoice::SquaredExponential);
        let supports: Vec<_> = (0..200)
            .map(|i| [(i % 20) as f32 - 10.0, (i / 20) as f32 * 2.0 - 10.0])
            .map(|centre_m| ScatteredSupport { centre_m: centre_m.into(), support: AnySupport::default() })
            .collect();
        let scan = Scene::named("building").unwrap().simulate(1).next().unwrap();
        let mut small = open_scattered(settings, supports.clone(), 4_096).unwrap();
        let mut large = OwnedScattered::<MAX_SCATTERED>::new(settings, supports.clone(), 4_096).unwrap();
        let report = small.integrate(&scan.as_scan()).unwrap();
        assert!(report.rows > 300 && report.tiles_failed == 0, "{report:?}");
        large.integrate(&scan.as_scan()).unwrap();
        for i in 0..100 {
            let at = Point::from([(i % 10) as f32 - 5.0, (i / 10) as f32 - 5.0]);
            let (a, b) = (small.occupancy(&at), large.occupancy(&at));
            assert!((a.probability - b.probability).abs() < 1e-3, "{a:?} {b:?}");
        }
        let many = vec![supports[0]; MAX_SCATTERED + 1];
        assert!(open_scattered(settings, many, 10).is_err());
        assert!(open_scattered(settings, Vec::new(), 10).is_err());
    }
}
