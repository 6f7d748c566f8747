//! How much of the stack was ever used: what start-up painted and nobody wrote over since.

use core::ptr::read_volatile;

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// The most that the stack ever took, bytes.
#[must_use]
pub fn high_water_bytes() -> u32 {
    let (mut at, top) = (&raw const _stack_end, &raw const _stack_start);
    // SAFETY: between these two lies the stack, painted word by word before anything ran on it.
    unsafe {
        while at < top && read_volatile(at) == cortex_m_rt::STACK_PAINT_VALUE {
            at = at.add(1);
        }
    }
    (top as usize - at as usize) as u32
}

/// Bytes of the stack.
#[must_use]
pub fn bytes() -> u32 {
    (&raw const _stack_start as usize - &raw const _stack_end as usize) as u32
}

/// The lowest address of the stack.
#[must_use]
pub fn bottom() -> usize {
    &raw const _stack_end as usize
}
