//! Experiments of the paper and beyond it, each a file or a folder: what it compares, a table, and its pictures.
//!
//! A new one is its file and its `mod` line.

pub mod granularity;
pub mod kernels;
pub mod placement;
pub mod poses;
pub mod relevance;
pub mod segments;
pub mod shapes;
mod trial;

pub use self::trial::{BeamSplit, Trial};
