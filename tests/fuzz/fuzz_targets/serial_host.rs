//! What comes over a serial line from a device.
#![no_main]

use bhm_core::profile;
use bhm_firmware_sim::serial::{
    Bytes, DirectoryPart, Event, FROM_DEVICE_BYTES, FromDevice, HelloFrame, HostEnd, NewsFrame, StatusFrame, TilePart,
    encode, packed::TileVersion,
};

const RUN: u64 = 7;

fn line(messages: &[FromDevice<'_>]) -> Vec<u8> {
    let mut buffer = [0; FROM_DEVICE_BYTES];
    messages.iter().flat_map(|message| encode(message, &mut buffer).expect("it fits").to_vec()).collect()
}

fn hello() -> FromDevice<'static> {
    FromDevice::Hello(HelloFrame {
        run: RUN,
        profile: "compact",
        settings: profile::COMPACT.settings.digest().0,
        passes: 3,
        supports: 144,
        band: 40,
        slots: 2,
    })
}

fn seeds() -> Vec<Vec<u8>> {
    let floats = [1; 4 * 605];
    let parts = (0..10).map(|part| {
        let from = part * 605;
        FromDevice::TilePart(TilePart { index: [1, -1], updates: 1, touched_at: 1, from, floats: Bytes(&floats) })
    });
    let tile = TileVersion { index: [1, -1], updates: 1, touched_at: 1 }.to_bytes();
    let directory = |number, tiles| {
        let listed = u32::from(number == 2);
        let news = NewsFrame::default();
        FromDevice::Directory(DirectoryPart { run: RUN, number, listed, from: 0, behind: 0, tiles: Bytes(tiles), news })
    };
    let status = FromDevice::Status(StatusFrame {
        run: RUN,
        directory: 2,
        handled: Some((1, 2)),
        ended: true,
        last_update_ns: 1,
        slowest_update_ns: 2,
        stack_high_water_bytes: Some(3),
        counters: Bytes(b"\x03one\x01\0\0\0\0\0\0\0"),
        link: Bytes(&[]),
    });
    let mut whole = vec![hello()];
    whole.extend(parts);
    whole.extend([directory(2, &tile), status]);
    vec![
        line(&[hello(), directory(1, &[])]),
        line(&whole),
        line(&[hello(), directory(2, &tile), FromDevice::Finishing { run: RUN }]),
    ]
}

fn check(bytes: &[u8]) {
    let mut end = HostEnd::<144, 40>::new(&profile::COMPACT);
    let mut rest = bytes;
    while let Some(event) = end.take(&mut rest) {
        match event {
            Event::Posterior(directory) => {
                assert!(directory.missing.is_empty() && end.mirror().tiles().len() <= 2);
                assert!(end.mirror().tiles().is_sorted_by(|a, b| a.version.index < b.version.index));
            }
            Event::Incomplete(directory) => assert!((1..=2).contains(&directory.missing.len())),
            _ => {}
        }
    }
    assert!(end.mirror().tiles().len() <= 2 * end.device().map_or(0, |device| device.slots));
    assert!(end.mirror().tiles().all(|tile| tile.view().mean.len() == 144));
    let counters = end.counters();
    assert_eq!(counters.bytes_received, bytes.len() as u64);
    let whole = bytes.iter().rposition(|byte| *byte == 0).map_or(&[][..], |end| &bytes[..end]);
    let segments = whole.split(|byte| *byte == 0).filter(|segment| !segment.is_empty()).count();
    assert_eq!(counters.frames_received + counters.frames_damaged(), segments as u64);
}

bhm_fuzz::target!(seeds, check);
