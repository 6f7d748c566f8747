//! Lists of supports that lie on no lattice, and the files that they are kept in.
//!
//! ```text
//! offset  bytes  what such a file holds
//!      0      8  magic, "BHM sct\n"
//!      8      4  format version, little-endian like every number here
//!     12      8  length of the file
//!     20      …  postcard: where they come from, and of each the centre, the covariance and the weight
//!     -4      4  CRC-32 of everything before it
//! ```
//!
//! A file is not trusted: [`decode_scattered`] takes any bytes without panicking, and allocates little more than their
//! length.

use std::{
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
};

use bhm_core::{
    geometry::Point,
    scattered::ScatteredSupport,
    support::{AnySupport, GaussianSupport, Support},
};
use serde::{Deserialize, Serialize};

use super::{MAX_SOURCE_BYTES, clusters::MAX_CLUSTERS};
use crate::{dataset::describe, replace::replace};

/// The first bytes of every such file. The line feed shows a file that was transferred as text.
pub(crate) const SCATTERED_MAGIC: [u8; 8] = *b"BHM sct\n";

/// The format version that is written, and the only one that is read.
pub const SCATTERED_VERSION: u32 = 1;

const PREFIX_BYTES: usize = 20;
const CHECKSUM_BYTES: usize = 4;

/// Where observations lie close together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cluster {
    /// Their mean, metres.
    pub centre_m: [f32; 2],
    /// Their covariance, m²: of x, of x and y, of y.
    pub covariance_m2: [f32; 3],
    /// How many they are, hits counting as several.
    pub weight: f64,
}

impl Cluster {
    /// A support at its centre.
    #[must_use]
    pub fn point(&self) -> ScatteredSupport<2> {
        ScatteredSupport { centre_m: Point::from(self.centre_m), support: AnySupport::default() }
    }

    /// A support spread as its observations are; `None` if its covariance is none.
    #[must_use]
    pub fn gaussian(&self) -> Option<ScatteredSupport<2>> {
        let [xx, xy, yy] = self.covariance_m2;
        // Of clusters along a line, rounding may leave more covariance than the variances allow.
        let bound = (xx * yy).max(0.0).sqrt();
        let support = GaussianSupport::from_numbers(&[xx, xy.clamp(-bound, bound), yy, 0.0, 0.0, 0.0])?;
        Some(ScatteredSupport { centre_m: Point::from(self.centre_m), support: AnySupport::GaussianSupport(support) })
    }
}

/// Clusters of a log, as a file holds them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clusters {
    /// In words, what they were found in.
    pub source: String,
    /// At least one.
    pub clusters: Vec<Cluster>,
}

/// Why bytes are no usable list of scattered supports.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ScatteredBytesError {
    /// It does not begin like one.
    #[error("expected a list of scattered supports, found {found}")]
    NotScattered {
        /// What it looks like.
        found: String,
    },
    /// It was written by another version of this program.
    #[error("format version {found}, only {SCATTERED_VERSION} is understood")]
    Version {
        /// The version it states.
        found: u32,
    },
    /// It is not as long as it states.
    #[error("{found} bytes, expected {expected}")]
    Length {
        /// Bytes it should have.
        expected: u64,
        /// Bytes it has, or one more than it should have.
        found: u64,
    },
    /// It was altered after it was written.
    #[error("damaged: checksum {computed:08x}, expected {stored:08x}")]
    Checksum {
        /// The checksum at its end.
        stored: u32,
        /// The checksum of what it holds.
        computed: u32,
    },
    /// What it holds is no such list.
    #[error("contents: {reason}")]
    Contents {
        /// Why not.
        reason: String,
    },
}

/// Why a file of scattered supports could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum ScatteredFileError {
    /// The file cannot be opened or read.
    #[error("cannot read {}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The file cannot be created, written or put in its place.
    #[error("cannot write {}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The file holds something that cannot be used.
    #[error("{}: {problem}", path.display())]
    Bad {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: ScatteredBytesError,
    },
}

/// Writes a file of scattered supports, replacing one of that name only when it is complete.
///
/// # Errors
/// If the file cannot be written.
pub fn save_scattered(path: &Path, clusters: &Clusters) -> Result<(), ScatteredFileError> {
    let bytes = encode_scattered(clusters);
    replace(path, |to| to.write_all(&bytes))
        .map_err(|source| ScatteredFileError::Unwritable { path: path.to_owned(), source })
}

