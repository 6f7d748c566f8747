//! What a map file promises: the map goes on as if never saved, and bytes that are not such a file are refused.

use std::path::Path;

use bhm_core::{
    beam::Observation,
    geometry::Point,
    kernel::{KernelSettings, SquaredExponentialSettings},
    profile::{self, Profile},
};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::*;
use crate::framed::{CHECKSUM_BYTES, sealed};
use crate::map::{self, PosteriorDigest};
use crate::sim::Scene;
use crate::supports::{LearnedSupports, test_supports};

/// Bytes before the header: the frame's, and the header's length.
const PREFIX_BYTES: usize = framed::PREFIX_BYTES + 4;

fn extras() -> Extras {
    Extras { profile: "compact".to_owned(), path_m: vec![[0.5, -1.0], [0.75, -1.25]] }
}

/// A map of a few tiles, and the bytes of its file.
fn small(points: usize) -> (Box<dyn AnyMap>, Vec<u8>) {
    small_with(points, None)
}

fn small_with(points: usize, supports: Option<LearnedSupports>) -> (Box<dyn AnyMap>, Vec<u8>) {
    let mut map = map::open_with(&profile::COMPACT, supports).unwrap();
    let at = |i: usize| Observation::at_point(Point::<2>::new(2.0 + 0.01 * i as f32, 2.0), i.is_multiple_of(3));
    let observations: Vec<_> = (0..points).map(at).collect();
    map.integrate_observations(&observations).unwrap();
    let bytes = encoded(&*map, &extras());
    (map, bytes)
}

fn encoded(map: &dyn AnyMap, extras: &Extras) -> Vec<u8> {
    let mut bytes = Vec::new();
    map.write_snapshot(extras, &mut bytes).unwrap();
    bytes
}

fn problem(bytes: &[u8]) -> SnapshotError {
    decode(bytes).err().expect("no usable map")
}

/// The profile with the stencil that its supports need.
fn fitted(profile: &Profile, supports: &Option<LearnedSupports>) -> Profile {
    let settings = supports.as_ref().map_or(profile.settings, |supports| profile.settings.fitted(supports.table()));
    Profile { settings, ..*profile }
}

/// Drives half of a simulated route, goes through a file or not, and drives the rest.
fn half_and_half(
    profile: &Profile,
    supports: &Option<LearnedSupports>,
    through_file: Option<&Path>,
) -> (PosteriorDigest, Vec<String>, Vec<u8>) {
    let scans: Vec<_> = Scene::named("building").unwrap().simulate(3).step_by(40).collect();
    let (first, second) = scans.split_at(scans.len() / 2);
    let mut map = map::open_with(profile, supports.clone()).unwrap();
    for scan in first {
        map.integrate(&scan.as_scan()).unwrap();
    }
    if let Some(path) = through_file {
        save(path, &*map, &extras()).unwrap();
        let snapshot = load(path).unwrap();
        assert_eq!((snapshot.map.digest(), &snapshot.extras), (map.digest(), &extras()));
        assert_eq!((snapshot.map.progress(), snapshot.map.tile_counts()), (map.progress(), map.tile_counts()));
        assert_eq!((snapshot.map.settings(), snapshot.map.capacities()), (map.settings(), map.capacities()));
        assert_eq!(snapshot.map.tile_indices(), map.tile_indices());
        assert_eq!((snapshot.map.supports(), snapshot.map.model()), (map.supports(), map.model()));
        for step in 0..500 {
            let at = Point::<2>::new(step as f32 * 0.05 - 20.0, (step % 23) as f32 * 0.3 - 3.0);
            assert_eq!(snapshot.map.gradient(&at), map.gradient(&at));
        }
        map = snapshot.map;
    }
    let reports = second.iter().map(|scan| format!("{:?}", map.integrate(&scan.as_scan()).unwrap())).collect();
    (map.digest(), reports, encoded(&*map, &extras()))
}

