//! The computer's end of a bad line.

use std::collections::BTreeMap;
use std::string::ToString;
use std::vec;
use std::vec::Vec;

use bhm_core::{profile, tile::TileIndex};
use bhm_host::ipc::{NumberedScan, Place, ScanAddress};
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::line::{Line, segments, spoil};
use super::loopback::{Device, assert_mirrors, device, scans};
use crate::Step;
use crate::serial::packed::TileVersion;
use crate::serial::*;

const RUN: u64 = 11;

fn numbered(scan: &bhm_host::ScanRecord, sequence: u64) -> NumberedScan<'_> {
    let address = ScanAddress { source: 2, mapper: None, sequence, place: Place::Within };
    NumberedScan { address, scan: scan.as_scan() }
}

/// The frames of a line, each with its zeros.
fn frames(line: &[u8]) -> Vec<Vec<u8>> {
    let contents = line.split(|byte| *byte == 0).filter(|content| !content.is_empty());
    contents.map(|content| [&[0], content, &[0]].concat()).collect()
}

/// The device's tiles as they are, to the last bit.
fn resident(device: &Device) -> impl Iterator<Item = (TileVersion, Vec<u32>)> {
    use crate::OnboardMap;
    device.map().mapper().tiles().iter().map(|tile| {
        let mut bytes = vec![0; 4 * packed::tile_floats::<144, 40>()];
        packed::write_tile(&tile.posterior.view(), 0, &mut bytes);
        let bits = bytes.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect();
        (TileVersion { index: tile.index, updates: tile.updates, touched_at: tile.touched_at }, bits)
    })
}

#[test]
fn ten_thousand_frames_on_a_bad_line_and_then_a_refresh() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let (line, mut end) = (Line::default(), HostEnd::<144, 40>::new(&profile::COMPACT));
    let mut device = device(&line, None);
    device.start();
    line.send(end.hello(RUN));
    let (mut sent, mut went, mut frames_sent) = (BTreeMap::new(), Vec::new(), 0);
    let (mut posteriors, mut incomplete) = (0, 0);
    for (scan, sequence) in scans(2_000).iter().zip(1..) {
        if frames_sent >= 10_000 {
            break;
        }
        for _ in 0..2 {
            assert_eq!(device.step(), Step::Continue);
            sent.extend(resident(&device));
        }
        // The first greeting comes through, so that there is a device to speak of.
        let mut spoil_it = |frame: &[u8]| if sequence == 1 { frame.to_vec() } else { spoil(frame, 0.05, &mut rng).0 };
        for frame in frames(&line.sent()) {
            frames_sent += 1;
            let bytes = spoil_it(&frame);
            went.extend(&bytes);
            let mut rest = &bytes[..];
            while let Some(event) = end.take(&mut rest) {
                match event {
                    Event::Posterior(_) => posteriors += 1,
                    Event::Incomplete(directory) => {
                        incomplete += 1;
                        line.send(&spoil_it(end.refresh(&directory.missing)));
                    }
                    _ => {}
                }
            }
            // Whatever is here was sent just so.
            if frames_sent % 50 == 0 {
                assert_sent(&end, &sent);
            }
        }
        let scan = end.scan(&numbered(scan, sequence)).expect("few beams").expect("a device").to_vec();
        line.send(&scan);
    }
    assert!(frames_sent >= 10_000, "{frames_sent} frames");
    assert_sent(&end, &sent);
    let counters = *end.counters();
    let ended = went.iter().rposition(|byte| *byte == 0).map_or(0, |end| segments(&went[..end]));
    assert_eq!(counters.frames_received + counters.frames_damaged(), ended);
    assert_eq!(counters.bytes_received, went.len() as u64);
    assert!(counters.frames_bad_crc > 50 && counters.frames_cut > 50, "{counters:?}");
    let mirror = *end.mirror_counters();
    assert!(posteriors > 10 && incomplete > 10, "{posteriors} {incomplete}");
    assert_eq!(mirror.directories_received, posteriors + incomplete);
    assert!(mirror.tile_parts_repeated > 20 && mirror.tile_parts_orphaned > 100, "{mirror:?}");
    assert!(mirror.tiles_abandoned > 100 && mirror.tile_parts_refused == 0, "{mirror:?}");

    // From here on the line is good: what is missing comes. More tiles than a request names are all of them.
    line.send(&[0]);
    line.send(end.refresh(&[[0; 2]; 513]));
    while !line.is_quiet() {
        assert_eq!(device.step(), Step::Continue);
    }
    assert_eq!(device.step(), Step::Continue);
    let mut rest = &[&[0], &line.sent()[..]].concat()[..];
    let mut last = None;
    while let Some(event) = end.take(&mut rest) {
        last = Some(event);
    }
    assert!(matches!(last, Some(Event::Status(_))), "{last:?}");
    assert!(end.is_settled());
    assert_mirrors(&end, &device);
}

