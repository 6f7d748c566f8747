//! What a computer adds to the core: memory and an archive for maps, services over shared memory, a simulated robot,
//! recorded logs, map files.

pub mod dataset;
pub mod map;
mod scan_record;
pub mod sim;
pub mod snapshot;

pub use scan_record::ScanRecord;
