//! Arm MPS2 with the AN500 image: a Cortex-M7 in QEMU (`-M mps2-an500`) or on the FPGA board.
//!
//! 4 MB of SSRAM for code and as much for data, 16 MB of PSRAM, a clock of 25 MHz. The stack lies at the bottom of the data
//! memory, so that one that overflows leaves the memory and faults instead of growing into the state.
//!
//! ```memory.x
//! MEMORY
//! {
//!   FLASH : ORIGIN = 0x00000000, LENGTH = 4M
//!   STACK : ORIGIN = 0x20000000, LENGTH = 16K
//!   RAM   : ORIGIN = 0x20004000, LENGTH = 4M - 16K
//!   PSRAM : ORIGIN = 0x60000000, LENGTH = 16M
//! }
//! _stack_end = ORIGIN(STACK);
//! _stack_start = ORIGIN(STACK) + LENGTH(STACK);
//! _archive_start = ORIGIN(PSRAM);
//! _archive_end = ORIGIN(PSRAM) + LENGTH(PSRAM);
//! ```
//!
//! Scans and posteriors go through UART 0, the log through UART 1, and time is timer 0.

use core::{
    ptr::{read_volatile, write_volatile},
    sync::atomic::{AtomicU32, Ordering},
};

use bhm_core::tile::Tile;
use bhm_firmware_sim::serial::Arriving;

use super::Board;
use crate::state::{B, M};

/// Registers of a CMSDK UART, 32-bit words from its base.
const DATA: usize = 0;
const STATE: usize = 1;
const CONTROL: usize = 2;
const INTERRUPT: usize = 3;
const BAUD_DIVIDER: usize = 4;

const STATE_TX_FULL: u32 = 1;
const STATE_RX_FULL: u32 = 1 << 1;
const STATE_RX_OVERRUN: u32 = 1 << 3;
const CONTROL_TX: u32 = 1;
const CONTROL_RX: u32 = 1 << 1;
const CONTROL_RX_INTERRUPT: u32 = 1 << 3;
const INTERRUPT_RX: u32 = 1 << 1;

/// Registers of a CMSDK timer, 32-bit words from its base; it counts down from `RELOAD` to 0.
const TIMER_CONTROL: usize = 0;
const TIMER_VALUE: usize = 1;
const TIMER_RELOAD: usize = 2;
const TIMER_INTERRUPT: usize = 3;
const TIMER_ENABLE: u32 = 1;
const TIMER_RAISES: u32 = 1 << 3;

/// Nanoseconds of one tick at 25 MHz.
const TICK_NS: u64 = 40;

/// How often the timer has run down.
static ROUNDS: AtomicU32 = AtomicU32::new(0);

/// A block of registers.
#[derive(Clone, Copy)]
struct Registers(*mut u32);

impl Registers {
    fn read(self, register: usize) -> u32 {
        // SAFETY: every constant above lies in the peripheral's 4 KB, which the memory map reserves for it.
        unsafe { read_volatile(self.0.add(register)) }
    }

    fn write(self, register: usize, value: u32) {
        // SAFETY: as for `read`; the registers written here have no effect on memory.
        unsafe { write_volatile(self.0.add(register), value) }
    }
}

const LINK: Registers = Registers(0x4000_4000 as *mut u32);
const LOG: Registers = Registers(0x4000_5000 as *mut u32);
const TIMER: Registers = Registers(0x4000_0000 as *mut u32);

/// Interrupt numbers.
const LINK_RX: i16 = 0;
const TIMER_0: i16 = 8;

/// The board itself.
pub struct Mps2An500;

fn write_all(uart: Registers, bytes: &[u8]) {
    for byte in bytes {
        while uart.read(STATE) & STATE_TX_FULL != 0 {}
        uart.write(DATA, u32::from(*byte));
    }
}

impl Board for Mps2An500 {
    const NAME: &'static str = "mps2-an500";

    fn start() {
        for uart in [LINK, LOG] {
            // The fastest there is: 25 MHz / 16.
            uart.write(BAUD_DIVIDER, 16);
        }
        LOG.write(CONTROL, CONTROL_TX);
        LINK.write(CONTROL, CONTROL_TX | CONTROL_RX | CONTROL_RX_INTERRUPT);
        TIMER.write(TIMER_RELOAD, u32::MAX);
        TIMER.write(TIMER_VALUE, u32::MAX);
        TIMER.write(TIMER_CONTROL, TIMER_ENABLE | TIMER_RAISES);
        for interrupt in [LINK_RX, TIMER_0] {
            // SAFETY: both have a handler below, and no critical section relies on their mask.
            unsafe { cortex_m::peripheral::NVIC::unmask(Interrupt(interrupt)) };
        }
    }

    fn interrupt(number: i16, arriving: &mut Arriving<'_>) {
        match number {
            LINK_RX => {
                LINK.write(INTERRUPT, INTERRUPT_RX);
                while LINK.read(STATE) & STATE_RX_FULL != 0 {
                    arriving.push(LINK.read(DATA) as u8);
                }
                if LINK.read(STATE) & STATE_RX_OVERRUN != 0 {
                    LINK.write(STATE, STATE_RX_OVERRUN);
                    arriving.lost(1);
                }
            }
            TIMER_0 => {
                TIMER.write(TIMER_INTERRUPT, 1);
                ROUNDS.store(ROUNDS.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
            }
            _ => {}
        }
    }

    fn write(bytes: &[u8]) {
        write_all(LINK, bytes);
    }

    fn log(bytes: &[u8]) {
        write_all(LOG, bytes);
    }

    fn now_ns() -> u64 {
        cortex_m::interrupt::free(|_| {
            let (mut rounds, mut left) = (ROUNDS.load(Ordering::Relaxed), TIMER.read(TIMER_VALUE));
            // Ran down since interrupts are off, which its handler has not counted yet.
            if TIMER.read(TIMER_INTERRUPT) != 0 {
                rounds += 1;
                left = TIMER.read(TIMER_VALUE);
            }
            (u64::from(rounds) << 32 | u64::from(u32::MAX - left)) * TICK_NS
        })
    }

    fn archive() -> &'static mut [Tile<2, M, B>] {
        unsafe extern "C" {
            static mut _archive_start: Tile<2, M, B>;
            static mut _archive_end: Tile<2, M, B>;
        }
        let start = &raw mut _archive_start;
        let slots = (&raw mut _archive_end as usize - start as usize) / size_of::<Tile<2, M, B>>();
        // SAFETY: the memory map gives this memory to nobody else, it begins as aligned as a memory can, the trait allows one
        // call, and all-zero bytes are a vacant tile.
        unsafe {
            core::ptr::write_bytes(start, 0, slots);
            core::slice::from_raw_parts_mut(start, slots)
        }
    }

    fn end(well: bool) -> ! {
        use cortex_m_semihosting::debug::{EXIT_FAILURE, EXIT_SUCCESS, exit};
        exit(if well { EXIT_SUCCESS } else { EXIT_FAILURE });
        // Without a debugger there is nobody to exit to.
        loop {
            cortex_m::asm::wfi();
        }
    }
}

/// An interrupt by its number.
#[derive(Clone, Copy)]
struct Interrupt(i16);

// SAFETY: the numbers are those of the AN500 image, below its 32 interrupts.
unsafe impl cortex_m::interrupt::InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self.0 as u16
    }
}

/// What the program runs on.
pub type Selected = Mps2An500;