/// Reads a file of scattered supports.
///
/// # Errors
/// If the file cannot be read, or is not such a file that this program understands, whole and undamaged.
pub fn load_scattered(path: &Path) -> Result<Clusters, ScatteredFileError> {
    let unreadable = |source| ScatteredFileError::Unreadable { path: path.to_owned(), source };
    let bad = |problem| ScatteredFileError::Bad { path: path.to_owned(), problem };
    let file = File::open(path).map_err(unreadable)?;
    let mut bytes = Vec::new();
    // The beginning alone first: what is no such file is not read to its end.
    (&file).take(PREFIX_BYTES as u64).read_to_end(&mut bytes).map_err(unreadable)?;
    let length = stated_length(&bytes).map_err(bad)?;
    let left = length.saturating_sub(bytes.len() as u64).saturating_add(1);
    file.take(left).read_to_end(&mut bytes).map_err(unreadable)?;
    decode_scattered(&bytes).map_err(bad)
}

/// The bytes of such a file.
#[must_use]
pub fn encode_scattered(clusters: &Clusters) -> Vec<u8> {
    // Into memory that grows, plain values have no way to fail.
    let contents = postcard::to_allocvec(clusters).unwrap_or_default();
    let length = (PREFIX_BYTES + contents.len() + CHECKSUM_BYTES) as u64;
    let mut bytes = [&SCATTERED_MAGIC[..], &SCATTERED_VERSION.to_le_bytes(), &length.to_le_bytes(), &contents].concat();
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    bytes
}

/// Reads scattered supports from the bytes of a file.
///
/// # Errors
/// What [`ScatteredBytesError`] names; no bytes make this panic, or allocate much more than their length.
pub fn decode_scattered(bytes: &[u8]) -> Result<Clusters, ScatteredBytesError> {
    let contents = |reason: &str| ScatteredBytesError::Contents { reason: reason.to_owned() };
    let (expected, found) = (stated_length(bytes)?, bytes.len() as u64);
    if found != expected {
        return Err(ScatteredBytesError::Length { expected, found });
    }
    let no_room = || contents("they do not fit the file");
    let (content, stored) = bytes.split_last_chunk::<CHECKSUM_BYTES>().ok_or_else(no_room)?;
    let (stored, computed) = (u32::from_le_bytes(*stored), crc32fast::hash(content));
    if stored != computed {
        return Err(ScatteredBytesError::Checksum { stored, computed });
    }
    let (clusters, rest) = postcard::take_from_bytes::<Clusters>(content.get(PREFIX_BYTES..).ok_or_else(no_room)?)
        .map_err(|error| contents(&error.to_string()))?;
    if !rest.is_empty() {
        return Err(no_room());
    }
    if clusters.clusters.is_empty() || clusters.clusters.len() > MAX_CLUSTERS {
        return Err(contents("expected 1 to 4096 supports"));
    }
    if clusters.source.len() > MAX_SOURCE_BYTES {
        return Err(contents("what the supports were found in: expected at most 4096 bytes"));
    }
    let good = |cluster: &Cluster| {
        cluster.centre_m.iter().all(|x| x.is_finite()) && cluster.weight >= 0.0 && cluster.gaussian().is_some()
    };
    match clusters.clusters.iter().position(|cluster| !good(cluster)) {
        Some(bad) => Err(contents(&format!("support {bad} is none"))),
        None => Ok(clusters),
    }
}

