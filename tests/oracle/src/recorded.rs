use std::path::{Path, PathBuf};

/// A file of recorded data, from the directory in `BHM_DATA` or from `shared/data` beside the workspace.
///
/// `None` where it is absent, which is said on standard error.
///
/// # Panics
/// Where it is absent and `CI` is set.
#[must_use]
pub fn recorded(name: &str) -> Option<PathBuf> {
    let beside = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data"));
    let path = std::env::var_os("BHM_DATA").map_or(beside.to_owned(), PathBuf::from).join(name);
    if path.is_file() {
        return Some(path);
    }
    assert!(std::env::var_os("CI").is_none(), "{} is absent; set BHM_DATA to the recorded logs", path.display());
    eprintln!("without recorded data: {} is absent; set BHM_DATA to the recorded logs", path.display());
    None
}
