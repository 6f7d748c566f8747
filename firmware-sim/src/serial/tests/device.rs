//! The loop at the end of a bad line.

use std::boxed::Box;
use std::collections::BTreeMap;
use std::vec;
use std::vec::Vec;

use bhm_core::{
    geometry::Pose,
    mapper::{IntegrateReport, Mapper},
    profile,
    scan::{Scan, ScanHeader, ScanRejected},
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::line::{Line, segments, spoil};
use crate::serial::frame::read;
use crate::serial::*;
use crate::tests::lent;
use crate::{End, Onboard, OnboardMap, Options, Step};

const SLOTS: usize = 8;

/// A small map that remembers what it was given.
struct Recorder {
    map: lent::Map,
    given: Vec<Vec<u32>>,
}

impl OnboardMap<144, 40> for Recorder {
    fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected> {
        self.given.push(bits(scan));
        self.map.integrate(scan)
    }

    fn mapper(&self) -> &Mapper<'_, 2, 144, 40> {
        self.map.mapper()
    }

    fn archived(&self) -> usize {
        self.map.archived()
    }
}

/// A scan to its last bit; its stamp, which tells scans apart here, first.
fn bits(scan: &Scan<'_>) -> Vec<u32> {
    let pose = scan.header.map_from_sensor;
    let limits =
        [scan.header.angle_min_rad, scan.header.angle_increment_rad, scan.header.range_min_m, scan.header.range_max_m];
    let floats = [pose.x_m, pose.y_m, pose.theta_rad].into_iter().chain(limits).chain(scan.ranges_m.iter().copied());
    [scan.header.stamp_ns as u32].into_iter().chain(floats.map(f32::to_bits)).collect()
}

type Device = Onboard<Recorder, SerialLink<'static, Line>, 144, 40>;

fn device(line: &Line, options: Options) -> Device {
    let buffers = Box::leak(Box::new(LinkBuffers::NEW));
    let sent = vec![SentTile::NONE; SLOTS].leak();
    let link = SerialLink::new(line.clone(), &profile::COMPACT, buffers, sent, None);
    Onboard::new(Recorder { map: lent::map(SLOTS), given: Vec::new() }, link, options)
}

fn frame(message: &ToDevice<'_>) -> Vec<u8> {
    encode(message, &mut [0; TO_DEVICE_BYTES]).expect("it fits").to_vec()
}

fn scan_frame(run: u64, sequence: u64, ranges: &[u8]) -> ScanFrame<'_> {
    ScanFrame {
        run,
        source: 3,
        sequence,
        last: false,
        header: ScanHeader {
            stamp_ns: sequence,
            map_from_sensor: Pose::new(0.001 * (sequence % 1_000) as f32, 0.0, 0.5),
            pose_covariance: None,
            angle_min_rad: -1.0,
            angle_increment_rad: 0.5,
            range_min_m: 0.1,
            range_max_m: 20.0,
        },
        ranges_m: Bytes(ranges),
    }
}

/// Turns the loop until it has read everything.
fn turn(device: &mut Device, line: &Line) {
    while !line.is_quiet() {
        assert_eq!(device.step(), Step::Continue);
    }
    device.step();
}

/// Whole messages that the device sent, by kind.
fn said(line: &Line) -> BTreeMap<&'static str, usize> {
    let mut deframer = Deframer::<FROM_DEVICE_BYTES>::NEW;
    let (bytes, mut kinds) = (line.sent(), BTreeMap::new());
    let mut rest = &bytes[..];
    while let Some(content) = deframer.take(&mut rest) {
        let kind = match content.and_then(read).expect("devices speak well") {
            FromDevice::Hello(_) => "hello",
            FromDevice::TilePart(_) => "tile part",
            FromDevice::Directory(_) => "directory",
            FromDevice::Status(_) => "status",
            FromDevice::Finishing { .. } => "finishing",
        };
        *kinds.entry(kind).or_default() += 1;
    }
    kinds
}

