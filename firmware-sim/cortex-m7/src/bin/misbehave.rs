//! Ends badly in the way that the first byte over the link asks for, for the tests of how that shows.
#![no_std]
#![no_main]

use bhm_cortex_m7::{
    board::{Board, Selected},
    port::BoardPort,
    state,
};
use bhm_firmware_sim::serial::embedded_io::Read;

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut port = BoardPort::new(state::link().queue.split());
    Selected::start();
    defmt::info!("waiting for a byte");
    let mut byte = [0];
    loop {
        // Waits for one.
        let Ok(_) = port.read(&mut byte);
        match byte[0] {
            b'p' => panic!("asked to"),
            b'o' => defmt::warn!("{} levels deep", overflow(1)),
            // Address space that no memory answers for.
            // SAFETY: it is not safe; the fault it raises is what is asked for.
            b'f' => unsafe { core::ptr::write_volatile(0x9fff_fff0 as *mut u32, 1) },
            b'e' => Selected::end(true),
            other => defmt::warn!("p, o, f or e, not {=u8}", other),
        }
    }
}

/// Takes more of the stack than there is.
#[inline(never)]
fn overflow(depth: u32) -> u32 {
    let mut frame = [depth; 64];
    let frame = core::hint::black_box(&mut frame);
    frame[0] + if frame[63] > 0 { overflow(depth + 1) } else { 0 }
}
