//! The file system behind shared memory: is there room, and is it really ours?
//!
//! It is lazy. A segment larger than what is free is created without complaint, and the writer dies of SIGBUS at the
//! first page that is missing. So the room is compared before, for an error that says how much is needed, and taken after,
//! so that nobody else can have it.

use std::fs;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use rustix::fs::{FallocateFlags, fallocate, statvfs};

use super::Domain;

/// Where Linux keeps shared memory.
const SHARED_MEMORY: &str = "/dev/shm";

/// How segments that hold messages end; a setting of iceoryx2 that we leave alone.
const SEGMENT_SUFFIX: &str = ".data";

/// Room for iceoryx2's own bookkeeping, beside the messages of a port.
const OVERHEAD_BYTES: u64 = 1 << 20;

/// Shared memory does not suffice.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SharedMemoryError {
    /// Less shared memory is free than is needed.
    #[error(
        "{needed_bytes} bytes of shared memory are needed, {available_bytes} are free in {SHARED_MEMORY}: \
         enlarge it (containers: --shm-size), or choose a profile with fewer tiles or allow fewer consumers"
    )]
    NotEnough {
        /// What the ports need, bytes.
        needed_bytes: u64,
        /// What is free, bytes.
        available_bytes: u64,
    },
    /// The file system behind shared memory could not be asked for its room, or did not reserve it.
    #[error("{SHARED_MEMORY}: {cause}")]
    Inaccessible {
        /// What the operating system said.
        cause: String,
    },
}

/// Checks that this many bytes are free.
pub(super) fn check_free(message_bytes: u64) -> Result<(), SharedMemoryError> {
    let needed_bytes = message_bytes.saturating_add(OVERHEAD_BYTES);
    let available_bytes = available_bytes()?;
    if available_bytes < needed_bytes {
        return Err(SharedMemoryError::NotEnough { needed_bytes, available_bytes });
    }
    Ok(())
}

fn available_bytes() -> Result<u64, SharedMemoryError> {
    let state = statvfs(SHARED_MEMORY).map_err(|cause| inaccessible(&cause.into()))?;
    Ok(state.f_bavail.saturating_mul(state.f_frsize))
}

/// Takes the memory of the domain's segments, all of it: pages that are missing fail here, not under a writer.
pub(super) fn reserve(domain: &Domain) -> Result<(), SharedMemoryError> {
    for entry in fs::read_dir(SHARED_MEMORY).map_err(|cause| inaccessible(&cause))? {
        let entry = entry.map_err(|cause| inaccessible(&cause))?;
        let name = entry.file_name();
        let ours = name.to_str().is_some_and(|n| n.starts_with(domain.prefix()) && n.ends_with(SEGMENT_SUFFIX));
        if ours {
            reserve_file(&entry.path())?;
        }
    }
    Ok(())
}

/// Removes what iceoryx2 leaves behind even when everybody has gone. Nobody may be in the domain any more.
pub(super) fn remove_all(domain: &Domain) {
    for entry in fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten() {
        if entry.file_name().to_str().is_some_and(|name| name.starts_with(domain.prefix())) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn reserve_file(path: &Path) -> Result<(), SharedMemoryError> {
    let file = match fs::OpenOptions::new().read(true).write(true).open(path) {
        Ok(file) => file,
        // Its owner removed it meanwhile.
        Err(gone) if gone.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(cause) => return Err(inaccessible(&cause)),
    };
    let metadata = file.metadata().map_err(|cause| inaccessible(&cause))?;
    let missing_bytes = metadata.len().saturating_sub(metadata.blocks().saturating_mul(512));
    if missing_bytes == 0 {
        return Ok(());
    }
    match fallocate(&file, FallocateFlags::empty(), 0, metadata.len()) {
        Ok(()) => Ok(()),
        Err(rustix::io::Errno::NOSPC) => {
            Err(SharedMemoryError::NotEnough { needed_bytes: missing_bytes, available_bytes: available_bytes()? })
        }
        Err(cause) => Err(inaccessible(&cause.into())),
    }
}

fn inaccessible(cause: &io::Error) -> SharedMemoryError {
    SharedMemoryError::Inaccessible { cause: cause.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_little_is_said_with_both_numbers() {
        let Err(SharedMemoryError::NotEnough { needed_bytes, available_bytes }) = check_free(u64::MAX / 2) else {
            panic!("no machine has that much");
        };
        assert_eq!(needed_bytes, u64::MAX / 2 + OVERHEAD_BYTES);
        assert!(available_bytes < needed_bytes);
        assert_eq!(check_free(0), Ok(()));
    }
}
