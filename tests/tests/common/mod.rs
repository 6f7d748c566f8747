//! What several of these tests need: simulated and recorded drives, and what the core's own tests need.
#![allow(dead_code, unused_imports, reason = "each test file is a program of its own and uses a part of this")]
#![allow(unreachable_pub, reason = "there is nobody outside a test program")]

#[path = "../../../core/tests/common/mod.rs"]
mod core_tests;
mod drive;

use bhm_core::{beam::Observation, settings::Settings};
use bhm_host::ScanRecord;
pub use core_tests::*;
pub use drive::{Drive, drives, intel_scans};

/// The labelled points that a scan is under these settings.
pub fn points_of(scan: &ScanRecord, settings: &Settings) -> Vec<Observation<2>> {
    core_tests::points_of(&scan.as_scan(), settings)
}