#[test]
fn a_loaded_map_goes_on_as_if_never_saved() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("half.bhm");
    let wide =
        profile::COMPACT.settings.with_kernel(KernelSettings::SquaredExponential(SquaredExponentialSettings::DEFAULT));
    let biased = Profile {
        settings: bhm_core::settings::Settings { bias: Some(Default::default()), ..wide },
        ..profile::COMPACT
    };
    let learned = Some(test_supports::over_a_building(0.5));
    let plain = profile::COMPACT;
    for (profile, supports) in [(plain, None), (biased, None), (fitted(&plain, &learned), learned)] {
        for tiles in [64, 7] {
            let capacities = profile::Capacities { tiles, ..profile.capacities };
            let profile = Profile { capacities, ..profile };
            // Reports too: the same tiles come back from the archive at the same scans.
            let went_on = half_and_half(&profile, &supports, None);
            assert!(went_on == half_and_half(&profile, &supports, Some(&path)), "{tiles} slots");
            // The supports matter: without them it is another map.
            assert!(supports.is_none() || went_on.0 != half_and_half(&profile, &None, None).0);
        }
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file is left");
}

/// What the store of a saved map held, it holds again: nothing has to come back from the archive for it.
#[test]
fn a_loaded_map_holds_the_tiles_that_were_touched_last() {
    let capacities = profile::Capacities { tiles: 3, ..profile::COMPACT.capacities };
    let profile = Profile { capacities, ..profile::COMPACT };
    // In the middle of a tile each, where no other holds the stencil; the first is met again in the end.
    let middles = [0, 3, 1, 4, 2, 0].map(|tile| Point::<2>::new(4.0 * tile as f32 + 2.75, 2.75));
    let mut map = map::open(&profile).unwrap();
    for middle in middles {
        assert_eq!(map.integrate_observations(&[Observation::at_point(middle, true)]).unwrap().tiles_touched, 1);
    }
    let bytes = encoded(&*map, &extras());
    for (middle, restored) in [(0.0, 0), (4.0, 0), (2.0, 0), (1.0, 1), (3.0, 1)]
        .map(|(tile, restored)| (Point::<2>::new(4.0 * tile + 2.75, 2.75), restored))
    {
        let mut loaded = decode(&bytes).unwrap().map;
        let report = loaded.integrate_observations(&[Observation::at_point(middle, false)]).unwrap();
        assert_eq!((report.tiles_restored, report.tiles_created), (restored, 0), "at {middle}");
    }
}

#[test]
fn every_cut_is_noticed() {
    let (_, bytes) = small_with(30, Some(test_supports::some()));
    assert!(decode(&bytes).is_ok());
    for length in 0..bytes.len() {
        assert!(matches!(problem(&bytes[..length]), SnapshotError::Frame(_)));
        // As if it had been written so: it is then the contents that do not fit.
        let _ = problem(&sealed(bytes[..length].to_vec()));
    }
}

#[test]
fn a_header_that_lies_is_refused_even_with_a_right_checksum() {
    for supports in [None, Some(test_supports::some())] {
        no_lie_is_believed(small_with(0, supports));
    }
}

fn no_lie_is_believed((map, bytes): (Box<dyn AnyMap>, Vec<u8>)) {
    // An empty map: the header is all there is, and every byte of it counts.
    for at in PREFIX_BYTES..bytes.len() - CHECKSUM_BYTES {
        // Of the supports, which are many, every seventh value.
        for value in (0..=u8::MAX).step_by(if map.supports().is_some() { 7 } else { 1 }) {
            let mut changed = bytes.clone();
            changed[at] = value;
            // Another name or place is as good as the first; what matters is that nothing panics or is sized by it.
            if let Ok(snapshot) = decode(&sealed(changed)) {
                let (bytes, _) = snapshot.map.bytes();
                assert!(bytes < 2 * map::MAX_TILE_BYTES);
            }
        }
    }
    drop(map);
}

#[test]
fn tiles_with_impossible_values_are_refused() {
    let (map, bytes) = small(1);
    let (tiles, tile) = (map.tile_indices().len(), record::record_bytes(144, 40));
    let first = bytes.len() - CHECKSUM_BYTES - tiles * tile;
    for (at, value, expected) in [
        (first, f32::NAN, "finite numbers"),
        (first + 4, f32::INFINITY, "finite numbers"),
        (first, 0.0, "positive precisions and variances"),
        (first + 144 * 40 * 4, -1.0, "positive precisions and variances"),
    ] {
        let mut changed = bytes.clone();
        changed[at..at + 4].copy_from_slice(&f32::to_le_bytes(value));
        assert_eq!(problem(&sealed(changed)), SnapshotError::Tile { index: map.tile_indices()[0], expected });
    }
}

