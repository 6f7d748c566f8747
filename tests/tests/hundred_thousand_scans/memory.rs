//! What the program allocates, and what the kernel says that it has.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    fs::File,
    io::Read,
};

use stats_alloc::{INSTRUMENTED_SYSTEM, Region, Stats, StatsAlloc};

use crate::{LOOK_EVERY, SCANS};

/// Counts what the thread that runs the loop allocates; the test program's own thread says after a minute that it still runs,
/// which allocates.
struct ThisThread;

thread_local! {
    static WATCHED: Cell<bool> = const { Cell::new(false) };
}

static COUNTED: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

#[global_allocator]
static ALLOCATOR: ThisThread = ThisThread;

/// Whether what this thread allocates is counted from now on.
pub(crate) fn watch(is_watched: bool) {
    WATCHED.set(is_watched);
}

fn watched() -> bool {
    WATCHED.try_with(Cell::get).unwrap_or(false)
}

// SAFETY: both are the system's allocator, one of them with a count, which does not allocate.
unsafe impl GlobalAlloc for ThisThread {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller promised.
        unsafe { if watched() { COUNTED.alloc(layout) } else { System.alloc(layout) } }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as the caller promised.
        unsafe { if watched() { COUNTED.dealloc(pointer, layout) } else { System.dealloc(pointer, layout) } }
    }
}

/// Memory that the process has, by the kernel's count, which knows pages of 4 KiB and nothing finer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Resident {
    /// Everything, the program's own code included.
    all_kb: u64,
    /// What no file holds: stacks, heap, statics that were written to.
    anonymous_kb: u64,
}

/// What was seen of it, in room taken beforehand.
pub(crate) struct Looks {
    seen: [Resident; SCANS / LOOK_EVERY + 2],
    count: usize,
    region: Option<Region<'static, System>>,
}

impl Looks {
    /// None yet, its memory written to.
    pub(crate) fn new() -> Self {
        Self { seen: [Resident { all_kb: 1, anonymous_kb: 1 }; _], count: 0, region: None }
    }

    pub(crate) fn look(&mut self) {
        // From the second scan on not a byte is allocated.
        self.region.get_or_insert_with(|| Region::new(COUNTED));
        let mut text = [0; 2_048];
        // Exact, unlike `statm` and `VmRSS`, which each processor may be some pages behind with.
        let read = File::open("/proc/self/smaps_rollup").and_then(|mut file| file.read(&mut text));
        let text = str::from_utf8(&text[..read.unwrap_or(0)]).expect("plain text");
        let kb = |name: &str| {
            let line = text.lines().find_map(|line| line.strip_prefix(name)).expect("the kernel's line");
            line.trim().trim_end_matches(" kB").parse::<u64>().expect("a number")
        };
        self.seen[self.count] = Resident { all_kb: kb("Rss:"), anonymous_kb: kb("Anonymous:") };
        self.count += 1;
    }

    /// What was allocated since the first look.
    pub(crate) fn allocated(&self) -> Stats {
        self.region.as_ref().expect("there was a second scan").change()
    }

    /// The looks of the first, …, the last quarter.
    fn quarter(&self, quarter: usize) -> &[Resident] {
        let looks = self.count / 4;
        &self.seen[quarter * looks..][..looks]
    }
}

pub(crate) fn resident_memory_is_flat(looks: &Looks) {
    let [first, last] = [looks.quarter(0), looks.quarter(3)];
    println!("resident: first quarter {:?} … {:?}, last {:?}", first[0], first[first.len() - 1], last[last.len() - 1]);
    // To the page of 4 KiB. Code that is needed late is read from the program's file late, and given back if memory is short:
    // that part of the resident set is the kernel's, not the map's.
    let anonymous = |seen: &[Resident]| seen.iter().map(|seen| seen.anonymous_kb).max();
    assert_eq!(anonymous(first), anonymous(last), "stack or heap grew");
    let all = |seen: &[Resident]| seen.iter().map(|seen| seen.all_kb).max();
    assert_eq!(all(first), all(last), "the resident set grew");
}
