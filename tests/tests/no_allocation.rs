//! Nothing allocates once a map exists, and memory stays flat however long the robot drives.

use std::alloc::System;

use bhm_core::{
    map::Map,
    profile,
    scan::{Scan, ScanHeader},
};
use bhm_host::{ScanRecord, map::OwnedMapper, sim};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// One test, so that no other thread allocates while this one counts.
#[test]
fn ten_thousand_scans_allocate_nothing() {
    const SCANS: u64 = 10_000;
    let recorded: Vec<ScanRecord> = sim::Scene::named("building")
        .expect("the building is built in")
        .simulate(3)
        .step_by(12)
        .map(|mut scan| {
            // Every tenth beam: the claim is about memory, and the test should end soon.
            scan.header.angle_increment_rad *= 10.0;
            scan.ranges_m = scan.ranges_m.into_iter().step_by(10).collect();
            scan
        })
        .collect();
    let mut profile = profile::COMPACT;
    profile.settings.passes = 1;
    // Far fewer slots than the building has tiles: eviction is part of what must not allocate.
    profile.capacities.tiles = 16;
    let mut owned = OwnedMapper::<144, 40>::new(&profile).expect("the profile is usable");

    // The archive grows until every tile has been evicted once; after that nothing may allocate at all.
    let mut integrate = |scan: &ScanRecord, stamp_ns: u64| {
        let scan = Scan { header: ScanHeader { stamp_ns, ..scan.as_scan().header }, ..scan.as_scan() };
        owned.integrate(&scan).expect("the simulated scan is sound")
    };
    let laps = SCANS as usize / recorded.len() + 1;
    let mut stamp_ns = 1;
    for scan in recorded.iter().chain(&recorded) {
        integrate(scan, stamp_ns);
        stamp_ns += 1;
    }
    let region = Region::new(ALLOCATOR);
    let mut evicted = 0;
    for scan in recorded.iter().cycle().take(laps * recorded.len()) {
        evicted += integrate(scan, stamp_ns).tiles_evicted;
        stamp_ns += 1;
    }
    let change = region.change();
    println!("{} scans, {evicted} tiles evicted: {change:?}", laps * recorded.len());
    assert!(evicted > 1_000, "the store was meant to be too small");
    assert_eq!((change.allocations, change.reallocations, change.deallocations), (0, 0, 0));
    assert_eq!(change.bytes_allocated, 0);

    // Queries, too.
    let region = Region::new(ALLOCATOR);
    for i in 0..1_000_u16 {
        let at = [f32::from(i) * 0.03, f32::from(i % 50) * 0.3].into();
        assert!(owned.view().occupancy(&at).probability.is_finite());
        assert!(owned.view().gradient(&at).mean.x.is_finite());
    }
    assert_eq!(region.change().allocations, 0);
}
