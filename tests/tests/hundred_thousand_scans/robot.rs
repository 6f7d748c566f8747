//! The robot: what it sends, and what it is answered.

use bhm_core::{
    geometry::{Pose, PoseCovariance},
    mapper::Mapper,
    scan::{MAX_BEAMS, Scan, ScanHeader},
};
use bhm_firmware_sim::{Incoming, IncomingScan, Link, News, Patience, Report};

use crate::{B, LOOK_EVERY, M, PROFILE, QUARTER, SCANS, common::Stream, memory::Looks};

/// What a scan is like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
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
    pub(crate) fn of(number: usize) -> Self {
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
pub(crate) struct Robot {
    sent: usize,
    random: Stream,
    ranges_m: [f32; MAX_BEAMS + 1],
    pub(crate) looks: Looks,
    pub(crate) reports: u64,
}

impl Robot {
    const BEAMS: usize = 24;
    /// Half a kilometre round, 2 cm from scan to scan.
    const RING_M: f64 = 80.0;
    const HALF_WIDTH_M: f32 = 1.6;

    /// One that has not set off, every byte that it will ever use written to.
    pub(crate) fn new() -> Self {
        let random = Stream::new(0x6268_6d10);
        Self { sent: 0, random, ranges_m: [1.0; MAX_BEAMS + 1], looks: Looks::new(), reports: 0 }
    }

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
            header: ScanHeader {
                stamp_ns: 1 + number as u64,
                map_from_sensor: Pose::new(x_m, y_m, heading_rad),
                pose_covariance: number.is_multiple_of(3).then(|| PoseCovariance::independent(0.02, 0.005)),
                angle_min_rad: 0.1,
                angle_increment_rad: std::f32::consts::TAU / Self::BEAMS as f32,
                range_min_m: 0.05,
                range_max_m: 4.0,
            },
            ranges_m: &[],
        };
        let mut beams = Self::BEAMS;
        match kind {
            Kind::Ordinary | Kind::BadRanges => {}
            Kind::AllBeams => {
                beams = MAX_BEAMS;
                scan.header.angle_increment_rad = 0.01;
            }
            Kind::Teleported => {
                const PLACES_M: [[f32; 2]; 4] = [[6e4, 6e4], [-6e4, 1.0], [0.0, 0.0], [-5e4, -3e4]];
                let [x_m, y_m] = PLACES_M[self.random.below(PLACES_M.len())];
                scan.header.map_from_sensor = Pose::new(x_m, y_m, 100.0);
            }
            Kind::Refused(0) => scan.header.map_from_sensor.x_m = f32::NAN,
            Kind::Refused(1) => scan.header.map_from_sensor.y_m = 1e30,
            Kind::Refused(2) => scan.header.map_from_sensor.theta_rad = f32::INFINITY,
            Kind::Refused(3) => {
                scan.header.pose_covariance =
                    Some(PoseCovariance { xx_m2: -1.0, ..PoseCovariance::independent(0.1, 0.1) });
            }
            Kind::Refused(4) => scan.header.angle_increment_rad = f32::NAN,
            Kind::Refused(5) => scan.header.range_min_m = 5.0,
            Kind::Refused(6) => scan.header.stamp_ns = 0,
            Kind::Refused(_) => beams = MAX_BEAMS + 1,
        }
        for (beam, range_m) in self.ranges_m[..beams].iter_mut().enumerate() {
            // Walls on both sides, off by a little noise, and nothing within range ahead and behind.
            let bearing_rad = scan.header.angle_min_rad + beam as f32 * scan.header.angle_increment_rad;
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

    fn publish(&mut self, mapper: &Mapper<'_, 2, M, B>, _: &News) -> Result<(), ()> {
        assert!(mapper.tiles().resident() <= PROFILE.capacities.tiles);
        Ok(())
    }

    fn report(&mut self, _: &Report<'_>) -> Result<(), ()> {
        self.reports += 1;
        Ok(())
    }
}