fn assert_sent(end: &HostEnd<144, 40>, sent: &BTreeMap<TileVersion, Vec<u32>>) {
    for tile in end.mirror().tiles() {
        let view = tile.view();
        let mut bytes = vec![0; 4 * packed::tile_floats::<144, 40>()];
        packed::write_tile(&view, 0, &mut bytes);
        let bits: Vec<_> = bytes.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect();
        assert!(sent.get(&tile.version) == Some(&bits), "{:?} was never sent so", tile.version);
    }
}

/// Messages as the line carries them.
fn said(messages: &[FromDevice<'_>]) -> Vec<u8> {
    let mut buffer = [0; FROM_DEVICE_BYTES];
    messages.iter().flat_map(|message| encode(message, &mut buffer).expect("it fits").to_vec()).collect()
}

const HELLO: HelloFrame<'static> =
    HelloFrame { run: RUN, profile: "compact", settings: 0, passes: 3, supports: 144, band: 40, slots: 3 };

fn hello() -> HelloFrame<'static> {
    HelloFrame { settings: profile::COMPACT.settings.digest().0, ..HELLO }
}

fn events(end: &mut HostEnd<144, 40>, bytes: &[u8]) -> Vec<Event> {
    let mut rest = bytes;
    std::iter::from_fn(|| end.take(&mut rest)).collect()
}

#[test]
fn a_device_that_cannot_be_used_is_refused_by_name() {
    let mut end = HostEnd::<144, 40>::new(&profile::COMPACT);
    for (hello, says) in [
        (
            HelloFrame { profile: "indoor", ..hello() },
            "the device has the profile \"indoor\", this computer has \"compact\"",
        ),
        (HelloFrame { settings: 1, ..hello() }, "other settings of the profile \"compact\": digest 00000001"),
        (HelloFrame { band: 41, ..hello() }, "144 supports in a band of 41, this computer's 144 in a band of 40"),
        (HelloFrame { slots: 0, ..hello() }, "room for 0 tiles"),
        (HelloFrame { slots: u32::MAX, ..hello() }, "room for 4294967295 tiles, expected 1 to 46603"),
    ] {
        match &events(&mut end, &said(&[FromDevice::Hello(hello)]))[..] {
            [Event::Refused(why)] => assert!(why.to_string().contains(says), "{why}"),
            other => panic!("{other:?}"),
        }
        assert!(end.device().is_none());
    }
    let nameless = FromDevice::Hello(HelloFrame { run: 0, ..hello() });
    assert_eq!(events(&mut end, &said(&[nameless])), []);
    assert_eq!(end.counters().frames_unreadable, 1);
    match &events(&mut end, &said(&[FromDevice::Hello(hello())]))[..] {
        [Event::Hello { device, new_run: true }] => assert_eq!((device.run, device.slots), (RUN, 3)),
        other => panic!("{other:?}"),
    }
}

fn part(index: TileIndex<2>, touched_at: u64, from: u32, floats: &[u8]) -> FromDevice<'_> {
    FromDevice::TilePart(TilePart { index, updates: 1, touched_at, from, floats: Bytes(floats) })
}

fn directory(number: u64, listed: u32, from: u32, tiles: &[u8]) -> FromDevice<'_> {
    let news = NewsFrame::default();
    FromDevice::Directory(DirectoryPart { run: RUN, number, listed, from, behind: 0, tiles: Bytes(tiles), news })
}

