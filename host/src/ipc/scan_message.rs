use bhm_core::{
    geometry::{Pose, PoseCovariance},
    scan::{MAX_BEAMS, Scan, ScanHeader},
};
use iceoryx2::prelude::ZeroCopySend;

use super::{IpcError, LayoutError, layout::Layout, wire::PlainNumbers};

/// A scan as it lies in shared memory.
#[repr(C)]
#[derive(Debug, ZeroCopySend)]
#[type_name("bhm.scan.v2")]
pub struct ScanMessage {
    /// [`ScanMessage::MAGIC`].
    pub magic: u64,
    /// [`ScanMessage::VERSION`].
    pub version: u32,
    /// [`ScanMessage::LAST`] or 0.
    pub flags: u32,
    /// Which run of which source; never 0.
    pub source: u64,
    /// The run of the mapper that the scan is meant for; 0 for any.
    pub mapper: u64,
    /// The source's count, from 1.
    pub sequence: u64,
    /// When the scan was taken, nanoseconds on the source's clock.
    pub stamp_ns: u64,
    /// Where the sensor stands in the map, metres.
    pub x_m: f32,
    /// Where the sensor stands in the map, metres.
    pub y_m: f32,
    /// Where the sensor's x axis points, radians.
    pub theta_rad: f32,
    /// With [`ScanMessage::UNCERTAIN`], the covariance of that pose as xx, xy, yy (m²), xθ, yθ (m·rad), θθ (rad²).
    pub pose_covariance: [f32; 6],
    /// Bearing of the first beam, radians.
    pub angle_min_rad: f32,
    /// Radians per beam.
    pub angle_increment_rad: f32,
    /// Shortest range, metres.
    pub range_min_m: f32,
    /// Range at and beyond which nothing returned, metres.
    pub range_max_m: f32,
    /// How many of the ranges are beams.
    pub beams: u32,
    /// The ranges, metres; those after the last beam mean nothing.
    pub ranges_m: [f32; MAX_BEAMS],
}

// SAFETY: integers, floating-point numbers, and an array of them.
unsafe impl PlainNumbers for ScanMessage {}

/// Whether more scans follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// More may follow.
    Within,
    /// The last of a source that ends.
    Last,
}

/// Who sends a scan to whom, and as which.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScanAddress {
    /// Which run of which source; never 0.
    pub source: u64,
    /// The run of the mapper that the scan is meant for; `None` for any.
    pub mapper: Option<u64>,
    /// The source's count, from 1.
    pub sequence: u64,
    /// Whether more follow.
    pub place: Place,
}

/// A scan that passed the checks, borrowed from the message.
#[derive(Clone, Copy, Debug)]
pub struct NumberedScan<'a> {
    /// Who sent the scan to whom.
    pub address: ScanAddress,
    /// The scan, of which the message's layout was checked; whether its values are usable, the mapper says.
    pub scan: Scan<'a>,
}

/// A scan message that cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ScanMessageRejected {
    /// The message is no scan, or has another layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// The source or the sequence number is 0.
    #[error("scan message with source or sequence number 0")]
    Unnumbered,
    /// The message claims more beams than it has room for.
    #[error("scan message of {found} beams, at most {MAX_BEAMS} fit")]
    Beams {
        /// The beams that the message claims.
        found: u32,
    },
}

impl ScanMessage {
    /// What a scan begins with.
    pub const MAGIC: u64 = u64::from_le_bytes(*b"BHM scan");
    /// The layout described here.
    pub const VERSION: u32 = 2;
    /// Flag: the last scan of a source that ends.
    pub const LAST: u32 = 1;
    /// Flag: the pose has a covariance.
    pub const UNCERTAIN: u32 = 2;
    const LAYOUT: Layout = Layout {
        what: "scan message",
        magic: Self::MAGIC,
        version: Self::VERSION,
        flags: Self::LAST | Self::UNCERTAIN,
    };

    /// Writes a scan over whatever was here.
    ///
    /// # Errors
    /// [`IpcError::TooManyBeams`].
    pub fn write(&mut self, address: &ScanAddress, scan: &Scan<'_>) -> Result<(), IpcError> {
        let beams = scan.ranges_m.len();
        let Some(ranges_m) = self.ranges_m.get_mut(..beams) else {
            return Err(IpcError::TooManyBeams { beams });
        };
        ranges_m.copy_from_slice(scan.ranges_m);
        self.magic = Self::MAGIC;
        self.version = Self::VERSION;
        self.flags = match address.place {
            Place::Within => 0,
            Place::Last => Self::LAST,
        };
        let ScanHeader {
            stamp_ns,
            map_from_sensor: Pose { x_m, y_m, theta_rad },
            pose_covariance,
            angle_min_rad,
            angle_increment_rad,
            range_min_m,
            range_max_m,
        } = scan.header;
        if pose_covariance.is_some() {
            self.flags |= Self::UNCERTAIN;
        }
        self.pose_covariance = pose_covariance.map_or([0.0; 6], |covariance| covariance.numbers());
        self.source = address.source;
        self.mapper = address.mapper.unwrap_or(0);
        self.sequence = address.sequence;
        (self.stamp_ns, self.x_m, self.y_m, self.theta_rad) = (stamp_ns, x_m, y_m, theta_rad);
        (self.angle_min_rad, self.angle_increment_rad) = (angle_min_rad, angle_increment_rad);
        (self.range_min_m, self.range_max_m) = (range_min_m, range_max_m);
        self.beams = beams as u32;
        Ok(())
    }

    /// The scan, if the message can be read.
    ///
    /// # Errors
    /// The first fault found in the message.
    pub fn check(&self) -> Result<NumberedScan<'_>, ScanMessageRejected> {
        Self::LAYOUT.check(self.magic, self.version, self.flags)?;
        let place = if self.flags & Self::LAST != 0 { Place::Last } else { Place::Within };
        if self.source == 0 || self.sequence == 0 {
            return Err(ScanMessageRejected::Unnumbered);
        }
        let ranges_m = self.ranges_m.get(..self.beams as usize);
        let ranges_m = ranges_m.ok_or(ScanMessageRejected::Beams { found: self.beams })?;
        let mapper = (self.mapper != 0).then_some(self.mapper);
        Ok(NumberedScan {
            address: ScanAddress { source: self.source, mapper, sequence: self.sequence, place },
            scan: Scan {
                header: ScanHeader {
                    stamp_ns: self.stamp_ns,
                    map_from_sensor: Pose::new(self.x_m, self.y_m, self.theta_rad),
                    pose_covariance: (self.flags & Self::UNCERTAIN != 0)
                        .then_some(PoseCovariance::from_numbers(self.pose_covariance)),
                    angle_min_rad: self.angle_min_rad,
                    angle_increment_rad: self.angle_increment_rad,
                    range_min_m: self.range_min_m,
                    range_max_m: self.range_max_m,
                },
                ranges_m,
            },
        })
    }
}
