//! Everything a simulation needs, under one name. Depends on `lidar`, `simulation`, `trajectory`, `world`.

use super::lidar::Lidar;
use super::simulation::Simulation;
use super::trajectory::Trajectory;
use super::world::World;

/// A world, a route through it and the lidar that suits them: the bill of materials of one simulation.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// What people call it.
    pub name: &'static str,
    /// The sensor driven along the route.
    pub lidar: Lidar,
    pub(super) world: fn() -> World,
    pub(super) trajectory: fn() -> Trajectory,
}

impl Scene {
    /// What is really there.
    #[must_use]
    pub fn world(&self) -> World {
        (self.world)()
    }

    /// The sensor's poses.
    #[must_use]
    pub fn trajectory(&self) -> Trajectory {
        (self.trajectory)()
    }

    /// Drives the route; the same seed gives the same scans, bit for bit.
    #[must_use]
    pub fn simulate(&self, seed: u64) -> Simulation {
        Simulation::new(self.world(), self.lidar, self.trajectory(), seed).expect("scenes name valid lidars")
    }
}
