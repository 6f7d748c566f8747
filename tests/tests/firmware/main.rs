//! The firmware in an emulated Cortex-M7: the same map as on a computer, in a time and a memory known beforehand.
//!
//! Needs the program (`firmware-sim/cortex-m7/run build`, or `BHM_FIRMWARE` naming the folder it is in) and QEMU. In CI both
//! must be there, elsewhere the tests say what is missing and pass.

#[path = "../common/mod.rs"]
mod common;
mod emulator;

use bhm_core::profile::COMPACT;
use bhm_host::map::{OwnedMapper, posterior_digest};
use emulator::{B, Emulator, M, counter, instructions, program};

#[test]
fn probe() {
    let passes: u32 = if std::env::var("ONE").is_ok() { 1 } else { 3 };
    let Some(program) = program(if passes == 1 { "one-pass" } else { "bhm-cortex-m7" }) else { return };
    let Some(scans) = common::intel_scans() else { return };
    let mut profile = COMPACT;
    profile.settings.passes = passes;
    let n: usize = std::env::var("SCANS").map_or(40, |n| n.parse().unwrap());
    let mut host = OwnedMapper::<M, B>::new(&profile).unwrap();
    let mut device = Emulator::start(&program, &profile);
    println!("{:?}", device.greet());
    let mut before: Vec<u64> = vec![0; 5];
    for scan in scans.iter().take(n) {
        let report = host.integrate(&scan.as_scan()).unwrap();
        let status = device.learn(scan);
        let now: Vec<u64> = ["tiles_touched", "rows", "points_used", "passes", "beams_hit"]
            .iter()
            .map(|c| counter(&status, c))
            .collect();
        println!(
            "S {} {} {} {} {} {}",
            instructions(&status),
            now[1] - before[1],
            now[0] - before[0],
            now[2] - before[2],
            now[3] - before[3],
            report.beams.total()
        );
        before = now;
        if status.handled.unwrap().1 == n as u64 {
            println!("stack {:?} evicted {}", status.stack_high_water_bytes, counter(&status, "tiles_evicted"));
        }
    }
    device.settle();
    println!("{:?}", device.end.counters());
    for (mine, theirs) in device.end.mirror().tiles().zip(host.mapper().tiles().iter()) {
        let a = mine.view::<M, B>().unwrap();
        let b = theirs.posterior.view();
        let d = a
            .covariance
            .as_flattened()
            .iter()
            .zip(b.covariance.as_flattened())
            .filter(|(x, y)| x.to_bits() != y.to_bits())
            .count();
        let first = a
            .covariance
            .as_flattened()
            .iter()
            .zip(b.covariance.as_flattened())
            .enumerate()
            .find(|(_, (x, y))| x.to_bits() != y.to_bits());
        let m = a.mean.iter().zip(b.mean).filter(|(x, y)| x.to_bits() != y.to_bits()).count();
        println!(
            "T {:?} {:?} updates {} {}: {d} cov {first:?} {m} mean",
            mine.version.index, theirs.index, mine.version.updates, theirs.updates
        );
    }
    let ours = device.end.mirror().tiles().map(|tile| (tile.version.index, tile.view::<M, B>().unwrap()));
    let theirs = host.mapper().tiles().iter().map(|tile| (tile.index, tile.posterior.view()));
    assert_eq!(posterior_digest(ours), posterior_digest(theirs));
    let (status, log) = device.finish();
    println!("{status} {}", log.len());
}
