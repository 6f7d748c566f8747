//! The onboard loop as a robot has it, in lent memory, over 100 000 scans of a robot that drives on and on: memory is flat to
//! the byte, and no scan, whatever it holds, is more work than the profile's capacities allow.

mod common;

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    fs::File,
    io::Read,
};

use bhm_core::{
    beam::LabelledPlace,
    geometry::{Pose, PoseCovariance},
    lattice::Node,
    mapper::{IntegrateReport, Mapper, Memory, ScanRejected},
    posterior::{Entry, RowState, Scratch},
    profile::{self, Capacities, Profile},
    scan::{MAX_BEAMS, Scan},
    settings::Settings,
    support::SupportTable,
    tile::{Archive, DirectoryEntry, Tile, TileIndex},
};
use bhm_firmware_sim::{
    Counters, End, Incoming, IncomingScan, LentMap, Link, News, Onboard, OnboardMap, Options, Patience, Report,
};
use common::Stream;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

/// Counts what the thread that runs the loop allocates; the test program's own thread says after a minute that it still runs,
/// which allocates.
struct ThisThread;

thread_local! {
    static WATCHED: Cell<bool> = const { Cell::new(false) };
}

static COUNTED: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

#[global_allocator]
static ALLOCATOR: ThisThread = ThisThread;

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

const M: usize = 144;
const B: usize = 40;

const SCANS: usize = 100_000;

/// Scans between two looks at the memory; a quarter is many of these.
const LOOK_EVERY: usize = 500;
const QUARTER: usize = SCANS / 4;

/// Far fewer slots than tiles on the way, so that a tile leaves for nearly each that comes; room for the observations of an
/// ordinary scan, and none to spare for the largest.
const PROFILE: Profile = Profile {
    settings: Settings { passes: 1, ..profile::COMPACT.settings },
    capacities: Capacities { tiles: 8, points: 192, rows: 48, touched: 6 },
    ..profile::COMPACT
};

/// Tiles that the archive has room for: fewer than there are on the way, so that some come back and others are lost.
const ARCHIVED: usize = 48;

/// Everything that one scan may cost at most, from the profile alone. What bounds a scan's work is asserted here.
fn check(report: &IntegrateReport) {
    let Capacities { tiles: _, points, rows, touched } = PROFILE.capacities;
    let IntegrateReport { beams, points: placed, .. } = report;
    let [points, rows, touched] = [points, rows, touched].map(|capacity| capacity as u32);
    let read = beams.hits + beams.beyond_range + beams.no_return;
    let dropped = beams.not_a_number + beams.negative + beams.too_near + beams.over_capacity;
    assert!(read + dropped <= MAX_BEAMS as u32, "{report:?}");
    assert!(placed.used + placed.unplaceable <= points, "{report:?}");
    assert!(report.tiles_touched <= touched, "{report:?}");
    // An observation is a row in each tile that holds its whole stencil: two along each axis at most.
    assert!(report.rows <= 4 * placed.used && report.rows <= report.tiles_touched * rows, "{report:?}");
    assert!(report.rows + report.rows_over_capacity <= 4 * placed.used, "{report:?}");
    assert!(report.passes <= report.tiles_touched * PROFILE.settings.passes, "{report:?}");
    for part in [report.tiles_created + report.tiles_restored, report.tiles_evicted, report.tiles_failed] {
        assert!(part <= report.tiles_touched, "{report:?}");
    }
    assert!(report.rows_refused == 0 && report.tiles_lost <= report.tiles_evicted, "{report:?}");
}

/// What a scan is like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Ordinary,
    /// Some ranges are no ranges.
    BadRanges,
    /// As many beams as a scan may have.
    AllBeams,
    /// From somewhere else on the lattice, however far.
    Teleported,
    /// One that must be refused, in one of so many ways.
    Refused(usize),
}

const WAYS_TO_BE_REFUSED: usize = 8;

impl Kind {
    /// One in eight is hostile.
    fn of(number: usize) -> Self {
        match number % 48 {
            5 | 13 => Self::BadRanges,
            21 => Self::AllBeams,
            29 => Self::Teleported,
            37 | 45 => Self::Refused(number / 48 % WAYS_TO_BE_REFUSED),
            _ => Self::Ordinary,
        }
    }
}

