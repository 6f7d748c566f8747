//! What a computer adds to the core: services over shared memory, a simulated robot, recorded logs.

mod scan_record;
pub mod sim;

pub use scan_record::ScanRecord;
