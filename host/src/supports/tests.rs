//! What a file of supports promises: the same supports come out, and bytes that are not such a file are refused.

use bhm_core::{
    kernel::KernelSettings,
    lattice::Window,
    profile,
    settings::Settings,
    support::{AnySupport, GaussianSettings, SupportSettings, TableError},
};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::file::FILE_KIND;
use super::*;
use crate::framed::{CHECKSUM_BYTES, PREFIX_BYTES, sealed};

fn some() -> LearnedSupports {
    test_supports::some()
}

fn with(source: &str) -> Option<LearnedWith> {
    Some(LearnedWith { kernel: KernelSettings::ALL[0], source: source.to_owned() })
}

fn problem(bytes: &[u8]) -> SupportsBytesError {
    decode(bytes).expect_err("no usable supports")
}

#[test]
fn supports_come_out_of_a_file_as_they_went_in() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("some.sup");
    let supports = some();
    save(&path, &supports).unwrap();
    let back = load(&path).unwrap();
    assert_eq!(back, supports);
    assert_eq!((back.digest(), back.table()), (supports.digest(), supports.table()));
    assert_eq!(back.table().supports().len(), 12);
    assert_eq!(back.table().get(&[0, 2]), Some(&supports.supports()[4]));
    let counts: Vec<_> = back.kinds().map(|(_, count)| count).collect();
    assert_eq!(counts, [4; 3]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file is left");
}

#[test]
fn the_digest_is_of_what_a_map_says_and_of_nothing_else() {
    let supports = some();
    let of = |origin_m, spacing_m, first, supports: Vec<AnySupport<2>>, source| {
        let window = Window { first, width: [3, 4] };
        LearnedSupports::new(origin_m, spacing_m, window, supports, with(source)).unwrap().digest()
    };
    let all = || supports.supports().to_vec();
    assert_eq!(of([0.0; 2], 0.5, [-1, 2], all(), "elsewhere"), supports.digest());
    let mut swapped = all();
    swapped.swap(1, 4);
    for other in [
        of([0.0, 1e-7], 0.5, [-1, 2], all(), ""),
        of([0.0; 2], 0.5_f32.next_up(), [-1, 2], all(), ""),
        of([0.0; 2], 0.5, [-1, 3], all(), ""),
        of([0.0; 2], 0.5, [-1, 2], swapped, ""),
    ] {
        assert_ne!(other, supports.digest());
    }
    assert_ne!(supports.digest(), 0);
}

#[test]
fn a_copy_shares_the_supports() {
    let supports = some();
    let copy = supports.clone();
    assert!(std::ptr::eq(supports.supports(), copy.supports()) && copy == supports);
}

#[test]
fn another_lattice_is_named_with_both_values() {
    let (supports, compact) = (some(), profile::COMPACT.settings);
    assert_eq!(supports.matches(&compact), Ok(()));
    let coarse = supports.matches(&Settings { spacing_m: 0.25, ..compact }).unwrap_err();
    assert_eq!(coarse.to_string(), "the supports were learned at a spacing of 0.5 m, the map has 0.25 m");
    let moved = supports.matches(&Settings { origin_m: [-20.0, 1.5], ..compact }).unwrap_err();
    let says = "the supports were learned on a lattice with node 0 at [0.0, 0.0] m, the map's is at [-20.0, 1.5] m";
    assert_eq!(moved.to_string(), says);
}

#[test]
fn what_are_no_supports_is_refused() {
    let window = Window { first: [0, 0], width: [1, 2] };
    let point = AnySupport::<2>::default();
    let new = |origin_m, spacing_m, window, supports: &[AnySupport<2>]| {
        LearnedSupports::new(origin_m, spacing_m, window, supports.to_vec(), None).unwrap_err()
    };
    let value = |name, expected| SupportsError::Value { name, expected };
    let pair = [point; 2];
    let positive = "a positive number of metres";
    for spacing_m in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(new([0.0; 2], spacing_m, window, &pair), value("spacing", positive));
    }
    assert_eq!(new([f32::NAN, 0.0], 0.5, window, &pair), value("origin", "finite numbers"));
    let count = TableError::Count { nodes: 2, supports: 1 };
    assert_eq!(new([0.0; 2], 0.5, window, &pair[..1]), SupportsError::Table(count));
    let nobody = Window { first: [0, 0], width: [0, 2] };
    assert_eq!(new([0.0; 2], 0.5, nobody, &[]), SupportsError::Empty);
    let far = Window { first: [i32::MIN, 0], width: [1, 2] };
    assert_eq!(new([0.0; 2], 0.5, far, &pair), SupportsError::Table(TableError::Window));
    for kind in SupportSettings::ALL.iter().filter(|kind| kind.name() != "point") {
        let error = new([0.0; 2], 0.5, window, &[point, kind.build(f32::NAN)]);
        assert_eq!(error, SupportsError::Numbers { node: [0, 1], kind: kind.name() });
    }
    let long = LearnedSupports::new([0.0; 2], 0.5, window, pair.to_vec(), with(&"x".repeat(MAX_SOURCE_BYTES + 1)));
    assert_eq!(long, Err(value("source", "at most 4096 bytes")));
}

#[test]
fn every_cut_is_noticed() {
    let bytes = encode(&some());
    for length in 0..bytes.len() {
        assert!(matches!(problem(&bytes[..length]), SupportsBytesError::Frame(_)));
        // As if it had been written so: it is then the contents that do not fit.
        let _ = problem(&sealed(bytes[..length].to_vec()));
    }
}

