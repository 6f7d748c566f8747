//! Frames and messages by themselves.

use std::vec;
use std::vec::Vec;

use bhm_core::{
    geometry::{Pose, PoseCovariance},
    posterior::Posterior,
    scan::{MAX_BEAMS, ScanHeader},
};
use proptest::prelude::*;

use super::line::segments;
use crate::serial::frame::read;
use crate::serial::*;

const NAN: u32 = 0x7fc1_2345;

fn scan_frame(ranges: &[u8]) -> ScanFrame<'_> {
    ScanFrame {
        run: u64::MAX,
        source: u64::MAX,
        sequence: u64::MAX,
        last: true,
        header: ScanHeader {
            stamp_ns: u64::MAX,
            map_from_sensor: Pose::new(f32::from_bits(NAN), -0.0, 3.0),
            pose_covariance: Some(PoseCovariance::from_numbers([1.0; 6])),
            angle_min_rad: -1.5,
            angle_increment_rad: 0.01,
            range_min_m: 0.1,
            range_max_m: f32::INFINITY,
        },
        ranges_m: Bytes(ranges),
    }
}

#[test]
fn a_frame_is_what_the_documentation_says() {
    let mut buffer = [0xff; 64];
    let frame = encode(&ToDevice::Finish { run: 5 }, &mut buffer).expect("room");
    // Postcard: variant 3, varint 5. CRC-32 of 01 03 05 by another program (Python's zlib).
    let checked = [1, 3, 5];
    assert_eq!(&frame[..5], [0, 8, 1, 3, 5]);
    assert_eq!(frame[5..9], crc32(&checked).to_le_bytes());
    assert_eq!(frame[9..], [0]);
}

/// CRC-32 (ISO-HDLC) bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
        }
    }
    !crc
}

#[test]
fn the_longest_messages_fit_their_frames_and_longer_ones_are_refused() {
    let (ranges, mut buffer) = ([0xff; MAX_BEAMS * 4], [0; TO_DEVICE_BYTES]);
    encode(&ToDevice::Scan(scan_frame(&ranges)), &mut buffer).expect("the longest scan fits");
    let part = [0xff; PART_BYTES];
    let tile = TilePart {
        index: [i32::MIN; 2],
        updates: u64::MAX,
        touched_at: u64::MAX,
        from: u32::MAX,
        floats: Bytes(&part),
    };
    encode(&FromDevice::TilePart(tile), &mut buffer[..FROM_DEVICE_BYTES]).expect("the longest part fits");
    let news = NewsFrame {
        handled: Some((u64::MAX, u64::MAX)),
        archived: u64::MAX,
        lost: u64::MAX,
        scans: u64::MAX,
        newest_stamp_ns: u64::MAX,
        ..NewsFrame::default()
    };
    let directory = DirectoryPart {
        run: u64::MAX,
        number: u64::MAX,
        listed: u32::MAX,
        from: u32::MAX,
        behind: u32::MAX,
        tiles: Bytes(&part),
        news,
    };
    encode(&FromDevice::Directory(directory), &mut buffer[..FROM_DEVICE_BYTES]).expect("the longest directory fits");
    assert_eq!(encode(&ToDevice::Scan(scan_frame(&ranges)), &mut buffer[..8_300]), Err(DoesNotFit));
    assert_eq!(encode(&ToDevice::Hello { run: 1 }, &mut []), Err(DoesNotFit));
}

