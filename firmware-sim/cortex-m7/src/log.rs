//! The log: defmt frames over the board's second serial port.

use core::{
    cell::UnsafeCell,
    sync::atomic::{AtomicBool, Ordering},
};

use critical_section::RestoreState;
use defmt::Encoder;

use crate::board::{Board, Selected};

#[defmt::global_logger]
struct SerialLogger;

struct State {
    taken: AtomicBool,
    encoder: UnsafeCell<Encoder>,
    restore: UnsafeCell<RestoreState>,
}

// SAFETY: the cells are touched only between `acquire` and `release`, with interrupts masked on the one core there is.
unsafe impl Sync for State {}

static STATE: State = State {
    taken: AtomicBool::new(false),
    encoder: UnsafeCell::new(Encoder::new()),
    restore: UnsafeCell::new(RestoreState::invalid()),
};

// SAFETY: one writer at a time: interrupts are masked between `acquire` and `release`, and `taken` refuses a second.
unsafe impl defmt::Logger for SerialLogger {
    fn acquire() {
        // SAFETY: `release` gives the section back.
        let restore = unsafe { critical_section::acquire() };
        if STATE.taken.swap(true, Ordering::Relaxed) {
            // A panic while a frame is written: what it says cannot be logged, that it ended badly can be.
            Selected::end(false);
        }
        // SAFETY: nobody else is here.
        unsafe {
            *STATE.restore.get() = restore;
            (*STATE.encoder.get()).start_frame(Selected::log);
        }
    }

    unsafe fn flush() {}

    unsafe fn release() {
        // SAFETY: acquired, hence alone; the state is the one that `acquire` stored.
        unsafe {
            (*STATE.encoder.get()).end_frame(Selected::log);
            let restore = *STATE.restore.get();
            STATE.taken.store(false, Ordering::Relaxed);
            critical_section::release(restore);
        }
    }

    unsafe fn write(bytes: &[u8]) {
        // SAFETY: acquired, hence alone.
        unsafe { (*STATE.encoder.get()).write(bytes, Selected::log) }
    }
}
