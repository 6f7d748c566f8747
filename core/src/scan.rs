//! One revolution (or sweep) of a lidar, borrowed from whoever received it.

use crate::geometry::{Pose, PoseCovariance};

/// Most beams a scan may have: the wire format's capacity, and a bound on the work of one scan.
pub const MAX_BEAMS: usize = 2_048;

/// A lidar scan: ranges at equally spaced bearings, and where the sensor stood.
///
/// A range of `+∞`, or at or beyond `range_max_m`, means "nothing returned". Ranges are not trusted: NaN, negative ones and
/// those below `range_min_m` are dropped one by one and counted.
#[derive(Clone, Copy, Debug)]
pub struct Scan<'a> {
    /// When the scan was taken, nanoseconds on the source's clock. May repeat, must not go back.
    pub stamp_ns: u64,
    /// Where the sensor stands in the map.
    pub map_from_sensor: Pose,
    /// How uncertain that is: widens what the scan's points mean. `None` where poses are taken as exact.
    pub pose_covariance: Option<PoseCovariance>,
    /// Bearing of the first beam, radians from the sensor's x axis, counter-clockwise.
    pub angle_min_rad: f32,
    /// Bearing from one beam to the next, radians; negative for a sensor that turns clockwise.
    pub angle_increment_rad: f32,
    /// Shortest range the sensor can measure, metres.
    pub range_min_m: f32,
    /// Range at and beyond which a reading means "nothing returned", metres.
    pub range_max_m: f32,
    /// One range per beam, metres; at most [`MAX_BEAMS`].
    pub ranges_m: &'a [f32],
}
