//! A robot with a lidar that drives through a world whose truth is known everywhere.

mod solid;
mod trajectory;

pub use solid::{Bounds, Position, Solid};
pub use trajectory::{Drive, InvalidRoute, Trajectory};
