use std::path::Path;

use bhm_core::{
    beam::AnyBeamRule,
    geometry::Pose,
    profile::Profile,
    scan::{MAX_BEAMS, ScanHeader},
};
use bhm_firmware_sim::budget::{Instructions, Work};
use bhm_host::{ScanRecord, map::OwnedMapper};

use crate::emulator::{B, Emulator, M, instructions};

/// Beams that see as far as a beam is believed, in as many of the directions: with this heading they touch as many tiles as
/// may be touched, and no more.
const RAYS: usize = 11;
const DIRECTIONS: usize = 16;
const HEADING_RAD: f32 = 0.03;

/// Has a device learn a scan that fills every capacity, and answers its instructions.
///
/// The robot stands where four tiles hold every point. A few beams see to the end; as many others as there is room for see a
/// wall a hand's breadth away, which makes two points each, hence eight rows.
pub(crate) fn learn(program: &Path, profile: &Profile) -> u64 {
    let scan = scan(profile);
    let mut host = OwnedMapper::<M, B>::new(profile).expect("a good profile");
    let mut device = Emulator::start(program, profile);
    device.greet();
    let report = host.integrate(&scan.as_scan()).expect("a good scan");
    let (work, most) = (Work::done(profile, &report), Work::most(profile));
    assert_eq!(report.beams.total() as usize, MAX_BEAMS);
    assert_eq!(work.observations, profile.capacities.observations as u64, "{report:?}");
    assert_eq!((work.tiles, work.passes), (most.tiles, most.passes), "{report:?}");
    assert_eq!(report.observations.over_capacity, 0, "{report:?}");
    assert!(10 * work.rows >= 9 * most.rows, "{} rows of {}", work.rows, most.rows);
    let took = instructions(&device.learn(&scan));
    let allowed = work.instructions(&Instructions::of(&profile.settings).expect("measured"));
    println!("full scan: {took} instructions, {allowed} allowed for {work:?}");
    assert!(took <= allowed);
    let (status, _) = device.finish();
    assert!(status.success(), "{status}");
    took
}

fn scan(profile: &Profile) -> ScanRecord {
    let settings = &profile.settings;
    // The middle of the cell that four tiles share: the last whole stencil of one and the first of the next.
    let shared = settings.tile.stride[0] as f32 + (settings.tile.stencil / 2) as f32 - 0.5;
    let at_m = shared * settings.spacing_m;
    let AnyBeamRule::PointSamples(rule) = settings.beam else { panic!("measured with points") };
    let near_m = rule.gap_m + 0.1;
    let far_m = settings.limits.range_max_m;
    let of_a_ray = (far_m / rule.free_spacing_m).ceil() as usize;
    let near = (profile.capacities.observations - RAYS * of_a_ray) / 2;
    let (mut ranges_m, mut left) = (vec![-1.0; MAX_BEAMS], near);
    for (beam, range_m) in ranges_m.iter_mut().enumerate() {
        if beam % (MAX_BEAMS / DIRECTIONS) == 0 && beam < RAYS * (MAX_BEAMS / DIRECTIONS) {
            // Beyond what is believed: free space only.
            *range_m = 1.5 * far_m;
        } else if left > 0 {
            *range_m = near_m;
            left -= 1;
        }
    }
    ScanRecord {
        header: ScanHeader {
            stamp_ns: 1,
            map_from_sensor: Pose::new(at_m, at_m, HEADING_RAD),
            angle_min_rad: 0.0,
            angle_increment_rad: std::f32::consts::TAU / MAX_BEAMS as f32,
            range_max_m: 2.0 * far_m,
            ..ScanHeader::default()
        },
        ranges_m,
    }
}
