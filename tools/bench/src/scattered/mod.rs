//! Supports anywhere: the dense case `B = M` of the posterior, with a given list of supports instead of a lattice.
//!
//! The paper's pseudo-inputs may lie at any point, such as cluster centres of the data. Without a lattice every support
//! couples with every other: one posterior, dense, whose cost grows with `M³`; the number of supports is bounded and the
//! area it covers is theirs. The same kernels, supports, beam rules, update rules and moments as a
//! [`Mapper`](bhm_core::mapper::Mapper)'s, no tiles, no blending, no bias.

mod basis;
mod clusters;
mod list;
mod map;
#[cfg(test)]
mod tests;

pub use basis::{ScatteredBasis, ScatteredSupport};
pub use clusters::{ClusterOptions, MAX_CLUSTERS, Observation, SEEDS_PER_CLUSTER, k_means, learn_clusters};
pub use list::{Cluster, Clusters};
pub use map::{DenseMap, MAX_SCATTERED, ScatteredMap, open_scattered};
