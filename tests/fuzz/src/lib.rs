//! What the fuzz targets share: seeds, a watch over memory, and bytes as files and messages have them.
//!
//! A target is a file in `fuzz_targets/`: a function that gives its seeds (valid inputs, made by the code itself), a function
//! that checks one input and panics if something is wrong, and [`target!`].

mod memory;
mod plain;
mod samples;

use std::{fs, path::Path, process};

#[doc(hidden)]
pub use libfuzzer_sys;
pub use memory::within;
pub use plain::{PlainNumbers, bytes_of, message, message_from};
pub use samples::{learned_supports, scan};

/// The environment variable that names a folder which a target is to write its seeds to, instead of fuzzing.
const SEEDS: &str = "BHM_FUZZ_SEEDS";

/// Makes a fuzz target of a function that gives seeds, `fn() -> Vec<Vec<u8>>`, and one that checks an input, `fn(&[u8])`.
#[macro_export]
macro_rules! target {
    ($seeds:path, $check:path) => {
        use $crate::libfuzzer_sys;
        libfuzzer_sys::fuzz_target!(init: $crate::write_seeds($seeds), |bytes: &[u8]| $check(bytes));
    };
}

/// Writes the seeds and ends the program, if it was started for that.
///
/// # Panics
/// If a file cannot be written.
pub fn write_seeds(seeds: fn() -> Vec<Vec<u8>>) {
    let Some(folder) = std::env::var_os(SEEDS) else { return };
    for (number, seed) in seeds().iter().enumerate() {
        fs::write(Path::new(&folder).join(format!("seed-{number}")), seed).expect("a seed can be written");
    }
    process::exit(0);
}

/// A file of this project with its length (8 bytes at 12) and its checksum (the last 4 bytes) made right again: what changes
/// under a right checksum must be noticed too.
#[must_use]
pub fn sealed(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let length = (bytes.len() as u64).to_le_bytes();
    if let Some(stated) = bytes.get_mut(12..20) {
        stated.copy_from_slice(&length);
    }
    if let Some((content, checksum)) = bytes.split_last_chunk_mut::<4>() {
        *checksum = crc32fast::hash(content).to_le_bytes();
    }
    bytes
}