/// A robot that drives round a ring road, four times, and a lidar with its share of nonsense. One scan in memory at a time.
struct Robot {
    sent: usize,
    random: Stream,
    ranges_m: [f32; MAX_BEAMS + 1],
    looks: Looks,
    reports: u64,
}

impl Robot {
    const BEAMS: usize = 24;
    /// Half a kilometre round, 2 cm from scan to scan.
    const RING_M: f64 = 80.0;
    const HALF_WIDTH_M: f32 = 1.6;

    /// The next scan.
    fn scan(&mut self) -> Scan<'_> {
        let number = self.sent - 1;
        let kind = Kind::of(number);
        // The angle on the ring; in f64, and within a turn, or the last rounds would be coarser than the first.
        let along = std::f64::consts::TAU * (number % QUARTER) as f64 / QUARTER as f64;
        let (sine, cosine) = along.sin_cos();
        let [x_m, y_m] = [cosine, sine].map(|part| (Self::RING_M * part) as f32);
        let heading_rad = (along + std::f64::consts::FRAC_PI_2) as f32;
        let mut scan = Scan {
            stamp_ns: 1 + number as u64,
            map_from_sensor: Pose::new(x_m, y_m, heading_rad),
            pose_covariance: number.is_multiple_of(3).then(|| PoseCovariance::independent(0.02, 0.005)),
            angle_min_rad: 0.1,
            angle_increment_rad: std::f32::consts::TAU / Self::BEAMS as f32,
            range_min_m: 0.05,
            range_max_m: 4.0,
            ranges_m: &[],
        };
        let mut beams = Self::BEAMS;
        match kind {
            Kind::Ordinary | Kind::BadRanges => {}
            Kind::AllBeams => {
                beams = MAX_BEAMS;
                scan.angle_increment_rad = 0.01;
            }
            Kind::Teleported => {
                const PLACES_M: [[f32; 2]; 4] = [[6e4, 6e4], [-6e4, 1.0], [0.0, 0.0], [-5e4, -3e4]];
                let [x_m, y_m] = PLACES_M[self.random.below(PLACES_M.len())];
                scan.map_from_sensor = Pose::new(x_m, y_m, 100.0);
            }
            Kind::Refused(0) => scan.map_from_sensor.x_m = f32::NAN,
            Kind::Refused(1) => scan.map_from_sensor.y_m = 1e30,
            Kind::Refused(2) => scan.map_from_sensor.theta_rad = f32::INFINITY,
            Kind::Refused(3) => {
                scan.pose_covariance = Some(PoseCovariance { xx_m2: -1.0, ..PoseCovariance::independent(0.1, 0.1) });
            }
            Kind::Refused(4) => scan.angle_increment_rad = f32::NAN,
            Kind::Refused(5) => scan.range_min_m = 5.0,
            Kind::Refused(6) => scan.stamp_ns = 0,
            Kind::Refused(_) => beams = MAX_BEAMS + 1,
        }
        for (beam, range_m) in self.ranges_m[..beams].iter_mut().enumerate() {
            // Walls on both sides, off by a little noise, and nothing within range ahead and behind.
            let bearing_rad = scan.angle_min_rad + beam as f32 * scan.angle_increment_rad;
            let wall_m = Self::HALF_WIDTH_M / bearing_rad.sin().abs().max(1e-3);
            *range_m = wall_m.min(10.0) + self.random.between(-0.02, 0.02) as f32;
            if kind == Kind::BadRanges && beam % 2 == 0 {
                const BAD: [f32; 8] =
                    [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 0.0, -0.0, f32::MAX, f32::MIN_POSITIVE];
                *range_m = BAD[self.random.below(BAD.len())];
            }
        }
        scan.ranges_m = &self.ranges_m[..beams];
        scan
    }
}

impl Link<M, B> for Robot {
    type Fault = ();