#[test]
fn ten_thousand_frames_on_a_bad_line() {
    const FRAMES: u64 = 10_000;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let line = Line::default();
    let mut device = device(&line, Options { publish_every: 50, ..Options::default() });
    device.start();
    let hello = frame(&ToDevice::Hello { run: 5 });
    let (mut spoiled, mut fates) = (hello.clone(), BTreeMap::new());
    line.send(&hello);
    let (mut sent, mut scans, mut controls) = (BTreeMap::new(), BTreeMap::new(), 1);
    for sequence in 1..=FRAMES {
        let ranges: Vec<u8> = (0..5).flat_map(|_| rng.random_range(0.0_f32..6.0).to_le_bytes()).collect();
        let clean = if sequence % 100 == 0 {
            frame(&ToDevice::Refresh(Wanted::Only(Bytes(&packed::index_bytes(&[0, sequence as i32])))))
        } else {
            let scan = scan_frame(5, sequence, &ranges);
            let mut ranges_m = [0.0; bhm_core::scan::MAX_BEAMS];
            let beams = scan.ranges_into(&mut ranges_m).expect("a good scan");
            let whole = Scan { header: scan.header, ranges_m: &ranges_m[..beams] };
            scans.insert(sequence as u32, bits(&whole));
            frame(&ToDevice::Scan(scan))
        };
        sent.insert(clean[1..clean.len() - 1].to_vec(), sequence % 100 == 0);
        let (bytes, fate) = spoil(&clean, 0.6, &mut rng);
        *fates.entry(std::format!("{fate:?}")).or_insert(0) += 1;
        spoiled.extend(&bytes);
        line.send(&bytes);
        if sequence % 100 == 0 {
            turn(&mut device, &line);
            line.sent();
        }
    }
    assert!(fates.len() == 6 && fates.values().all(|count| *count > 500), "{fates:?}");
    // What is between the last zero and here is no frame yet.
    spoiled.push(0);
    line.send(&[0]);
    turn(&mut device, &line);

    // No wrong scan: each that was integrated or refused is one that was sent, to the last bit.
    for given in &device.map().given {
        assert_eq!(scans.get(&given[0]), Some(given));
    }
    // Nothing uncounted: whatever stands between two zeros is either a frame that was sent, to the last bit, and received,
    // or damaged, and counted as that.
    let (link, loops) = (*device.link().counters(), *device.counters());
    let whole: Vec<_> = spoiled.split(|byte| *byte == 0).filter_map(|segment| sent.get(segment)).collect();
    controls += whole.iter().filter(|control| ***control).count() as u64;
    assert_eq!(link.frames_received, whole.len() as u64 + 1);
    assert_eq!(link.frames_received + link.frames_damaged(), segments(&spoiled));
    assert_eq!(link.bytes_received, spoiled.len() as u64);
    assert!(link.frames_cut > 500 && link.frames_bad_crc > 500, "{link:?}");
    assert_eq!(link.bytes_overrun, 7, "what the port says");
    // Each is handed to the loop, which counts it as well, or is a message to the link.
    assert_eq!(loops.unreadable, link.frames_damaged());
    assert_eq!(loops.received + controls, link.frames_received);
    assert_eq!(loops.received, loops.integrated + loops.duplicates + loops.rejected());
    assert_eq!((loops.for_another, loops.publish_failed, loops.report_failed), (0, 0, 0));
    assert_eq!(device.map().given.len() as u64, loops.integrated + loops.rejected());
    assert!(loops.integrated > FRAMES / 3 && loops.duplicates > 500, "{loops:?}");

    // The line is alive.
    line.send(&frame(&ToDevice::Scan(scan_frame(5, FRAMES + 1, &[0, 0, 128, 63]))));
    turn(&mut device, &line);
    assert_eq!(device.counters().integrated, loops.integrated + 1);
    assert_eq!(device.map().given.last().map(|given| given[0]), Some(FRAMES as u32 + 1));
}

#[test]
fn noise_alone_is_survived() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let line = Line::default();
    let mut device = device(&line, Options::default());
    for _ in 0..300 {
        let noise: Vec<u8> = (0..rng.random_range(0..20_000)).map(|_| rng.random()).collect();
        line.send(&noise);
        turn(&mut device, &line);
    }
    let sound = frame(&ToDevice::Hello { run: 9 });
    line.send(&sound);
    turn(&mut device, &line);
    assert_eq!(said(&line).get("hello"), Some(&1));
    assert_eq!(device.counters().received, 0);
}

#[test]
fn a_device_says_nothing_until_it_is_greeted_and_keeps_its_first_run() {
    let line = Line::default();
    let mut device = device(&line, Options::default());
    device.start();
    line.send(&frame(&ToDevice::Hello { run: 0 }));
    line.send(&frame(&ToDevice::Scan(scan_frame(5, 1, &[]))));
    line.send(&frame(&ToDevice::Refresh(Wanted::All)));
    turn(&mut device, &line);
    assert!(line.sent().is_empty());
    assert_eq!((device.counters().unreadable, device.counters().for_another), (1, 1));
    for run in [5, 6] {
        line.send(&frame(&ToDevice::Hello { run }));
        turn(&mut device, &line);
        assert_eq!(said(&line), [("directory", 1), ("hello", 1), ("status", 1)].into());
    }
    // Scans and an end that are meant for a run that never was.
    line.send(&frame(&ToDevice::Scan(scan_frame(6, 1, &[]))));
    line.send(&frame(&ToDevice::Finish { run: 6 }));
    turn(&mut device, &line);
    assert_eq!((device.counters().for_another, device.counters().received), (3, 0));
    line.send(&frame(&ToDevice::Scan(scan_frame(5, 1, &[0, 0, 128, 63]))));
    turn(&mut device, &line);
    assert_eq!(device.counters().integrated, 1);
    line.sent();
    line.send(&frame(&ToDevice::Finish { run: 5 }));
    assert_eq!(device.step(), Step::End(End::Stopped));
    assert_eq!(said(&line), [("directory", 1), ("finishing", 1), ("status", 1)].into());
}

#[test]
fn scans_that_contradict_themselves_are_unreadable() {
    let line = Line::default();
    let mut device = device(&line, Options::default());
    line.send(&frame(&ToDevice::Hello { run: 5 }));
    let too_many = [0; 4 * (bhm_core::scan::MAX_BEAMS + 1)];
    for scan in [
        scan_frame(5, 0, &[]),
        ScanFrame { source: 0, ..scan_frame(5, 1, &[]) },
        scan_frame(5, 1, &[1, 2, 3]),
        scan_frame(5, 1, &too_many),
    ] {
        line.send(&frame(&ToDevice::Scan(scan)));
    }
    turn(&mut device, &line);
    assert_eq!((device.counters().unreadable, device.counters().received), (4, 0));
    assert_eq!(device.link().counters().frames_unreadable, 4);
}