#[test]
fn a_tile_touched_after_the_last_scan_is_refused() {
    let (map, bytes) = small(1);
    assert_eq!((map.tile_indices().len(), map.progress().0), (1, 1), "one tile, learned from the only scan");
    // The header ends with that tile's last number, the scan that touched it.
    let at = bytes.len() - CHECKSUM_BYTES - record::record_bytes(144, 40) - 1;
    assert_eq!(bytes[at], 1);
    let mut changed = bytes;
    changed[at] = 2;
    let expected = SnapshotError::HeaderValue { name: "tiles", expected: "no tile touched after the last scan" };
    assert_eq!(problem(&sealed(changed)), expected);
}

#[test]
fn supports_of_another_lattice_are_refused() {
    let (map, bytes) = small_with(0, Some(test_supports::some()));
    let spacing = 0.5_f32.to_le_bytes();
    // The settings' spacing comes first, then the supports'.
    let places: Vec<_> = bytes.windows(4).enumerate().filter(|(_, w)| *w == spacing).map(|(at, _)| at).collect();
    let refused = places.iter().filter(|at| {
        let mut changed = bytes.clone();
        changed[**at..**at + 4].copy_from_slice(&f32::to_le_bytes(0.25));
        let error = decode(&sealed(changed)).err().map(|error| error.to_string()).unwrap_or_default();
        error.contains("the supports were learned at a spacing of")
    });
    assert_eq!(refused.count(), 2, "either of the two");
    assert_eq!(map.supports().map(|supports| supports.supports().len()), Some(12));
}

#[test]
fn what_is_no_map_file_is_named_with_its_path() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("what.bhm");
    std::fs::write(&path, "FLASER 2 1 1").unwrap();
    let error = load(&path).err().unwrap().to_string();
    let says = "expected a map file, found text beginning with `FLASER 2 1 1`";
    assert_eq!(error, format!("{}: {says}", path.display()));
    assert!(matches!(load(folder.path()), Err(MapFileError::Unreadable { .. })));
    assert!(matches!(load(&folder.path().join("absent")), Err(MapFileError::Unreadable { .. })));
    let (map, _) = small(1);
    assert!(matches!(
        save(&folder.path().join("no/folder.bhm"), &*map, &extras()),
        Err(MapFileError::Unwritable { .. })
    ));
    assert!(matches!(save(folder.path(), &*map, &extras()), Err(MapFileError::Unwritable { .. })));
}

fn seeded(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, rng_seed: RngSeed::Fixed(0x6268_6d02), failure_persistence: None, ..Default::default() }
}

proptest! {
    #![proptest_config(seeded(256))]

    #[test]
    fn any_bytes_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..400), header in any::<u16>()) {
        prop_assert!(decode(&bytes).is_err());
        let contents = [&u32::from(header % 400).to_le_bytes()[..], &bytes].concat();
        prop_assert!(decode(&FILE_KIND.encode(&contents)).is_err());
    }

    #[test]
    fn damage_under_a_right_checksum_never_panics(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        cut in any::<prop::sample::Index>(),
    ) {
        let (_, bytes) = small_with(3, Some(test_supports::some()));
        let header_end = bytes.len() - CHECKSUM_BYTES;
        let mut changed = bytes.clone();
        for (index, value) in changes {
            // Most of them in the header, which decides how the rest is read.
            changed[PREFIX_BYTES + index.index(300.min(header_end - PREFIX_BYTES))] = value;
        }
        if let Ok(mut snapshot) = decode(&sealed(changed.clone())) {
            let _ = snapshot.map.integrate_observations(&[Observation::at_point(Point::<2>::new(1.0, 1.0), true)]);
            let _ = snapshot.map.gradient(&Point::<2>::new(2.0, 2.0));
        }
        changed.truncate(cut.index(changed.len()));
        prop_assert!(decode(&sealed(changed)).is_err());
    }
}
