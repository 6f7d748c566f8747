//! The firmware in an emulated Cortex-M7: the same map as on a computer, in a time and a memory known beforehand.
//!
//! Needs the programs (`firmware-sim/cortex-m7/run build`, or `BHM_FIRMWARE` naming the folder they are in) and QEMU. In CI
//! both must be there, elsewhere the tests say what is missing and pass. `BHM_FIRMWARE_SCANS` says how many scans of the log
//! are sent (200, and 60 to the variant with one pass; `all`), `BHM_FIRMWARE_MEASURE=write` writes the figures that the
//! documentation quotes instead of comparing with them.

#[path = "../common/mod.rs"]
mod common;
mod emulator;
mod full_scan;
mod image;
mod measured;
mod misbehaviour;
mod run;

use std::{panic, thread};

use bhm_core::{
    profile::{COMPACT, Profile},
    settings::Settings,
};
use bhm_firmware_sim::budget;
use emulator::{Emulator, program};
use measured::Measured;
use run::{Run, learn};

/// A variant of the firmware, and what it is made with.
pub(crate) struct Variant {
    pub(crate) program: &'static str,
    pub(crate) profile: Profile,
    /// Scans of the log unless said otherwise.
    pub(crate) scans: usize,
}

pub(crate) const THREE_PASSES: Variant = Variant { program: "bhm-cortex-m7", profile: COMPACT, scans: 200 };
pub(crate) const ONE_PASS: Variant = Variant {
    program: "one-pass",
    profile: Profile { settings: Settings { passes: 1, ..COMPACT.settings }, ..COMPACT },
    scans: 60,
};

/// Sends the recorded log, which the documented figures are of, compares every posterior that is asked for and every update with its bound; then the scan that fills
/// every capacity.
fn the_log_is_learned_as_on_a_computer_within_the_bound(variant: &Variant) -> Option<(Run, u64)> {
    let program = program(variant.program)?;
    let scans = common::intel_scans()?;
    let count = match std::env::var("BHM_FIRMWARE_SCANS").as_deref() {
        Ok("all") => scans.len(),
        Ok(count) => count.parse().expect("a number of scans, or all"),
        Err(_) => variant.scans,
    };
    let scans = &scans[..count.min(scans.len())];
    let run = learn(&program, &variant.profile, scans);
    let full = full_scan::learn(&program, &variant.profile);
    let most = budget::most_instructions(&variant.profile).expect("measured");
    let worst = run.worst().max(full);
    println!(
        "{}: {} scans, mean {:.2} million instructions, worst {:.2}; full scan {:.2}; bound {:.2} million, {:.2} times the worst",
        variant.program,
        scans.len(),
        run.mean() / 1e6,
        run.worst() as f64 / 1e6,
        full as f64 / 1e6,
        most as f64 / 1e6,
        most as f64 / worst as f64,
    );
    assert!(worst <= most, "{worst} instructions, {most} at most");
    assert!(most <= 2 * worst, "the bound of {most} is more than twice the worst, {worst}");
    Some((run, full))
}

#[test]
fn three_passes_and_one_are_the_computers_bit_for_bit_within_the_bound_and_as_documented() {
    // Side by side: together they are most of what the tests of the workspace wait for.
    let (three, one) = thread::scope(|scope| {
        let three = scope.spawn(|| the_log_is_learned_as_on_a_computer_within_the_bound(&THREE_PASSES));
        let one = the_log_is_learned_as_on_a_computer_within_the_bound(&ONE_PASS);
        (three.join().unwrap_or_else(|panic| panic::resume_unwind(panic)), one)
    });
    let (Some(three), Some(one)) = (three, one) else { return };
    let mean = one.0.mean();
    assert!(mean <= 25e6, "{mean} instructions a scan at one pass: a lidar at 10 Hz needs 25 million at 400 MHz");
    Measured::of(&three, &one).check();
}

/// Instructions of the clock's interrupt (34), and some: it counts how often the timer has run down. While the processor
/// sleeps QEMU has time jump to where the timer runs down, and may raise the interrupt in the update that comes next.
const CLOCK_INTERRUPT: u64 = 100;

#[test]
fn two_runs_take_the_same_instructions_but_for_an_interrupt_of_the_clock() {
    let Some(program) = program(ONE_PASS.program) else { return };
    for drive in common::drives() {
        let scans: Vec<_> = drive.scans.into_iter().step_by(30).take(25).collect();
        let [first, second] = [(); 2].map(|()| learn(&program, &ONE_PASS.profile, &scans).instructions);
        assert_eq!(first.len(), second.len());
        for (scan, (first, second)) in first.into_iter().zip(second).enumerate() {
            let off = first.abs_diff(second);
            assert!(off <= CLOCK_INTERRUPT, "{}, scan {scan}: {first} instructions, then {second}", drive.name);
        }
    }
}

#[test]
fn a_device_with_other_settings_is_refused() {
    let Some(program) = program(ONE_PASS.program) else { return };
    let mut device = Emulator::start(&program, &COMPACT);
    let refused = device.refusal();
    assert!(refused.contains("other settings"), "{refused}");
}
