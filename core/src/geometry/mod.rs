//! Points, poses and the few `f32` functions they need.
//!
//! Whatever does not know about a robot driving on a floor is written for any dimension `D`; a [`Pose`] is planar.

mod place;
mod pose;
mod pose_covariance;
mod trigonometry;

pub use place::Place;
pub use pose::Pose;
pub use pose_covariance::PoseCovariance;
pub use trigonometry::sin_cos;

/// A position or a displacement in metres, in the map frame unless a name says otherwise.
pub type Point<const D: usize> = nalgebra::SVector<f32, D>;