#[test]
fn every_kind_of_damage_is_told_apart_and_the_next_frame_is_read() {
    let mut buffer = [0; 256];
    let good = encode(&ToDevice::Hello { run: 1 }, &mut buffer).expect("room").to_vec();
    let raw = |content: &[u8]| {
        let mut checked = content.to_vec();
        checked.extend(crc32(content).to_le_bytes());
        let mut frame = vec![0; 300];
        let length = cobs::encode(&checked, &mut frame);
        frame.truncate(length);
        frame.push(0);
        frame
    };
    let mut flipped = good.clone();
    // The number, and not what COBS keeps its lengths in.
    flipped[4] ^= 4;
    type Case = (Vec<u8>, fn(&LinkCounters) -> u64);
    let cases: [Case; 8] = [
        (vec![0; 9], |_| 1),
        (good[..4].to_vec(), |counters| counters.frames_cut),
        (vec![9, 1, 2, 0], |counters| counters.frames_cut),
        (flipped, |counters| counters.frames_bad_crc),
        (raw(&[9, 0, 1]), |counters| counters.frames_other_version),
        (raw(&[PROTOCOL_VERSION, 77]), |counters| counters.frames_unreadable),
        // Something after the message.
        (raw(&[PROTOCOL_VERSION, 0, 1, 0]), |counters| counters.frames_unreadable),
        (vec![7; 1_000], |counters| counters.frames_oversized),
    ];
    for (bytes, counter) in cases {
        let mut deframer = Deframer::<64>::NEW;
        let line = [bytes, good.clone()].concat();
        let mut rest = &line[..];
        let mut messages = 0;
        while let Some(content) = deframer.take(&mut rest) {
            let outcome =
                content.and_then(read::<ToDevice<'_>>).map(|message| assert_eq!(message, ToDevice::Hello { run: 1 }));
            messages += u64::from(outcome.is_ok());
            deframer.count(&outcome);
        }
        let counters = deframer.counters;
        assert_eq!((messages, counter(&counters)), (1, 1), "{line:?}");
        assert_eq!(counters.frames_received + counters.frames_damaged(), segments(&line));
        assert_eq!(counters.bytes_received, line.len() as u64);
    }
}

#[test]
fn a_tile_in_parts_is_the_tile() {
    let mut posterior = Posterior::<9, 4>::ZERO;
    let mut number = 0.0;
    let mut next = |to: &mut f32| {
        number += 1.0;
        *to = number;
    };
    posterior.mean.iter_mut().for_each(&mut next);
    posterior.border_covariance.iter_mut().for_each(&mut next);
    next(&mut posterior.bias_covariance);
    next(&mut posterior.bias_mean);
    posterior.covariance.as_flattened_mut().iter_mut().for_each(&mut next);
    for part in [1, 2, 3, 7, 8, 9, 10, 17, 50, 100] {
        let (mut floats, mut bytes) = (Vec::new(), vec![0; part * 4]);
        for from in (0..packed::tile_floats::<9, 4>()).step_by(part) {
            let written = packed::write_tile(&posterior.view(), from, &mut bytes);
            floats.extend(packed::floats(&bytes[..written]).0);
        }
        // They were numbered in the order of the line.
        assert!(floats.iter().zip(1..).all(|(float, number)| *float == number as f32), "{part}: {floats:?}");
        assert_eq!(floats.len(), 9 + 9 + 2 + 36);
        let view = packed::view_of::<9, 4>(&floats).expect("all are there");
        assert_eq!((view.mean, view.covariance), (&posterior.mean, &posterior.covariance));
        assert_eq!(view.border_covariance, &posterior.border_covariance);
        assert_eq!((view.bias_covariance, view.bias_mean), (19.0, 20.0));
        assert!(packed::view_of::<9, 4>(&floats[1..]).is_none());
    }
}

#[test]
fn counts_that_are_cut_are_noticed() {
    let mut bytes = [0; 64];
    let length = packed::write_named([("one", 1), ("", u64::MAX)], &mut bytes).expect("room");
    let read = |length| packed::named(&bytes[..length]).collect::<Result<Vec<_>, _>>();
    assert_eq!(read(length), Ok(vec![("one", 1), ("", u64::MAX)]));
    for cut in 1..length {
        assert!(cut == 12 || read(cut).is_err(), "{cut}");
    }
    assert_eq!(packed::write_named([("four", 1)], &mut bytes[..12]), None);
}

proptest! {
    #[test]
    fn a_scan_arrives_bit_for_bit(
        ranges in proptest::collection::vec(any::<u32>(), 0..=MAX_BEAMS),
        bits in proptest::array::uniform3(any::<u32>()),
        (run, source, sequence, stamp_ns, last) in any::<(u64, u64, u64, u64, bool)>(),
        chunk in 1_usize..500,
    ) {
        let bytes: Vec<u8> = ranges.iter().flat_map(|bits| bits.to_le_bytes()).collect();
        let map_from_sensor = bits.map(f32::from_bits);
        let [x_m, y_m, theta_rad] = map_from_sensor;
        let other = scan_frame(&bytes);
        let header = ScanHeader { stamp_ns, map_from_sensor: Pose::new(x_m, y_m, theta_rad), ..other.header };
        let sent = ScanFrame { run, source, sequence, last, header, ..other };
        let mut buffer = [0; TO_DEVICE_BYTES];
        let line = encode(&ToDevice::Scan(sent), &mut buffer).expect("it fits");
        prop_assert!(line[1..line.len() - 1].iter().all(|byte| *byte != 0));
        let mut deframer = Deframer::<TO_DEVICE_BYTES>::NEW;
        let mut came = 0;
        for mut chunk in line.chunks(chunk) {
            while let Some(content) = deframer.take(&mut chunk) {
                let Ok(ToDevice::Scan(scan)) = content.and_then(read) else { panic!("a scan") };
                prop_assert_eq!({
                    let Pose { x_m, y_m, theta_rad } = scan.header.map_from_sensor;
                    [x_m, y_m, theta_rad].map(f32::to_bits)
                }, bits);
                prop_assert_eq!(scan.ranges_m, sent.ranges_m);
                let numbers = (scan.run, scan.source, scan.sequence, scan.header.stamp_ns, scan.last);
                prop_assert_eq!(numbers, (run, source, sequence, stamp_ns, last));
                let mut ranges_m = [0.0; MAX_BEAMS];
                let beams = scan.ranges_into(&mut ranges_m);
                if source != 0 && sequence != 0 {
                    prop_assert_eq!(beams, Ok(ranges.len()));
                    prop_assert!(ranges_m.iter().zip(&ranges).all(|(range, bits)| range.to_bits() == *bits));
                } else {
                    prop_assert_eq!(beams, Err(Damage::Unreadable));
                }
                came += 1;
            }
        }
        prop_assert_eq!(came, 1);
    }

    #[test]
    fn no_bytes_make_a_reader_panic_or_lose_count(
        line in proptest::collection::vec(prop_oneof![Just(0_u8), any::<u8>()], 0..2_000),
        chunk in 1_usize..100,
    ) {
        let mut deframer = Deframer::<128>::NEW;
        for mut bytes in line.chunks(chunk) {
            while let Some(content) = deframer.take(&mut bytes) {
                let outcome = content.and_then(read::<ToDevice<'_>>).map(drop);
                deframer.count(&outcome);
            }
        }
        let counters = deframer.counters;
        let ended = line.iter().rposition(|byte| *byte == 0).map_or(0, |end| segments(&line[..end]));
        prop_assert_eq!(counters.frames_received + counters.frames_damaged(), ended);
        prop_assert_eq!(counters.bytes_received, line.len() as u64);
    }

    /// Whole frames whose content is anything: what the checks let through if they were no checks.
    #[test]
    fn no_content_makes_a_message_panic(content in proptest::collection::vec(any::<u8>(), 0..300)) {
        let _ = read::<FromDevice<'_>>(&content);
        if let Ok(ToDevice::Scan(scan)) = read(&content) {
            let _ = scan.ranges_into(&mut [0.0; MAX_BEAMS]);
        }
        let _ = packed::named(&content).count();
        let _ = packed::indices(&content).map(Iterator::count);
        let _ = packed::tile_versions(&content).map(Iterator::count);
    }
}
