//! A robot with a lidar that drives through a world whose truth is known everywhere.
//!
//! A [`Scene`] names a world, a route and a lidar; a [`Simulation`] is the iterator over the scans taken on the way. Of a
//! world in which things move, a scan sees what is there at its stamp, and a map is judged by what stands still. There is
//! no clock: stamps follow from the scan rate, so a simulation runs as fast as its scans are taken. Random numbers come
//! from a seeded ChaCha generator and the elementary functions from `libm`, so a seed stands for the same bits on every
//! platform.
//!
//! ```
//! use bhm_host::sim::Scene;
//!
//! let scene = Scene::named("building")?;
//! let scan = scene.simulate(7).next().expect("a route has scans");
//! assert_eq!(scan.ranges_m.len(), scene.lidar.beams);
//! assert!(!scene.world().is_occupied([scan.header.map_from_sensor.x_m, scan.header.map_from_sensor.y_m]));
//! # Ok::<(), bhm_host::sim::UnknownScene>(())
//! ```
//!
//! Each module depends only on those before it in this list, and says on which: `solid`, `noise`, `mover`, `trajectory`,
//! `world`, `lidar`, `simulation`, `scene`, `worlds`.

mod lidar;
mod mover;
mod noise;
mod scene;
mod simulation;
mod solid;
mod trajectory;
mod world;
mod worlds;

#[cfg(test)]
mod tests;

pub use lidar::{InvalidLidar, Lidar};
pub use mover::Mover;
pub use noise::{InvalidPoseNoise, PoseNoise};
pub use scene::Scene;
pub use simulation::{FIRST_STAMP_NS, Simulation};
pub use solid::{Bounds, Position, Solid};
pub use trajectory::{Drive, InvalidRoute, Trajectory};
pub use world::World;
pub use worlds::UnknownScene;
