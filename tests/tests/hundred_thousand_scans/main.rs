//! The onboard loop as a robot has it, in lent memory, over 100 000 scans of a robot that drives on and on: memory is flat to
//! the byte, and no scan, whatever it holds, is more work than the profile's capacities allow.

#[path = "../common/mod.rs"]
mod common;
mod memory;
mod robot;

use std::hint::black_box;

use bhm_core::{
    mapper::{IntegrateReport, Mapper},
    profile::{self, Capacities, Profile},
    scan::{MAX_BEAMS, Scan, ScanRejected},
    settings::Settings,
    static_memory,
    tile::{Archive, Tile, TileIndex},
};
use bhm_firmware_sim::{
    Counters, End, LentMap, Onboard, OnboardMap, Options,
    budget::{self, Instructions, Work},
};
use memory::{resident_memory_is_flat, watch};
use robot::{Kind, Robot};

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
    capacities: Capacities { tiles: 8, observations: 192, rows: 48, touched: 6 },
    ..profile::COMPACT
};

/// Tiles that the archive has room for: fewer than there are on the way, so that some come back and others are lost.
const ARCHIVED: usize = 48;

/// Everything that one scan may cost at most, from the profile alone. What bounds a scan's work is asserted here. Answers the
/// instructions that it may have taken.
fn check(report: &IntegrateReport) -> u64 {
    let Capacities { tiles: _, observations, rows, touched } = PROFILE.capacities;
    let IntegrateReport { beams, observations: placed, .. } = report;
    let [observations, rows, touched] = [observations, rows, touched].map(|capacity| capacity as u32);
    let read = beams.hits + beams.beyond_range + beams.no_return;
    let dropped = beams.not_a_number + beams.negative + beams.too_near + beams.over_capacity;
    assert!(read + dropped <= MAX_BEAMS as u32, "{report:?}");
    assert!(placed.used + placed.unplaceable <= observations, "{report:?}");
    assert!(report.tiles_touched <= touched, "{report:?}");
    // An observation is a row in each tile that holds its whole stencil: two along each axis at most.
    assert!(report.rows <= 4 * placed.used && report.rows <= report.tiles_touched * rows, "{report:?}");
    assert!(report.rows + report.rows_over_capacity <= 4 * placed.used, "{report:?}");
    assert!(report.passes <= report.tiles_touched * PROFILE.settings.passes, "{report:?}");
    for part in [report.tiles_created + report.tiles_restored, report.tiles_evicted, report.tiles_failed] {
        assert!(part <= report.tiles_touched, "{report:?}");
    }
    assert!(report.rows_refused == 0 && report.tiles_lost <= report.tiles_evicted, "{report:?}");
    let (work, most) = (Work::done(&PROFILE, report), Work::most(&PROFILE));
    assert!(work.is_within(&most), "{work:?} of {most:?}: {report:?}");
    let instructions = work.instructions(&Instructions::of(&PROFILE.settings).expect("measured"));
    assert!(instructions <= budget::most_instructions(&PROFILE).expect("measured"), "{work:?} of {most:?}");
    instructions
}

/// What the ordinary scans of a quarter were.
#[derive(Clone, Copy, Debug, Default)]
struct Totals {
    scans: u64,
    tiles: u64,
    rows: u64,
    passes: u64,
}

/// The map, with every report checked and the work added up by quarters.
struct Watched {
    map: LentMap<'static, Shelf, M, B>,
    offered: usize,
    work: [Totals; 4],
    hostile: [u64; 3],
    /// Most instructions that a scan may have taken, by its report.
    dearest: u64,
}

impl OnboardMap<M, B> for Watched {
    fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected> {
        let (kind, quarter) = (Kind::of(self.offered), self.offered / QUARTER);
        self.offered += 1;
        let result = self.map.integrate(scan);
        match (kind, &result) {
            (Kind::Refused(_), Err(_)) => {}
            (Kind::Refused(_), Ok(_)) | (_, Err(_)) => panic!("scan {}, {kind:?}: {result:?}", self.offered),
            (_, Ok(report)) => self.dearest = self.dearest.max(check(report)),
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

    fn mapper(&self) -> &Mapper<'_, 2, M, B> {
        self.map.mapper()
    }

    fn archived(&self) -> usize {
        self.map.archived()
    }
}

/// An archive of a fixed size, as a robot's flash is: when it is full, what comes is lost.
struct Shelf(Vec<Tile<2, M, B>>);

impl Archive<2, M, B> for Shelf {
    fn keep(&mut self, tile: &Tile<2, M, B>) -> bool {
        let place = self.0.iter_mut().find(|place| place.updates == 0 || place.index == tile.index);
        place.map(|place| place.clone_from_in_place(tile)).is_some()
    }

    fn bring_back(&mut self, index: &TileIndex<2>, tile: &mut Tile<2, M, B>) -> bool {
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
    // Hidden from the compiler, which would otherwise ask for zeroed pages that nothing is written to.
    let memory = Box::new(black_box(<static_memory!(PROFILE)>::ZERO));
    let memory = Box::leak(memory).lend();
    let mapper = Mapper::new(PROFILE.settings, memory).expect("a good profile");
    let map = LentMap::new(mapper, Shelf(vec![Tile::VACANT; ARCHIVED]));
    let watched = Watched { map, offered: 0, work: [Totals::default(); 4], hostile: [0; 3], dearest: 0 };
    Onboard::new(watched, Robot::new(), Options::default())
}

/// One test, so that no other changes the resident set.
#[test]
fn memory_is_flat_and_every_scan_bounded_over_a_hundred_thousand_scans() {
    let mut onboard = onboard();
    watch(true);
    assert_eq!(onboard.run(), End::Stopped);
    watch(false);
    let change = onboard.link().looks.allocated();
    assert_eq!((change.allocations, change.reallocations, change.deallocations), (0, 0, 0));
    assert_eq!((change.bytes_allocated, change.bytes_deallocated), (0, 0));

    let (map, robot, counters) = (onboard.map(), onboard.link(), *onboard.counters());
    let most = budget::most_instructions(&PROFILE).expect("measured");
    println!("{counters:?}\n{:?}\n{} instructions of {most} at most", map.work, map.dearest);
    resident_memory_is_flat(&robot.looks);
    work_does_not_grow(&map.work);
    the_scans_were_what_they_were_meant_to_be(map, &counters);
    assert_eq!(robot.reports, 1 + SCANS as u64);
}

/// A quarter is a round of the ring road: the same walls from the same poses, so that noise alone tells one from another.
fn work_does_not_grow(rounds: &[Totals; 4]) {
    let a_scan = |work: &Totals| [work.tiles, work.rows].map(|count| count as f64 / work.scans as f64);
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
    assert!(counters.rows_over_capacity > 0 && counters.observations_over_capacity > 0, "{counters:?}");
}