    fn receive(&mut self, _: Patience) -> Result<Incoming<'_>, ()> {
        if self.sent % LOOK_EVERY == 1 {
            self.looks.look();
        }
        if self.sent == SCANS {
            return Ok(Incoming::Stop);
        }
        self.sent += 1;
        let sequence = self.sent as u64;
        Ok(Incoming::Scan(IncomingScan { source: 1, sequence, last: false, received_ns: None, scan: self.scan() }))
    }

    fn publish(&mut self, mapper: &Mapper<'_, M, B>, _: &News) -> Result<(), ()> {
        assert!(mapper.tiles().resident() <= PROFILE.capacities.tiles);
        Ok(())
    }

    fn report(&mut self, _: &Report<'_>) -> Result<(), ()> {
        self.reports += 1;
        Ok(())
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
struct Looks {
    seen: [Resident; SCANS / LOOK_EVERY + 2],
    count: usize,
    region: Option<Region<'static, System>>,
}

impl Looks {
    fn look(&mut self) {
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

    /// The looks of the first, …, the last quarter.
    fn quarter(&self, quarter: usize) -> &[Resident] {
        let looks = self.count / 4;
        &self.seen[quarter * looks..][..looks]
    }
}

/// Work of the ordinary scans of a quarter.
#[derive(Clone, Copy, Debug, Default)]
struct Work {
    scans: u64,
    tiles: u64,
    rows: u64,
    passes: u64,
}

/// The map, with every report checked and the work added up by quarters.
struct Watched {
    map: LentMap<'static, Shelf, M, B>,
    offered: usize,
    work: [Work; 4],
    hostile: [u64; 3],
}

impl OnboardMap<M, B> for Watched {
    fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected> {
        let (kind, quarter) = (Kind::of(self.offered), self.offered / QUARTER);
        self.offered += 1;
        let result = self.map.integrate(scan);
        match (kind, &result) {
            (Kind::Refused(_), Err(_)) => {}
            (Kind::Refused(_), Ok(_)) | (_, Err(_)) => panic!("scan {}, {kind:?}: {result:?}", self.offered),
            (_, Ok(report)) => check(report),
        }
        if let (Kind::Ordinary, Ok(report)) = (kind, &result) {
            let work = &mut self.work[quarter];
            work.scans += 1;
            work.tiles += u64::from(report.tiles_touched);
            work.rows += u64::from(report.rows);
            work.passes += u64::from(report.passes);
        }
        match (kind, &result) {
            (Kind::BadRanges, Ok(report)) => {
                self.hostile[0] += u64::from(report.beams.not_a_number + report.beams.negative);
            }
            (Kind::AllBeams, Ok(report)) => self.hostile[1] += u64::from(report.beams.over_capacity > 0),
            (Kind::Teleported, Ok(report)) => self.hostile[2] += u64::from(report.tiles_evicted > 0),
            _ => {}
        }
        result
    }

    fn mapper(&self) -> &Mapper<'_, M, B> {
        self.map.mapper()
    }

    fn archived(&self) -> usize {
        self.map.archived()
    }
}

/// An archive of a fixed size, as a robot's flash is: when it is full, what comes is lost.
struct Shelf(Vec<Tile<M, B>>);

impl Archive<M, B> for Shelf {
    fn keep(&mut self, tile: &Tile<M, B>) -> bool {
        let place = self.0.iter_mut().find(|place| place.updates == 0 || place.index == tile.index);
        place.map(|place| place.clone_from_in_place(tile)).is_some()
    }

    fn bring_back(&mut self, index: &TileIndex<2>, tile: &mut Tile<M, B>) -> bool {
        let Some(place) = self.0.iter_mut().find(|place| place.updates > 0 && place.index == *index) else {
            return false;
        };
        tile.clone_from_in_place(place);
        place.updates = 0;
        true
    }
}

/// The loop, every byte that it will ever use written to once.
fn onboard() -> Onboard<Watched, Robot, M, B> {
    let Capacities { tiles, points, rows, touched } = PROFILE.capacities;
    let stencil = PROFILE.settings.stencil;
    let memory = Memory {
        tiles: vec![Tile::VACANT; tiles].leak(),
        directory: vec![DirectoryEntry::default(); tiles].leak(),
        scratch: Box::leak(Box::new(Scratch::ZERO)),
        places: vec![LabelledPlace::default(); points].leak(),
        firsts: vec![Some(Node::<2>::default()); points].leak(),
        touched: vec![[1; 2]; touched].leak(),
        entries: vec![Entry::default(); rows * stencil * stencil].leak(),
        states: vec![RowState::default(); rows].leak(),
        supports: SupportTable::EMPTY,
    };
    let mapper = Mapper::new(PROFILE.settings, memory).expect("a good profile");
    let map = LentMap::new(mapper, Shelf(vec![Tile::VACANT; ARCHIVED]));
    let looks = Looks { seen: [Resident { all_kb: 1, anonymous_kb: 1 }; _], count: 0, region: None };
    let robot = Robot { sent: 0, random: Stream::new(0x6268_6d10), ranges_m: [1.0; MAX_BEAMS + 1], looks, reports: 0 };
    Onboard::new(Watched { map, offered: 0, work: [Work::default(); 4], hostile: [0; 3] }, robot, Options::default())
}

/// One test, so that no other changes the resident set.
#[test]
fn memory_is_flat_and_every_scan_bounded_over_a_hundred_thousand_scans() {
    let mut onboard = onboard();
    WATCHED.set(true);
    assert_eq!(onboard.run(), End::Stopped);
    WATCHED.set(false);
    let region = onboard.link().looks.region.as_ref().expect("there was a second scan");
    let change = region.change();
    assert_eq!((change.allocations, change.reallocations, change.deallocations), (0, 0, 0));
    assert_eq!((change.bytes_allocated, change.bytes_deallocated), (0, 0));

    let (map, robot, counters) = (onboard.map(), onboard.link(), *onboard.counters());
    println!("{counters:?}\n{:?}", map.work);
    resident_memory_is_flat(&robot.looks);
    work_does_not_grow(&map.work);
    the_scans_were_what_they_were_meant_to_be(map, &counters);
    assert_eq!(robot.reports, 1 + SCANS as u64);
}

fn resident_memory_is_flat(looks: &Looks) {
    let [first, last] = [looks.quarter(0), looks.quarter(3)];
    println!("resident: first quarter {:?} … {:?}, last {:?}", first[0], first[first.len() - 1], last[last.len() - 1]);
    // To the page of 4 KiB. Code that is needed late is read from the program's file late, and given back if memory is short:
    // that part of the resident set is the kernel's, not the map's.
    let anonymous = |seen: &[Resident]| seen.iter().map(|seen| seen.anonymous_kb).max();
    assert_eq!(anonymous(first), anonymous(last), "stack or heap grew");
    let all = |seen: &[Resident]| seen.iter().map(|seen| seen.all_kb).max();
    assert_eq!(all(first), all(last), "the resident set grew");
}

/// A quarter is a round of the ring road: the same walls from the same poses, so that noise alone tells one from another.
fn work_does_not_grow(rounds: &[Work; 4]) {
    let a_scan = |work: &Work| [work.tiles, work.rows].map(|count| count as f64 / work.scans as f64);
    let first = a_scan(&rounds[0]);
    for round in rounds {
        for (mean, first) in a_scan(round).into_iter().zip(first) {
            assert!((mean / first - 1.0).abs() < 0.005, "{rounds:?}");
        }
        assert_eq!(round.passes, round.tiles * u64::from(PROFILE.settings.passes), "{rounds:?}");
    }
}

fn the_scans_were_what_they_were_meant_to_be(map: &Watched, counters: &Counters) {
    assert_eq!(counters.received, SCANS as u64);
    assert_eq!(counters.integrated + counters.rejected(), counters.received);
    for refused in [
        counters.rejected_pose_not_finite,
        counters.rejected_pose_too_far,
        counters.rejected_pose_covariance,
        counters.rejected_angles,
        counters.rejected_range_limits,
        counters.rejected_stamp_went_back,
        counters.rejected_too_many_beams,
    ] {
        assert!(refused > 500, "{counters:?}");
    }
    assert!(map.hostile.iter().all(|count| *count > 1_000), "{:?}", map.hostile);
    assert!(counters.tiles_evicted > 1_000 && counters.tiles_restored > 100, "{counters:?}");
    assert!(counters.tiles_lost > 100 && counters.tiles_failed == 0, "{counters:?}");
    assert!(counters.rows_over_capacity > 0 && counters.points_over_capacity > 0, "{counters:?}");
}
