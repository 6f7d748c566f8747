//! A lidar driven along a trajectory through a world. Depends on `lidar`, `noise`, `trajectory`, `world`.

use bhm_core::scan::ScanHeader;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::lidar::{InvalidLidar, Lidar};
use super::noise::{InvalidPoseNoise, PoseNoise};
use super::trajectory::Trajectory;
use super::world::World;
use crate::ScanRecord;

/// Stamp of the first scan, nanoseconds: not zero, which a receiver could mistake for "never".
pub const FIRST_STAMP_NS: u64 = 1_000_000_000;

/// Number of the generator's stream that pose errors come from; ranges come from stream 0, and so do not depend on them.
const POSE_STREAM: u64 = 1;

/// The scans a lidar takes along a trajectory, in order, of the world as it is at each scan's stamp.
///
/// Scans are taken from the true pose. That is also what `map_from_sensor` says, unless there is [`PoseNoise`].
#[derive(Clone, Debug)]
pub struct Simulation {
    world: World,
    lidar: Lidar,
    trajectory: Trajectory,
    pose_noise: PoseNoise,
    rng: ChaCha8Rng,
    pose_rng: ChaCha8Rng,
    taken: usize,
}

impl Simulation {
    /// A simulation that has not taken a scan yet; all its noise comes from `seed`.
    ///
    /// # Errors
    /// [`InvalidLidar`] if the lidar's fields contradict themselves.
    pub fn new(world: World, lidar: Lidar, trajectory: Trajectory, seed: u64) -> Result<Self, InvalidLidar> {
        lidar.validate()?;
        let rng = ChaCha8Rng::seed_from_u64(seed);
        let mut pose_rng = rng.clone();
        pose_rng.set_stream(POSE_STREAM);
        Ok(Self { world, lidar, trajectory, pose_noise: PoseNoise::NONE, rng, pose_rng, taken: 0 })
    }

    /// The same scans, bit for bit, but their poses are reported with errors, which come from the same seed, and with the
    /// covariance of those errors.
    ///
    /// # Errors
    /// [`InvalidPoseNoise`] if a standard deviation is negative or not finite.
    pub fn with_pose_noise(self, pose_noise: PoseNoise) -> Result<Self, InvalidPoseNoise> {
        pose_noise.validate()?;
        Ok(Self { pose_noise, ..self })
    }

    /// How far off the reported poses are.
    #[must_use]
    pub fn pose_noise(&self) -> PoseNoise {
        self.pose_noise
    }

    /// What is really there.
    #[must_use]
    pub fn world(&self) -> &World {
        &self.world
    }
}

impl Iterator for Simulation {
    type Item = ScanRecord;

    fn next(&mut self) -> Option<ScanRecord> {
        let &true_pose = self.trajectory.poses().get(self.taken)?;
        let stamp_ns = FIRST_STAMP_NS + self.taken as u64 * self.trajectory.period_ns();
        self.taken += 1;
        Some(ScanRecord {
            header: ScanHeader {
                stamp_ns,
                map_from_sensor: self.pose_noise.perturb(true_pose, &mut self.pose_rng),
                pose_covariance: self.pose_noise.covariance(),
                angle_min_rad: self.lidar.angle_min_rad(),
                angle_increment_rad: self.lidar.angle_increment_rad(),
                range_min_m: self.lidar.range_min_m,
                range_max_m: self.lidar.range_max_m,
            },
            ranges_m: self.lidar.measure(&self.world.at(stamp_ns), true_pose, &mut self.rng),
        })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.trajectory.poses().len() - self.taken;
        (left, Some(left))
    }
}

impl ExactSizeIterator for Simulation {}
