//! What tests of recorded data share.

use std::path::{Path, PathBuf};

/// A file of recorded data, from the directory in `BHM_DATA` or from `shared/data` beside the workspace; absence fails the
/// test in CI and skips it elsewhere.
pub(crate) fn recorded(name: &str) -> Option<PathBuf> {
    let beside = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data"));
    let path = std::env::var_os("BHM_DATA").map_or(beside.to_owned(), PathBuf::from).join(name);
    if path.is_file() {
        return Some(path);
    }
    assert!(std::env::var_os("CI").is_none(), "{} is absent; set BHM_DATA to the recorded logs", path.display());
    eprintln!("skipped: {} is absent; set BHM_DATA to the recorded logs", path.display());
    None
}
