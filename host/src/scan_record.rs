use bhm_core::geometry::{Pose, PoseCovariance};
use bhm_core::scan::Scan;

/// A lidar scan that owns its ranges: what a log holds and a queue carries.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanRecord {
    /// When the scan was taken, nanoseconds on the source's clock.
    pub stamp_ns: u64,
    /// Where the sensor stood in the map.
    pub map_from_sensor: Pose,
    /// How uncertain that is; `None` where poses are taken as exact.
    pub pose_covariance: Option<PoseCovariance>,
    /// Bearing of the first beam, radians from the sensor's x axis, counter-clockwise.
    pub angle_min_rad: f32,
    /// Bearing from one beam to the next, radians; negative for a sensor that turns clockwise.
    pub angle_increment_rad: f32,
    /// Shortest range the sensor can measure, metres.
    pub range_min_m: f32,
    /// Range at and beyond which a reading means "nothing returned", metres.
    pub range_max_m: f32,
    /// One range per beam, metres, as the sensor gave them: NaN, infinite and negative ones included.
    pub ranges_m: Vec<f32>,
}

impl ScanRecord {
    /// The scan as the core takes it, borrowed from this record.
    #[must_use]
    pub fn as_scan(&self) -> Scan<'_> {
        Scan {
            stamp_ns: self.stamp_ns,
            map_from_sensor: self.map_from_sensor,
            pose_covariance: self.pose_covariance,
            angle_min_rad: self.angle_min_rad,
            angle_increment_rad: self.angle_increment_rad,
            range_min_m: self.range_min_m,
            range_max_m: self.range_max_m,
            ranges_m: &self.ranges_m,
        }
    }
}