/// The length that the beginning of a file states.
fn stated_length(bytes: &[u8]) -> Result<u64, ScatteredBytesError> {
    let cut = || ScatteredBytesError::Length { expected: PREFIX_BYTES as u64, found: bytes.len() as u64 };
    let Some(rest) = bytes.strip_prefix(&SCATTERED_MAGIC) else {
        return Err(ScatteredBytesError::NotScattered { found: describe(bytes) });
    };
    let (version, rest) = rest.split_first_chunk::<4>().ok_or_else(cut)?;
    let found = u32::from_le_bytes(*version);
    if found != SCATTERED_VERSION {
        return Err(ScatteredBytesError::Version { found });
    }
    let (length, _) = rest.split_first_chunk::<8>().ok_or_else(cut)?;
    Ok(u64::from_le_bytes(*length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::{prelude::*, test_runner::RngSeed};

    fn some() -> Clusters {
        let cluster = |i: u8| Cluster {
            centre_m: [f32::from(i), -0.5],
            covariance_m2: [0.2, 0.1, 0.1 * f32::from(i + 1)],
            weight: f64::from(i),
        };
        Clusters { source: "a test".to_owned(), clusters: (0..5).map(cluster).collect() }
    }

    /// Makes the checksum and the length right again after bytes were changed.
    fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
        let length = (bytes.len() as u64).to_le_bytes();
        if let Some(stated) = bytes.get_mut(12..20) {
            stated.copy_from_slice(&length);
        }
        if let Some((content, checksum)) = bytes.split_last_chunk_mut::<CHECKSUM_BYTES>() {
            *checksum = crc32fast::hash(content).to_le_bytes();
        }
        bytes
    }

    #[test]
    fn what_went_in_comes_out_and_other_files_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("some.sct");
        save_scattered(&path, &some()).unwrap();
        assert_eq!(load_scattered(&path).unwrap(), some());
        // The lattice's own supports are another kind of file, and either says what it was given.
        let error = crate::supports::load(&path).unwrap_err().to_string();
        let says = "expected a file of learned supports, found a list of scattered supports";
        assert!(error.contains(says), "{error}");
        crate::supports::save(&path, crate::supports::test_supports::some()).unwrap();
        let error = load_scattered(&path).unwrap_err().to_string();
        assert!(
            error.ends_with("expected a list of scattered supports, found text beginning with `BHM sup`"),
            "{error}"
        );
        assert!(matches!(load_scattered(folder.path()), Err(ScatteredFileError::Unreadable { .. })));
        let nowhere = folder.path().join("no/some.sct");
        assert!(matches!(save_scattered(&nowhere, &some()), Err(ScatteredFileError::Unwritable { .. })));
    }

    #[test]
    fn every_cut_and_every_flipped_bit_is_noticed() {
        let mut bytes = encode_scattered(&some());
        for length in 0..bytes.len() {
            assert!(decode_scattered(&bytes[..length]).is_err());
            assert!(decode_scattered(&sealed(bytes[..length].to_vec())).is_err());
        }
        for at in 0..bytes.len() {
            for bit in 0..8 {
                bytes[at] ^= 1 << bit;
                assert!(decode_scattered(&bytes).is_err(), "bit {bit} of byte {at}");
                bytes[at] ^= 1 << bit;
            }
        }
        assert_eq!(decode_scattered(&bytes), Ok(some()));
    }

    #[test]
    fn what_is_no_support_is_named() {
        let damaged = |damage: &dyn Fn(&mut Clusters)| {
            let mut clusters = some();
            damage(&mut clusters);
            decode_scattered(&encode_scattered(&clusters)).unwrap_err().to_string()
        };
        assert_eq!(damaged(&|c| c.clusters[3].centre_m[1] = f32::NAN), "contents: support 3 is none");
        assert_eq!(damaged(&|c| c.clusters[2].covariance_m2[0] = -1.0), "contents: support 2 is none");
        assert_eq!(damaged(&|c| c.clusters[0].weight = f64::NAN), "contents: support 0 is none");
        assert_eq!(damaged(&|c| c.clusters.clear()), "contents: expected 1 to 4096 supports");
        assert!(damaged(&|c| c.source = "x".repeat(5_000)).ends_with("expected at most 4096 bytes"));
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            cases: 512, rng_seed: RngSeed::Fixed(0x6268_6d04), failure_persistence: None, ..Default::default()
        })]

        #[test]
        fn damage_under_a_right_checksum_never_panics(
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        ) {
            let mut bytes = encode_scattered(&some());
            let end = bytes.len() - CHECKSUM_BYTES;
            for (index, value) in changes {
                bytes[PREFIX_BYTES + index.index(end - PREFIX_BYTES)] = value;
            }
            if let Ok(clusters) = decode_scattered(&sealed(bytes)) {
                prop_assert_eq!(&decode_scattered(&encode_scattered(&clusters)).unwrap(), &clusters);
            }
        }
    }
}
