//! A robot with a lidar that drives through a world whose truth is known everywhere.
//!
//! A [`Scene`] names a world, a route and a lidar; a [`Simulation`] is the iterator over the scans taken on the way. There
//! is no clock: stamps follow from the scan rate, so a simulation runs as fast as its scans are taken. Random numbers come
//! from a seeded ChaCha generator and the elementary functions from `libm`, so a seed stands for the same bits on every
//! platform.
//!
//! ```
//! use bhm_host::sim::Scene;
//!
//! let scene = Scene::named("building")?;
//! let scan = scene.simulate(7).next().expect("a route has scans");
//! assert_eq!(scan.ranges_m.len(), scene.lidar.beams);
//! assert!(!scene.world().is_occupied([scan.map_from_sensor.x_m, scan.map_from_sensor.y_m]));
//! # Ok::<(), bhm_host::sim::UnknownScene>(())
//! ```

mod lidar;
mod scene;
mod solid;
mod trajectory;
mod world;
mod worlds;

#[cfg(test)]
mod tests;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

pub use lidar::{InvalidLidar, Lidar};
pub use scene::{Scene, UnknownScene};
pub use solid::{Bounds, Position, Solid};
pub use trajectory::{Drive, InvalidRoute, Trajectory};
pub use world::World;

use crate::ScanRecord;

/// Stamp of the first scan, nanoseconds: not zero, which a receiver could mistake for "never".
pub const FIRST_STAMP_NS: u64 = 1_000_000_000;

/// The scans a lidar takes along a trajectory, in order; `map_from_sensor` is the true pose.
#[derive(Clone, Debug)]
pub struct Simulation {
    world: World,
    lidar: Lidar,
    trajectory: Trajectory,
    rng: ChaCha8Rng,
    taken: usize,
}

impl Simulation {
    /// A simulation that has not taken a scan yet; all its noise comes from `seed`.
    ///
    /// # Errors
    /// [`InvalidLidar`] if the lidar's fields contradict themselves.
    pub fn new(world: World, lidar: Lidar, trajectory: Trajectory, seed: u64) -> Result<Self, InvalidLidar> {
        lidar.validate()?;
        Ok(Self { world, lidar, trajectory, rng: ChaCha8Rng::seed_from_u64(seed), taken: 0 })
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
        let &map_from_sensor = self.trajectory.poses().get(self.taken)?;
        let stamp_ns = FIRST_STAMP_NS + self.taken as u64 * self.trajectory.period_ns();
        self.taken += 1;
        Some(ScanRecord {
            stamp_ns,
            map_from_sensor,
            pose_covariance: None,
            angle_min_rad: self.lidar.angle_min_rad(),
            angle_increment_rad: self.lidar.angle_increment_rad(),
            range_min_m: self.lidar.range_min_m,
            range_max_m: self.lidar.range_max_m,
            ranges_m: self.lidar.measure(&self.world, map_from_sensor, &mut self.rng),
        })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.trajectory.poses().len() - self.taken;
        (left, Some(left))
    }
}

impl ExactSizeIterator for Simulation {}
