//! Both ends in one thread: what the device learned is what the host sees.

use std::boxed::Box;
use std::vec;
use std::vec::Vec;

use bhm_core::{
    profile::{self, Capacities, Profile},
    scan::ScanHeader,
    tile::TileIndex,
};
use bhm_host::{
    ScanRecord,
    ipc::{NumberedScan, Place, ScanAddress},
    map::{OwnedMapper, posterior_digest},
    sim::{self, PoseNoise},
};

use super::line::Line;
use crate::ipc::RecordedMap;
use crate::serial::*;
use crate::{Onboard, OnboardMap, Options, Step};

pub(super) type Device = Onboard<RecordedMap<144, 40>, SerialLink<'static, Line>, 144, 40>;

/// Fewer slots than the way takes tiles, so that tiles leave and return.
pub(super) const SLOTS: usize = 24;

pub(super) fn device(line: &Line, bytes_per_publication: Option<u32>) -> Device {
    let buffers = Box::leak(Box::new(LinkBuffers::NEW));
    let sent = vec![SentTile::NONE; SLOTS].leak();
    let link = SerialLink::new(line.clone(), &profile::COMPACT, buffers, sent, bytes_per_publication);
    let profile =
        Profile { capacities: Capacities { tiles: SLOTS, ..profile::COMPACT.capacities }, ..profile::COMPACT };
    let map = OwnedMapper::new(&profile).expect("a good profile");
    Onboard::new(RecordedMap::new(map, 2), link, Options::default())
}

/// Scans of a simulated building, over and over; only what is near, so that few tiles change at a time.
pub(super) fn scans(count: usize) -> Vec<ScanRecord> {
    let scene = sim::Scene::named("building").expect("a scene");
    let noise = PoseNoise { position_m: 0.02, heading_rad: 0.005 };
    let once: Vec<_> = scene.simulate(1).with_pose_noise(noise).expect("little noise").step_by(5).collect();
    let scans = once.iter().cycle().zip(1..).map(|(scan, stamp_ns)| {
        let ranges_m = scan.ranges_m.iter().map(|range_m| if *range_m < 4.0 { *range_m } else { f32::NAN });
        ScanRecord { header: ScanHeader { stamp_ns, ..scan.clone().header }, ranges_m: ranges_m.collect() }
    });
    scans.take(count).collect()
}

#[track_caller]
pub(super) fn assert_mirrors(end: &HostEnd<144, 40>, device: &Device) {
    let store = device.map().mapper().tiles();
    let theirs: Vec<_> = store.iter().map(|tile| (tile.index, tile.updates, tile.touched_at)).collect();
    let tiles = end.mirror().tiles().map(|tile| tile.version);
    let ours: Vec<(TileIndex<2>, _, _)> = tiles.map(|tile| (tile.index, tile.updates, tile.touched_at)).collect();
    assert_eq!(ours, theirs);
    let ours = end.mirror().tiles().map(|tile| (tile.version.index, tile.view()));
    // Of every bit.
    assert_eq!(posterior_digest(ours), posterior_digest(store.iter().map(|tile| (tile.index, tile.posterior.view()))));
}

#[test]
fn the_host_sees_what_the_device_learned_bit_for_bit() {
    const SCANS: usize = 150;
    for budget in [None, Some(60_000), Some(1)] {
        let (line, mut end) = (Line::default(), HostEnd::<144, 40>::new(&profile::COMPACT));
        let mut device = device(&line, budget);
        device.start();
        line.send(end.hello(77));
        let (mut behind, mut most_at_once) = (0, 0);
        let mut listen = |end: &mut HostEnd<144, 40>, device: &Device| {
            let (sent, mut handled) = (line.sent(), None);
            most_at_once = most_at_once.max(sent.len());
            let mut rest = &sent[..];
            while let Some(event) = end.take(&mut rest) {
                match event {
                    Event::Posterior(directory) if directory.behind == 0 => assert_mirrors(end, device),
                    Event::Posterior(_) => behind += 1,
                    Event::Status(status) => handled = status.handled,
                    Event::Hello { new_run: true, .. } => {}
                    other => panic!("{other:?}"),
                }
            }
            handled
        };
        assert_eq!(device.step(), Step::Continue);
        // The map is shown before there is a scan.
        device.step();
        listen(&mut end, &device);
        assert!(end.is_settled() && end.mirror().tiles().len() == 0);
        for (scan, sequence) in scans(SCANS).iter().zip(1..) {
            let place = if sequence == SCANS as u64 { Place::Last } else { Place::Within };
            let address = ScanAddress { source: 2, mapper: None, sequence, place };
            let numbered = NumberedScan { address, scan: scan.as_scan() };
            line.send(end.scan(&numbered).expect("few beams").expect("a device"));
            device.step();
            assert_eq!(listen(&mut end, &device), Some((2, sequence)));
            if sequence == 50 {
                // Idle, it catches up.
                (0..2 * SLOTS).for_each(|_| assert_eq!(device.step(), Step::Continue));
                listen(&mut end, &device);
                assert!(end.is_settled());
            }
        }
        assert!(end.is_settled(), "at the end of a source everything is sent");
        assert_mirrors(&end, &device);
        assert!(device.counters().tiles_restored > 10, "{:?}", device.counters());
        assert_eq!(end.counters().frames_damaged() + end.for_another_run(), 0);
        assert_eq!(behind > 20, budget.is_some(), "{behind}");
        let mirror = *end.mirror_counters();
        assert_eq!((mirror.directories_behind, mirror.directories_incomplete), (behind, 0));
        let (theirs, ours) = (device.link().counters(), end.counters());
        assert_eq!((theirs.frames_sent, theirs.bytes_sent), (ours.frames_received, ours.bytes_received));
        assert_eq!((ours.frames_sent, ours.bytes_sent), (theirs.frames_received, theirs.bytes_received));
    }
}

#[test]
fn a_host_that_comes_late_gets_everything() {
    let (line, mut first) = (Line::default(), HostEnd::<144, 40>::new(&profile::COMPACT));
    let mut device = device(&line, None);
    line.send(first.hello(77));
    device.step();
    let sent = line.sent();
    assert!(matches!(first.take(&mut &sent[..]), Some(Event::Hello { .. })));
    for (scan, sequence) in scans(20).iter().zip(1..) {
        let address = ScanAddress { source: 2, mapper: None, sequence, place: Place::Within };
        line.send(first.scan(&NumberedScan { address, scan: scan.as_scan() }).expect("few").expect("a device"));
        device.step();
    }
    line.sent();
    let mut second = HostEnd::<144, 40>::new(&profile::COMPACT);
    line.send(second.hello(78));
    for _ in 0..4 {
        device.step();
        let sent = line.sent();
        let mut rest = &sent[..];
        while let Some(event) = second.take(&mut rest) {
            match event {
                // The first host named it.
                Event::Hello { device, .. } => assert_eq!(device.run, 77),
                Event::Incomplete(directory) => line.send(second.refresh(&directory.missing)),
                _ => {}
            }
        }
    }
    assert!(second.is_settled());
    assert_mirrors(&second, &device);
}
