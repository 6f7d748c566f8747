use std::path::Path;

use bhm_core::profile::Profile;
use bhm_firmware_sim::budget::{Instructions, Work};
use bhm_host::{
    ScanRecord,
    map::{OwnedMapper, posterior_digest},
};

use crate::emulator::{B, Emulator, M, counter, instructions};

/// Scans between two comparisons of the whole posterior.
const COMPARE_EVERY: usize = 50;

/// What a log came to.
pub(crate) struct Run {
    /// Of each update.
    pub(crate) instructions: Vec<u64>,
    pub(crate) stack_bytes: u32,
}

impl Run {
    pub(crate) fn mean(&self) -> f64 {
        self.instructions.iter().sum::<u64>() as f64 / self.instructions.len() as f64
    }

    pub(crate) fn worst(&self) -> u64 {
        self.instructions.iter().copied().max().expect("scans")
    }
}

/// Has a computer and the device learn the scans; what they know must be equal in every bit, and every update must stay
/// below what its own report says that it may take.
pub(crate) fn learn(program: &Path, profile: &Profile, scans: &[ScanRecord]) -> Run {
    let unit = Instructions::of(&profile.settings).expect("measured");
    let most = Work::most(profile);
    let mut host = OwnedMapper::<M, B>::new(profile).expect("a good profile");
    let mut device = Emulator::start(program, profile);
    device.greet();
    let mut run = Run { instructions: Vec::new(), stack_bytes: 0 };
    for (number, scan) in scans.iter().enumerate() {
        device.send_scan(scan);
        let report = host.integrate(&scan.as_scan()).expect("a good scan");
        let status = device.learned();
        let took = instructions(&status);
        let work = Work::done(profile, &report);
        let allowed = work.instructions(&unit);
        assert!(took <= allowed, "scan {number}: {took} instructions, {allowed} allowed for {work:?}");
        assert!(work.is_within(&most), "scan {number}: {work:?}");
        run.instructions.push(took);
        run.stack_bytes = status.stack_high_water_bytes.expect("painted");
        let last = number + 1 == scans.len();
        if last {
            assert_eq!(counter(&status, "integrated"), scans.len() as u64);
            assert!(status.link.iter().all(|(name, count)| !is_damage(name) || *count == 0), "{:?}", status.link);
        }
        if last || (number + 1) % COMPARE_EVERY == 0 {
            device.settle();
            let theirs = host.mapper().tiles().iter().map(|tile| (tile.index, tile.posterior.view()));
            let theirs = posterior_digest(theirs);
            let tiles = device.end.mirror().tiles().map(|tile| (tile.version.index, tile.view()));
            assert_eq!(posterior_digest(tiles), theirs, "after scan {number}");
        }
    }
    println!("{:?}", device.end.counters());
    let (status, _) = device.finish();
    assert!(status.success(), "{status}");
    run
}

fn is_damage(name: &str) -> bool {
    ["cut", "bad_crc", "other_version", "unreadable", "oversized", "overrun"].iter().any(|kind| name.contains(kind))
}