/// A file of one support as version 2 has it, which later programs read and write alike.
const ONE_SUPPORT: &[u8] = b"BHM sup\n\x02\0\0\0d\0\0\0\0\0\0\0\
    \0\0\0\0\0\0\0\0\0\0\0?\x01\x04\x01\x01\
    \x01\0\x06a test\
    \x18point\ngaussian\nrectangle\
    \x01\x01\0\0\x80<\0\0\0\0\0\0\x80<\0\0\0\0\0\0\0\0\0\0\0\0\
    \xa7u\t7";

/// The same supports as version 1 had them: the kernel by its name, with a shape.
const ONE_SUPPORT_OF_VERSION_1: &[u8] = b"BHM sup\n\x01\0\0\0u\0\0\0\0\0\0\0\
    \0\0\0\0\0\0\0\0\0\0\0?\x01\x04\x01\x01\
    \x0ecubic-b-spline\0\0\0?\x06a test\
    \x18point\ngaussian\nrectangle\
    \x01\x01\0\0\x80<\0\0\0\0\0\0\x80<\0\0\0\0\0\0\0\0\0\0\0\0\
    \x04M\x0fl";

#[test]
fn a_file_of_version_2_is_read_and_its_bytes_are_these() {
    let window = Window { first: [-1, 2], width: [1, 1] };
    let supports = vec![SupportSettings::GaussianSupport(GaussianSettings { size: 0.25 }).build(0.5)];
    let expected = LearnedSupports::new([0.0; 2], 0.5, window, supports, with("a test")).unwrap();
    assert_eq!(decode(ONE_SUPPORT).unwrap(), expected);
    assert_eq!(encode(&expected), ONE_SUPPORT);
}

#[test]
fn a_file_of_version_1_is_refused_with_both_versions() {
    let problem = problem(ONE_SUPPORT_OF_VERSION_1);
    assert_eq!(problem.to_string(), "format version 1, only 2 is understood");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("old.sup");
    std::fs::write(&path, ONE_SUPPORT_OF_VERSION_1).unwrap();
    assert_eq!(load(&path).unwrap_err().to_string(), format!("{}: {problem}", path.display()));
}

#[test]
fn contents_that_lie_under_a_right_checksum_are_named() {
    let bytes = encode(&some());
    let last = bytes.len() - CHECKSUM_BYTES;
    let damaged = |at: usize, change: &[u8]| {
        let mut changed = bytes.clone();
        changed[at..at + change.len()].copy_from_slice(change);
        problem(&sealed(changed))
    };
    // The last support: a byte for its kind, six numbers.
    let (kind, node) = (SupportSettings::ALL[11 % SupportSettings::ALL.len()].name(), [1, 5]);
    for number in 0..6 {
        let numbers = SupportsBytesError::Supports(SupportsError::Numbers { node, kind });
        assert_eq!(damaged(last - 24 + 4 * number, &f32::NAN.to_le_bytes()), numbers);
        assert_eq!(damaged(last - 24 + 4 * number, &f32::INFINITY.to_le_bytes()), numbers);
    }
    assert_eq!(damaged(last - 25, &[9]), SupportsBytesError::Supports(SupportsError::Kind { node, kind: 9 }));
    // The spacing stands behind the origin.
    let spacing = damaged(PREFIX_BYTES + 8, &f32::NAN.to_le_bytes());
    assert!(spacing.to_string().starts_with("spacing of the supports: expected"), "{spacing}");
    let at = bytes.windows(8).position(|window| window == b"gaussian").unwrap();
    assert!(matches!(damaged(at, b"gaussiam"), SupportsBytesError::Supports(SupportsError::Kind { kind: 1, .. })));
    // A count of supports, here the byte before them, that no file could hold.
    let many = [&bytes[..last - 12 * 25 - 1], &[0xff, 0xff, 0xff, 0xff, 0x0f][..], &bytes[last - 12 * 25..]].concat();
    assert!(matches!(problem(&sealed(many)), SupportsBytesError::Contents { .. }));
    let longer = [&bytes[..last], &[0], &bytes[last..]].concat();
    assert!(matches!(problem(&sealed(longer)), SupportsBytesError::Contents { .. }));
}

#[test]
fn what_is_no_file_of_supports_is_named_with_its_path() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("what.sup");
    std::fs::write(&path, "FLASER 2 1 1").unwrap();
    let says = "expected a file of learned supports, found text beginning with `FLASER 2 1 1`";
    assert_eq!(load(&path).unwrap_err().to_string(), format!("{}: {says}", path.display()));
    assert!(matches!(load(folder.path()), Err(SupportsFileError::Unreadable { .. })));
    assert!(matches!(load(&folder.path().join("absent")), Err(SupportsFileError::Unreadable { .. })));
    assert!(matches!(save(&folder.path().join("no/f.sup"), &some()), Err(SupportsFileError::Unwritable { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 512, rng_seed: RngSeed::Fixed(0x6268_6d03), failure_persistence: None, ..Default::default()
    })]

    #[test]
    fn any_bytes_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(decode(&bytes).is_err());
        prop_assert!(decode(&FILE_KIND.encode(&bytes)).is_err());
    }

    #[test]
    fn damage_under_a_right_checksum_never_panics(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut bytes = encode(&some());
        let end = bytes.len() - CHECKSUM_BYTES;
        for (index, value) in changes {
            bytes[PREFIX_BYTES + index.index(end - PREFIX_BYTES)] = value;
        }
        if let Ok(supports) = decode(&sealed(bytes.clone())) {
            prop_assert_eq!(&decode(&encode(&supports)).unwrap(), &supports);
        }
        bytes.truncate(cut.index(bytes.len()));
        prop_assert!(decode(&sealed(bytes)).is_err());
    }
}
