//! Everything a simulation needs, under one name.

use super::Simulation;
use super::lidar::Lidar;
use super::trajectory::Trajectory;
use super::world::World;
use super::worlds;

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

/// There is no scene of that name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no simulated world is called {name:?}; there are: {}", Scene::names().collect::<Vec<_>>().join(", "))]
pub struct UnknownScene {
    /// The name asked for.
    pub name: String,
}

impl Scene {
    /// The scene of that name.
    ///
    /// # Errors
    /// [`UnknownScene`] lists the names there are.
    pub fn named(name: &str) -> Result<&'static Self, UnknownScene> {
        worlds::SCENES.iter().find(|scene| scene.name == name).ok_or_else(|| UnknownScene { name: name.to_owned() })
    }

    /// The names of all scenes.
    pub fn names() -> impl Iterator<Item = &'static str> {
        worlds::SCENES.iter().map(|scene| scene.name)
    }

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
