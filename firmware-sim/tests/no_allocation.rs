//! Memory does not grow in the loop after start-up, shared memory included. A program of its own, for its own allocator.
//!
//! The loop itself allocates nothing. iceoryx2 takes 48 bytes for each message that it sends, and gives them back when it
//! is sent; nothing else is allowed.
#![cfg(feature = "ipc")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use bhm_core::{
    geometry::Pose,
    lattice::Window,
    profile::{self, Capacities, Profile},
    scan::{Scan, ScanHeader},
    support::{GaussianSettings, SupportSettings},
};
use bhm_firmware_sim::{OnboardOptions, Options, Until, run_onboard};
use bhm_host::{
    ipc::{PacedSource, Place, Sent, StatusSubscriber, TemporaryDomain, open_posterior_any},
    supports::LearnedSupports,
};

thread_local! {
    static WATCHED: Cell<bool> = const { Cell::new(false) };
}

/// What iceoryx2 may take while a message is being written.
const BOOKKEEPING_BYTES: usize = 64;

/// Allocations of the watched thread, those larger than iceoryx2's bookkeeping, and those that were not given back.
static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);
static LARGE: AtomicU64 = AtomicU64::new(0);
static KEPT: AtomicI64 = AtomicI64::new(0);

fn watched() -> bool {
    WATCHED.try_with(Cell::get).unwrap_or(false)
}

struct Counting;

// SAFETY: everything is left to the system's allocator; counting does not allocate.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if watched() {
            ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
            LARGE.fetch_add(u64::from(layout.size() > BOOKKEEPING_BYTES), Ordering::Relaxed);
            KEPT.fetch_add(1, Ordering::Relaxed);
        }
        // SAFETY: as the caller promised.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        if watched() {
            KEPT.fetch_sub(1, Ordering::Relaxed);
        }
        // SAFETY: as the caller promised.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn memory_does_not_grow_once_the_loop_runs() {
    const PROFILE: Profile = Profile {
        capacities: Capacities { tiles: 24, observations: 4_096, rows: 4_096, touched: 24 },
        ..profile::COMPACT
    };
    let domain = TemporaryDomain::new().expect("a domain");
    // With supports of their own for some nodes: they travel before the loop begins.
    let window = Window { first: [-8; 2], width: [16; 2] };
    let gaussian = SupportSettings::GaussianSupport(GaussianSettings { size: 0.2 });
    let gaussians = vec![gaussian.build(0.5); window.supports()];
    let supports = LearnedSupports::new([0.0; 2], 0.5, window, gaussians, None).expect("good supports");
    let profile = Profile { settings: PROFILE.settings.fitted(supports.table()), ..PROFILE };
    let run = Options { publish_every: 3, linger_ns: 0, until: Until::SourceEnds, deadline_ns: Some(1) };
    let options = OnboardOptions { run, consumers: 2, path_poses: 16, supports: Some(supports) };
    let never = AtomicBool::new(false);
    thread::scope(|scope| {
        let mapper = scope.spawn(|| {
            WATCHED.set(true);
            let at_the_end = |_: &dyn bhm_host::map::AnyMap, _: &_| {
                WATCHED.set(false);
                Ok(())
            };
            run_onboard(&profile, &domain, &options, &never, at_the_end).expect("no error")
        });
        let here = domain.join("test").expect("a domain of one's own");
        let mut source = PacedSource::open(&here).expect("the only source");
        let mut status = StatusSubscriber::open(&here).expect("room");
        let ranges_m = [3.0; 90];
        let mut send = |number: u64, place| {
            let scan = Scan {
                header: ScanHeader {
                    stamp_ns: number,
                    map_from_sensor: Pose::new((number % 40) as f32 * 0.05, 0.0, 0.0),
                    angle_min_rad: 0.0,
                    angle_increment_rad: 0.07,
                    range_min_m: 0.1,
                    range_max_m: 20.0,
                    ..ScanHeader::default()
                },
                ranges_m: &ranges_m,
            };
            assert_eq!(source.send(&scan, place, &never), Ok(Sent::Yes));
            assert_eq!(source.finish(&never), Ok(Sent::Yes));
        };
        // Everybody is connected, and both consumers have heard something.
        send(1, Place::Within);
        let mut consumer = open_posterior_any(&here).expect("a mapper is there");
        let _ = status.receive(Duration::MAX);
        for number in 2..20 {
            send(number, Place::Within);
            let _ = consumer.receive(Duration::ZERO);
        }
        let settled = || {
            // Idle cycles: nothing is being sent.
            thread::sleep(Duration::from_millis(120));
            (LARGE.load(Ordering::Relaxed), KEPT.load(Ordering::Relaxed))
        };
        let before = settled();
        assert!(before.0 > 0 && before.1 > 0, "the count works");
        let allocations = ALLOCATIONS.load(Ordering::Relaxed);
        for number in 20..300 {
            send(number, Place::Within);
            let _ = consumer.receive(Duration::ZERO);
        }
        assert_eq!(settled(), before, "large allocations, and those not given back");
        // Each of 280 scans was reported, published, and reported again.
        let more = ALLOCATIONS.load(Ordering::Relaxed) - allocations;
        assert!(more <= 3 * 280, "{more} allocations");
        send(300, Place::Last);
        let summary = mapper.join().expect("no panic");
        assert_eq!((summary.counters.integrated, summary.counters.tiles_evicted), (300, 0));
    });
}
