//! What comes over a serial line to a device: the whole loop, with a map that learns nothing, so that an input does the same
//! whatever came before it.
#![no_main]

use std::collections::VecDeque;

use bhm_core::{
    geometry::{Pose, PoseCovariance},
    mapper::{IntegrateReport, Mapper},
    profile::{self, Capacities, Profile},
    scan::{MAX_BEAMS, Scan, ScanHeader, ScanRejected},
};
use bhm_firmware_sim::{
    Onboard, OnboardMap, Options, Step,
    serial::{
        Bytes, LinkBuffers, Port, ScanFrame, SentTile, SerialLink, TO_DEVICE_BYTES, ToDevice, Wanted,
        embedded_io::{ErrorType, Read, ReadReady, Write},
        encode,
    },
};
use bhm_host::map::OwnedMapper;

const RUN: u64 = 7;

/// Two tiles, so that they leave for each other.
const SMALL: Profile =
    Profile { capacities: Capacities { tiles: 2, observations: 64, rows: 64, touched: 2 }, ..profile::COMPACT };

fn line(messages: &[ToDevice<'_>]) -> Vec<u8> {
    let mut buffer = [0; TO_DEVICE_BYTES];
    messages.iter().flat_map(|message| encode(message, &mut buffer).expect("it fits").to_vec()).collect()
}

fn seeds() -> Vec<Vec<u8>> {
    let scan = |sequence, last| ScanFrame {
        run: RUN,
        source: 2,
        sequence,
        last,
        header: ScanHeader {
            stamp_ns: sequence,
            map_from_sensor: Pose::new(0.5, 0.0, 1.0),
            pose_covariance: Some(PoseCovariance::independent(0.3, 0.1)),
            angle_min_rad: -1.0,
            angle_increment_rad: 0.5,
            range_min_m: 0.1,
            range_max_m: 10.0,
        },
        ranges_m: Bytes(&[0, 0, 128, 63, 0, 0, 0, 64]),
    };
    let hello = ToDevice::Hello { run: RUN };
    vec![
        line(&[hello]),
        line(&[hello, ToDevice::Scan(scan(1, false)), ToDevice::Scan(scan(2, true))]),
        line(&[hello, ToDevice::Refresh(Wanted::All), ToDevice::Refresh(Wanted::Only(Bytes(&[0; 8])))]),
        line(&[hello, ToDevice::Finish { run: RUN }]),
    ]
}

/// A scan that reaches several tiles.
fn scan() -> Scan<'static> {
    let header = ScanHeader {
        stamp_ns: 1,
        map_from_sensor: Pose::new(1.0, 1.0, 0.0),
        angle_increment_rad: 1.0,
        range_min_m: 0.1,
        range_max_m: 10.0,
        ..ScanHeader::default()
    };
    Scan { header, ranges_m: &[3.0; 6] }
}

struct Fed(VecDeque<u8>);

impl ErrorType for Fed {
    type Error = std::io::Error;
}

impl ReadReady for Fed {
    fn read_ready(&mut self) -> Result<bool, Self::Error> {
        Ok(!self.0.is_empty())
    }
}

impl Read for Fed {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Self::Error> {
        std::io::Read::read(&mut self.0, into)
    }
}

impl Write for Fed {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}

impl Port for Fed {
    fn overruns(&self) -> u32 {
        0
    }

    fn idle(&mut self) {}
}

struct Map<'m>(&'m OwnedMapper<144, 40>);

impl OnboardMap<144, 40> for Map<'_> {
    fn integrate(&mut self, scan: &Scan<'_>) -> Result<IntegrateReport, ScanRejected> {
        assert!(scan.ranges_m.len() <= MAX_BEAMS);
        Ok(IntegrateReport::default())
    }

    fn mapper(&self) -> &Mapper<'_, 2, 144, 40> {
        self.0.mapper()
    }

    fn archived(&self) -> usize {
        self.0.archive().len()
    }
}

thread_local! {
    /// One for all inputs: a map takes longer to make than an input to read.
    static MAP: OwnedMapper<144, 40> = {
        let mut map = OwnedMapper::new(&SMALL).expect("a good profile");
        map.integrate(&scan()).expect("a good scan");
        map
    };
}

fn check(bytes: &[u8]) {
    MAP.with(|map| {
        let (mut buffers, mut sent) = (Box::new(LinkBuffers::NEW), [SentTile::NONE; 2]);
        let link = SerialLink::new(Fed(bytes.iter().copied().collect()), &SMALL, &mut buffers, &mut sent, None);
        let mut onboard = Onboard::new(Map(map), link, Options::default());
        onboard.start();
        let mut ended = false;
        // Each step takes a frame off the line, or finds none.
        while !ended && !onboard.link().port().0.is_empty() {
            ended = matches!(onboard.step(), Step::End(_));
        }
        let (link, counters) = (*onboard.link().counters(), *onboard.counters());
        assert_eq!(counters.unreadable, link.frames_damaged());
        assert!(counters.received + counters.for_another <= link.frames_received);
        assert_eq!((counters.publish_failed, counters.report_failed), (0, 0));
        let read = bytes.len() - onboard.link().port().0.len();
        assert_eq!(link.bytes_received, read as u64);
        let whole = bytes[..read].iter().rposition(|byte| *byte == 0).map_or(&[][..], |end| &bytes[..end]);
        let segments = whole.split(|byte| *byte == 0).filter(|segment| !segment.is_empty()).count();
        assert_eq!(link.frames_received + link.frames_damaged(), segments as u64);
    });
}

bhm_fuzz::target!(seeds, check);
