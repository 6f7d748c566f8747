//! An allocator that counts, so that a decoder that takes absurd amounts of memory is found before the system feels it.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    process,
    sync::atomic::{AtomicUsize, Ordering},
};

/// Bytes taken and not given back, and how many there may be.
static TAKEN: AtomicUsize = AtomicUsize::new(0);
static LIMIT: AtomicUsize = AtomicUsize::new(usize::MAX);

struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Runs `f`, which may hold at most `limit_bytes` more than is held now at any moment. More ends the program with a report,
/// which libFuzzer takes for a crash.
///
/// What is asked for counts, whether or not it is ever touched.
pub fn within<T>(limit_bytes: usize, f: impl FnOnce() -> T) -> T {
    let taken = TAKEN.load(Ordering::Relaxed);
    LIMIT.store(taken.saturating_add(limit_bytes), Ordering::Relaxed);
    let result = f();
    LIMIT.store(usize::MAX, Ordering::Relaxed);
    result
}

fn take(bytes: usize) {
    let taken = TAKEN.fetch_add(bytes, Ordering::Relaxed).wrapping_add(bytes);
    let limit = LIMIT.load(Ordering::Relaxed);
    if taken > limit {
        // Printing may allocate.
        LIMIT.store(usize::MAX, Ordering::Relaxed);
        eprintln!("too much memory: {} bytes over the limit, the last request {bytes} bytes", taken - limit);
        process::abort();
    }
}

// SAFETY: everything is left to the system's allocator; counting does not allocate.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        take(layout.size());
        // SAFETY: as the caller promised.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        take(layout.size());
        // SAFETY: as the caller promised.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        TAKEN.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as the caller promised.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        take(new_size);
        TAKEN.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as the caller promised.
        unsafe { System.realloc(pointer, layout, new_size) }
    }
}