#[test]
fn parts_and_directories_that_contradict_themselves_are_refused_and_counted() {
    let mut end = HostEnd::<144, 40>::new(&profile::COMPACT);
    let floats = [1; PART_BYTES];
    let whole = packed::tile_floats::<144, 40>() * 4;
    let tile = |index, touched_at| -> Vec<u8> {
        let parts = (0..whole)
            .step_by(PART_BYTES)
            .map(|from| part(index, touched_at, from as u32 / 4, &floats[..PART_BYTES.min(whole - from)]));
        said(&parts.collect::<Vec<_>>())
    };
    let version = |index, touched_at| TileVersion { index, updates: 1, touched_at };
    let list = |tiles: &[TileVersion]| -> Vec<u8> { tiles.iter().flat_map(TileVersion::to_bytes).collect() };
    // Before it said who it is, nothing counts but that it came.
    events(&mut end, &tile([0; 2], 1));
    assert_eq!((end.for_another_run(), end.mirror().tiles().len()), (6, 0));
    events(&mut end, &said(&[FromDevice::Hello(hello())]));
    // Numbers that no tile has, half a number, none.
    for (from, length) in [(u32::MAX, 4), (6_050, 4), (6_049, 8), (0, 3), (0, 0)] {
        events(&mut end, &said(&[part([0; 2], 1, from, &floats[..length])]));
    }
    assert_eq!((end.mirror_counters().tile_parts_refused, end.mirror().tiles().len()), (5, 0));
    // More tiles than twice what it has room for.
    for x in 0..10 {
        events(&mut end, &tile([x, 0], 1));
    }
    assert_eq!((end.mirror_counters().tiles_received, end.mirror().tiles().len()), (6, 6));
    assert_eq!(end.mirror_counters().tile_parts_refused, 5 + 4 * 6);
    // Directories: of more tiles than that, out of order, cut, with nothing in it, with more in it than it lists.
    let tiles = [version([0, 0], 1), version([1, 0], 1), version([2, 0], 1), version([3, 0], 1)];
    for (listed, list) in [
        (4, list(&tiles)),
        (2, list(&[tiles[1], tiles[0]])),
        (2, list(&[tiles[1], tiles[1]])),
        (1, list(&tiles[..1])[1..].to_vec()),
        (1, Vec::new()),
        (1, list(&tiles[..2])),
    ] {
        assert_eq!(events(&mut end, &said(&[directory(1, listed, 0, &list)])), []);
    }
    assert_eq!(end.mirror_counters().directory_parts_refused, 6);
    // In two parts, the first of them twice, then the second alone.
    let (first, second) = (list(&tiles[..1]), list(&tiles[1..3]));
    let [first, second] = [directory(2, 3, 0, &first), directory(2, 3, 1, &second)];
    let got = events(&mut end, &said(&[first, first, second, second]));
    assert!(matches!(&got[..], [Event::Posterior(directory)] if directory.number == 2), "{got:?}");
    assert_eq!((end.mirror().tiles().len(), end.mirror_counters().directory_parts_orphaned), (3, 1));
    // What is older than that is known already.
    assert_eq!(events(&mut end, &said(&[directory(1, 0, 0, &[])])), []);
    // A tile in another version, and one that never came.
    let list = list(&[version([0, 0], 2), tiles[1], version([7, 7], 1)]);
    match &events(&mut end, &said(&[directory(3, 3, 0, &list)]))[..] {
        [Event::Incomplete(directory)] => assert_eq!(directory.missing, [[0, 0], [7, 7]]),
        other => panic!("{other:?}"),
    }
    assert!(!end.is_settled());
    assert_eq!(end.missing(), [[0, 0], [7, 7]]);
    // Another run knows nothing of this.
    events(&mut end, &said(&[FromDevice::Hello(HelloFrame { run: 12, ..hello() })]));
    assert_eq!((end.mirror().tiles().len(), end.is_settled()), (0, false));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]
    /// Whole frames with anything in them.
    #[test]
    fn nothing_that_a_device_says_makes_its_host_panic(
        seed in any::<u64>(),
        contents in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..200), 0..50),
    ) {
        let mut end = HostEnd::<144, 40>::new(&profile::COMPACT);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        events(&mut end, &said(&[FromDevice::Hello(hello())]));
        for content in &contents {
            let (small, big) = (rng.random_range(0..4), rng.random());
            let index = [rng.random_range(-1..2), 0];
            let (from, listed) = if rng.random() { (small, small) } else { (big, big) };
            let message = match rng.random_range(0..5) {
                0 => part(index, u64::from(small), from, content),
                1 => directory(u64::from(small), listed, from, content),
                2 => directory(u64::from(small), 1, 0, content),
                3 => FromDevice::Status(StatusFrame {
                    run: RUN,
                    directory: u64::from(big),
                    handled: None,
                    ended: false,
                    last_update_ns: 0,
                    slowest_update_ns: 0,
                    stack_high_water_bytes: None,
                    counters: Bytes(content),
                    link: Bytes(&[]),
                }),
                _ => FromDevice::Finishing { run: RUN },
            };
            events(&mut end, &said(&[message]));
        }
        prop_assert!(end.mirror().tiles().len() <= 6);
        let counters = end.counters();
        prop_assert_eq!(counters.frames_received + counters.frames_unreadable, contents.len() as u64 + 1);
    }
}
