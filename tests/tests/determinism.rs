//! The same input gives the same bits: again, with a small store and an archive, and whatever else was learned elsewhere.

mod common;

use std::collections::BTreeMap;

use bhm_core::{
    beam::Observation,
    geometry::Point,
    map::Map as _,
    profile::{COMPACT, Capacities, Profile},
    rule::AnyRule,
    settings::{BiasSettings, Settings},
};
use bhm_host::{ScanRecord, map::OwnedMapper};
use common::{Stream, drives, posterior_bits};

type Map = OwnedMapper<144, 40>;

/// Index → updates, last touch, and bits, of every tile in store and archive.
fn tiles(map: &Map) -> BTreeMap<[i32; 2], (u64, u64, Vec<u32>)> {
    let all = map.mapper().tiles().iter().chain(map.archive().iter());
    all.map(|tile| (tile.index, (tile.updates, tile.touched_at, posterior_bits(&tile.posterior)))).collect()
}

fn profile(tiles: usize, settings: Settings) -> Profile {
    Profile { settings, capacities: Capacities { tiles, ..COMPACT.capacities }, ..COMPACT }
}

fn learn(profile: &Profile, scans: &[ScanRecord]) -> (Map, u32) {
    let mut map = Map::new(profile).unwrap();
    let mut evicted = 0;
    for scan in scans {
        let report = map.integrate(&scan.as_scan()).unwrap();
        assert_eq!(report.tiles_lost + report.tiles_failed, 0);
        evicted += report.tiles_evicted;
    }
    (map, evicted)
}

/// Both rules, forgetting and a bias: whatever runs over a tile.
fn variants() -> impl Iterator<Item = Settings> {
    AnyRule::ALL.iter().flat_map(|rule| {
        [(1.0, None), (0.9, Some(BiasSettings::DEFAULT))].map(|(forgetting, bias)| Settings {
            rule: *rule,
            forgetting,
            bias,
            ..COMPACT.settings
        })
    })
}

#[test]
fn twice_the_same() {
    for drive in drives() {
        for settings in variants() {
            let profile = profile(256, settings);
            let (one, other) = (learn(&profile, &drive.scans[..60]).0, learn(&profile, &drive.scans[..60]).0);
            assert!(tiles(&one).len() > 20, "{}", drive.name);
            assert!(tiles(&one) == tiles(&other), "{}: {settings:?}", drive.name);
        }
    }
}

#[test]
fn a_small_store_with_an_archive_is_a_large_store() {
    for drive in drives() {
        // A hundred scans of the drive.
        let apart = drive.scans.len() / 100;
        let scans: Vec<_> = drive.scans.into_iter().step_by(apart).collect();
        for settings in variants() {
            let (large, evicted) = learn(&profile(512, settings), &scans);
            assert_eq!(evicted, 0, "the large store must be large");
            let exact = tiles(&large);
            for slots in [1, 5, 20] {
                let (small, evicted) = learn(&profile(slots, settings), &scans);
                assert!(evicted > 100, "{}: only {evicted} tiles left a store of {slots}", drive.name);
                assert!(tiles(&small) == exact, "{}: {slots} slots, {settings:?}", drive.name);
                let mut stream = Stream::new(3);
                for _ in 0..500 {
                    let at = Point::<2>::new(stream.between(-20.0, 25.0) as f32, stream.between(-25.0, 12.0) as f32);
                    assert_eq!(small.view().occupancy(&at), large.view().occupancy(&at));
                }
            }
        }
    }
}

/// Labelled points around a place, as batches.
fn batches(seed: u64, middle: [f64; 2]) -> Vec<Vec<Observation<2>>> {
    let mut stream = Stream::new(seed);
    (0..6)
        .map(|_| {
            (0..80)
                .map(|_| {
                    let at = middle.map(|x| (x + stream.between(-3.0, 3.0)) as f32);
                    Observation::at_point(Point::from(at), stream.unit() < 0.3)
                })
                .collect()
        })
        .collect()
}

#[test]
fn what_happens_elsewhere_does_not_matter() {
    let (here, there) = (batches(1, [0.0, 0.0]), batches(2, [200.0, -150.0]));
    let learn = |map: &mut Map, batch: &[Observation<2>]| {
        map.integrate_observations(batch).unwrap();
    };
    for settings in variants() {
        let open = || Map::new(&profile(64, settings)).unwrap();
        let (mut one_after_the_other, mut in_turns, mut at_once, mut backwards) = (open(), open(), open(), open());
        for batch in here.iter().chain(&there) {
            learn(&mut one_after_the_other, batch);
        }
        for (a, b) in here.iter().zip(&there) {
            learn(&mut in_turns, b);
            learn(&mut in_turns, a);
            learn(&mut at_once, &[a.as_slice(), b].concat());
            // Interleaved within a batch, each place's own order being kept.
            let mixed: Vec<_> = b.iter().zip(a).flat_map(|(b, a)| [*b, *a]).collect();
            learn(&mut backwards, &mixed);
        }
        let posteriors = |map: &Map| -> BTreeMap<_, _> {
            tiles(map).into_iter().map(|(index, (updates, _, bits))| (index, (updates, bits))).collect()
        };
        let exact = posteriors(&one_after_the_other);
        assert!(exact.len() >= 4);
        for other in [&in_turns, &at_once, &backwards] {
            assert!(posteriors(other) == exact, "{settings:?}");
        }
    }
}
