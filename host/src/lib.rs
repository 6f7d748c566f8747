//! What a computer adds to the core: memory and an archive for maps, services over shared memory, a simulated robot,
//! recorded logs.

pub mod dataset;
pub mod map;
mod scan_record;
pub mod sim;

pub use scan_record::ScanRecord;
