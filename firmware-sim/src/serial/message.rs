use bhm_core::{
    geometry::Pose,
    scan::{MAX_BEAMS, ScanHeader},
};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Visitor};

use super::{Damage, packed};
use crate::News;

/// Longest frame that goes to a device, bytes as the line carries them: a scan of [`MAX_BEAMS`] beams, about 100 bytes of
/// what stands before its ranges, and one byte in 254 for COBS.
pub const TO_DEVICE_BYTES: usize = 8_448;

/// Longest frame that comes from a device, bytes as the line carries them.
pub const FROM_DEVICE_BYTES: usize = 4_352;

/// Most bytes that a message from a device carries packed: floats of a tile, tiles of a directory, counters.
pub const PART_BYTES: usize = 4_096;

/// Bytes within a message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bytes<'a>(
    /// The bytes.
    pub &'a [u8],
);

impl Serialize for Bytes<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(self.0)
    }
}

impl<'de: 'a, 'a> Deserialize<'de> for Bytes<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Borrowed;
        impl<'de> Visitor<'de> for Borrowed {
            type Value = &'de [u8];

            fn expecting(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.write_str("bytes")
            }

            fn visit_borrowed_bytes<E>(self, bytes: &'de [u8]) -> Result<Self::Value, E> {
                Ok(bytes)
            }
        }
        deserializer.deserialize_bytes(Borrowed).map(Bytes)
    }
}

/// What a host says to a device.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToDevice<'a> {
    /// Who are you? A device that was not greeted since it started takes the number as that of its run: it has no clock to
    /// draw one from. It answers with [`FromDevice::Hello`] and says where it stands.
    Hello {
        /// A number that the host never used before; not 0.
        run: u64,
    },
    /// A scan.
    #[serde(borrow)]
    Scan(ScanFrame<'a>),
    /// Send tiles again, then the directory.
    #[serde(borrow)]
    Refresh(Wanted<'a>),
    /// Send what is not sent yet and end.
    Finish {
        /// The run that is meant.
        run: u64,
    },
}

/// Which tiles a host lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Wanted<'a> {
    /// Perhaps any.
    All,
    /// These [indices](packed::indices), perhaps none: then it lacks the directory alone.
    #[serde(borrow)]
    Only(Bytes<'a>),
}

/// A scan on the line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScanFrame<'a> {
    /// The run of the device that it is meant for.
    pub run: u64,
    /// Which run of which source; not 0.
    pub source: u64,
    /// The source's count, from 1.
    pub sequence: u64,
    /// Whether it is the last of a source that ends.
    pub last: bool,
    /// Everything but the ranges.
    pub header: ScanHeader,
    /// The ranges in metres, as the bytes of little-endian `f32`: bit for bit, whatever they are.
    #[serde(borrow)]
    pub ranges_m: Bytes<'a>,
}

/// What a device says to a host.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum FromDevice<'a> {
    /// Which device it is.
    #[serde(borrow)]
    Hello(HelloFrame<'a>),
    /// A part of a tile.
    #[serde(borrow)]
    TilePart(TilePart<'a>),
    /// A part of the list of tiles that the device has sent and still has.
    #[serde(borrow)]
    Directory(DirectoryPart<'a>),
    /// How far it has come, and everything it counts.
    #[serde(borrow)]
    Status(StatusFrame<'a>),
    /// The device was told to end and does so. What the device has not sent yet follows.
    Finishing {
        /// The device's run.
        run: u64,
    },
}

/// Which device it is: what its tiles mean follows from this.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HelloFrame<'a> {
    /// The number that the first host gave this run of it; not 0.
    pub run: u64,
    /// The name of its profile.
    pub profile: &'a str,
    /// The [digest](bhm_core::settings::Settings::digest) of its settings.
    pub settings: u32,
    /// Passes over each scan.
    pub passes: u32,
    /// Supports of a tile, `M`.
    pub supports: u32,
    /// Width of a tile's band, `B`.
    pub band: u32,
    /// Tiles that it has room for.
    pub slots: u32,
}

/// Consecutive numbers of a tile, in the order `μ`, `Σ` between bias and weights, `Σ` and `μ` of the bias, band of `Σ`. The
/// parts of a tile follow each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TilePart<'a> {
    /// The tile's place in the grid of tiles.
    pub index: [i32; 2],
    /// Updates that it has learned from.
    pub updates: u64,
    /// The mapper's scan count when it was last touched.
    pub touched_at: u64,
    /// Which of its numbers is the first here.
    pub from: u32,
    /// The numbers, as the bytes of little-endian `f32`.
    #[serde(borrow)]
    pub floats: Bytes<'a>,
}

/// Some of the tiles that a host must have by now, and what is worth knowing about them. The parts of a directory follow
/// each other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DirectoryPart<'a> {
    /// The device's run.
    pub run: u64,
    /// The device's count of directories, from 1.
    pub number: u64,
    /// Tiles in all parts together.
    pub listed: u32,
    /// Which of them is the first here.
    pub from: u32,
    /// Resident tiles that are newer than the host knows: their turn comes.
    pub behind: u32,
    /// [Tiles](packed::TileVersion) in ascending order of index.
    #[serde(borrow)]
    pub tiles: Bytes<'a>,
    /// What else is worth knowing.
    pub news: NewsFrame,
}

