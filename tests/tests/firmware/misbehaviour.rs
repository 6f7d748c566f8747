use bhm_core::profile::COMPACT;

use crate::emulator::{Emulator, program};

/// What the program that misbehaves ends with when it is sent the byte: whether well, and its log, undecoded.
fn ends(byte: u8) -> Option<(bool, String)> {
    let mut device = Emulator::start(&program("misbehave")?, &COMPACT);
    device.send(&[byte]);
    let (status, log) = device.ended();
    Some((status.success(), String::from_utf8_lossy(&log).into_owned()))
}

#[test]
fn a_panic_ends_with_its_message_in_the_log_and_a_failing_exit() {
    let Some((well, log)) = ends(b'p') else { return };
    // Text formatted on the device is in the log as it is, in pieces.
    assert!(!well && log.contains("misbe"), "{log:?}");
}

#[test]
fn a_stack_that_overflows_faults_and_says_so() {
    let (Some((well, overflow)), Some((_, fault))) = (ends(b'o'), ends(b'f')) else { return };
    assert!(!well && overflow != fault, "{overflow:?}");
}

#[test]
fn a_fault_ends_with_a_line_in_the_log_and_a_failing_exit() {
    let (Some((well, log)), Some((ended_well, quiet))) = (ends(b'f'), ends(b'e')) else { return };
    assert!(!well && ended_well && log.len() > quiet.len(), "{log:?}");
}
