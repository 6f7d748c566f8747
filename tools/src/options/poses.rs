use bhm_core::geometry::PoseCovariance;
use bhm_host::ScanRecord;
use clap::Args;

/// How far off the poses of scans are, where the scans themselves do not say: standard deviations, 0 for exact poses.
///
/// It belongs to the scans: whoever reads them says it, and they carry it through shared memory. The onboard process takes
/// what it gets.
#[derive(Args, Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PoseDeviations {
    /// Standard deviation of the position in the scans' poses along each axis, metres; 0 if they are exact
    #[arg(long, env = "BHM_POSE_DEVIATION", value_name = "M", default_value_t = 0.0)]
    pub(crate) pose_deviation: f32,
    /// Standard deviation of the heading in the scans' poses, radians; 0 if it is exact
    #[arg(long, env = "BHM_HEADING_DEVIATION", value_name = "RAD", default_value_t = 0.0)]
    pub(crate) heading_deviation: f32,
}

/// Largest deviations that make sense: what is less certain than this is no pose, and the square still a number.
const MAX_POSITION_M: f32 = 1e3;
const MAX_HEADING_RAD: f32 = 4.0;

impl PoseDeviations {
    /// What is wrong with them, if anything.
    pub(crate) fn check(&self) -> Result<(), String> {
        for (name, value, max, unit) in [
            ("pose deviation", self.pose_deviation, MAX_POSITION_M, "m"),
            ("heading deviation", self.heading_deviation, MAX_HEADING_RAD, "rad"),
        ] {
            if !(0.0..=max).contains(&value) {
                return Err(format!("{name} is {value}, expected 0 to {max} {unit}"));
            }
        }
        Ok(())
    }

    /// Whether poses are exact.
    pub(crate) fn are_zero(&self) -> bool {
        *self == Self::default()
    }

    /// Says so in a scan that has no covariance of its own.
    pub(crate) fn apply(&self, scan: &mut ScanRecord) {
        if !self.are_zero() && scan.header.pose_covariance.is_none() {
            scan.header.pose_covariance =
                Some(PoseCovariance::independent(self.pose_deviation, self.heading_deviation));
        }
    }

    /// The options that say the same to another process.
    pub(crate) fn arguments(&self) -> Vec<String> {
        let Self { pose_deviation, heading_deviation } = self;
        vec![format!("--pose-deviation={pose_deviation}"), format!("--heading-deviation={heading_deviation}")]
    }
}
