//! How long things take here and now: to compare on one machine, never to assert.
//!
//! `cargo bench -p bhm-tools --bench wall_clock`. The instruction counts beside it are what the documentation quotes.

use bhm_core::{
    geometry::Point,
    profile::{self, Profile},
};
use bhm_host::{ScanRecord, map, sim};
use divan::Bencher;

fn main() {
    divan::main();
}

fn scans() -> Vec<ScanRecord> {
    sim::Scene::named("building").expect("the building is built in").simulate(1).take(200).collect()
}

fn learned(profile: &Profile, scans: &[ScanRecord]) -> Box<dyn map::AnyMap> {
    let mut map = map::open(profile).expect("the profile is usable");
    for scan in scans {
        map.integrate(&scan.as_scan()).expect("the simulated scan is sound");
    }
    map
}

/// One scan into a map that has seen the place before.
#[divan::bench(args = [&profile::COMPACT, &profile::INDOOR])]
fn integrate(bencher: Bencher<'_, '_>, profile: &Profile) {
    let scans = scans();
    let mut map = learned(profile, &scans);
    let last = scans.last().expect("there are scans").clone();
    bencher.bench_local(|| map.integrate(&last.as_scan()));
}

/// One query with its variance, and one with its gradient.
#[divan::bench(args = ["occupancy", "gradient"])]
fn query(bencher: Bencher<'_, '_>, what: &str) {
    let scans = scans();
    let map = learned(&profile::INDOOR, &scans);
    let pose = scans[0].header.map_from_sensor.position();
    let mut turn = 0_u32;
    bencher.bench_local(|| {
        turn = turn.wrapping_add(1);
        let point = pose + Point::<2>::new((turn % 97) as f32 * 0.05, (turn % 89) as f32 * 0.05);
        if what == "occupancy" { map.occupancy(&point) } else { map.gradient(&point).occupancy }
    });
}
