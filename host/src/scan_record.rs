use bhm_core::scan::{Scan, ScanHeader};

/// A lidar scan that owns its ranges: what a log holds and a queue carries.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanRecord {
    /// Everything but the ranges.
    pub header: ScanHeader,
    /// One range per beam, metres, as the sensor gave them: NaN, infinite and negative ones included.
    pub ranges_m: Vec<f32>,
}

impl ScanRecord {
    /// The scan as the core takes it, borrowed from this record.
    #[must_use]
    pub fn as_scan(&self) -> Scan<'_> {
        Scan { header: self.header, ranges_m: &self.ranges_m }
    }
}