/// What is worth knowing about a posterior that is not in its tiles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NewsFrame {
    /// Which run of which source was heard last, and the scan up to which all of its scans are dealt with.
    pub handled: Option<(u64, u64)>,
    /// Whether that source has ended, and its last scan is dealt with.
    pub ended: bool,
    /// Where the sensor stood at the newest scan integrated: x and y in metres, heading in radians.
    pub map_from_sensor: [f32; 3],
    /// Tiles in the device's archive.
    pub archived: u64,
    /// Tiles evicted and not kept.
    pub lost: u64,
    /// Scans integrated since the map began.
    pub scans: u64,
    /// Stamp of the newest scan integrated, nanoseconds on its source's clock.
    pub newest_stamp_ns: u64,
}

/// How far a device has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StatusFrame<'a> {
    /// The device's run.
    pub run: u64,
    /// The device's newest directory; 0 before the first.
    pub directory: u64,
    /// Which run of which source was heard last, and the scan up to which all of its scans are dealt with.
    pub handled: Option<(u64, u64)>,
    /// Whether that source has ended, and its last scan is dealt with.
    pub ended: bool,
    /// How long the newest integration took, nanoseconds; 0 if none did or nothing measures it.
    pub last_update_ns: u64,
    /// How long the slowest integration took, nanoseconds.
    pub slowest_update_ns: u64,
    /// The most that the stack ever took, bytes, where that is known.
    pub stack_high_water_bytes: Option<u32>,
    /// The loop's [counters](packed::named).
    #[serde(borrow)]
    pub counters: Bytes<'a>,
    /// The device's own [`LinkCounters`](super::LinkCounters), likewise.
    #[serde(borrow)]
    pub link: Bytes<'a>,
}

impl NewsFrame {
    pub(super) fn new(news: &News, scans: u64, newest_stamp_ns: u64) -> Self {
        let News { handled, ended, map_from_sensor: Pose { x_m, y_m, theta_rad }, archived, lost } = *news;
        Self { handled, ended, map_from_sensor: [x_m, y_m, theta_rad], archived, lost, scans, newest_stamp_ns }
    }
}

impl ScanFrame<'_> {
    /// Copies the ranges and answers how many there are.
    ///
    /// # Errors
    /// [`Damage::Unreadable`] if they are cut or too many, or the scan has no source or number.
    pub(super) fn ranges_into(&self, ranges_m: &mut [f32; MAX_BEAMS]) -> Result<usize, Damage> {
        let (ranges, cut) = packed::floats(self.ranges_m.0);
        let beams = ranges.len();
        let room = ranges_m.get_mut(..beams);
        match room {
            Some(room) if self.source != 0 && self.sequence != 0 && !cut => {
                room.iter_mut().zip(ranges).for_each(|(to, range)| *to = range);
                Ok(beams)
            }
            _ => Err(Damage::Unreadable),
        }
    }
}
